"""Specifications are typed, bounded and consistent, and say their units."""

from __future__ import annotations

import json

import pytest
from every_case import for_each
from pydantic import ValidationError

from labgym.assets import AssetFile, Catalog, Specifications
from labgym.assets.specs import quantity, value_text
from labgym.cli.describe import asset_details
from labgym.errors import DocumentError

CATALOG = Catalog.load()


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"rotation_rpm": (1500, 50)}, "a range must ascend"),
        ({"heating_C": (20.0, 20.0)}, "a range must ascend"),
        ({"heating_C": (-300.0, 20.0)}, "-273.15"),
        ({"capacity_mL": 0.0}, "greater than 0"),
        ({"capacity_mL": float("nan")}, "finite"),
        ({"ultimate_mbar": 2000.0}, "1013"),
        ({"capacity_mL": 100.0, "working_mL": (10.0, 150.0)}, "above capacity_mL 100"),
        ({"capacity_g": 1.0, "resolution_g": 2.0}, "less than capacity_g"),
        ({"features": ("dry", "dry")}, "once"),
        ({"features": ("pretty",)}, "electrical"),
        ({"volume": 250.0}, "no specification 'volume'"),
        ({"capacity_ml": 250.0}, "nearest: capacity_mL"),
        ({"speed_rpm": "50..1500"}, "rotation_rpm"),
    ],
)
def test_what_cannot_be_is_refused_with_what_would_be_right(wrong, told):
    with pytest.raises(ValidationError, match=told):
        Specifications.model_validate(wrong)


def test_only_what_is_specified_is_written_and_reads_back_the_same():
    flask = Specifications(capacity_mL=250.0, withstands_C=500.0)
    written = json.loads(flask.model_dump_json())
    assert written == {"capacity_mL": 250.0, "withstands_C": 500.0}
    assert Specifications.model_validate(written) == flask
    assert Specifications().model_dump() == {}


@for_each("name", CATALOG.names)
def test_the_specifications_of_every_asset_survive_a_file(name):
    specs = CATALOG.get(name).specs
    assert Specifications.model_validate_json(specs.model_dump_json()) == specs


def test_entries_that_assets_add_wrote_before_still_read(tmp_path):
    # Until now only these two specifications came of a mesh file's name.
    flask, acid = CATALOG.get("Beaker"), CATALOG.get("AceticAcid")
    entries = [
        {**flask.model_dump(mode="json"), "specs": {"capacity_mL": 250.0}},
        {**acid.model_dump(mode="json"), "specs": {"pack_mL": 500.0}},
    ]
    read = AssetFile.parse({"schema": "labgym.assets/1", "assets": entries})
    assert [asset.specs.volume_mL for asset in read.assets] == [250.0, 500.0]


def test_an_unknown_specification_in_a_file_is_named_with_its_place():
    entry = {**CATALOG.get("Beaker").model_dump(mode="json"), "specs": {"max_temperature_C": 250.0}}
    with pytest.raises(DocumentError, match=r"assets\.0\.specs.*'max_temperature_C'.*nearest") as caught:
        AssetFile.parse({"schema": "labgym.assets/1", "assets": [entry]}, "own.json")
    assert "own.json" in str(caught.value)


def test_every_specification_says_what_it_is_and_has_a_user_in_the_catalogue():
    used = {name for asset in CATALOG for name, _ in asset.specs.items()}
    assert set(Specifications.model_fields) == used
    assert all((field.description or "").endswith(".") for field in Specifications.model_fields.values())


@pytest.mark.parametrize(
    ("name", "words", "unit"),
    [
        ("capacity_mL", "capacity", "mL"),
        ("face_velocity_m_s", "face velocity", "m/s"),
        ("heating_C", "heating", "C"),
        ("flow_mL_min", "flow", "mL/min"),
        ("water_L_min", "water", "L/min"),
        ("fire_rating_min", "fire rating", "min"),
        ("free_flow_m3_h", "free flow", "m3/h"),
        ("centrifuge_xg", "centrifuge", "x g"),
        ("load_kg", "load", "kg"),
        ("capacity_g", "capacity", "g"),
        ("joint", "joint", ""),
        ("nfpa_special", "nfpa special", ""),
    ],
)
def test_a_name_ends_in_its_unit(name, words, unit):
    assert quantity(name) == (words, unit)


NUMERIC_WITHOUT_UNIT = {"places", "pieces", "magnification"}


def test_every_number_has_a_unit():
    for asset in CATALOG:
        for name, value in asset.specs.items():
            numeric = isinstance(value, float | int) or (isinstance(value, tuple) and isinstance(value[0], float | int))
            assert bool(quantity(name)[1]) == (numeric and name not in NUMERIC_WITHOUT_UNIT), name


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("rotation_rpm", (50.0, 1500.0), "50 to 1500 rpm"),
        ("heating_C", (20.0, 310.0), "20 to 310 C"),
        ("flow_mL_min", (0.00002, 33.0), "0.00002 to 33 mL/min"),
        ("capacity_mL", 1e6, "1000000 mL"),
        ("lines_nm", (254.0, 365.0), "254 and 365 nm"),
        ("bowl_m", (0.45, 0.4, 0.3), "0.45 x 0.4 x 0.3 m"),
        ("features", ("electrical", "local_exhaust"), "electrical, local exhaust"),
        ("joint", "24/29", "24/29"),
    ],
)
def test_values_are_told_with_units(name, value, text):
    assert value_text(name, value) == text


def test_the_details_of_an_asset_show_its_specifications():
    told = asset_details(CATALOG.get("MagneticHotplateStirrer"))
    for line in ("heating 20 to 310 C", "rotation 50 to 1500 rpm", "power 600 W"):
        assert line in " ".join(told.split())
