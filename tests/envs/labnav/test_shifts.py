"""Shifts: what a draw promises, what the document refuses, and the environment with several drives."""

from __future__ import annotations

import math
import pickle

import gymnasium as gym
import numpy as np
import pytest
from laboratories import island_laboratory

import labgym  # noqa: F401 -- registers the ids
from labgym.documents import canonical_hash
from labgym.envs.conditions.changes import Changes
from labgym.envs.conditions.payload import LegPayload, leg_payload_of
from labgym.envs.labnav.drawing import ShiftDrawer, draw_floor
from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes, published_episodes
from labgym.envs.world import world_of
from labgym.errors import LabgymError, OptionError
from labgym.layouts import load_published
from labgym.navigation import goal_pairs

FLOOR = load_published("floors-val", "floors-val-0014")
"""A laboratory and an instrument room along a corridor."""
ROOM = island_laboratory()


@pytest.fixture(scope="module")
def drawn():
    return draw_floor(FLOOR, "shift", 2, 2, 14, attempts=50)


def test_a_shift_has_the_places_of_a_protocol_in_its_order(drawn):
    episodes, draws = drawn
    assert draws.accepted == len(episodes) == 2
    drives = [goal_pairs(FLOOR, one) for one in FLOOR.protocols]
    routes = [[each[0].start_location, *(pair.goal_location for pair in each)] for each in drives]
    for one in episodes:
        pairs = one.pairs
        assert 5 <= len(pairs) <= 10
        assert [pair.start for pair in pairs[1:]] == [pair.goal for pair in pairs[:-1]]
        names = [pair.goal_location for pair in pairs]
        assert any(names[k : k + len(route)] == route for route in routes for k in (0, 1))
        spaces = [FLOOR.floor.space_at(*pair.goal[:2]) for pair in pairs]
        assert 2 <= len({space.id for space in spaces if space.use != "corridor"}) <= 4


def test_its_lengths_are_those_of_the_true_floor_and_it_has_all_conditions(drawn):
    for one in drawn[0]:
        task = one.task(FLOOR)
        assert set(one.conditions) == {"changes", "payload", "people"}
        assert len(one.conditions["changes"]) == 1
        legs = one.conditions["payload"]["legs"]
        assert legs == sorted(set(legs))
        assert len(legs) == round(0.5 * len(one.lengths))
        true = Changes().prepare(task, one.conditions["changes"])
        for pair, length in zip((true.pair, *true.following), one.lengths, strict=True):
            assert length == pytest.approx(world_of(true.fixed).length_to_disc(pair, 0.36), abs=1e-5)
            assert length >= 0.5


def test_a_floor_of_one_room_has_no_shift():
    drawer = ShiftDrawer(load_published("floors-val", "floors-val-0001"), "shift", 2)
    rng = np.random.default_rng(0)
    assert [drawer.draw(rng) for _ in range(5)] == [None] * 5


def test_episodes_of_one_drive_keep_their_bytes(drawn):
    old = published_episodes("aisle", 2)
    assert all("following" not in each for each in old.to_json()["episodes"])
    assert canonical_hash(old.to_json()) == old.hash
    one = old.episodes[0]
    assert (one.lengths, len(one.pairs)) == ((one.length,), 1)
    shift = drawn[0][0]
    assert LabNavEpisode.model_validate(shift.model_dump(mode="json")) == shift
    assert "following" in shift.model_dump(mode="json")


@pytest.mark.parametrize(
    "change",
    [
        {"following": [{"goal": [0.0, 0.0, 0.0], "length": 1.0}] * 32},
        {"following": [{"goal": [0.0, 0.0], "length": 1.0}]},
        {"following": [{"goal": [0.0, 0.0, 0.0], "length": 0.0}]},
        {"following": [{"goal": [0.0, 0.0, 0.0], "length": 1.0, "more": 1}]},
        {"following": "x"},
    ],
)
def test_broken_drives_are_refused_in_one_line(drawn, change):
    data = {
        "schema": LabNavEpisodes.SCHEMA, "task": "shift", "level": 2, "split": "floors-val", "seed": 14,
        "episodes": [drawn[0][0].model_dump(mode="json") | change],
    }  # fmt: skip
    with pytest.raises(LabgymError) as caught:
        LabNavEpisodes.parse(data)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "data", ["x", {}, {"beaker": {}}, {"beaker": {}, "legs": [-1]}, {"beaker": {}, "legs": [True]},
             {"beaker": {}, "legs": [32]}, {"beaker": {}, "legs": [0] * 99}, {"beaker": {"x": 1}, "legs": []}]
)  # fmt: skip
def test_a_broken_beaker_is_refused(data):
    with pytest.raises(OptionError) as caught:
        leg_payload_of(data)
    assert "\n" not in str(caught.value)


def test_a_share_out_of_range_is_refused():
    for share in (0.0, 1.5, math.nan):
        with pytest.raises(OptionError):
            LegPayload(share=share)


def shift_env(**arguments):
    actions = {"kind": "velocity", "stop": True}
    arguments = {"layout": ROOM, "conditions": [{"kind": "leg_payload"}], "sensors": ["velocity"], **arguments}
    arguments["actions"] = actions
    return gym.make("LabNavShift-v0", **arguments).unwrapped


def test_after_stop_the_next_drive_begins_and_after_the_last_one_the_episode_ends():
    env = shift_env()
    info = env.reset(seed=1)[1]
    assert info["legs"] == len(goal_pairs(ROOM)) == 3
    for leg in range(3):
        assert env.state.leg == leg
        terminated = env.step([0.0, 0.0, 1.0])[2]
    assert terminated
    assert env.state.leg == 2
    with pytest.raises(OptionError, match="last"):
        env.next_drive()
    env.close()


def test_the_beaker_is_full_again_in_each_of_its_drives():
    env = shift_env(endings=["stop"], onward=("stop",))
    env.reset(seed=1)
    legs = env.state.conditions["payload"]["legs"]
    for leg in range(3):
        for _ in range(6):
            env.step([1.0, 0.0, 0.0])
        env = pickle.loads(pickle.dumps(env))
        highest = env.state.presences["payload"].outcome["highest"]
        assert (highest > 0.002) == (leg in legs)
        env.step([0.0, 0.0, 1.0])
    assert {leg in legs for leg in range(3)} == {True, False}
    env.close()


def test_a_touch_ends_the_episode_at_once():
    env = shift_env(endings=["stop", "contact"], conditions=["contacts"])
    env.reset(seed=1)
    for _ in range(100):
        terminated = env.step([1.0, 0.0, 0.0])[2]
        if terminated:
            break
    assert (terminated, env.state.leg, env.state.ending) == (True, 0, "contact")
    env.close()


def test_the_time_of_a_drive_ends_it():
    env = shift_env(endings=[{"kind": "limit", "duration": 0.3}], onward=("time",))
    env.reset(seed=1)
    legs = []
    for _ in range(9):
        terminated = env.step([0.0, 0.0, 0.0])[2]
        legs.append(env.state.leg)
    assert legs == [0, 0, 1, 1, 1, 2, 2, 2, 2]
    assert terminated
    env.close()


def test_names_of_endings_are_a_list():
    with pytest.raises(OptionError, match="onward"):
        shift_env(onward="stop")
