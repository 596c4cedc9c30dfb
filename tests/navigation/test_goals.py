from __future__ import annotations

import math

import pytest

from labgym.errors import LabgymError, UnknownNameError
from labgym.geometry import OrientedBox
from labgym.navigation import goal_pairs, goal_pose, goal_poses


@pytest.mark.parametrize(
    "yaw, place, heading",
    [
        (0.0, (4.0, 5.0), -math.pi / 2),
        (math.pi / 2, (3.0, 4.0), 0.0),
        (math.pi, (4.0, 3.0), math.pi / 2),
        (-math.pi / 2, (5.0, 4.0), math.pi),
    ],
)
def test_the_robot_stands_sixty_centimetres_before_the_front_and_looks_at_it(yaw, place, heading):
    x, y, robot = goal_pose(OrientedBox(4.0, 4.0, 1.5, 0.8, yaw))
    assert (x, y) == pytest.approx(place)
    assert (math.cos(robot), math.sin(robot)) == pytest.approx((math.cos(heading), math.sin(heading)))


@pytest.mark.parametrize("yaw", [-2.9, -1.0, 0.3, 1.7, 3.1])
def test_driving_ahead_from_a_goal_pose_meets_the_middle_of_the_front(yaw):
    box = OrientedBox(1.0, -2.0, 1.2, 0.7, yaw)
    x, y, heading = goal_pose(box)
    ahead = box.to_local(x + 0.6 * math.cos(heading), y + 0.6 * math.sin(heading))
    assert ahead == pytest.approx((0.0, 0.35))
    assert -math.pi < heading <= math.pi


def test_a_device_on_a_larger_bench_is_served_from_before_the_bench():
    bench, balance = OrientedBox(4.0, 4.0, 1.8, 0.75), OrientedBox(4.5, 4.1, 0.2, 0.3, math.pi)
    assert goal_pose(balance, bench) == goal_pose(bench)
    assert goal_pose(bench, balance) == goal_pose(bench)


def test_pairs_follow_the_steps_and_merge_repeats(make_plan, make_protocol):
    plan = make_plan(named={"Hood": OrientedBox(2.0, 7.5, 1.0, 0.8, math.pi), "Sink": OrientedBox(6.0, 0.5, 1.0, 0.8)})
    pairs = goal_pairs(plan, make_protocol("Hood", "Hood", "Sink", "Hood"))
    assert [(p.index, p.start_location, p.goal_location) for p in pairs] == [(0, "Hood", "Sink"), (1, "Sink", "Hood")]
    assert pairs[0].goal == pairs[1].start == pytest.approx((6.0, 1.5, -math.pi / 2))
    assert pairs[0].start == pytest.approx((2.0, 6.5, math.pi / 2))


def test_a_drive_of_no_length_is_dropped(make_plan, make_protocol):
    bench = OrientedBox(2.0, 7.5, 1.6, 0.8, math.pi)
    named = {
        "Bench": bench,
        "Balance": OrientedBox(2.2, 7.5, 0.2, 0.3, math.pi),
        "Sink": OrientedBox(6.0, 0.5, 1.0, 0.8),
    }
    pairs = goal_pairs(make_plan(named=named, on={"Balance": "Bench"}), make_protocol("Bench", "Balance", "Sink"))
    assert [(p.index, p.start_location, p.goal_location) for p in pairs] == [(0, "Balance", "Sink")]


def test_poses_are_named_by_location_in_the_order_of_the_visits(make_plan, make_protocol):
    plan = make_plan(named={"Hood": OrientedBox(2.0, 7.5, 1.0, 0.8, math.pi), "Sink": OrientedBox(6.0, 0.5, 1.0, 0.8)})
    assert list(goal_poses(plan, make_protocol("Sink", "Hood", "Sink"))) == ["Sink", "Hood"]


def test_a_location_that_is_not_placed_is_named(make_plan, make_protocol):
    with pytest.raises(LabgymError, match="FumeHood is a location of the protocol, but the layout does not contain it"):
        goal_pairs(make_plan(), make_protocol("FumeHood", "Bench"))


def test_a_layout_without_a_protocol_asks_for_one(make_plan):
    with pytest.raises(LabgymError, match="protocol"):
        goal_pairs(make_plan())


def test_an_unknown_protocol_is_named(make_plan):
    with pytest.raises(UnknownNameError, match="no_such_protocol"):
        goal_pairs(make_plan(), "no_such_protocol")
