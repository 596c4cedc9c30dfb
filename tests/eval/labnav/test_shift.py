"""Shifts: goals in a row without a reset, in a room made by hand, with policies of a few lines."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes, LabNavLeg
from labgym.envs.labnav.tasks import config_of
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.world import world_of
from labgym.eval.labnav.drive import drive_floor, shortest_from
from labgym.eval.labnav.results import DriveTerms
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.labnav.summary import summarise, summary_table
from labgym.geometry import compose
from labgym.policies import Policy

LAYOUT = island_laboratory()
START = (1.5, 4.2, 0.0)
GOALS = [(6.5, 4.2, 0.0), (6.5, 1.0, -math.pi / 2.0), (2.0, 1.0, math.pi)]
"""Around the island, along free straight lines."""
RADIUS = 0.36


def shift(goals=GOALS, people=(), changes=(), legs=()):
    lengths = [max(math.dist(a[:2], b[:2]) - RADIUS, 0.1) for a, b in zip([START, *goals[:-1]], goals, strict=True)]
    return LabNavEpisode(
        floor=LAYOUT.id, floor_hash=LAYOUT.hash, number=0, start=START, goal=goals[0], seed=3, length=lengths[0],
        conditions={
            "changes": list(changes),
            "people": {"people": list(people)},
            "payload": {"beaker": {"freeboard": 0.02}, "legs": list(legs)},
        },
        following=tuple(LabNavLeg(goal=g, length=one) for g, one in zip(goals[1:], lengths[1:], strict=True)),
    )  # fmt: skip


def driven(policy, one=None, level=2, **arguments):
    (drive,) = drive_floor(
        policy, LAYOUT, (one or shift(),), DriveTerms("shift", level, "mine", "suite/0", 0, **arguments)
    )
    return drive


class Still(Policy):
    def reset(self, episode):
        self.start = episode

    def act(self, observation):
        return np.zeros(2)


class Careful(Still):
    """Turns to the goal, and drives slower and slower towards it."""

    def act(self, observation):
        away, ahead, side = (float(each) for each in observation["goal"])
        return np.array([min(1.0, 0.7 * away) * max(0.0, ahead) ** 4, 1.5 * math.atan2(side, ahead) / 1.5])


class Watching(Careful):
    """Remembers what it is told of each drive."""

    privileged = True

    def __init__(self):
        self.starts = []

    def reset(self, episode):
        self.starts.append(episode)


@pytest.fixture(scope="module")
def reached():
    policy = Watching()
    return policy, driven(policy)


def test_a_careful_robot_reaches_all_goals_and_the_score_is_the_mean_of_its_drives(reached):
    row = reached[1].row
    assert [leg.success for leg in row.legs] == [True] * 3
    assert (row.goals, row.stopped, row.error) == (3, "evaluator", None)
    parts = [leg.shortest / max(leg.shortest, leg.path_length) * (1.0 if leg.docked else 0.5) for leg in row.legs]
    assert row.score == pytest.approx(sum(parts) / 3)
    assert row.score > 0.4
    assert row.success == all(leg.docked for leg in row.legs)
    assert row.path_length == pytest.approx(sum(leg.path_length for leg in row.legs))
    assert row.time == pytest.approx(sum(leg.time for leg in row.legs))
    assert row.shortest == pytest.approx(5.0 + 3.2 + 4.5 - 3 * RADIUS)


def test_the_first_drives_of_a_shift_do_not_depend_on_how_many_follow(reached):
    fewer = driven(Watching(), shift(GOALS[:2]))
    assert fewer.row.legs == reached[1].row.legs[:2]
    assert fewer.route == reached[1].route[: len(fewer.route)]


def test_the_shortest_paths_begin_where_the_robot_really_stands(reached):
    drive = reached[1]
    steps = np.cumsum([0, *(round(leg.time / 0.1) for leg in drive.row.legs)])
    for begin, goal, leg in zip(steps[:-1], GOALS, drive.row.legs, strict=True):
        here = drive.route[begin]
        # Free straight lines; the route is rounded to 1 mm.
        assert leg.shortest == pytest.approx(math.dist(here[:2], goal[:2]) - RADIUS, abs=2e-3)
    assert drive.route[steps[-1]] == drive.route[-1]


def test_later_goals_and_places_on_the_map_have_the_errors_of_the_odometry(reached):
    policy, drive = reached
    steps = np.cumsum([0, *(round(leg.time / 0.1) for leg in drive.row.legs)])
    errors = []
    for start, begin, goal in zip(policy.starts, steps[:-1], GOALS, strict=True):
        here = start.truth.start
        # The goal of the map, seen from where the odometry has the robot on the map.
        assert compose(here, (*start.goal, start.heading)) == pytest.approx(goal, abs=1e-6)
        assert start.truth.pair.goal == goal
        errors.append(math.dist(here[:2], drive.route[begin][:2]))
    assert errors[0] < 1e-3
    assert 2e-3 < min(errors[1:]) < 0.5
    assert drive.row.odometry_error > 2e-3


def test_a_robot_that_stands_scores_0_even_where_a_goal_is():
    row = driven(Still(), shift([*GOALS, START])).row
    assert (row.score, row.success, row.ending, row.goals) == (0.0, False, "stuck", 4)
    # Near its dock the clock of a stuck robot stands; there the evaluator parks it, which is no way driven.
    assert [leg.ending for leg in row.legs] == ["stuck", "stuck", "stuck", "success"]
    assert [leg.time for leg in row.legs[:3]] == [30.0] * 3
    assert row.legs[3].shortest == 0.0


def test_a_touch_of_a_person_ends_the_shift_and_the_rest_counts_0():
    person = {"start": [6.5, 2.5], "yields": False, "group": 0, "stops": [[6.5, 2.5, 0.0, 600.0]]}
    row = driven(Careful(), shift(people=[person])).row
    assert (row.ending, row.contact, row.goals) == ("contact", "person 1", 3)
    assert [leg.ending == "contact" for leg in row.legs] == [False, True]
    first = row.legs[0]
    whole = first.shortest / max(first.shortest, first.path_length) * (1.0 if first.docked else 0.5)
    assert row.score == pytest.approx(whole / 3)


class Shaking(Still):
    """Sways forward and back at the beaker's frequency."""

    def reset(self, episode):
        self.beaker, self.step = episode.beaker, 0

    def act(self, observation):
        self.step += 1
        speed = 1.0 if self.beaker is not None and self.step % 4 < 2 else 0.0
        return np.array([speed, 0.0])


