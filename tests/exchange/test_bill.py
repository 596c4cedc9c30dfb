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


@pytest.mark.parametrize(
    ("text", "counts"),
    [
        ("Item Name,Quantity,Unit\nrotovap,2,pcs\nAcetone,500,mL\n", {"RotaryEvaporator": 2, "Acetone": 1}),
        ("Resource,Amount\nAcetone,2.5 L\nrotovap,3\n", {"Acetone": 1, "RotaryEvaporator": 3}),
        ("Chemical,Qty\nAcetone,500 mL\nAcetone,2 x 500 mL\nEthanol,3 bottles\n", {"Acetone": 3, "Ethanol": 3}),
        ("Name,Quantity (mL)\nAcetone,500\n", {"Acetone": 1}),
        ("Chemical,Amount\nAcetone,500\n", {"Acetone": 1}),
        ("Product,Pack size,No. of items\nAcetone,2.5 L,4\n", {"Acetone": 4}),
        ("Bezeichnung;Anzahl;Menge\nAcetone;2;2,5 L\n", {"Acetone": 2}),
        ("名称,数量\n烧杯,4个\n", {"Beaker": 4}),
        ("Laboratory 3\n\nItem,Description,Count\n17,rotovap,2\n", {"RotaryEvaporator": 2}),
        ("Substance,CAS No.,Stock\nPropanone (HPLC),67-64-1,2\n", {"Acetone": 2}),
        ('Name,Count\n"Acetone, 99.5%, reagent grade",2\n', {"Acetone": 2}),
    ],
)
def test_headers_count_by_their_meaning_and_amounts_are_not_counts(tmp_path, text, counts):
    (tmp_path / "have.csv").write_text(text, encoding="utf-8")
    assert read_inventory(tmp_path / "have.csv").counts == counts


def test_an_amount_is_kept_as_a_note(tmp_path):
    (tmp_path / "have.csv").write_text("Item,Quantity,Note\nAcetone,2 x 500 mL,cabinet 3\n")
    (item,) = read_inventory(tmp_path / "have.csv").items
    assert (item.count, item.note) == (2, "500 mL; cabinet 3")


def test_what_matches_is_imported_and_the_rest_is_listed_with_proposals(tmp_path):
    remarks: list[str] = []
    (tmp_path / "have.csv").write_text("Item,Qty\nFlyingCarpet,1\nrotovap,1\n,2\nbeaker,some\nMagnetic Stirer Unit,1\n")
    assert read_inventory(tmp_path / "have.csv", remark=remarks.append).counts == {"RotaryEvaporator": 1}
    (remark,) = remarks
    assert "1 rows are imported, 4 are not" in remark
    assert "row 2 'FlyingCarpet' (no such asset" in remark
    assert "row 4 '' (the asset is empty)" in remark
    assert "row 5 'beaker' (count 'some' must be" in remark
    assert "MagneticStirrer" in remark.partition("row 6")[2]


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
        (b"asset,count\nFlyingCarpet,1\n,2\nTardis,1\n", "row 2 'FlyingCarpet'.* row 3 ''.* row 4 'Tardis'"),
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
