"""Whatever a protocol or a rule requires is named when all objects that serve for it are removed."""

from __future__ import annotations

from functools import cache

import pytest

from labgym.layouts import Layout, load_published
from labgym.layouts.moves import without
from labgym.layouts.rules import Assessment, evaluate_layout

LAYOUTS = (("val", "val-alk_02"), ("floors-test", "floors-test-0001"))
SAFETY = {
    "EmergencyShower": {"EmergencyShower"},
    "EyewashStation": {"EyewashStation"},
    "HandWashSink": {"HandWashSink"},
    "FireExtinguisher": {"FireExtinguisher", "CO2Extinguisher"},
    "GasDetector": {"GasDetector"},
    "SpillKit": {"SpillKit"},
    "FirstAidKit": {"FirstAidKit"},
    "SolventWasteContainer": {"SolventWasteContainer"},
}
"""What a safety officer asks for where hazardous and flammable liquids are handled, and the assets that serve."""


@cache
def published(split: str, name: str) -> Layout:
    return load_published(split, name)


def assess(layout: Layout) -> Assessment:
    assessment = evaluate_layout(layout, layout.protocol, navigation=False, rules="touchstone")
    assert isinstance(assessment, Assessment)
    return assessment


def removed(layout: Layout, roles: set[str]) -> Layout:
    rest = without(layout, [p.id for p in layout.placements if layout.asset(p.id).role in roles])
    assert len(rest.placements) < len(layout.placements), f"nothing of {roles} stands in {layout.id}"
    return rest


def required_roles(layout: Layout) -> list[str]:
    assert layout.protocol is not None
    return sorted({layout.catalog.find(name).role for name in layout.protocol.required_assets()})


@pytest.mark.parametrize(("split", "name"), LAYOUTS)
def test_published_layouts_lack_nothing(split, name):
    assert assess(published(split, name)).lacking == ()


@pytest.mark.parametrize(("split", "name"), LAYOUTS)
@pytest.mark.parametrize("equipment", SAFETY)
def test_each_kind_of_safety_equipment_is_named_when_it_is_removed(split, name, equipment):
    assessment = assess(removed(published(split, name), SAFETY[equipment]))
    assert equipment in assessment.unequipped
    assert any(equipment in item.message for item in assessment.violations.of("missing"))


@pytest.mark.parametrize(("split", "name"), LAYOUTS)
def test_each_asset_of_the_protocol_is_named_when_it_is_removed(split, name):
    layout = published(split, name)
    roles = required_roles(layout)
    assert len(roles) > 10
    unnamed = [role for role in roles if role not in (assess(removed(layout, {role})).missing or ())]
    assert unnamed == []


@pytest.mark.parametrize(("split", "name"), LAYOUTS)
def test_bins_and_an_empty_station_take_no_liquid_waste(split, name):
    layout = published(split, name)
    assert any(layout.asset(p.id).role == "WasteStation" for p in layout.placements)
    bare = removed(layout, {"SolventWasteContainer"})
    bins = [p.model_copy(update={"asset": "SolidWasteBin"}) for p in layout.placements if p not in bare.placements][:1]
    assert "SolventWasteContainer" in assess(bare.replace(placements=(*bare.placements, *bins))).unequipped