def test_a_spill_ends_a_drive_and_the_next_one_begins_at_rest_with_a_full_beaker():
    drive = driven(Shaking(), shift(legs=[0, 2]), seconds=40.0)
    first, second, third = drive.row.legs
    assert [leg.ending for leg in drive.row.legs] == ["spilt", "stuck", "spilt"]
    assert [leg.beaker for leg in drive.row.legs] == [True, False, True]
    assert min(first.rise, third.rise) > 0.02
    assert second.rise == 0.0
    assert drive.row.score == 0.0
    # Each begins where the one before ended, and the second one stands there all the time.
    at = round(first.time / 0.1)
    assert drive.route[at] == drive.route[at + round(second.time / 0.1)]
    assert second.time == 30.0
    assert math.dist(drive.route[0][:2], drive.route[at][:2]) > 0.02


def test_the_time_limit_is_that_of_each_drive_and_ends_with_the_robot_at_rest():
    class Ahead(Still):
        def act(self, observation):
            return np.array([0.4, 0.0])

    drive = driven(Ahead(), seconds=2.0)
    assert [leg.ending for leg in drive.row.legs] == ["time"] * 3
    assert all(2.0 < leg.time < 3.5 for leg in drive.row.legs)
    at = round(drive.row.legs[0].time / 0.1)
    assert drive.route[at - 1][0] == pytest.approx(drive.route[at][0], abs=6e-3)


def test_an_error_of_the_policy_ends_the_shift():
    class Failing(Careful):
        def next_goal(self, episode):
            raise RuntimeError("no idea")

    row = driven(Failing()).row
    assert (row.ending, row.error, len(row.legs)) == ("error", "RuntimeError: no idea", 2)
    assert 0.0 < row.score < 1.0 / 3.0


def test_an_action_that_comes_late_does_not_reach_the_next_drive():
    class Late(Careful):
        latency = 0.2

    class Once(Late):
        """Drives the first time only."""

        def next_goal(self, episode):
            self.act = lambda observation: np.zeros(2)

    drive = driven(Once(), shift(GOALS[:2]))
    at = round(drive.row.legs[0].time / 0.1)
    assert drive.row.legs[0].success
    assert math.dist(drive.route[at][:2], drive.route[-1][:2]) <= 0.002


def test_equal_shifts_give_equal_rows(reached):
    assert driven(Watching()).row == reached[1].row


def test_the_shortest_path_from_a_place_where_the_disc_does_not_fit_leads_out_first():
    env = LabPointNavEnv(config=config_of("shift", layout=LAYOUT, conditions=(), split="val", drives="pair"))
    env.reset(seed=0, options={"start": (4.0, 4.2, 0.0), "goal": GOALS[0]})
    state = env.state
    exact = shortest_from(state, 99.0)
    assert exact == pytest.approx(world_of(LAYOUT).length_to_disc(state.pair, RADIUS))
    front = LAYOUT.box("IslandBench1800_1")
    edge = front.y + front.depth / 2.0
    state.pose = (4.0, edge + 0.28, 0.0)
    state.pair = replace(state.pair, start=state.pose)
    assert math.isinf(state.shortest_path_length)
    # 2 cm out of the bench's rim, then as from there.
    free = replace(state.pair, start=(4.0, edge + 0.30, 0.0))
    length = shortest_from(state, 99.0)
    assert length == pytest.approx(world_of(LAYOUT).length_to_disc(free, RADIUS) + 0.02, abs=0.02)
    env.close()


def test_the_summary_counts_drives_and_perfect_shifts(reached):
    one = shift()
    part = LabNavEpisodes(task="shift", level=2, split="floors-val", seed=0, episodes=(one,))
    suite = LabNavSuite("labnav-shift-2", (part,))
    fields = {"policy": "x", "options": {}, "track": "mapless", "sensors": "lidar", "seed": 0, "latency": 0.0}
    row = reached[1].row
    cut = row.model_copy(update={"legs": row.legs[:1], "success": False, "ending": "stuck", "floor": "other"})
    summary = summarise(suite, [row, cut], **fields)
    (task,) = summary.tasks
    assert sum(task.legs.values()) == 6
    assert task.legs["not begun"] == 2
    assert task.success.value == float(row.success) / 2.0
    assert "shift-2: 6 drives: " in summary_table(summary).text()
    assert suite.drives == 3
