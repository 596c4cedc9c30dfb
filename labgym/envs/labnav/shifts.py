"""Drawing shifts: the places of a whole protocol, one after the other, over several rooms."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from labgym.envs.conditions.casting import SMALLEST
from labgym.envs.labnav.drawing import Drawer, Drawn, Place
from labgym.envs.labnav.tasks import task_of
from labgym.envs.tasks import Task
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.navigation import GoalPair, Pose, goal_pairs, goal_pose

CORRIDOR = "corridor"
"""Use of the spaces that count as no rooms."""


class ShiftDrawer(Drawer):
    """Draws shifts on one floor: from an exit or a place of work to all places of a protocol in its order.

    Where the protocol has too few places, or stays in too few rooms, an errand to furniture in another room is added at
    its begin, and if that is not enough at its end (assumption: material is fetched, and samples are handed over).

    Args:
        layout: the floor. task: name of the task. level: its level.
    """

    def __init__(self, layout: Layout, task: str, level: int) -> None:
        super().__init__(layout, task, level)
        self._routes = [_places(layout, index) for index in range(len(layout.protocols))]
        self._errands = _errands(layout, self._paths.free)

    def draw(self, rng: np.random.Generator) -> Drawn | None:
        """Return a shift if the next one drawn is accepted, else None."""
        goals, start = self._goals(rng), self._place(rng, self._entries, self._work)
        if goals is None or start is None:
            return None
        places = [start, *goals]
        pairs = tuple(
            GoalPair(index, here[1], there[1], here[0], there[0])
            for index, (here, there) in enumerate(pairwise(places))
        )
        if not all(self._suits(self._length(self._paths, pair), pair) for pair in pairs):
            return None
        return self._conditioned(Task(self._layout, self._layout.protocol, pairs[0], pairs[1:]), rng)

    def _goals(self, rng: np.random.Generator) -> list[Place] | None:
        """Return the goals of a shift in their order, None if their numbers do not suit."""
        routes = [route for route in self._routes if route]
        if not routes:
            return None
        goals = list(routes[int(rng.integers(len(routes)))])
        for place in (0, len(goals) + 1):
            if self._enough(goals):
                break
            beside = self._room_at(goals[min(place, len(goals) - 1)][1])
            others = [each for each in self._errands if self._room_at(each[1]) not in ("", beside)]
            if not others:
                return None
            goals.insert(place, others[int(rng.integers(len(others)))])
        most_goals, most_rooms = self._level.goals[1], self._level.rooms[1]
        suits = self._enough(goals) and len(goals) <= most_goals and self._rooms(goals) <= most_rooms
        return goals if suits else None

    def _enough(self, goals: list[Place]) -> bool:
        """Whether there are enough goals, in enough rooms."""
        return len(goals) >= self._level.goals[0] and self._rooms(goals) >= self._level.rooms[0]

    def _rooms(self, goals: list[Place]) -> int:
        """Return the number of rooms in which goals are."""
        return len({self._room_at(pose) for _, pose in goals} - {""})

    def _room_at(self, pose: Pose) -> str:
        """Return the id of the room at a pose, "" in a corridor."""
        space = self._layout.floor.space_at(*pose[:2])
        return "" if space is None or space.use == CORRIDOR else space.id


def drawer_of(layout: Layout, task: str, level: int) -> Drawer:
    """Return what draws the episodes of a task on a floor.

    Raises:
        UnknownNameError: there is no such task or level.
    """
    return (ShiftDrawer if task_of(task).chain else Drawer)(layout, task, level)


def _places(layout: Layout, index: int) -> list[Place]:
    """Return the places of one of a layout's protocols in its order, none for one that stays at a place."""
    pairs = goal_pairs(layout, layout.protocols[index])
    first = [(pair.start_location, pair.start) for pair in pairs[:1]]
    return [*first, *((pair.goal_location, pair.goal) for pair in pairs)]


def _errands(layout: Layout, free: Callable[[float, float], bool]) -> list[Place]:
    """Return the places in front of furniture on the floor, by its asset, at which the robot fits."""
    places = []
    for placement in layout.placements:
        box = layout.box(placement.id)
        if placement.support == FLOOR and box.width * box.depth >= SMALLEST:
            pose = goal_pose(box)
            if free(*pose[:2]):
                places.append((placement.asset, pose))
    return places
