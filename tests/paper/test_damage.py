"""Each kind of damage changes what it says, raises the figure that it should, and leaves the rest alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from furnished_floors import furnished
from shapely import Point, Polygon

from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.geometry import wrap_angle
from labgym.layouts import Layout, load_published
from labgym.layouts.moves import descendants
from labgym.layouts.rules.objective import evaluate_layout
from labgym.navigation import goal_poses
from labgym.paper.damage import FAR, KINDS, LEFT_BEHIND, LIFT, SHOVE, TURN, Damage, damaged

FURNITURE = ("load_left", "moved", "turned", "moved_and_turned", "furniture_stacked", "goal_pose")


@pytest.fixture(scope="module")
def room() -> Layout:
    return load_published("test", "test-sub_01")


def damage(layout: Layout, kind: str, pieces: int = 2, seed: int = 5) -> Damage:
    return damaged(layout, kind, pieces, np.random.default_rng(seed))


def shift(before: Layout, after: Layout, each: str) -> float:
    """Distance in the plane between the places of an object."""
    return math.dist(before.placement(each).position[:2], after.placement(each).position[:2])


def outline(layout: Layout, each: str) -> Polygon:
    return Polygon(layout.box(each).corners())


@pytest.mark.parametrize("kind", KINDS)
def test_the_damage_raises_the_figure_that_it_should(room, kind):
    before = evaluate_layout(room, room.protocol, navigation=True, rules="paper")
    assert (before.v, before.missing) == (0, ())
    for pieces in (1, 3):
        after = evaluate_layout(damage(room, kind, pieces).layout, room.protocol, navigation=True, rules="paper")
        figures = {
            "items_stacked": len(after.collisions),
            "items_shoved": len(after.out_of_bounds),
            "reagents_out": sum(instance.satisfaction == 0.0 for instance in after.of("storage")),
            "load_left": len(after.out_of_bounds),
            "furniture_stacked": len(after.collisions),
            "goal_pose": sum(not transition.feasible for transition in after.transitions),
            "removed": len(after.missing),
        }
        assert figures.get(kind, after.cost - before.cost) > 0


@pytest.mark.parametrize("kind", KINDS)
def test_only_the_pieces_and_what_stands_on_them_change(room, kind):
    result = damage(room, kind, 3)
    assert len(set(result.ids)) == 3
    carried = {item for each in result.ids for item in descendants(room, each)}
    for placement in room.placements:
        if placement.id in result.ids:
            assert result.layout.by_id.get(placement.id) != placement
        elif placement.id not in carried or kind == "load_left":
            assert result.layout.placement(placement.id) == placement
    assert result.layout.floor == room.floor


@pytest.mark.parametrize("kind", KINDS)
def test_the_same_seed_gives_the_same_damage(room, kind):
    first, second, other = damage(room, kind), damage(room, kind), damage(room, kind, seed=6)
    assert first.layout.hash == second.layout.hash
    assert first.ids == second.ids
    assert first.layout.hash != other.layout.hash


def test_items_are_shoved_as_far_as_stated(room):
    result = damage(room, "items_shoved", 5)
    for each in result.ids:
        assert SHOVE[0] - 1e-5 <= shift(room, result.layout, each) <= SHOVE[1] + 1e-5
        assert LIFT[0] <= abs(result.layout.placement(each).position[2] - room.placement(each).position[2]) <= LIFT[1]


def test_stacked_items_share_their_place_with_another_item(room):
    result = damage(room, "items_stacked", 1)
    (each,) = result.ids
    item = result.layout.placement(each)
    others = [other for other in result.layout.children(item.support) if other.id != each and other.slot == item.slot]
    assert any(outline(result.layout, other.id).intersects(outline(result.layout, each)) for other in others)


def test_reagents_leave_their_cabinets_for_open_surfaces(room):
    result = damage(room, "reagents_out", 3)
    for each in result.ids:
        placement = result.layout.placement(each)
        assert result.layout.asset(placement.support).storage_class is None
        top = result.layout.surface(placement.support, placement.slot)
        assert Polygon(top.corners()).buffer(1e-6).contains(outline(result.layout, each).centroid)
        assert placement.position[2] == pytest.approx(top.z0)


def test_furniture_goes_as_far_as_stated_with_or_without_its_load(room):
    for kind, limits in (("load_left", LEFT_BEHIND), ("moved", FAR), ("moved_and_turned", FAR), ("turned", (0.0, 0.0))):
        result = damage(room, kind, 4)
        for each in result.ids:
            assert limits[0] - 1e-5 <= shift(room, result.layout, each) <= limits[1] + 1e-5
            turn = abs(wrap_angle(result.layout.placement(each).yaw - room.placement(each).yaw))
            assert turn >= TURN[0] - 1e-6 if "turned" in kind else turn < 1e-6
            for item in descendants(room, each):
                before, after = (
                    layout.box(each).to_local(*layout.placement(item).position[:2]) for layout in (room, result.layout)
                )
                assert (after == pytest.approx(before, abs=1e-4)) == (kind != "load_left")


def test_stacked_furniture_has_the_center_of_other_furniture(room):
    result = damage(room, "furniture_stacked", 1)
    (each,) = result.ids
    others = [p for p in result.layout.placements if p.support == "floor" and p.id != each]
    assert min(shift_to(result.layout, each, other.id) for other in others) < 1e-6


def shift_to(layout: Layout, each: str, other: str) -> float:
    return math.dist(layout.placement(each).position[:2], layout.placement(other).position[:2])


def test_a_goal_pose_is_covered(room):
    result = damage(room, "goal_pose", 1)
    (each,) = result.ids
    goals = goal_poses(room).values()
    assert any(outline(result.layout, each).contains(Point(x, y)) for x, y, _ in goals)


def test_removed_objects_are_gone_with_what_stood_on_them(room):
    result = damage(room, "removed", 3)
    gone = {item for each in result.ids for item in (each, *descendants(room, each))}
    assert result.layout.by_id.keys() == room.by_id.keys() - gone


@pytest.mark.parametrize("kind", KINDS)
def test_fixed_objects_stay(room, kind):
    able = KINDS[kind].candidates(room)
    free = "SinkBench_1" if "SinkBench_1" in able else able[0]
    kept = room.by_id.keys() - {free, *descendants(room, free)}
    fixed = room.replace(placements=tuple(p.model_copy(update={"fixed": p.id in kept}) for p in room.placements))
    assert damage(fixed, kind, 1).ids == (free,)
    with pytest.raises(LabgymError, match="pieces for damage"):
        damage(fixed, kind, 5 if kind in ("removed", "items_stacked", "items_shoved") else 2)


@pytest.mark.parametrize("kind", FURNITURE)
def test_floors_of_many_rooms_are_damaged_too(kind):
    layout = furnished("suite")
    if not KINDS[kind].candidates(layout):
        with pytest.raises(LabgymError, match="has 0 pieces"):
            damage(layout, kind, 1)
        return
    result = damage(layout, kind, 1)
    assert result.layout.placements != layout.placements


def test_what_cannot_be_damaged_is_refused(room):
    for pieces in (0, 6):
        with pytest.raises(OptionError, match="must be 1 to 5"):
            damage(room, "moved", pieces)
    with pytest.raises(UnknownNameError, match="available: furniture_stacked, goal_pose"):
        damage(room, "burnt")
    bare = room.replace(placements=(), protocols=())
    for kind in KINDS:
        with pytest.raises(LabgymError, match="has 0 pieces"):
            damage(bare, kind, 1)
    lonely = room.replace(placements=(room.placement("IslandBench_1"),), protocols=())
    with pytest.raises(LabgymError, match="caused no fault"):
        damage(lonely, "furniture_stacked", 1)
