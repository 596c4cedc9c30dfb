"""Drives under the common rules, in a room made by hand, with policies of a few lines."""

from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.envs.labnav.tasks import TASKS
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.results import DriveTerms
from labgym.navigation import goal_pose
from labgym.policies import Policy

LAYOUT = island_laboratory()
START, GOAL = (1.5, 4.2, 0.0), (6.5, 4.2, 0.0)
"""A free straight line of 5 m along the island."""
LENGTH = 5.0 - 0.36


def episode(start=START, goal=GOAL, **conditions):
    return LabNavEpisode(
        floor=LAYOUT.id, floor_hash=LAYOUT.hash, number=0, start=start, goal=goal, conditions=conditions, seed=3,
        length=LENGTH,
    )  # fmt: skip


NOTHING = {
    "aisle": {"parked": []},
    "carry": {"people": {}},
    "people": {"people": {}},
    "moved": {"changes": []},
    "glass": {"glass": {"panes": [], "seed": 0, "void": 0.4, "true": 0.1, "steel": 0.3}},
    "shift": {"changes": [], "people": {}, "payload": {"beaker": {}, "legs": []}},
    "dock": {"station": {"station": "ValidationPlatform_1", "shift": [0.0, 0.0, 0.0]}},
}
"""Data of the conditions of each task, without people, panes and changes."""
DOCK = goal_pose(LAYOUT.box("ValidationPlatform_1"))
"""The docking pose of a device."""


def driven(policy, task="aisle", level=2, one=None, **arguments):
    goal = DOCK if task == "dock" else GOAL
    episodes = (one or episode(goal=goal, **NOTHING.get(task, {})),)
    (drive,) = drive_floor(policy, LAYOUT, episodes, DriveTerms(task, level, "mine", "suite/0", 0, **arguments))
    return drive


class Still(Policy):
    def reset(self, episode):
        self.start = episode

    def act(self, observation):
        return np.zeros(2)


class Ahead(Still):
    """Full speed ahead."""

    def act(self, observation):
        return np.array([1.0, 0.0])


class Pursuing(Still):
    """Full speed ahead, turning towards the goal."""

    def act(self, observation):
        return np.array([1.0, float(observation["goal"][2])])


class Arriving(Ahead):
    """Full speed ahead, and stops at a distance from the goal."""

    def __init__(self, distance: float) -> None:
        self.distance = distance

    def stop(self, observation):
        return float(observation["goal"][0]) <= self.distance


@pytest.mark.cases(3)
@pytest.mark.parametrize("task", TASKS)
def test_a_robot_that_stands_scores_0_and_is_stuck_after_30_s(task):
    row = driven(Still(), task).row
    assert (row.score, row.success, row.ending, row.time) == (0.0, False, "stuck", 30.0)


def test_a_robot_that_stops_at_once_is_in_the_wrong_place():
    row = driven(Arriving(99.0)).row
    assert (row.score, row.ending, row.stopped, row.path_length) == (0.0, "wrong place", "policy", 0.0)


def test_the_evaluator_brakes_a_policy_that_cannot_stop():
    row = driven(Pursuing()).row
    assert (row.ending, row.stopped, row.contacts) == ("success", "evaluator", 0)
    assert row.final_distance <= 0.252
    assert row.score == pytest.approx(LENGTH / row.time)
    # From rest and to rest at 1.5 m/s2: 2/3 s more than at full speed all the way.
    assert row.time >= 4.74 + 0.6


def test_stop_brakes_to_rest_before_the_distance_counts():
    far, near = driven(Arriving(0.9)).row, driven(Arriving(0.5)).row
    braking = 0.5 * 1.0**2 / 1.5
    # STOP is given up to one control step, 0.1 m, after the distance; the servo lags.
    assert 0.9 - braking - 0.15 < far.final_distance < 0.9 - braking
    assert (far.ending, far.success) == ("wrong place", False)
    assert (near.ending, near.success) == ("success", True)


