"""Implausible specifications are found and named; the published catalogue has none."""

from __future__ import annotations

import math

import pytest
from every_case import for_each

from labgym.assets import Catalog
from labgym.assets.checks import check
from labgym.assets.plausibility import RULES, faults

CATALOG = Catalog.load()
HEATERS = [asset for asset in CATALOG if asset.heat_class is not None]
GLASS = [asset for asset in CATALOG if asset.category == "glassware"]


def changed(name, **specs):
    asset = CATALOG.get(name)
    return asset.model_copy(update={"specs": asset.specs.model_copy(update=specs)})


# asset, what is changed (a bad value), the specification that is named if not the first that is changed
FAULTS = [
    ("Beaker", {"capacity_mL": 900.0}, "capacity_mL"),
    ("Beaker", {"capacity_mL": 0.25}, "capacity_mL"),
    ("CentrifugeTube", {"capacity_mL": 0.05}, "capacity_mL"),
    ("AceticAcid", {"pack_mL": 50_000.0}, "pack_mL"),
    ("AceticAcid", {"pack_mL": 900.0}, "pack_mL"),
    ("BenzoicAcid", {"pack_g": 5000.0}, "pack_g"),
    ("DryingOven", {"chamber_L": 400.0}, "chamber_L"),
    ("LabRefrigerator", {"chamber_L": 600.0}, "chamber_L"),
    ("FlammableCabinet", {"storage_L": 700.0}, "storage_L"),
    ("FireExtinguisher", {"charge_kg": 12.0}, "charge_kg"),
    ("OilBath", {"heating_C": None}, "heating_C"),
    ("OilBath", {"heating_C": (20.0, 400.0)}, "heating_C"),
    ("MagneticHotplateStirrer", {"heating_C": (20.0, 3000.0)}, "heating_C"),
    ("DryingOven", {"power_W": None}, "power_W"),
    ("BunsenBurner", {"flame_C": None}, "flame_C"),
    ("MagneticStirrer", {"heating_C": (20.0, 300.0)}, "heating_C"),
    ("Beaker", {"flame_C": 1500.0}, "flame_C"),
    ("HeatGun", {"power_W": 20_000.0}, "power_W"),
    ("HeatGun", {"features": ()}, "power_W"),
    ("RoundBottomFlask", {"withstands_C": 1000.0}, "withstands_C"),
    ("RoundBottomFlask", {"withstands_C": 5.0}, "withstands_C"),
    ("CentrifugeTube", {"withstands_C": 500.0}, "withstands_C"),
    ("PressureTube", {"withstands_bar": 200.0}, "withstands_bar"),
    ("MagneticStirrer", {"rotation_rpm": (100.0, 15_000.0)}, "rotation_rpm"),
    ("Centrifuge", {"centrifuge_xg": 1_000_000.0}, "centrifuge_xg"),
    ("Centrifuge", {"centrifuge_xg": 150.0}, "centrifuge_xg"),
    ("Centrifuge", {"rotation_rpm": None}, "rotation_rpm"),
    ("FumeHood", {"face_velocity_m_s": 0.2}, "face_velocity_m_s"),
    ("FumeHood", {"face_velocity_m_s": 1.2}, "face_velocity_m_s"),
    ("FumeHood", {"face_velocity_m_s": None}, "face_velocity_m_s"),
    ("FumeHood", {"sash_open_m": 1.5}, "sash_open_m"),
    ("LabBench", {"face_velocity_m_s": 0.5}, "face_velocity_m_s"),
    ("EyewashStation", {"water_L_min": 0.4}, "water_L_min"),
    ("EmergencyShower", {"water_L_min": None}, "water_L_min"),
    ("LabRefrigerator", {"cooling_C": (20.0, 30.0)}, "cooling_C"),
    ("UltraLowFreezer", {"cooling_C": None}, "cooling_C"),
    ("VacuumPump", {"ultimate_mbar": None}, "ultimate_mbar"),
    ("AnalyticalBalance", {"resolution_g": 1e-9}, "resolution_g"),
    ("ElectronicScale", {"resolution_g": None}, "resolution_g"),
]


def test_no_specification_of_the_published_catalogue_is_implausible():
    assert [(asset.name, fault) for asset in CATALOG for fault in faults(asset)] == []


@pytest.mark.parametrize(("name", "specs", "field"), FAULTS, ids=[f"{n}-{f}-{i}" for i, (n, _, f) in enumerate(FAULTS)])
def test_a_bad_specification_is_named(name, specs, field):
    found = [problem for problem in check(Catalog([changed(name, **specs)])) if problem.field.startswith("specs")]
    assert {problem.field for problem in found} == {f"specs.{field}"}


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_each_rule_finds_a_fault(rule):
    assert any(list(rule(changed(name, **specs))) for name, specs, _ in FAULTS)


@for_each("asset", HEATERS)
def test_every_heat_source_says_how_hot_it_gets(asset):
    assert asset.specs.flame_C is not None or asset.specs.heating_C[1] > 60.0


@for_each("asset", GLASS)
def test_all_glassware_says_what_heat_it_withstands(asset):
    assert asset.specs.withstands_C or asset.specs.measures_C or asset.specs.working_C


def test_the_centrifuge_turns_as_mechanics_says():
    specs = CATALOG.get("Centrifuge").specs
    radius = specs.centrifuge_xg * 9.80665 / (specs.rotation_rpm[1] * math.tau / 60.0) ** 2
    assert 0.03 < radius < CATALOG.get("Centrifuge").size.short / 2.0


def test_hoods_draw_within_what_is_usual():
    assert all(0.4 <= asset.specs.face_velocity_m_s <= 0.6 for asset in CATALOG if asset.fume_hood)
