from __future__ import annotations

import math

import numpy as np
import pytest

pytest.importorskip("torch")

import torch
from laboratories import island_laboratory
from map_drives import drive

from labgym.errors import DocumentError, OptionError
from labgym.geometry import OrientedBox, rotate
from labgym.navigation import goal_pairs
from labgym.policies.adapters.actor_file import ActorHeader, Perceptron
from labgym.policies.distance_field import DistanceField
from labgym.policies.local.inputs import (
    ALONG_M,
    FREE_RAYS,
    FREE_REACH_M,
    SIZE,
    SIZES,
    LatestMotion,
    StackState,
    TaskKnowledge,
    network_input,
    place_of,
)
from labgym.policies.local.policy import LocalPolicy
from labgym.policies.registry import make_policy
from labgym.policies.stack.costmap import Costmap
from labgym.policies.stack.people import TrackedPerson
from labgym.policies.stack.planner import PlannedPath
from labgym.training.local.collection import Apprentice

LAYOUT = island_laboratory()
AROUND = goal_pairs(LAYOUT)[1]
PLAIN = TaskKnowledge(False, False, False, False, False, 0.0, 1.0, True)


def part(vector: np.ndarray, name: str) -> np.ndarray:
    return vector[place_of(name)]


def seen(
    boxes=(),
    people=(),
    pose=(0.0, 0.0, 0.0),
    velocity=(0.0, 0.0),
    path=((0.0, 0.0), (6.0, 0.0)),
    left=6.0,
    advanced=False,
):
    field = DistanceField.of_boxes(boxes, (-8.0, -8.0, 8.0, 8.0))
    motion = LatestMotion()
    motion.moved(pose)
    plan = PlannedPath(np.array(path))
    for _ in range(10 if advanced else 0):
        plan.advance(pose)
    state = StackState(plan, left, pose, velocity, Costmap(field, field), tuple(people))
    return network_input(state, motion, PLAIN)


def perceptron(*layers: tuple[np.ndarray, np.ndarray]) -> Perceptron:
    header = ActorHeader(algorithm="test", inputs=tuple(SIZES), activation="relu", squash=False)
    tensors = tuple(
        (torch.tensor(weight, dtype=torch.float32), torch.tensor(bias, dtype=torch.float32)) for weight, bias in layers
    )
    return Perceptron(header, tensors, {})


