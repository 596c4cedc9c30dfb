"""Forged LabNav results fail without a drive: routes through what is fixed, of other episodes, with hidden figures."""

from __future__ import annotations

import itertools
import math
from functools import cache

import numpy as np
import pytest
from labnav_forgeries import forged_row, legal_route
from scipy.signal import lsim, lti
from shapely import LineString

from labgym.envs.conditions.beaker import Beaker
from labgym.envs.labnav.nuisances import prepared
from labgym.envs.world import world_of
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.results import DriveTerms, score_of
from labgym.eval.labnav.suites import load_labnav
from labgym.eval.submission.check import drawn_again, driven_again, unseen
from labgym.eval.submission.labnav_rows import LabNavTerms, labnav_route_problems, labnav_row_problems
from labgym.eval.submission.outcome_checks import PeopleClaims, least_rise, people_problems
from labgym.eval.submission.route_checks import RouteClaims, route_problems
from labgym.layouts import Layout
from labgym.navigation import ShortestPaths
from labgym.policies import make_policy

TERMS = LabNavTerms("mine", 0, "mapless", 120.0, 0.0)
SHIFT = LabNavTerms("mine", 0, "mapless", 6.0, 0.0)
TASKS = ("aisle", "moved", "people", "odometry", "dock", "glass", "carry")


@cache
def episodes(task: str):
    """Return the first episode of each floor of floors-val, with its floor and the task after its conditions."""
    (part,) = load_labnav(f"labnav-val-{task}").parts
    chosen = []
    for episode in part.first(6, 1).episodes:
        layout = part.layout(episode.floor)
        chosen.append((part, episode, layout, prepared(part.task, part.level, episode, layout)))
    return chosen


def problems(row, route, part, episode, layout: Layout, terms: LabNavTerms = TERMS) -> list[str]:
    return [
        *labnav_row_problems(row, part, episode, terms),
        *labnav_route_problems(row, route, part, episode, layout),
    ]


def along(layout: Layout, task, acceleration=1.3):
    """Return a route along the shortest path of the disc of 0.30 m in a layout."""
    path = ShortestPaths(layout).path(task.pair.start[:2], task.pair.goal[:2])
    assert path is not None
    return legal_route(task.pair.start, path.points[1:], task.pair.goal[2], acceleration)


@pytest.mark.cases(3)
@pytest.mark.parametrize("task", TASKS)
def test_a_possible_route_raises_no_alarm(task):
    for part, episode, layout, world in episodes(task)[:3]:
        route = along(world.layout, world, 0.2 if task == "carry" else 1.3)
        assert problems(forged_row(part, episode, world, route), route, part, episode, layout) == []


@pytest.mark.parametrize("task", TASKS)
def test_a_straight_route_through_what_is_fixed_is_named(task):
    blocked = [each for each in episodes(task) if each[1].length > math.dist(each[1].start[:2], each[1].goal[:2]) + 0.5]
    assert blocked
    for part, episode, layout, world in blocked[:3]:
        route = legal_route(world.pair.start, [world.pair.goal[:2]], world.pair.goal[2])
        found = problems(forged_row(part, episode, world, route), route, part, episode, layout)
        assert any("inside an obstacle at step" in problem for problem in found), (episode.key, found)


@pytest.mark.parametrize("task", ["moved", "glass"])
def test_a_route_through_panes_shut_doors_and_things_that_the_map_does_not_show_is_named(task):
    """Routes that are free on the floor before its conditions."""
    named = []
    for part, episode, layout, world in episodes(task):
        route = along(layout, world)
        found = problems(forged_row(part, episode, world, route), route, part, episode, layout)
        longer = ShortestPaths(world.layout).path(*ends(world)).length
        if longer <= ShortestPaths(layout).path(*ends(world)).length + 0.1:
            continue  # the changes leave the way free
        assert any("inside an obstacle" in problem for problem in found), (episode.key, found)
        named.append(episode.key)
    assert len(named) >= 3


def ends(world):
    return world.pair.start[:2], world.pair.goal[:2]


def honest(task="odometry", number=0):
    part, episode, layout, world = episodes(task)[number]
    return part, episode, layout, world, along(world.layout, world)


def test_the_route_of_another_episode_is_named():
    part, episode, layout, *_ = honest()
    *_, other, theirs = honest(number=1)
    found = problems(forged_row(part, episode, other, theirs), theirs, part, episode, layout)
    assert any("does not begin at the start" in problem for problem in found)
    assert any("final_distance is" in problem for problem in found)


