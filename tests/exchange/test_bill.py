"""Bills of materials count every placement once; inventories are read back and compared with protocols."""

from __future__ import annotations

import csv
from collections import Counter

import pytest
from laboratories import island_laboratory, put

from labgym.assets import Catalog
from labgym.errors import DocumentError
from labgym.exchange.bill import COLUMNS, bill_of_materials, write_bill
from labgym.exchange.inventory import lacking, read_inventory, to_acquire
from labgym.layouts import load_published, published
from labgym.protocols import get

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
    assert lacking([layout.protocol], inventory, CATALOG) == ()
    assert to_acquire([placement.asset for placement in layout.placements], inventory) == ()


@pytest.mark.parametrize(
    "text",
    ["asset,count\nrotovap,2\n", "Item;Quantity\nrotovap;2\n", "\ufeffname\tcount\nrotovap\t1\nRotaryEvaporator\t1\n"],
)
def test_names_are_resolved_and_rows_added(tmp_path, text):
    (tmp_path / "have.csv").write_text(text, encoding="utf-8")
    assert read_inventory(tmp_path / "have.csv").counts == {"RotaryEvaporator": 2}


def test_lacks_name_protocol_number_and_remedy(tmp_path):
    protocol = get("sub_01")
    required = Counter(CATALOG.find(name).name for name in protocol.required_assets())
    equipment = {name: count for name, count in required.items() if CATALOG.get(name).kind != "reagent"}
    missing, *others = equipment
    (tmp_path / "have.csv").write_text("asset,count\n" + "".join(f"{name},{equipment[name]}\n" for name in others))
    (lack,) = lacking([protocol], read_inventory(tmp_path / "have.csv"), CATALOG)
    assert (lack.asset, lack.required, lack.existing) == (missing, equipment[missing], 0)
    assert (
        lack.message
        == f"{missing}: protocol sub_01 requires {equipment[missing]}, the inventory has 0: add {equipment[missing]}"
    )


def test_protocols_share_equipment(tmp_path):
    (tmp_path / "have.csv").write_text("asset,count\nGlassRod,0\n")
    inventory = read_inventory(tmp_path / "have.csv")
    both = lacking([get("sub_01"), get("red_02")], inventory, CATALOG)
    for lack in both:
        counts = [
            Counter(CATALOG.find(name).name for name in get(each).required_assets())[lack.asset]
            for each in ("sub_01", "red_02")
        ]
        assert lack.required == max(counts)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "no column"),
        (b"count\n3\n", "no column"),
        (b"asset,count\nFlyingCarpet,1\n", "row 2.*FlyingCarpet"),
        (b"asset,count\nrotovap,-1\n", "row 2.*'-1'"),
        (b"asset,count\nrotovap,1.5\n", "'1.5'"),
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
