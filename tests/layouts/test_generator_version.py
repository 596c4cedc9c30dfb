"""The same generator makes the same layouts: content hashes recorded with the generator's number."""

import hashlib
import json
import math
from importlib import metadata
from pathlib import Path

import pytest
from inward_rooms import inward

from labgym.layouts import GENERATOR, Layout, generate
from labgym.layouts.places import published_protocols

RECORD = json.loads((Path(__file__).parent / "generator.json").read_text())
CASES = {"sub_01 bay 11": ("sub_01", 11, "bay"), "red_03 tight 12": ("red_03", 12, "tight"),
         "pro_02 two_exits 13": ("pro_02", 13, "two_exits")}  # fmt: skip
"""Protocol, seed and room by name in the record, which is of rooms whose doors open inward."""


def content_hash(case: str) -> str:
    name, seed, preset = CASES[case]
    return layout_hash(generate(published_protocols()[name], seed, inward(preset)))


def layout_hash(layout: Layout) -> str:
    """SHA-256 of the placements alone, to a millimeter and a milliradian: neither documents nor catalogue count."""
    rows = []
    for item in layout.placements:
        numbers = (*item.position, math.cos(item.yaw), math.sin(item.yaw))
        rows.append([item.id, item.asset, item.support, item.slot, *(round(value * 1000) for value in numbers)])
    return hashlib.sha256(json.dumps(rows).encode()).hexdigest()


def test_the_record_belongs_to_this_generator() -> None:
    assert RECORD["generator"] == GENERATOR, "record the hashes of the new generator in tests/layouts/generator.json"


@pytest.mark.skipif(metadata.version("ortools") != RECORD["ortools"], reason="another ortools searches differently")
@pytest.mark.parametrize("case", CASES)
def test_the_generator_makes_the_recorded_layouts(case: str) -> None:
    assert content_hash(case) == RECORD["layouts"][case], (
        f"generator {GENERATOR} made another layout of {case!r}: raise GENERATOR in labgym/layouts/generate.py and "
        "record the new hashes if the generator is meant to change, otherwise find what changed it"
    )