def test_a_declared_latency_delays_every_action():
    class Late(Arriving):
        latency = 0.25

    prompt, late = driven(Arriving(0.9)), driven(Late(0.9))
    assert (prompt.row.delay, late.row.delay) == (0, 3)
    assert [pose[0] for pose in late.route[:4]] == [START[0]] * 4
    assert late.route[4][0] > START[0]
    # STOP comes late, too: 0.3 s at 1 m/s.
    assert prompt.row.final_distance - late.row.final_distance == pytest.approx(0.3, abs=0.03)


def test_a_contact_ends_the_drive_and_is_named():
    row = driven(Ahead(), one=episode(start=(2.0, 2.5, 0.0), parked=[])).row
    assert (row.ending, row.contact, row.score) == ("contact", "IslandBench1800_1", 0.0)
    assert row.touched == ("IslandBench1800_1",)
    assert row.time < 3.0


@pytest.mark.parametrize("task", ["odometry", "people", "carry", "glass", "moved"])
def test_a_contact_with_furniture_ends_a_drive_in_every_task(task):
    row = driven(Ahead(), task, one=episode(start=(2.0, 2.5, 0.0), **NOTHING.get(task, {})), seconds=6.0).row
    assert (row.ending, row.contact, row.score) == ("contact", "IslandBench1800_1", 0.0)


def test_a_parked_thing_is_in_the_way_and_on_the_map():
    class Mapped(Ahead):
        privileged = True

        def act(self, observation):
            assert any(one.id == "parked-1" for one in self.start.truth.layout.placements)
            return np.array([1.0, 0.0])

    thing = {"asset": "SteelDrum", "x": 4.0, "y": 4.2, "yaw": 0.0}
    row = driven(Mapped(), one=episode(parked=[thing])).row
    assert (row.ending, row.contact, row.track, row.error) == ("contact", "parked-1", "deployed", None)


def test_the_goal_follows_the_odometry_and_a_wrong_one_is_lost():
    class Watching(Ahead):
        def __init__(self):
            self.errors = []

        def act(self, observation):
            x, y, yaw = observation["odometry"]
            goal = self.start.goal
            away, bearing = math.hypot(goal[0] - x, goal[1] - y), math.atan2(goal[1] - y, goal[0] - x) - yaw
            expected = np.array([away, math.cos(bearing), math.sin(bearing)])
            self.errors.append(float(np.abs(observation["goal"] - expected).max()))
            return np.array([1.0, 0.6 * float(observation["goal"][2])])

        def stop(self, observation):
            return float(observation["goal"][0]) < 0.5

    policy = Watching()
    rows = [driven(policy, "odometry", 3, episode().model_copy(update={"seed": seed})).row for seed in range(4)]
    assert max(policy.errors) < 1e-5
    assert {row.ending for row in rows} <= {"lost", "success", "time", "stuck", "wrong place"}
    assert "lost" in {row.ending for row in rows}
    for row in rows:
        assert row.odometry_error > 0.0
        assert (row.ending == "success") == (row.final_distance <= 0.36)


def test_hard_braking_spills_and_the_score_is_that_of_the_rise():
    row = driven(Arriving(0.5), "carry").row
    rise = row.outcomes["payload"]["highest"]
    # Ramps of 1.5 m/s2 let a 1 L beaker rise by 12 to 16 mm.
    assert 0.010 < rise < 0.022
    assert row.ending == "spilt"
    assert row.score == pytest.approx(LENGTH / row.time * min(max(2.0 - rise / 0.010, 0.0), 1.0))


class Careful(Still):
    """Slower and slower towards the goal."""

    def act(self, observation):
        away, _, side = (float(each) for each in observation["goal"])
        return np.array([min(1.0, 0.6 * away), 1.5 * side])


def docking(shift):
    data = {"station": {"station": "ValidationPlatform_1", "shift": shift}}
    return driven(Careful(), "dock", one=episode(start=(6.0, 4.8, -1.3), goal=DOCK, **data)).row


def test_the_evaluator_parks_at_the_mapped_pose_and_the_score_is_that_of_the_true_one():
    there, off = docking([0.0, 0.0, 0.0]), docking([-0.06, 0.03, 0.0])
    assert (there.ending, there.stopped) == ("success", "evaluator")
    assert there.final_distance <= 0.05
    assert abs(there.final_heading) <= 0.02
    assert off.final_distance == pytest.approx(math.hypot(0.06, 0.03), abs=there.final_distance + 1e-3)
    for row in (there, off):
        error = max(row.final_distance / 0.1, abs(row.final_heading) / 0.1)
        assert row.score == pytest.approx(max(0.0, -math.log10(error)))
    # At rest for 1 s.
    assert there.time >= 1.0 + 2.0