def shifted(route):
    return tuple((x + 0.05, y, yaw) for x, y, yaw in route)


def turned(route):
    return ((*route[0][:2], route[0][2] + 0.3), *route[1:])


def unrested(route):
    """End the route in the middle of a straight part within reach of the goal."""
    away = [math.dist(pose[:2], route[-1][:2]) for pose in route]
    return route[: next(k for k, each in enumerate(away) if each < 0.33) + 1]


def through_a_wall(route):
    """Pass 2.5 m in three steps in the middle of the route."""
    middle = len(route) // 2
    return (*route[:middle], *route[middle + 25 :])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (shifted, "does not begin at the start"),
        (turned, "does not begin at the start"),
        (unrested, "does not come to rest"),
        (through_a_wall, "which the robot cannot drive in 0.1 s"),
    ],
)
def test_an_impossible_route_is_named(change, message):
    part, episode, layout, world, route = honest()
    forged = change(route)
    found = problems(forged_row(part, episode, world, forged), forged, part, episode, layout)
    assert any(message in problem for problem in found), found


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"time": 3.0}, "time is 3 s, but"),
        ({"score": 0.999}, "score is 0.999, recomputed"),
        ({"final_distance": 0.01}, "final_distance is 0.010 m, but its route ends"),
        ({"final_heading": 0.2}, "final_heading is 0.200 rad, but its route ends"),
        ({"path_length": 1.0}, "path_length is 1.000 m, but its route is at least"),
        ({"contacts": 3}, "success is True, but its robot had 3 contacts"),
        ({"steps": 7}, "poses, expected 8 for 7 steps"),
        ({"delay": 2}, "delay is 2, expected 0"),
        ({"outcomes": {"people": {}}}, "outcomes are of ['people'], expected []"),
    ],
)
def test_a_row_that_its_route_contradicts_is_named(fields, message):
    part, episode, layout, world, route = honest()
    found = problems(forged_row(part, episode, world, route, **fields), route, part, episode, layout)
    assert any(message in problem for problem in found), found


