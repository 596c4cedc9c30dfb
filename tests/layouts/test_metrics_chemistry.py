"""Flam, Incomp, Store, Glass and Asset against closed forms, shapely and sampled points."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laboratories import put
from shapely.geometry import LineString, Polygon

from labgym.assets import Catalog
from labgym.layouts import Layout, Placement, Room
from labgym.layouts.rules import thresholds
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.glass import glass_instances
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.rules.separation import contained, flammable_instances, hazard_between, incompatible_instances
from labgym.layouts.rules.storage import in_own_class, storage_cabinet, storage_instances
from labgym.layouts.rules.whereabouts import missing_assets
from labgym.protocols import Protocol, ReagentUse, Step

DEFAULT = thresholds.profile("default")
HALL = Room(width=40.0, depth=40.0)


def unrolled(*placements: Placement) -> Arrangement:
    return Arrangement.of(Layout(id="test", floor=HALL.floor, placements=placements))


@pytest.mark.parametrize(
    ("source", "gap", "expected"),
    [
        ("MagneticHotplateStirrer", 0.29, 0.0),
        ("MagneticHotplateStirrer", 0.31, 0.31),
        ("MagneticHotplateStirrer", 1.01, 1.0),
        ("OilBath", 0.5, 0.5),
        ("DryingOven", 0.9, 0.9),
        ("BunsenBurner", 0.59, 0.0),
        ("BunsenBurner", 1.5, 0.5),
        ("BunsenBurner", 3.01, 1.0),
    ],
)
def test_a_flammable_keeps_its_distance_from_the_surface_of_a_heat_source(
    source: str, gap: float, expected: float
) -> None:
    catalog = Catalog.load()
    apart = gap + (catalog.get("Acetone").size.width + catalog.get(source).size.width) / 2.0
    (found,) = flammable_instances(
        unrolled(put("a", "Acetone", 10, 10, 1), put("h", source, 10 + apart, 10, 1)), DEFAULT
    )
    assert found.ids == ("a", "h")
    assert found.distance == pytest.approx(gap)
    assert found.satisfaction == pytest.approx(expected)
    assert found.hard == (expected == 0.0)


def test_height_counts_in_distances() -> None:
    top = 10.0 + Catalog.load().get("OilBath").size.height
    (found,) = flammable_instances(
        unrolled(put("h", "OilBath", 5, 5, 10), put("a", "Acetone", 5, 5, top + 0.5)), DEFAULT
    )
    assert found.distance == pytest.approx(0.5)


def test_what_merely_runs_warm_and_what_does_not_burn_make_no_instance() -> None:
    warm = unrolled(put("gc", "GasChromatograph", 5, 5), put("acetone", "Acetone", 5.5, 5))
    salt = unrolled(put("burner", "BunsenBurner", 5, 5), put("salt", "SodiumChloride", 5.2, 5))
    assert flammable_instances(warm, DEFAULT) == flammable_instances(salt, DEFAULT) == ()


def test_every_flammable_meets_every_heat_source() -> None:
    scene = unrolled(
        put("a", "Acetone", 5, 5), put("e", "Ethanol", 6, 5), put("b", "OilBath", 7, 5), put("f", "BunsenBurner", 9, 5)
    )
    pairs = {found.ids for found in flammable_instances(scene, DEFAULT)}
    assert pairs == {("a", "b"), ("a", "f"), ("e", "b"), ("e", "f")}


@pytest.mark.parametrize(
    ("profile", "gap", "expected"), [("default", 0.5, 0.5), ("paper", 0.5, 1.0), ("paper", 0.14, 0.0)]
)
def test_incompatible_reagents_keep_the_distance_of_the_profile(profile: str, gap: float, expected: float) -> None:
    catalog = Catalog.load()
    acid, base = catalog.get("HydrochloricAcid"), catalog.get("SodiumHydroxide")
    apart = gap + (acid.size.depth + base.size.depth) / 2.0
    scene = unrolled(
        put("acid", acid.name, 5, 5), put("base", base.name, 5, 5 + apart), put("salt", "SodiumChloride", 9, 9)
    )
    (found,) = incompatible_instances(scene, thresholds.profile(profile))
    assert found.ids == ("acid", "base")
    assert found.satisfaction == pytest.approx(expected)


def test_which_pairs_are_incompatible_is_symmetric() -> None:
    reagents = Catalog.load().of_kind("reagent")[:40]
    pairs = [(a, b) for a in reagents for b in reagents]
    assert all(hazard_between(a, b, "segregation") == hazard_between(b, a, "segregation") for a, b in pairs)


def cabinets(gap: float) -> tuple[Placement, ...]:
    """An acid and a base on the lowest shelves of two neighbouring cabinets 0.6 m wide."""
    shelf = Catalog.load().get("AcidCabinet").surfaces[0].z
    return (
        put("acids", "AcidCabinet", 5.0, 5.0),
        put("bases", "BaseCabinet", 5.6 + gap, 5.0),
        put("acid", "HydrochloricAcid", 5.0, 5.0, shelf, on="acids", slot=0),
        put("base", "SodiumHydroxide", 5.6 + gap, 5.0, shelf, on="bases", slot=0),
    )


def test_two_closed_cabinets_separate_only_in_the_containment_aware_variant() -> None:
    scene = unrolled(*cabinets(0.0))
    plain = incompatible_instances(scene, DEFAULT)
    assert plain[0].satisfaction == pytest.approx(0.6 - 0.0775)
    assert [found.satisfaction for found in contained(scene, plain)] == [1.0]


def test_one_cabinet_or_an_open_bench_separates_nothing() -> None:
    shelf = Catalog.load().get("AcidCabinet").surfaces[0].z
    together = unrolled(
        put("acids", "AcidCabinet", 5.0, 5.0),
        put("acid", "HydrochloricAcid", 4.9, 5.0, shelf, on="acids", slot=0),
        put("base", "SodiumHydroxide", 5.1, 5.0, shelf, on="acids", slot=0),
    )
    bench = unrolled(
        *cabinets(0.0)[:3],
        put("bench", "LabBench", 7.0, 5.0),
        put("base", "SodiumHydroxide", 6.4, 5.0, 0.9, on="bench", slot=0),
    )
    for scene in (together, bench):
        plain = incompatible_instances(scene, DEFAULT)
        assert contained(scene, plain) == plain


@settings(max_examples=200, deadline=None)
@given(
    dx=st.floats(-0.7, 0.7),
    dy=st.floats(-0.35, 0.35),
    yaw=st.floats(-3.0, 3.0),
    turn=st.floats(-3.0, 3.0),
    slot=st.integers(0, 3),
)
def test_a_reagent_is_stored_exactly_where_all_of_its_points_are_in_the_hollow(
    dx: float, dy: float, yaw: float, turn: float, slot: int
) -> None:
    asset, bottle = Catalog.load().get("FlammableCabinet"), Catalog.load().get("Acetone").size
    z = asset.surfaces[slot].z
    x, y = 10 + dx * math.cos(yaw) - dy * math.sin(yaw), 10 + dx * math.sin(yaw) + dy * math.cos(yaw)
    scene = unrolled(
        put("cabinet", asset.name, 10, 10, yaw=yaw), put("bottle", "Acetone", x, y, z, turn, on="cabinet", slot=slot)
    )
    assert asset.cavity is not None
    rng = np.random.default_rng(0)
    corners = np.array([(i, j, k) for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (0.0, 1.0)])
    local = np.vstack([corners, rng.uniform((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0), (100, 3))])
    local = local * (bottle.width, bottle.depth, bottle.height)
    world = local @ turned(turn).T + (x, y, z)
    inside = (world - (10, 10, 0)) @ turned(yaw)
    beyond = np.maximum(
        np.abs(inside[:, :2] - (asset.cavity.x, asset.cavity.y)) - (asset.cavity.width / 2, asset.cavity.depth / 2), 0.0
    ).max()
    if abs(beyond - 0.001) > 1e-6:  # at the tolerance itself rounding decides
        assert (storage_cabinet(scene, scene.row("bottle")) is not None) == (beyond < 0.001)


def turned(yaw: float) -> np.ndarray:
    return np.array([[math.cos(yaw), -math.sin(yaw), 0.0], [math.sin(yaw), math.cos(yaw), 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("support", "stored"),
    [
        ("FlammableCabinet", True),
        ("AcidCabinet", True),
        ("FlammableSafeRefrigerator", True),
        ("FumeHood", False),
        ("GlasswareCabinet", False),
        ("WasteStation", False),
        ("EquipmentRack", False),
        ("LabBench", False),
    ],
)
def test_only_reagent_cabinets_store(support: str, stored: bool) -> None:
    z = Catalog.load().get(support).surfaces[0].z
    scene = unrolled(put("s", support, 5, 5), put("bottle", "Acetone", 5, 5, z, on="s", slot=0))
    (found,) = storage_instances(scene)
    assert (found.satisfaction == 1.0) == stored
    assert found.hard != stored


def test_a_bottle_between_two_shelves_is_not_stored() -> None:
    scene = unrolled(put("s", "FlammableCabinet", 5, 5), put("bottle", "Acetone", 5, 5, 0.2, on="s", slot=0))
    assert storage_instances(scene)[0].satisfaction == 0.0


def test_the_share_in_the_own_class_tells_right_cabinets_from_any() -> None:
    scene = unrolled(*cabinets(0.0), put("other", "SodiumHydroxide", 4.9, 5.0, 0.1, on="acids", slot=0))
    assert [found.satisfaction for found in storage_instances(scene)] == [1.0, 1.0, 1.0]
    assert in_own_class(scene) == pytest.approx(2 / 3)


@pytest.mark.parametrize(("surface", "z"), [("LabBench", 0.9), ("FumeHood", 0.9), ("EquipmentRack", 0.1)])
def test_glass_distance_is_that_of_the_polygon_to_the_surface_outline(surface: str, z: float) -> None:
    rng = np.random.default_rng(1)
    yaw = 0.7
    top = Layout(id="t", floor=HALL.floor, placements=(put("s", surface, 10, 10, yaw=yaw),)).surface("s", 0)
    outline = LineString([*top.corners(), top.corners()[0]])
    for _ in range(50):
        x, y = top.to_world(rng.uniform(-0.3, 0.3) * top.width, rng.uniform(-0.3, 0.3) * top.depth)
        flask = put("flask", "ThreeNeckFlask", x, y, z, rng.uniform(-3, 3), on="s", slot=0)
        scene = unrolled(put("s", surface, 10, 10, yaw=yaw), flask)
        footprint = Polygon(scene.layout.box("flask").corners())
        expected = outline.distance(footprint) if Polygon(top.corners()).contains(footprint) else 0.0
        (found,) = glass_instances(scene, DEFAULT)
        assert found.distance == pytest.approx(expected, abs=1e-9)
        assert found.satisfaction == pytest.approx(min(1.0, expected / 0.15))


def test_glass_in_cabinets_glass_on_the_floor_and_what_is_not_glass_do_not_count() -> None:
    scene = unrolled(
        put("c", "GlasswareCabinet", 5, 5),
        put("flask", "RoundBottomFlask", 5, 5, 0.08, on="c", slot=0),
        put("floor", "RoundBottomFlask", 8, 8),
        put("bench", "LabBench", 10, 10),
        put("plate", "MagneticHotplateStirrer", 10, 10, 0.9, on="bench", slot=0),
        put("acetone", "Acetone", 10.3, 10, 0.9, on="bench", slot=0),
    )
    assert glass_instances(scene, DEFAULT) == ()


def protocol(*instruments: str) -> Protocol:
    steps = [("PreparationBench", "Weigh"), ("FumeHood", "Heat")]
    return Protocol(
        id="test",
        name="Test",
        reaction_type="substitution",
        reagents=(ReagentUse(name="Acetone", role="solvent"),),
        instruments=instruments,
        steps=tuple(
            Step(index=k, location=location, action=action, text=action)
            for k, (location, action) in enumerate(steps, 1)
        ),
    )


def test_missing_assets_are_counted_as_a_multiset_without_those_out_of_bounds() -> None:
    scene = unrolled(
        put("p", "PreparationBench", 5, 5),
        put("h", "FumeHood", 8, 8),
        put("b1", "Beaker", 5, 5, 0.9, on="p", slot=0),
        put("b2", "Beaker", 5.3, 5, 0.9, on="p", slot=0),
        put("a", "Acetone", 5.6, 5, 0.9, on="p", slot=0),
    )
    assert missing_assets(scene, protocol("Beaker", "Beaker"), frozenset()) == ()
    assert missing_assets(scene, protocol("Beaker", "Beaker", "Beaker"), frozenset()) == ("Beaker",)
    assert missing_assets(scene, protocol("Beaker"), frozenset({"b1"})) == ()
    assert missing_assets(scene, protocol("Beaker"), frozenset({"b1", "b2", "h"})) == ("Beaker", "FumeHood")


@settings(max_examples=40, deadline=None)
@given(yaw=st.floats(-3.1, 3.1), dx=st.floats(-8, 8), dy=st.floats(-8, 8))
def test_chemistry_and_collisions_do_not_depend_on_where_the_laboratory_lies_and_how_it_is_turned(
    yaw: float, dx: float, dy: float
) -> None:
    shelf = Catalog.load().get("AcidCabinet").surfaces[0].z
    lab = (
        *cabinets(0.1),
        put("bench", "LabBench", 4.0, 3.6, yaw=0.4),
        put("bath", "OilBath", 4.0, 3.7, 0.9, 0.2, on="bench", slot=0),
        put("flask", "RoundBottomFlask", 3.6, 3.6, 0.9, on="bench", slot=0),
        put("crash", "RoundBottomFlask", 3.64, 3.6, 0.9, on="bench", slot=0),
        put("acetone", "Acetone", 4.9, 4.9, shelf, 0.3, on="acids", slot=0),
    )
    moved = tuple(carried(placement, yaw, dx, dy) for placement in lab)
    before, after = (
        evaluate_layout(Layout(id="t", floor=HALL.floor, placements=p), rules="paper") for p in (shifted(lab), moved)
    )
    assert before.v == after.v > 0
    assert before.fitness == pytest.approx(after.fitness, abs=1e-9)
    for first, second in zip(before.instances, after.instances, strict=True):
        assert first.ids == second.ids
        assert first.distance == pytest.approx(second.distance, abs=1e-9)
        assert first.satisfaction == pytest.approx(second.satisfaction, abs=1e-9)
    for one, other in zip(before.collisions, after.collisions, strict=True):
        assert (one.ids, one.depth, one.volume) == (
            other.ids,
            pytest.approx(other.depth, abs=1e-9),
            pytest.approx(other.volume, abs=1e-9),
        )


def shifted(lab: tuple[Placement, ...]) -> tuple[Placement, ...]:
    return tuple(carried(placement, 0.0, 0.0, 0.0) for placement in lab)


def carried(placement: Placement, yaw: float, dx: float, dy: float) -> Placement:
    x, y, z = placement.position
    x, y = x - 5.0, y - 5.0
    x, y = math.cos(yaw) * x - math.sin(yaw) * y + 20 + dx, math.sin(yaw) * x + math.cos(yaw) * y + 20 + dy
    return placement.model_copy(update={"position": (x, y, z), "yaw": placement.yaw + yaw})
