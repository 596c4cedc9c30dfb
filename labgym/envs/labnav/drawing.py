"""Drawing the episodes and the shifts of a task on a floor, and the number of drives drawn for those accepted."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from labgym.envs.conditions.cast import SMALLEST
from labgym.envs.conditions.parked import plain_things
from labgym.envs.episode import stream
from labgym.envs.labnav.episodes import Draws, LabNavEpisode, LabNavLeg
from labgym.envs.labnav.necks import has_neck, neck_things
from labgym.envs.labnav.task import Level
from labgym.envs.labnav.tasks import config_of, task_of
from labgym.envs.parts.protocols import Condition
from labgym.envs.tasks import Task
from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.layouts.drives import entry_poses, places_of_work
from labgym.layouts.placement import FLOOR
from labgym.navigation import PLANNING_RADIUS, GoalPair, Pose, ShortestPaths, goal_pairs, goal_pose
from labgym.navigation.goals import ANYWHERE
from labgym.navigation.lengths import length_to_disc

ATTEMPTS = 300
"""Number of drives that are drawn on a floor before it is left with fewer episodes."""
LENGTHS = (0.01, 1000.0)
"""Least and greatest length L* of the drives of unfiltered suites, meters: all that do not start in the disc."""
ROOM = 0.40
"""Radius of the disc that fits at a free pose, meters."""
TRIES = 50
"""Number of points that are drawn for a free pose."""

Place = tuple[str, Pose]


@dataclass(frozen=True)
class Drawn:
    """A drive that was accepted.

    Attributes:
        task: before the conditions. conditions: their data by name.
        lengths: L* of each drive on the true floor without what the robot can push, meters.
    """

    task: Task
    conditions: dict[str, Any]
    lengths: tuple[float, ...]


class Drawer:
    """Draws drives of a task on one floor.

    Args:
        layout: the floor. task: name of the task. level: its level.
        filtered: whether drives must have the properties of the level; otherwise all that have a path are accepted.
    """

    def __init__(self, layout: Layout, task: str, level: int, filtered: bool = True) -> None:
        self._layout, self._task, self._filtered = layout, task_of(task), filtered
        own = task_of(task).level(level)
        self._level = own if filtered else replace(own, neck=None, detour=0.0, lengths=LENGTHS)
        self._paths, self._room = ShortestPaths(layout, PLANNING_RADIUS), ShortestPaths(layout, ROOM)
        self._entries, self._work = list(entry_poses(layout).items()), list(places_of_work(layout).items())
        self._conditions: tuple[Condition, ...] = config_of(task, level).conditions

    def draw(self, rng: np.random.Generator) -> Drawn | None:
        """Return a drive if the next one drawn is accepted, else None."""
        start, goal = self._place(rng, self._entries, self._work), self._place(rng, self._work)
        if start is None or goal is None:
            return None
        pair = GoalPair(-1, start[1], goal[1], start[0], goal[0])
        if not self._suits(self._length(self._paths, pair), pair):
            return None
        task = Task(self._layout, self._layout.protocol, pair)
        if self._level.neck is not None:
            neck = self._level.neck
            things = () if has_neck(self._layout, pair, neck) else neck_things(self._layout, pair, neck, rng)
            if things is None:
                return None
            task = replace(task, conditions={"parked": plain_things(things)})
        return self._conditioned(task, rng)

    def _place(self, rng: np.random.Generator, *lists: list[Place]) -> Place | None:
        """Return a place of one of the lists, or a free pose, each with the same probability."""
        choices = [each for each in lists if each]
        kind = int(rng.integers(len(choices) + (0 if self._task.docks else 1)))
        if kind < len(choices):
            return choices[kind][int(rng.integers(len(choices[kind])))]
        low_x, low_y, high_x, high_y = self._layout.floor.bounds
        for _ in range(TRIES):
            x, y, yaw = (float(each) for each in rng.uniform((low_x, low_y, -math.pi), (high_x, high_y, math.pi)))
            if self._room.free(x, y):
                return ANYWHERE, (round(x, 3), round(y, 3), round(yaw, 3))
        return None

    def _length(self, paths: ShortestPaths, pair: GoalPair) -> float:
        """Return L*, or inf for a drive whose length cannot be one of the level."""
        low, high = self._level.lengths
        if math.dist(pair.start[:2], pair.goal[:2]) > high + self._task.radius:
            return math.inf
        path = paths.path(pair.start, pair.goal)
        # The way to the goal, less the radius, is a way to the disc.
        if path is None or path.length - self._task.radius < low:
            return math.inf
        return length_to_disc(paths, pair.start, pair.goal, self._task.radius)

    def _suits(self, length: float, pair: GoalPair) -> bool:
        """Whether a drive has a length and a detour of the level."""
        straight, (low, high) = math.dist(pair.start[:2], pair.goal[:2]), self._level.lengths
        return low <= length <= high and length >= self._level.detour * straight

    def _conditioned(self, task: Task, rng: np.random.Generator) -> Drawn | None:
        """Return a drive with the data of its conditions, if they leave it one of the level."""
        (own,) = rng.spawn(1)
        data: dict[str, Any] = {}
        true = task
        for condition in self._conditions:
            name = condition.name
            drawn = task.conditions.get(name)
            if drawn is None:
                try:
                    drawn = condition.draw(true, stream(own, f"condition {name}"))
                except OptionError:  # a station that cannot move
                    return None
            if drawn is not None:
                data[name] = drawn
            true = condition.prepare(true, drawn)
        if self._filtered and not _complete(self._level, data):
            return None
        fixed = true.fixed
        paths = self._paths if fixed is self._layout else ShortestPaths(fixed, PLANNING_RADIUS)
        pairs = (true.pair, *true.following)
        lengths = [self._length(paths, pair) for pair in pairs]
        if not all(self._suits(length, pair) for length, pair in zip(lengths, pairs, strict=True)):
            return None
        return Drawn(task, data, tuple(round(length, 6) for length in lengths))


def _complete(level: Level, data: Mapping[str, Any]) -> bool:
    """Whether the conditions could place all that the level has."""
    panes = sum(int(each.get("panes", 1)) for each in level.conditions if each["kind"] == "glass")
    moved = any(each["kind"] == "changes" for each in level.conditions)
    return (not panes or len(data["glass"]["panes"]) == panes) and (not moved or bool(data["changes"]))


def draw_floor(
    layout: Layout, task: str, level: int, count: int, seed: int, attempts: int = ATTEMPTS, filtered: bool = True
) -> tuple[tuple[LabNavEpisode, ...], Draws]:
    """Return episodes of a task on a floor, and how many drives were drawn for them.

    They depend on the arguments and on the floor's `draw_seed` alone.

    Args:
        layout: the floor. task, level: of LabNav.
        count: number of episodes to accept.
        seed: random seed of the draw.
        attempts: number of drives to draw at most.
        filtered: as for `Drawer`.
    """
    drawer = drawer_of(layout, task, level) if filtered else Drawer(layout, task, level, filtered)
    kind = [] if filtered else [1]
    rng = np.random.default_rng([seed, layout.draw_seed, zlib.crc32(task.encode()), level, *kind])
    episodes: list[LabNavEpisode] = []
    drawn = 0
    while len(episodes) < count and drawn < attempts:
        drawn += 1
        one = drawer.draw(rng)
        if one is None:
            continue
        pair = one.task.pair
        following = tuple(
            LabNavLeg(goal=each.goal, location=each.goal_location, length=length)
            for each, length in zip(one.task.following, one.lengths[1:], strict=True)
        )
        episode = LabNavEpisode(
            floor=layout.id,
            floor_hash=layout.hash,
            number=len(episodes),
            start=pair.start,
            goal=pair.goal,
            start_location=pair.start_location,
            goal_location=pair.goal_location,
            conditions=one.conditions,
            seed=int(rng.integers(2**53)),
            length=one.lengths[0],
            following=following,
        )
        episodes.append(episode)
    return tuple(episodes), Draws(drawn=drawn, accepted=len(episodes))


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
            neighbor = self._room_at(goals[min(place, len(goals) - 1)][1])
            others = [each for each in self._errands if self._room_at(each[1]) not in ("", neighbor)]
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
