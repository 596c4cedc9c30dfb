"""Whole reports of layouts whose objects were moved at random: they pin every threshold that moves a score.

A test of one rule passes its own distances; these have distances of all kinds, near the thresholds as well as far
from them, and every figure of the report. The numbers change only with a rule, and the changelog says so.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from labgym.eval import score
from labgym.layouts import Layout, load_published

FILE = Path(__file__).parent / "data" / "reports_of_moved.json"
CASES = tuple(
    (split, name, seed)
    for split, name, seed in (
        ("test", "test-sub_01", 1),
        ("test", "test-red_05", 2),
        ("test", "test-alk_03", 3),
        ("val", "val-con_02", 4),
        ("floors-val", "floors-val-0003", 5),
    )
)
SHARE = 0.2
"""Share of the objects that are moved."""
REACH_M = 0.6
"""Standard deviation of each coordinate's change."""

WORDS = ("message", "suggestion", "requires", "provenance")
"""Fields of reports that hold text or where a layout comes from."""


def moved(layout: Layout, seed: int) -> Layout:
    generator = np.random.default_rng(seed)
    placements = list(layout.placements)
    for index in np.flatnonzero(generator.random(len(placements)) < SHARE):
        x, y, z = placements[index].position
        dx, dy = generator.normal(scale=REACH_M, size=2)
        position = (round(x + dx, 3), round(y + dy, 3), z)
        placements[index] = placements[index].model_copy(update={"position": position})
    return layout.replace(placements=placements)


def rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, 6)
    if isinstance(value, dict):
        return {key: rounded(one) for key, one in value.items() if key not in WORDS}
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return value


def report(split: str, name: str, seed: int, rules: str) -> Any:
    found = score(moved(load_published(split, name), seed), rules=rules)
    return rounded(json.loads(found.model_dump_json()))


@pytest.mark.parametrize("rules", ["touchstone", "paper"])
@pytest.mark.parametrize("case", CASES, ids=lambda case: case[1])
def test_a_report_of_a_moved_layout_is_as_before(case: tuple[str, str, int], rules: str) -> None:
    key, found = f"{case[1]} {rules}", report(*case, rules)
    if os.environ.get("LABGYM_GOLDEN") == "1":  # After a change of a rule, which the changelog names.
        FILE.parent.mkdir(exist_ok=True)
        reports = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
        FILE.write_text(json.dumps({**reports, key: found}, indent=0) + "\n", encoding="utf-8")
    assert found == json.loads(FILE.read_text(encoding="utf-8"))[key]