def test_free_distances_are_those_to_a_wall():
    wall = OrientedBox(1.6, 0.0, 0.2, 12.0)  # its front is at x = 1.5
    free = part(seen([wall]), "free")[:FREE_RAYS] * FREE_REACH_M
    for k in range(FREE_RAYS):
        cosine = math.cos(2.0 * math.pi * k / FREE_RAYS)
        expected = 1.5 / cosine if cosine > 0.5 else None
        if expected is not None:
            assert free[k] == pytest.approx(expected, abs=0.06)
    assert free[FREE_RAYS // 2] == pytest.approx(FREE_REACH_M)


def test_room_and_arcs_tell_what_is_left_until_the_chassis_touches():
    left, right = (OrientedBox(3.0, side * 0.52, 8.0, 0.2) for side in (1.0, -1.0))
    vector = seen([left, right])  # an aisle of 0.84 m, so that 0.15 m are left on each side
    room = part(vector, "room").reshape(-1, 3) * 0.2
    assert room[:, 1] == pytest.approx(0.15, abs=0.02)
    assert room[:, 0] == pytest.approx(0.03, abs=0.02)
    arcs = part(vector, "arcs").reshape(3, 7) * 0.1
    assert arcs[:, 3] == pytest.approx(0.15, abs=0.03)
    assert arcs[2, 0] == arcs[2, 6] == pytest.approx(-0.1)
    assert (np.diff(arcs[:, 0]) <= 1e-6).all()


def test_the_path_is_seen_from_the_robot():
    vector = seen(pose=(0.0, 0.0, math.pi / 2.0))
    points = part(vector, "path")[: 2 * len(ALONG_M)].reshape(-1, 2)
    assert points[:, 0] == pytest.approx(0.0, abs=1e-6)
    assert points[:, 1] == pytest.approx(-1.0, abs=0.07)


def test_people_are_seen_by_distance_in_the_frame_of_the_robot():
    near, far = TrackedPerson((0.0, 2.0), (0.0, -1.0), True), TrackedPerson((3.0, 0.0), (0.5, 0.0), False)
    people = part(seen(people=[far, near, TrackedPerson((0.0, 40.0), (0.0, 0.0), True)]), "people").reshape(-1, 7)
    assert people[0] == pytest.approx([1.0, 0.0, 2.0 / 3.0, 0.0, -1.0, 1.0, math.exp(-1.4 / 0.5)])
    assert people[1][:6] == pytest.approx([1.0, 1.0, 0.0, 0.5, 0.0, 0.0])
    assert not people[2:].any()


def test_at_the_end_of_the_path_its_last_heading_counts():
    vector = seen(pose=(0.0, 3.0, 0.0), path=((0.0, 3.0), (0.0, 3.0001)), left=0.0)
    cosine, sine = part(vector, "path")[-2:]
    assert (cosine, sine) == pytest.approx((0.0, 1.0), abs=1e-6)
    beyond = seen(pose=(0.0, 3.0, 0.0), path=((0.0, 0.0), (0.0, 3.0)), left=0.0, advanced=True)
    assert part(beyond, "path")[-2:] == pytest.approx((0.0, 1.0), abs=1e-6)


def test_a_turned_world_looks_the_same():
    turn, shift = 0.7, (0.4, -0.3)

    def moved(x: float, y: float) -> tuple[float, float]:
        turned = rotate(x, y, turn)
        return turned[0] + shift[0], turned[1] + shift[1]

    box = OrientedBox(1.5, 0.6, 0.5, 0.4, 0.2)
    there = OrientedBox(*moved(1.5, 0.6), 0.5, 0.4, 0.2 + turn)
    path = ((0.0, 0.0), (1.0, -0.4), (3.0, 0.0))
    here = seen([box], [TrackedPerson((1.0, 1.0), (0.3, 0.1), True)], path=path, velocity=(0.5, 0.1))
    elsewhere = seen(
        [there],
        [TrackedPerson(moved(1.0, 1.0), rotate(0.3, 0.1, turn), True)],
        (*moved(0.0, 0.0), turn),
        (0.5, 0.1),
        tuple(moved(*point) for point in path),
    )
    near = np.abs(here - elsewhere)
    assert np.quantile(near, 0.95) < 0.06  # the fields are sampled at 5 cm
    assert near[SIZES["free"] : SIZES["free"] + 2 * len(ALONG_M)].max() < 1e-5


def test_the_network_decides_the_velocities():
    class Straight(LocalPolicy):
        name = "straight-on"

    forward = perceptron((np.zeros((2, SIZE)), np.array([0.4, 0.0])))
    driven = drive(Straight(actor=forward), LAYOUT, AROUND.start, AROUND.goal, task="odometry", steps=8)
    assert driven.commands[0] == pytest.approx((0.0, 0.0))  # the first action comes late
    assert np.array(driven.commands[1:]) == pytest.approx(np.array([(0.4, 0.0)] * 7))


@pytest.mark.parametrize(("speed", "distance", "expected"), [(0.1, 1.5, 0.0), (0.1, 1.7, 0.1), (0.2, 1.5, 0.2)])
def test_a_robot_near_a_person_rests_rather_than_creeps(speed, distance, expected):
    class Accompanied(LocalPolicy):
        name = "accompanied"

        @property
        def _people(self):
            return (TrackedPerson((AROUND.start[0] - distance, AROUND.start[1]), (0.0, 0.0), True),)

    forward = perceptron((np.zeros((2, SIZE)), np.array([speed, 0.0])))
    driven = drive(Accompanied(actor=forward), LAYOUT, AROUND.start, AROUND.goal, task="people", steps=2)
    assert driven.commands[1] == pytest.approx((expected, 0.0))


@pytest.mark.parametrize(("safety", "expected"), [(True, 0.0), (False, 0.5)])
def test_a_robot_rests_for_one_who_comes_near(safety, expected):
    x, y, heading = AROUND.start
    ahead = 1.0 * math.cos(heading), 1.0 * math.sin(heading)

    class Approached(LocalPolicy):
        name = "approached"

        @property
        def _people(self):
            return (TrackedPerson((x + ahead[0], y + ahead[1]), (-ahead[0], -ahead[1]), True),)

    forward = perceptron((np.zeros((2, SIZE)), np.array([0.5, 0.0])))
    policy = Approached(actor=forward, safety=safety)
    driven = drive(policy, LAYOUT, AROUND.start, AROUND.goal, task="people", steps=2)
    assert driven.commands[1][0] == pytest.approx(expected)


def test_the_way_of_a_robot_that_brakes_for_people_counts_for_the_decision_before():
    class Braking(Apprentice):
        def __init__(self) -> None:
            super().__init__(perceptron((np.zeros((2, SIZE)), np.array([0.5, 0.0]))), "alone")
            self.ways: list[tuple[PlannedPath, float]] = []

        def _rest_for_people(self, plan, pose, velocity):
            return (0.0, 0.0) if len(self.ways) % 2 else None

        def _follow(self, plan, pose, velocity, left):
            commanded = super()._follow(plan, pose, velocity, left)
            self.ways.append((plan, left))
            return commanded

    apprentice = Braking()
    x, y, heading = AROUND.start
    behind = x - 1.5 * math.cos(heading), y - 1.5 * math.sin(heading), heading
    drive(apprentice, LAYOUT, behind, AROUND.start, task="people", steps=20)
    assert {id(plan) for plan, _ in apprentice.ways} == {id(apprentice.ways[0][0])}
    assert len(apprentice.inputs) == 10
    way = apprentice.ways[0][1] - apprentice.ways[-1][1]
    assert way > 0.1
    assert sum(apprentice.progress) == pytest.approx(way)


def test_a_misspelt_option_is_refused():
    with pytest.raises(OptionError, match="safety is 'maybe', expected True or False"):
        make_policy("local-ppo", safety="maybe")


def test_a_file_of_another_network_is_refused(tmp_path):
    file = perceptron((np.zeros((2, SIZE - 1)), np.zeros(2))).save(tmp_path / "other.safetensors")
    with pytest.raises(DocumentError, match=f"expected {SIZE} to 2"):
        LocalPolicy(weights=file)
