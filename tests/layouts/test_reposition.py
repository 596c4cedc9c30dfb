"""Moves that a person asks for: what stands on an object goes along, and supports are kept."""

from __future__ import annotations

import math

import pytest
from laboratories import island_laboratory, put

from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.layouts.reposition import reposition
from labgym.layouts.rules import evaluate_layout


@pytest.fixture
def layout():
    """The island laboratory with a tray on the island, a beaker on the tray's bench, and a clock on a wall."""
    base = island_laboratory()
    top = base.surface("IslandBench1800_1", 0)
    beaker = put("Beaker_1", "Beaker", top.x + 0.5, top.y + 0.1, top.z0, 0.3, on="IslandBench1800_1", slot=0)
    hood = base.surface("FumeHood_1", 0)
    flask = put("Beaker_2", "Beaker", hood.x, hood.y, hood.z0, on="FumeHood_1", slot=0)
    return base.replace(placements=(*base.placements, beaker, flask))


def test_furniture_takes_along_what_stands_on_it(layout):
    moved = reposition(layout, "IslandBench1800_1", 4.5, 2.0, math.pi / 2.0)
    bench, beaker = moved.placement("IslandBench1800_1"), moved.placement("Beaker_1")
    assert bench.position == (4.5, 2.0, 0.0)
    before = layout.placement("Beaker_1").position
    dx, dy = before[0] - 4.0, before[1] - 2.5
    assert beaker.position == pytest.approx((4.5 - dy, 2.0 + dx, before[2]))
    assert beaker.yaw == pytest.approx(0.3 + math.pi / 2.0)
    others = [placement for placement in layout.placements if placement.id not in ("IslandBench1800_1", "Beaker_1")]
    assert [moved.placement(placement.id) for placement in others] == others


def test_an_object_stays_on_its_surface(layout):
    moved = reposition(layout, "Beaker_1", 3.8, 2.4)
    assert (moved.placement("Beaker_1").support, moved.placement("Beaker_1").yaw) == ("IslandBench1800_1", 0.3)
    assert evaluate_layout(moved, rules="paper").violations.of("bounds") == ()


def test_an_object_changes_to_the_surface_below_its_new_place(layout):
    sink = layout.placement("PreparationBench_1")
    moved = reposition(layout, "Beaker_1", *sink.position[:2])
    beaker = moved.placement("Beaker_1")
    assert beaker.support == "PreparationBench_1"
    assert beaker.position == pytest.approx((*sink.position[:2], moved.surface(beaker.support, beaker.slot).z0))
    assert beaker.yaw == pytest.approx(0.3)
    assert evaluate_layout(moved, rules="paper").violations.of("bounds") == ()


def test_a_place_without_a_surface_is_refused_with_the_distance(layout):
    with pytest.raises(LabgymError, match=r"Beaker_1 .* beyond the edge of IslandBench1800_1"):
        reposition(layout, "Beaker_1", 1.5, 1.5)


def test_wall_equipment_stays_at_a_wall(layout):
    shower = put("clock", "Clock", 3.0, 5.98, 2.0, math.pi, on="wall")
    layout = layout.replace(placements=(*layout.placements, shower))
    assert reposition(layout, "clock", 2.0, 5.98).placement("clock").position[0] == 2.0
    with pytest.raises(LabgymError, match="mounted on a wall"):
        reposition(layout, "clock", 3.0, 4.0)


def test_fixed_objects_can_be_moved_and_stay_fixed(layout):
    pinned = layout.placement("SinkBench_1").model_copy(update={"fixed": True})
    layout = layout.replace(placements=tuple(pinned if p.id == pinned.id else p for p in layout.placements))
    assert reposition(layout, "SinkBench_1", 4.5, pinned.position[1]).placement("SinkBench_1").fixed


def test_unknown_ids_and_places_are_refused(layout):
    with pytest.raises(UnknownNameError):
        reposition(layout, "Piano_1", 1.0, 1.0)
    with pytest.raises(OptionError, match="out of range"):
        reposition(layout, "SinkBench_1", math.nan, 1.0)
    with pytest.raises(OptionError, match="out of range"):
        reposition(layout, "SinkBench_1", 1.0, 1000.0)
