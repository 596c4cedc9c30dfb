"""Table 1: our counts equal the paper's to the digits that it prints, and the catalog's counts add up."""

from __future__ import annotations

import json

import pytest

from labgym.assets import Catalog
from labgym.cli import main
from labgym.paper.reproduction.figures import PublishedFigures


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reproduce") / "protocols"
    assert main(["reproduce", "protocols", "--out", str(folder)]) == 0
    return folder


def test_the_counts_per_protocol_are_those_of_table_1(folder):
    table = PublishedFigures.load(folder / "figures.json").tables[0]
    by_name = {(line.name, line.origin): line.cells for line in table.lines}
    for name in ("Reagents", "Instruments", "Steps", "Moves"):
        ours, printed = by_name[name, "labgym"], by_name[name, "paper"]
        assert {key: round(cell.value, 2) for key, cell in ours.items()} == {k: c.value for k, c in printed.items()}


def test_the_entries_are_those_of_the_catalog(folder):
    rows = [json.loads(line) for line in (folder / "rows.jsonl").read_text().splitlines()]
    names = [row["name"] for row in rows if row["of"] == "asset"]
    assert names == [asset.name for asset in Catalog.published().assets]
    entries = PublishedFigures.load(folder / "figures.json").tables[1]
    total = {line.name: line for line in entries.lines if line.origin == "labgym"}.pop("all")
    assert total.cells["all"].value == len(names)
    assert total.cells["core"].value == 176


def test_the_page_has_two_charts(folder):
    assert (folder / "index.html").read_text().count("data:image/png;base64,") == 2
