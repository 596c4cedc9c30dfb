"""Rows of a run against the published ones: shifts with fewer goals and a shorter limit, and what is not compared."""

from __future__ import annotations

import pytest

from labgym.eval.driving.episode_row import LabNavLegRow, LabNavRow
from labgym.eval.labnav.results import score_of
from labgym.eval.leaderboard.labnav import Outcome, agreement

SECONDS = 60.0


def leg(ending="success", time=20.0, path=5.0):
    reached = ending == "success"
    return LabNavLegRow(
        success=reached, docked=reached, ending=ending, stopped="policy", shortest=5.0, path_length=path, time=time,
        final_distance=0.05, final_heading=0.0, beaker=False, rise=0.0,
    )  # fmt: skip


def row(*legs, goals=3, task="shift", **fields):
    values = {
        "suite": f"labnav-{task}-2/1", "task": task, "level": 2, "floor": "floors-test-0000", "floor_hash": "0" * 64,
        "number": 0, "policy": "mine", "track": "deployed", "seed": 0, "score": 0.0,
        "success": False, "ending": "time", "shortest": 15.0, "straight": 12.0, "path_length": 15.0,
        "time": sum(each.time for each in legs), "final_distance": 0.05, "final_heading": 0.0, "odometry_error": 0.0,
        "steps": 600, "contacts": 0, "legs": legs, "goals": goals,
    }  # fmt: skip
    shift = LabNavRow(**(values | fields))
    return shift if "score" in fields or not legs else shift.model_copy(update={"score": score_of(shift, {}, {})})


def published(*legs, goals=6, **fields):
    outcome = Outcome.of(row(*legs, goals=goals, **fields))
    return {outcome.key: outcome}


def test_the_drives_of_a_shift_are_compared_although_it_has_fewer_goals():
    legs = (leg(), leg("stuck", 45.0), leg(path=6.0))
    result = agreement([row(*legs)], published(*legs, leg(), leg("time", 120.0), leg()), SECONDS)
    assert (result.equal, result.compared, result.missing) == (1, 1, ())


@pytest.mark.parametrize("other", [leg("stuck", 45.0), leg(time=20.1), leg(path=5.001)])
def test_a_shift_with_another_drive_is_named_with_its_drives(other):
    result = agreement([row(leg(), other, leg())], published(*[leg()] * 6), SECONDS)
    assert (result.equal, result.compared) == (0, 1)
    assert "mine, shift-2/floors-test-0000/0: success after 20 s" in result.differing[0]
    assert result.differing[0].count("after") == 6


def test_what_follows_a_drive_that_the_limit_cut_off_is_not_compared():
    longer = published(leg(), leg(time=80.0), leg(), leg())
    assert agreement([row(leg(), leg("time", 60.8), leg("stuck", 31.0))], longer, SECONDS).equal == 1
    assert agreement([row(leg(), leg("time", 50.0), leg())], longer, SECONDS).equal == 0
    assert agreement([row(leg(), leg(time=60.0), leg())], longer, SECONDS).equal == 0


def test_a_shift_that_a_person_ended_has_as_many_drives_as_the_published_one():
    ended = (leg(), leg("contact", 3.0))
    assert agreement([row(*ended)], published(*ended), SECONDS).equal == 1
    assert agreement([row(*ended)], published(*ended, leg()), SECONDS).equal == 0
    assert agreement([row(leg(), leg(), leg())], published(leg(), leg()), SECONDS).equal == 0


def test_tasks_that_are_not_published_are_named():
    aisle = row(goals=1, task="aisle", score=0.5, ending="success", time=9.0)
    result = agreement([aisle, row(leg())], published(goals=1, task="aisle", score=0.5, ending="success", time=9.0), 60)
    assert (result.equal, result.compared, result.missing) == (1, 1, ("shift",))
    without_drives = {key: one.model_copy(update={"legs": ()}) for key, one in published(leg()).items()}
    assert agreement([row(leg())], without_drives, SECONDS).missing == ("shift",)


def test_a_drive_that_arrives_with_the_last_step_of_the_limit_is_cut_off():
    arrived = published(goals=1, task="aisle", score=0.4, ending="success", time=60.0)
    assert agreement([row(goals=1, task="aisle", score=0.0, ending="time", time=60.0)], arrived, SECONDS).equal == 1
    assert agreement([row(goals=1, task="aisle", score=0.3, ending="success", time=60.0)], arrived, 60.0).equal == 0
