"""The layouts of split="train": which one an episode gets depends on the seed and its number alone."""

from __future__ import annotations

import gc
import math
from collections import Counter

import numpy as np
import pytest
import training_sources

from labgym.envs import LabPointNavEnv
from labgym.envs.endpoints import LEAST_DRIVE_M
from labgym.envs.training import TrainingRooms, source_of, training_floor
from labgym.envs.training_layouts import NUMBERS, RESIDENT_LAYOUTS, TURN_EPISODES, LayoutSequence, TrainingLayouts
from labgym.envs.world import KEPT, World
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import splits
from labgym.layouts.places import layout_at
from labgym.navigation import PLANNING_RADIUS


def drawn(env: LabPointNavEnv, episodes: int, **first) -> list[str]:
    return [env.reset(**(first if k == 0 else {}))[1]["layout"] for k in range(episodes)]


def environment(**arguments) -> LabPointNavEnv:
    return LabPointNavEnv(
        **{"split": "train", "training": training_sources.shifted, "episodes_per_layout": 1, **arguments}
    )


def test_a_seed_fixes_the_layouts_of_all_episodes_that_follow():
    env = environment(episodes_per_layout=2)
    first = drawn(env, 6, seed=3)
    assert [first.count(name) for name in dict.fromkeys(first)] == [2, 2, 2]
    assert drawn(env, 6, seed=3) == drawn(environment(episodes_per_layout=2), 6, seed=3) == first
    assert set(drawn(env, 6, seed=4)).isdisjoint(first)


def test_what_happens_within_a_layout_does_not_change_which_ones_follow():
    env = environment(episodes_per_layout=2)
    expected = drawn(env, 6, seed=3)
    names = []
    for k in range(6):
        _, info = env.reset(seed=3 if k == 0 else None, options={"pair": 1} if k % 2 else None)
        env.step(env.action_space.sample())
        names.append(info["layout"])
    assert names == expected


def test_numbers_are_spread_over_all_layouts():
    numbers = [LayoutSequence(training_sources.shifted, entropy, 8).numbers(3) for entropy in range(200)]
    flat = [number for row in numbers for number in row]
    assert len(set(flat)) > 595
    assert 0 <= min(flat) < NUMBERS / 50
    assert NUMBERS * 0.98 < max(flat) < NUMBERS
    sequence = LayoutSequence(training_sources.shifted, 7, 8)
    ahead = sequence.numbers(3)
    assert [sequence.turn(sequence.source) for _ in range(2)] == ahead[:2]
    assert sequence.numbers(1) == ahead[2:]


def test_an_environment_returns_to_32_layouts_and_replaces_each_after_its_episodes():
    sequence, turns = LayoutSequence(training_sources.shifted, 7, 64), 3000
    numbers = [sequence.turn(sequence.source) for _ in range(turns)]
    assert len(set(numbers[:RESIDENT_LAYOUTS])) == RESIDENT_LAYOUTS
    assert set(numbers[RESIDENT_LAYOUTS : RESIDENT_LAYOUTS + 5]) <= set(numbers[:RESIDENT_LAYOUTS])
    served = Counter(numbers)
    assert max(served.values()) == 64 // TURN_EPISODES
    finished = sum(count == 64 // TURN_EPISODES for count in served.values())
    assert len(served) - RESIDENT_LAYOUTS <= finished <= len(served)
    again = LayoutSequence(training_sources.shifted, 7, 64)
    assert [again.turn(again.source) for _ in range(turns)] == numbers


def test_a_layout_that_an_environment_returns_to_is_not_generated_again():
    made, count = [], TURN_EPISODES * (RESIDENT_LAYOUTS + 20)

    def counted(number):
        made.append(number)
        return training_sources.shifted(number)

    def names(layouts, episodes):
        rng = np.random.default_rng(3)
        return [layouts.draw(rng, None, fresh=episode == 0).id for episode in range(episodes)]

    layouts = TrainingLayouts(counted)
    first = names(layouts, count)
    assert len(made) == len(set(first)) < RESIDENT_LAYOUTS + 10
    assert names(layouts, 1) == first[:1]
    assert len(made) == len(set(first))
    assert names(TrainingLayouts(training_sources.shifted), count) == first


def test_rooms_of_a_number_are_those_of_train_layout(monkeypatch):
    calls = []
    monkeypatch.setattr(splits, "generate", lambda *arguments, rules: calls.append((*arguments, rules)))
    for _ in range(2):
        TrainingRooms(profile="strict")(12)
    assert calls[0] == calls[1]
    assert calls[0][1] < splits.TRAIN_SEEDS
    assert calls[0][3:] == ("strict", splits.MADE_UNDER)


def test_a_source_that_cannot_be_used_is_refused():
    with pytest.raises(UnknownNameError, match="rooms"):
        source_of("roms", None, "default")
    with pytest.raises(OptionError, match="'rooms', 'empty' or a function"):
        environment(training=7)
    with pytest.raises(OptionError, match="has no effect in split 'val'"):
        environment(split="val", training=training_floor)
    with pytest.raises(OptionError, match="only training='rooms' takes a protocol"):
        environment(protocol="alk_03")


def test_empty_rooms_have_straight_drives_between_poses_where_the_robot_fits():
    env = environment(training="empty", episodes_per_layout=64)
    rooms, drives = set(), set()
    for seed in range(12):
        _, info = env.reset(seed=seed)
        task = env._episode.task
        room, (start, goal) = task.layout.room, (task.pair.start, task.pair.goal)
        assert not task.layout.placements
        assert not task.layout.protocols
        for x, y, _yaw in (start, goal):
            assert PLANNING_RADIUS <= x <= room.width - PLANNING_RADIUS
            assert PLANNING_RADIUS <= y <= room.depth - PLANNING_RADIUS
        assert info["shortest_path_length"] == pytest.approx(math.dist(start[:2], goal[:2]))
        assert math.dist(start[:2], goal[:2]) > LEAST_DRIVE_M
        rooms.add((room.width, room.depth))
        drives.add((start, goal))
    assert len(rooms) > 8
    assert len(drives) == 12
    assert env.reset(seed=11)[1]["layout"] == info["layout"]


def test_floors_are_those_of_floors_train():
    env = environment(split="floors-train", training="rooms")
    env.reset(seed=1)
    floor = env._episode.task.layout
    split, _, index = floor.provenance.options["place"].partition("/")
    assert split == "floors-train"
    assert floor.hash == layout_at("floors-train", int(index)).hash


def test_the_objects_in_memory_do_not_grow_with_the_number_of_training_layouts():
    """Every episode has a new layout; docs/performance.md has the memory of 10,000 resets."""
    others = worlds()  # of tests before, which stay alive
    env = environment()
    names = drawn(env, 25, seed=0)
    before = objects()
    names += drawn(env, 20)
    after = objects()
    assert len({*names}) == 45
    assert len([world for world in worlds() if all(world is not other for other in others)]) <= KEPT + 1
    assert after < 1.01 * before


def objects() -> int:
    gc.collect()
    return len(gc.get_objects())


def worlds() -> list[World]:
    gc.collect()
    return [each for each in gc.get_objects() if isinstance(each, World)]