def test_people_are_met_and_their_touch_ends_a_drive():
    person = {"start": [4.0, 4.2], "yields": False, "group": 0, "stops": [[4.0, 4.2, 0.0, 600.0]]}
    row = driven(Ahead(), "people", one=episode(people={"people": [person]})).row
    assert (row.ending, row.contact, row.score) == ("contact", "person 1", 0.0)
    # Radii of 0.27 and 0.3 m; the control step of 0.1 s goes on to its end.
    assert 0.46 < row.outcomes["people"]["least_distance"] < 0.57


def test_an_error_of_the_policy_scores_0():
    class Failing(Still):
        def act(self, observation):
            raise RuntimeError("no idea")

    row = driven(Failing()).row
    assert (row.ending, row.error, row.score) == ("error", "RuntimeError: no idea", 0.0)


def test_wheels_err_so_that_commands_do_not_tell_where_the_robot_is():
    ends = [driven(Ahead(), "aisle", one=episode(parked=[]).model_copy(update={"seed": seed}), seconds=4.0).route[-1]
            for seed in range(6)]  # fmt: skip
    sides = [pose[1] - START[1] for pose in ends]
    # A veer of N(0, 1 degree per meter) moves the end of 3.7 m aside by N(0, 0.12 m).
    assert 0.02 < float(np.std(sides)) < 0.3


def test_equal_episodes_give_equal_rows():
    rows = [driven(Pursuing(), "odometry", 2).row for _ in range(2)]
    assert rows[0] == rows[1]


def test_the_time_limit_ends_a_drive():
    row = driven(Ahead(), one=episode(parked=[]), seconds=2.0).row
    assert (row.ending, row.time) == ("time", 2.0)


def test_the_world_is_handed_to_policies_that_foresee_it_and_to_no_others():
    class Knowing(Still):
        foresees = True

        def act(self, observation):
            world = self.start.world
            self.goal, self.radius, self.floor = world.goal, world.radius, world.solids()
            self.poses = [*getattr(self, "poses", ()), world.pose]
            return np.array([1.0, 0.0])

        def stop(self, observation):
            return self.start.world.time >= 1.0

    class Mapped(Still):
        privileged = True

    knowing, thing = Knowing(), {"asset": "SteelDrum", "x": 4.0, "y": 3.0, "yaw": 0.0}
    drive = driven(knowing, one=episode(parked=[thing]))
    assert (drive.row.track, drive.row.error) == ("privileged", None)
    assert (knowing.goal, knowing.radius, knowing.start.truth) == (GOAL, TASKS["aisle"].radius, None)
    assert any(one.id == "parked-1" for one in knowing.floor.placements)
    np.testing.assert_allclose(knowing.poses, drive.route[:10], atol=6e-4)
    for other in (Still(), Mapped()):
        driven(other, seconds=0.5)
        assert other.start.world is None


def test_the_futures_of_the_world_are_what_then_happens():
    class Knowing(Still):
        foresees = True

        def act(self, observation):
            world = self.start.world
            if world.time == 0.0:
                self.times = [0.1 * k for k in range(1, 31)]
                self.expected = world.people(self.times)
                self.seen = []
            else:
                self.seen.append(world.people([world.time])[0])
            return np.zeros(2)

    walker = {"start": [2.0, 1.0], "group": 0, "yields": True, "stops": [[7.0, 1.0, 0.0, 2.0], [2.0, 1.0, 0.0, 2.0]]}
    people = {"people": {"people": [walker], "speed": 1.0, "model": "orca"}}
    knowing = Knowing()
    driven(knowing, "people", one=episode(**people), seconds=3.1)
    np.testing.assert_allclose(knowing.seen, knowing.expected, atol=1e-9)
    assert knowing.expected[-1, 0, 0] - knowing.expected[0, 0, 0] > 1.0
