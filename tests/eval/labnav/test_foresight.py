"""The clairvoyant under the common rules, in a room made by hand."""

from __future__ import annotations

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.labnav.episodes import LabNavEpisode
from labgym.errors import LabgymError
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.results import DriveTerms
from labgym.navigation import goal_pose
from labgym.policies import EpisodeStart, make_policy

LAYOUT = island_laboratory()
START, GOAL = (1.5, 4.2, 0.0), (6.5, 4.2, 0.0)
"""A free straight line of 5 m along the island."""
LENGTH = 5.0 - 0.36
DOCK = goal_pose(LAYOUT.box("ValidationPlatform_1"))
"""The docking pose of a device."""


def driven(task, start=START, goal=GOAL, **conditions):
    episode = LabNavEpisode(
        floor=LAYOUT.id, floor_hash=LAYOUT.hash, number=0, start=start, goal=goal, conditions=conditions, seed=3,
        length=LENGTH,
    )  # fmt: skip
    (drive,) = drive_floor(make_policy("clairvoyant"), LAYOUT, (episode,), DriveTerms(task, 2, "mine", "suite/0", 0))
    return drive


WALKER = {"start": [4.2, 5.0], "group": 0, "yields": False, "stops": [[4.2, 3.7, 0.0, 2.0], [4.2, 5.0, 0.0, 2.0]]}
CROSSED = {"people": {"people": [WALKER], "speed": 0.5, "model": "orca"}}
"""A person who crosses the straight line without seeing the robot."""


def test_alone_it_takes_little_longer_than_even_acceleration_allows():
    row = driven("aisle", parked=[]).row
    assert (row.ending, row.track, row.contacts, row.stopped) == ("success", "privileged", 0, "policy")
    # From rest and to rest at 1.5 m/s2: 2/3 s more than at full speed all the way.
    assert LENGTH + 0.6 < row.time < LENGTH + 1.1


def test_it_docks_at_the_true_pose_of_a_station_that_moved():
    station = {"station": {"station": "ValidationPlatform_1", "shift": [-0.04, 0.05, 0.08]}}
    row = driven("dock", goal=DOCK, **station).row
    assert (row.ending, row.contacts) == ("success", 0)
    assert row.final_distance < 0.01
    assert abs(row.final_heading) < 0.01


@pytest.mark.cases(1)
@pytest.mark.parametrize("task", ["people", "carry"])
def test_it_lets_a_person_cross_and_drives_the_same_way_again(task):
    beaker = {"payload": {"freeboard": 0.01}} if task == "carry" else {}
    first, again = (driven(task, **CROSSED, **beaker) for _ in range(2))
    assert (first.row.ending, first.row.touched) == ("success", ())
    assert first.row.outcomes["people"]["least_distance"] > 0.57
    assert first.row.time < LENGTH + 6.0
    assert (first.route, first.row) == (again.route, again.row)
    if task == "carry":
        assert first.row.outcomes["payload"]["highest"] < 0.01


def test_with_a_beaker_alone_the_liquid_stays_below_the_rim():
    for freeboard in (0.005, 0.01):
        row = driven("carry", start=(1.5, 1.0, 0.3), payload={"freeboard": freeboard}, people={}).row
        assert row.ending == "success"
        assert 0.1 * freeboard < row.outcomes["payload"]["highest"] < freeboard


def test_it_needs_the_world():
    with pytest.raises(LabgymError, match="needs the world"):
        make_policy("clairvoyant").reset(EpisodeStart(goal=(1.0, 0.0), rng=np.random.default_rng(0)))
