"""Refinement for navigation: what blocks a transition, which updates free it, and that the loop applies them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import put
from shapely import Point, Polygon

from labgym.layouts import Door, Layout, Placement, Room, generate, refine
from labgym.layouts.moves import Move, Rotate, apply
from labgym.layouts.refinement import blockages
from labgym.layouts.refinement.blockages import Translation, deduplicated, responsible, rotation_fixes, translations
from labgym.layouts.rules.objective import evaluate_layout
from labgym.navigation import feasibility
from labgym.navigation.feasibility import Transition
from labgym.navigation.goals import GoalPair
from labgym.protocols import protocols

ROOM = Room(width=10.0, depth=6.0, doors=(Door(wall="front", offset=1.5),))
HOOD = put("hood", "FumeHood", 2.0, 5.575, yaw=math.pi)
BENCH = put("bench", "LabBench1800", 8.0, 5.625, yaw=math.pi)


def lab(*further: Placement) -> Layout:
    return Layout(id="lab", floor=ROOM.floor, placements=(HOOD, BENCH, *further))


def drive(layout: Layout) -> Transition:
    """The transition from the hood to the bench."""
    from labgym.navigation.goals import location_pose

    start, goal = location_pose(layout, "FumeHood"), location_pose(layout, "LabBench1800")
    return feasibility(layout, [GoalPair(0, start, goal, "FumeHood", "LabBench1800")])[0]


def test_a_feasible_transition_has_no_blockage() -> None:
    assert blockages(lab(), drive(lab())) == ()


@pytest.mark.parametrize("yaw", [0.0, 0.4, 1.2])
def test_a_blocked_start_names_what_reaches_into_the_disc_and_how_deep(yaw: float) -> None:
    x, y, _ = drive(lab()).start or (0.0, 0.0, 0.0)
    spoilt = lab(put("rack", "EquipmentRack", x + 0.4, y - 0.2, yaw=yaw))
    transition = drive(spoilt)
    assert (transition.failure, transition.ends) == ("endpoint_invalid", ("start",))
    (place,) = blockages(spoilt, transition)
    assert (place.cause, place.location, place.objects) == ("start_blocked", "FumeHood", ("rack",))
    distance = Polygon(spoilt.box("rack").corners()).distance(Point(x, y))
    assert place.depth == pytest.approx(place.radius - distance)


@pytest.mark.parametrize("yaw", [0.0, 0.4, 1.2])
def test_each_translation_frees_the_disc_and_is_the_least_that_does(yaw: float) -> None:
    x, y, _ = drive(lab()).start or (0.0, 0.0, 0.0)
    spoilt = lab(put("rack", "EquipmentRack", x + 0.4, y - 0.2, yaw=yaw))
    (place,) = blockages(spoilt, drive(spoilt))
    pushes = [push for push in translations(spoilt, place) if push.id == "rack"]
    assert {(push.axis, push.delta > 0.0) for push in pushes} == {(a, s) for a in "xy" for s in (True, False)}
    for push in pushes:
        moved = apply(spoilt, push.command)
        assert Polygon(moved.box("rack").corners()).distance(Point(x, y)) >= place.radius
        less = push.delta - math.copysign(0.025, push.delta)
        near = apply(spoilt, Translation("rack", push.axis, less).command)
        assert Polygon(near.box("rack").corners()).distance(Point(x, y)) < place.radius
    assert responsible(spoilt, place) == (min(pushes, key=lambda push: abs(push.delta)),)


def test_the_piece_at_which_the_robot_works_can_move_instead() -> None:
    x, y, _ = drive(lab()).start or (0.0, 0.0, 0.0)
    rack = put("rack", "EquipmentRack", x + 0.4, y - 0.2).model_copy(update={"fixed": True})
    spoilt = lab(rack)
    (place,) = blockages(spoilt, drive(spoilt))
    pushes = translations(spoilt, place)
    assert {push.id for push in pushes} == {"hood"}
    rack_area = Polygon(spoilt.box("rack").corners())
    for push in pushes:
        moved = apply(spoilt, push.command)
        start = drive(moved).start or (0.0, 0.0, 0.0)
        assert rack_area.distance(Point(start[:2])) >= place.radius


def test_a_wall_of_furniture_is_blocked_where_it_is_thinnest() -> None:
    """Racks across the room: a deep row, and one shallow piece through which the path breaks."""
    row = [put(f"rack{k}", "EquipmentRack", 5.0, 0.3 + 0.6 * k, yaw=math.pi / 2.0) for k in range(10)]
    spoilt = lab(*row)
    transition = drive(spoilt)
    assert transition.failure == "unreachable"
    places = blockages(spoilt, transition)
    assert {place.cause for place in places} == {"path_blocked"}
    assert all(abs(place.point[0] - 5.0) < 1.0 for place in places)
    fixed = [item.model_copy(update={"fixed": True}) for item in row[:-3]]
    partly = lab(*fixed, *row[-3:])
    for place in blockages(partly, drive(partly)):
        assert place.point[1] > spoilt.box("rack7").y - 0.6
    walled = lab(*(item.model_copy(update={"fixed": True}) for item in row))
    assert blockages(walled, drive(walled)) == ()


def test_a_piece_that_faces_the_wall_turns_to_the_room() -> None:
    spoilt = apply(lab(), Rotate("bench", 0.0))
    transition = drive(spoilt)
    assert transition.ends == ("goal",)
    (place,) = blockages(spoilt, transition)
    assert place.cause == "goal_outside"
    (turn,) = rotation_fixes(spoilt, place)
    assert drive(apply(spoilt, turn)).feasible
    assert abs(turn.yaw) == pytest.approx(math.pi)


def test_of_several_translations_along_an_axis_the_largest_remains() -> None:
    generator = np.random.default_rng(3)
    raw = [
        Translation(str(generator.choice(["a", "b"])), axis, float(delta))
        for axis in ("x", "y")
        for delta in generator.normal(0.0, 1.0, 40)
    ]
    for one in deduplicated(raw):
        assert abs(one.delta) == max(abs(other.delta) for other in raw if (other.id, other.axis) == (one.id, one.axis))
    assert len(deduplicated(raw)) == 4


def test_two_pieces_in_one_place_both_make_way() -> None:
    protocol = protocols()["sub_01"]
    layout = generate("sub_01", 0)
    hood = layout.box("FumeHood_1")
    x, y = hood.to_world(0.0, hood.depth / 2.0 + 0.6)
    pieces = [item.id for item in layout.placements if item.asset in ("EquipmentRack", "GlasswareCabinet")][:2]
    spoilt = layout
    for side, item in zip((-0.35, 0.35), pieces, strict=False):
        position = spoilt.placement(item).position
        spoilt = apply(spoilt, Move(item, x + side - position[0], y - position[1]))
    assert any(
        not one.feasible for one in evaluate_layout(spoilt, protocol, navigation=True, rules="paper").transitions or ()
    )
    after = evaluate_layout(refine(spoilt, protocol, rules="paper"), protocol, navigation=True, rules="paper")
    assert all(one.feasible for one in after.transitions or ())
    assert after.cost == 0