def test_a_success_far_from_the_goal_is_named():
    part, episode, layout, world, route = honest()
    short = legal_route(world.pair.start, [route[len(route) // 3][:2]])
    found = problems(forged_row(part, episode, world, short), short, part, episode, layout)
    assert any("success is True, but it ended" in problem for problem in found)


def test_a_policy_that_declares_a_latency_must_have_its_delay():
    part, episode, layout, world, route = honest()
    terms = LabNavTerms("mine", 0, "mapless", 120.0, 0.25)
    row = forged_row(part, episode, world, route)
    assert "delay is 0, expected 3" in problems(row, route, part, episode, layout, terms)
    assert problems(row.model_copy(update={"delay": 3}), route, part, episode, layout, terms) == []


def test_things_that_the_outcomes_say_were_not_pushed_stand_in_the_way():
    for part, episode, layout, world in episodes("moved"):
        late = {one["id"] for one in episode.conditions["changes"] if one.get("after") is not None}
        things = [name for name in world.pushable if name not in late]
        if not things:
            continue
        x, y = world.layout.placement(things[0]).position[:2]
        route = legal_route(world.pair.start, [(x, y)])
        found = problems(forged_row(part, episode, world, route), route, part, episode, layout)
        assert any("inside an obstacle" in problem for problem in found)
        outcomes = {"changes": {"pushed": {}, "appeared": {}}}
        found = problems(forged_row(part, episode, world, route, outcomes=outcomes), route, part, episode, layout)
        assert any("can be pushed, kg by name" in problem for problem in found)
        return
    pytest.fail("no episode has a thing that can be pushed")


def test_all_of_at_most_60_rows_are_driven_again_and_a_tenth_or_60_of_more():
    for count, again in ((3, 3), (60, 60), (61, 60), (129, 60), (600, 60), (601, 61), (2400, 240)):
        keys = [str(number) for number in range(count)]
        assert len(drawn_again(keys, 0)) == again
        assert drawn_again(keys, 0) == tuple(sorted(drawn_again(keys, 0), key=int))
    assert drawn_again(keys, 0) != drawn_again(keys, 1)


def test_the_probability_that_forged_rows_go_unseen_is_that_of_drawing_without_replacement():
    # Three forged rows of 129, 60 driven again: 69/129 * 68/128 * 67/127.
    assert unseen(129, 60) == pytest.approx(69 / 129 * 68 / 128 * 67 / 127)
    assert unseen(60, 60) == 0.0
    assert unseen(2, 1) == 0.0
    assert "go unseen with a probability of 15%" in driven_again(60, 129, "straight", 4)
    assert driven_again(24, 24, "straight", 4) == "all 24 episodes driven again with 'straight'"


def test_a_kick_across_a_wall_between_two_poses_is_named():
    """Contacts may throw the robot by up to 1 m in a step; both poses are clear of a wall that lies between them."""
    layout = episodes("odometry")[0][2]
    fixed = world_of(layout)
    for wall in layout.floor.walls:
        (ax, ay), (bx, by) = wall.start, wall.end
        along = np.array([bx - ax, by - ay]) / math.dist(wall.start, wall.end)
        normal = np.array([-along[1], along[0]])
        for share in np.linspace(0.1, 0.9, 17):
            middle = np.array(wall.start) + share * math.dist(wall.start, wall.end) * along
            away = 0.275 + wall.thickness / 2.0
            sides = np.array([middle + away * normal, middle - away * normal])
            crossing = LineString(sides).intersection(LineString([wall.start, wall.end]))
            if crossing.is_empty or (fixed.clearances(sides) <= 0.0).any() or not fixed.clearances(sides).max() < 0.02:
                continue
            yaw = math.atan2(*(sides[1] - sides[0])[::-1])
            poses = np.column_stack([sides[[0, 0, 1, 1]], np.full(4, yaw)])
            start, goal = tuple(poses[0].tolist()), tuple(poses[-1].tolist())
            claims = RouteClaims(start, goal, steps=3, path_length=2.0 * away, final_distance=0.0, contacts=1)
            found = list(route_problems(claims, poses, fixed))
            assert any("m inside an obstacle at step 2" in problem for problem in found), found
            assert not any("jumps" in problem for problem in found)
            return
    pytest.fail("no wall has free places on both sides")


@cache
def driven(task: str):
    """Return episodes of a task that policies drove."""
    (part,) = load_labnav(f"labnav-val-{task}").parts
    drives = []
    for name, episode in itertools.product(("straight", "bug2"), part.first(2, 1).episodes):
        layout = part.layout(episode.floor)
        (drive,) = drive_floor(make_policy(name), layout, [episode], DriveTerms.of(part, "mine", 0, seconds=25.0))
        drives.append((part, episode, layout, drive))
    return drives


def crowd(**figures):
    return lambda row: {"outcomes": {**row.outcomes, "people": {**row.outcomes["people"], **figures}}}


def beaker(**figures):
    return lambda row: {"outcomes": {**row.outcomes, "payload": {**row.outcomes["payload"], **figures}}}


FORGED = {
    "people": (
        crowd(close_seconds=1e3),
        crowd(close_seconds=-1.0),
        crowd(close_seconds=0.0, least_distance=0.7),
        crowd(close_seconds=4.0, least_distance=1.4),
        crowd(least_distance=None),
        crowd(least_distance=30.0, nearest=30.0),
        crowd(least_distance=2.0, nearest=1.2),
        crowd(people=0),
        crowd(met=99),
        crowd(beside_seconds=9.0, nearest=4.0),
        crowd(least_distance=0.1, close_seconds=2.0),
        lambda row: {"waited": row.time},
    ),
    "carry": (
        beaker(highest=0.0),
        beaker(highest=0.0005, spilt=False),
        beaker(highest=0.001),
        beaker(highest=-1.0),
        beaker(spilt=True, highest=0.004),
        beaker(spilt=False, highest=0.02),
        lambda row: {"ending": "spilt", **beaker(spilt=False, highest=0.004)(row)},
        lambda row: {"ending": "success", "success": True, **beaker(spilt=True, highest=0.02)(row)},
    ),
}
"""Figures of people and of the liquid that nobody measured; everything else in the row is honest."""


@pytest.mark.parametrize("task", ["people", "carry"])
def test_honest_figures_of_people_and_liquid_raise_no_alarm(task):
    terms = LabNavTerms("mine", 0, "mapless", 25.0, 0.0)
    for part, episode, layout, drive in driven(task):
        row = drive.row.model_copy(update={"track": "mapless"})
        assert problems(row, drive.route, part, episode, layout, terms) == []


@pytest.mark.parametrize(
    ("task", "number"), [(task, k) for task, forgeries in FORGED.items() for k in range(len(forgeries))]
)
def test_a_figure_of_people_or_liquid_that_the_route_contradicts_is_named(task, number):
    terms = LabNavTerms("mine", 0, "mapless", 25.0, 0.0)
    part, episode, layout, drive = driven(task)[0]
    row = drive.row.model_copy(update={"track": "mapless"} | FORGED[task][number](drive.row))
    row = row.model_copy(update={"score": score_of(row, row.outcomes, episode.conditions)})
    assert problems(row, drive.route, part, episode, layout, terms) != []


@pytest.mark.parametrize(
    ("least", "close_seconds", "named"),
    [(14.1, 0.0, False), (13.9, 0.0, False), (13.5, 0.0, True), (0.6, 0.4, True), (0.6, 0.0, True)],
)
def test_a_person_cannot_have_come_nearer_than_it_can_walk(least, close_seconds, named):
    """The robot drives 2 m in 2 s toward a person 20 m away, who may walk 4 m in that time: 14 m remain.

    The distance is refused though no other field contradicts it: the robot may have ended at a wall.
    """
    poses = np.column_stack([np.linspace(0.0, 2.0, 21), np.zeros(21), np.zeros(21)])
    claims = PeopleClaims([(20.0, 0.0)], 1.0, 0.57, 1.0, close_seconds, least, touched=False)
    assert bool(list(people_problems(claims, poses, 0.1))) is named


def test_nobody_can_have_been_close_for_longer_than_walks_take():
    """Somebody begins 5 m from a robot that rests for 4 s and is within 1 m after 2 s at the earliest."""
    poses = np.zeros((41, 3))
    for close_seconds, named in ((1.9, False), (2.5, True)):
        claims = PeopleClaims([(5.0, 0.0)], 1.0, 0.57, 1.0, close_seconds, 0.6, touched=False)
        assert any("close for at most" in one for one in people_problems(claims, poses, 0.1)) is named


def test_the_least_rise_is_below_that_of_the_liquid_and_near_it():
    """The oracle integrates the oscillator by scipy, for motions with other accelerations than those of the bound."""
    held = Beaker()
    for acceleration in (0.1, 0.5, 1.5):
        times, dt = np.arange(0.0, 6.0, 0.1), 0.001
        fine = np.arange(0.0, 6.0, dt)
        pushes = np.where(fine < 0.8, acceleration, np.where((fine > 3.0) & (fine < 3.8), -acceleration, 0.0))
        places = np.cumsum(np.cumsum(pushes) * dt) * dt
        system = lti([-1.0], [1.0, 2.0 * held.damping * held.frequency, held.frequency**2])
        rise = held.rise(float(np.abs(lsim(system, pushes, fine)[1]).max()))
        poses = np.round(np.column_stack([np.interp(times, fine, places), 0.0 * times]), 3)
        assert least_rise(held, poses, 0.1) <= rise
        if acceleration >= 0.5:
            assert least_rise(held, poses, 0.1) > 0.2 * rise


@pytest.fixture(scope="module")
def shift():
    """A shift of three goals by `straight`, 6 s a drive."""
    part = load_labnav("labnav-val-shift").parts[0].first(1, 1, 3)
    (episode,) = part.episodes
    layout = part.layout(episode.floor)
    (drive,) = drive_floor(make_policy("straight"), layout, [episode], DriveTerms.of(part, "mine", 0, seconds=6.0))
    return part, episode, layout, drive


def test_an_honest_shift_raises_no_alarm(shift):
    part, episode, layout, drive = shift
    assert len(drive.row.legs) >= 2
    assert problems(drive.row, drive.route, part, episode, layout, SHIFT) == []


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"success": True, "ending": "undocked"}, "does not come to rest at its goal"),
        ({"success": True, "docked": True, "ending": "success"}, "is docked,"),
        ({"success": True}, "but success is True and docked is False"),
        ({"shortest": 1.0}, "shortest of drive 1 is 1.000 m, recomputed"),
        ({"final_distance": 0.02}, "drive 1 ends 0.020 m from its goal"),
        ({"path_length": 0.0}, "path_length"),
        ({"time": 0.1}, "its drives take"),
        ({"time": 500.0}, "drive 1 takes 500 s, which is no part"),
    ],
)
def test_a_drive_of_a_shift_that_the_route_contradicts_is_named(shift, fields, message):
    part, episode, layout, drive = shift
    legs = list(drive.row.legs)
    legs[1] = legs[1].model_copy(update=fields)
    row = drive.row.model_copy(update={"legs": tuple(legs)})
    row = row.model_copy(update={"score": score_of(row, {}, {})})
    found = problems(row, drive.route, part, episode, layout, SHIFT)
    assert any(message in problem for problem in found), found
