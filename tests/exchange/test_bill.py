"""Bills of materials count every placement once; inventories are read back and compared with protocols."""

from __future__ import annotations

import csv
from collections import Counter

import pytest
from laboratories import island_laboratory, put

from labgym.assets import Catalog
from labgym.errors import DocumentError
from labgym.exchange.bill import COLUMNS, bill_of_materials, write_bill
from labgym.exchange.inventory import read_inventory
from labgym.layouts import load_published, published
from labgym.layouts.request import Holdings

CATALOG = Catalog.load()


def rows(path):
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


@pytest.mark.parametrize("name", published("test")[::7])
def test_the_counts_are_those_of_the_placements(tmp_path, name):
    layout = load_published("test", name)
    lines = rows(write_bill(layout, tmp_path / "bill.csv"))
    assert tuple(lines[0]) == COLUMNS
    counts: Counter[str] = Counter()
    for line in lines:
        counts[line["asset"]] += int(line["count"])
        assert len(line["where"].split("; ")) == int(line["count"])
        size = CATALOG.get(line["asset"]).size
        assert float(line["width_m"]) == pytest.approx(size.width, abs=5e-4)
    assert counts == Counter(placement.asset for placement in layout.placements)
    named = [entry.split()[0] for line in lines for entry in line["where"].split("; ")]
    assert sorted(named) == sorted(layout.by_id)


def test_a_placement_of_another_size_has_its_own_line():
    layout = island_laboratory()
    bench = layout.asset("IslandBench1800_1")
    larger = bench.size.model_copy(update={"width": bench.size.width * 1.1})
    second = put("second", bench.name, 1.0, 1.0).model_copy(update={"size": larger})
    lines = bill_of_materials(layout.replace(placements=(*layout.placements, second)))
    widths = [line.asset.size.width for line in lines if line.asset.name == bench.name]
    assert widths == [bench.size.width, larger.width]


def test_a_bill_of_materials_is_an_inventory(tmp_path):
    layout = load_published("test", published("test")[0])
    inventory = read_inventory(write_bill(layout, tmp_path / "bill.csv"))
    assert inventory.counts == dict(Counter(placement.asset for placement in layout.placements))
    assert Holdings(inventory.counts).missing(placement.asset for placement in layout.placements) == {}


@pytest.mark.parametrize(
    "text",
    [
        "asset,count\nrotovap,2\n",
        "asset,count\nrotovap,2.0\n",
        "Item;Quantity\nrotovap;2\n",
        "\ufeffname\tcount\nrotovap\t1\nRotaryEvaporator\t1\n",
    ],
)
def test_names_are_resolved_and_rows_added(tmp_path, text):
    (tmp_path / "have.csv").write_text(text, encoding="utf-8")
    assert read_inventory(tmp_path / "have.csv").counts == {"RotaryEvaporator": 2}


def test_the_bill_says_what_must_be_bought(tmp_path):
    layout = load_published("test", published("test")[0])
    existing = {"FumeHood": 1, "RotaryEvaporator": 5}
    options = {**layout.provenance.options, "inventory": {"existing": existing, "to_buy": {}, "unused": {}}}
    listed = layout.replace(provenance=layout.provenance.model_copy(update={"options": options}))
    lines = rows(write_bill(listed, tmp_path / "bill.csv"))
    bought: Counter[str] = Counter()
    for line in lines:
        bought[line["asset"]] += int(line["to_buy"])
    placed = Counter(placement.asset for placement in layout.placements)
    assert bought == Counter({name: max(placed[name] - existing.get(name, 0), 0) for name in placed})
    assert all(line["to_buy"] == "" for line in rows(write_bill(layout, tmp_path / "plain.csv")))


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "no column"),
        (b"count\n3\n", "no column"),
        (b"asset,count\nFlyingCarpet,1\n", "row 2.*FlyingCarpet"),
        (b"asset,count\nrotovap,-1\n", "row 2.*'-1'"),
        (b"asset,count\nrotovap,1.5\n", "'1.5'"),
        (b"asset,count\nrotovap,1.000\n", "'1.000'"),
        (b'asset,count\nrotovap,"1,000"\n', "'1,000'"),
        (
            b"asset,count\nFlyingCarpet,1\nrotovap,1\n,2\nTardis,1\n",
            "3 rows .* row 2 'FlyingCarpet', row 4 '', row 5 'Tardis'",
        ),
        (b"asset,count\nrotovap,99999999\n", "whole number"),
        (b"asset,count\n,1\n", "empty"),
        (b"asset\n" + b"rotovap\n" * 6000, "more than 5000 rows"),
        (b"asset\n\xff\xfe", "UTF-8"),
        (b'asset\n"rotovap', "CSV"),
        (b"a" * 1_100_000, "larger"),
    ],
)
def test_a_bad_inventory_is_one_line_that_names_the_row(tmp_path, content, words):
    (tmp_path / "have.csv").write_bytes(content)
    with pytest.raises(DocumentError, match=words) as caught:
        read_inventory(tmp_path / "have.csv")
    assert "\n" not in str(caught.value)
