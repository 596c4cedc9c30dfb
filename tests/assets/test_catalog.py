"""The catalogue can be loaded, asked by name, and refuses files that are not what they should be."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys

import pytest
from every_case import for_each
from hypothesis import given, settings
from hypothesis import strategies as st

from labgym.assets import Asset, AssetFile, Catalog
from labgym.errors import DocumentError, LabgymError, UnknownNameError

CATALOG = Catalog.load()
LOCATIONS = (
    "PreparationBench",
    "FumeHood",
    "MainWorkbench",
    "RotaryEvaporatorStation",
    "PurificationBench",
    "DryingStation",
    "ValidationPlatform",
    "SinkBench",
    "GloveBox",
)


def asset_data(**changes: object) -> dict[str, object]:
    data: dict[str, object] = {
        "name": "TestBeaker",
        "kind": "instrument",
        "category": "glassware",
        "subtype": "beaker",
        "description": "A beaker that exists in this test only.",
        "caption": "Not to be used outside of this test.",
        "size": {"width": 0.07, "depth": 0.07, "height": 0.095},
        "mass": 0.1,
        "placing": "desktop",
        "shape": {"name": "beaker"},
    }
    return {**data, **changes}


def write_catalog(folder, *assets, schema="labgym.assets/1"):
    (folder / "some.json").write_text(json.dumps({"schema": schema, "assets": list(assets)}))
    return folder


def test_holds_the_papers_176_entities_and_more():
    assert sum(asset.core for asset in CATALOG) == 176
    assert len(CATALOG) == len(CATALOG.assets) >= 360


def test_has_reagents_instruments_and_facilities():
    counts = {kind: len(CATALOG.of_kind(kind)) for kind in ("reagent", "instrument", "facility")}
    assert sum(counts.values()) == len(CATALOG)
    assert counts["reagent"] >= 180
    assert counts["instrument"] >= 100
    assert counts["facility"] >= 60


def test_loads_once_a_process_and_sorted_by_name():
    assert Catalog.load() is CATALOG
    assert list(CATALOG.names) == sorted(CATALOG.names)


@for_each("name", CATALOG.names)
def test_every_canonical_name_finds_itself(name):
    assert CATALOG.get(name).name == name
    assert CATALOG.find(name).name == name
    assert name in CATALOG


@for_each("name", LOCATIONS)
def test_every_step_location_has_a_surface_to_work_on(name):
    location = CATALOG.get(name)
    assert location.kind == "facility"
    assert location.surfaces
    assert 0.7 <= location.surfaces[0].z <= 1.0


@pytest.mark.parametrize(
    "storage", ["Flammable", "Acid", "Base", "Oxidizer", "Toxic", "WaterReactive", "Refrigerator", "Gas", "General"]
)
def test_every_storage_class_has_a_core_cabinet_and_a_reagent_that_fits_in(storage):
    cabinets = [asset for asset in CATALOG if asset.storage_class == storage and asset.core]
    reagents = [asset for asset in CATALOG.of_kind("reagent") if asset.chemistry.storage_class == storage]
    assert cabinets
    assert reagents
    for reagent in reagents:
        size = reagent.size
        assert any(
            size.height < shelf.headroom and size.width < shelf.width and size.depth < shelf.depth
            for cabinet in cabinets
            for shelf in cabinet.surfaces
        ), reagent.name


@pytest.mark.parametrize("given", ["beaker", "Unicorn", "", "FumeHood ", None, 3, ["Beaker"]])
def test_get_is_exact_and_names_what_was_given(given):
    with pytest.raises(UnknownNameError) as caught:
        CATALOG.get(given)
    assert repr(str(given)[:80]) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_two_assets_of_one_name_are_refused(tmp_path):
    with pytest.raises(DocumentError, match=r"TestBeaker.*twice"):
        Catalog.read(write_catalog(tmp_path, asset_data(), asset_data()))


def test_an_empty_or_missing_folder_is_refused(tmp_path):
    with pytest.raises(DocumentError, match="no asset files"):
        Catalog.read(tmp_path)
    with pytest.raises(DocumentError, match="no asset files"):
        Catalog.read(tmp_path / "missing")


@pytest.mark.parametrize(
    ("sides", "slip"),
    [
        ((7.0, 7.0, 9.5), "centimeters"),
        ((2.76, 2.76, 3.74), "inches"),
        ((0.0007, 0.0007, 0.00095), "divided by 100"),
        ((0.0009996, 0.002414, 0.002351), "divided by 100"),
    ],
)
def test_a_size_in_wrong_units_is_an_error_on_import_that_names_the_slip(tmp_path, sides, slip):
    size = dict(zip(("width", "depth", "height"), sides, strict=True))
    with pytest.raises(DocumentError, match=slip) as caught:
        Catalog.read(write_catalog(tmp_path, asset_data(size=size)))
    assert caught.value.field == "assets.0.size"


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"name": "lower case"}, "name"),
        ({"kind": "animal"}, "kind"),
        ({"size": {"width": -1, "depth": 0.1, "height": 0.1}}, "size.width"),
        ({"size": {"width": "wide", "depth": 0.1, "height": 0.1}}, "size.width"),
        ({"size": {"width": 70, "depth": 70, "height": 95}}, "size.width"),
        ({"mass": 0}, "mass"),
        ({"hazards": {"radioactive": True}}, "hazards.radioactive"),
        ({"surprise": 1}, "surprise"),
        ({"placing": "ceiling"}, "placing"),
        ({"surfaces": [{"z": 0.1, "width": 0.1}]}, "surfaces.0.depth"),
    ],
)
def test_a_wrong_field_is_named(tmp_path, changes, field):
    with pytest.raises(DocumentError) as caught:
        Catalog.read(write_catalog(tmp_path, asset_data(**changes)))
    assert caught.value.field == f"assets.0.{field}"
    assert "some.json" in str(caught.value)


def test_another_schema_is_refused(tmp_path):
    with pytest.raises(DocumentError, match=r"labgym\.assets/1"):
        Catalog.read(write_catalog(tmp_path, asset_data(), schema="labgym.assets/2"))


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "NaN", '{"schema": "labgym.assets/1"}', "[" * 100_000])
def test_broken_files_give_one_line(tmp_path, text):
    (tmp_path / "broken.json").write_text(text)
    with pytest.raises(DocumentError) as caught:
        Catalog.read(tmp_path)
    assert "broken.json" in str(caught.value)
    assert "\n" not in str(caught.value)


JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=10), inner, max_size=4),
    max_leaves=12,
)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(sorted(asset_data())), JSON)
def test_no_value_of_any_field_escapes_as_another_error(field, value):
    with contextlib.suppress(LabgymError):
        file = AssetFile.parse({"schema": "labgym.assets/1", "assets": [asset_data(**{field: value})]})
        assert isinstance(file.assets[0], Asset)


def test_files_survive_a_round_trip(tmp_path):
    document = AssetFile(assets=CATALOG.assets)
    document.save(tmp_path / "all.json")
    assert Catalog.read(tmp_path).assets == CATALOG.assets


def test_importing_the_package_reads_no_artefact_and_loads_nothing_heavy():
    code = (
        "import sys, labgym.assets, labgym.protocols; from labgym.assets import catalog;"
        "assert catalog._published.cache_info().misses == 0;"
        "heavy = {'torch', 'stable_baselines3', 'pxr', 'ortools', 'matplotlib', 'mujoco'} & set(sys.modules);"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
