"""People who walk from place to place, in steps of 0.1 s."""

from __future__ import annotations

import copy
import math
from functools import lru_cache
from itertools import pairwise
from threading import Lock

import numpy as np

from labgym.envs.conditions.cast import RADIUS, Model, PeopleCast
from labgym.envs.conditions.intentions import BEYOND, DT, PASSED, POINTS, STANDING, STOP, TO_GO, PeopleMotion, intend
from labgym.envs.conditions.orca import Avoidance, Disc, OrcaRobot, Vector, nearest_walls, off_walls, velocities
from labgym.envs.conditions.social_force import SocialForce, pushed
from labgym.envs.world import World
from labgym.geometry import Array, BoxArray
from labgym.layouts import Layout
from labgym.navigation.barriers import Barriers


class Walls:
    """The rectangles that people do not enter; a segment is a rectangle without width.

    Args:
        boxes: the rectangles.
    """

    def __init__(self, boxes: BoxArray) -> None:
        self._center, self._half = np.ascontiguousarray(boxes.centre), np.ascontiguousarray(boxes.half)
        self._cosine, self._sine = np.cos(boxes.yaw), np.sin(boxes.yaw)

    @property
    def boxes(self) -> tuple[Array, Array, Array, Array]:
        """Centers (m, 2) and halves (m, 2), meters, and cosines (m,) and sines (m,) of the rectangles."""
        return self._center, self._half, self._cosine, self._sine

    @classmethod
    def of(cls, layout: Layout) -> Walls:
        """Return the furniture below 1.40 m and the walls of a layout."""
        return cls(Barriers.of(layout).obstacles.boxes)


REST = 0.5
"""Time after which everybody avoids a robot at rest, seconds."""
GAP = 0.01
"""Least distance that people keep from a robot at rest, meters."""
AVOIDANCE, FORCES = Avoidance(RADIUS, GAP, dt=DT), SocialForce(RADIUS, dt=DT)

WAYS = 512
"""Number of ways that are remembered."""
ROOM = 32
"""Number of points of a way for which there is room at first."""


class KnownWays:
    """The ways of people in a world, of which those planned first are forgotten.

    Futures, and drives of other robots in the same episode, plan the same ways again and again.
    """

    def __init__(self) -> None:
        self._points: dict[tuple[Vector, Vector], tuple[Vector, ...]] = {}
        self._lock = Lock()

    def between(self, world: World, start: Vector, goal: Vector) -> tuple[Vector, ...]:
        """Return the points of the way from a place to another, meters; none if there is no way."""
        points = self._points.get((start, goal))
        if points is None:
            path = world.paths.path(start, goal)
            points = () if path is None else tuple(map(tuple, path.points.tolist()))
            with self._lock:
                self._points[start, goal] = points
                if len(self._points) > WAYS:
                    del self._points[next(iter(self._points))]
        return points


class Crowd:
    """The people of an episode, who know the paths of its world.

    Args:
        world: the layout. cast: the people; stops that a person cannot reach are passed over.

    Attributes:
        world: the layout. speed: of the people, m/s. model: how they avoid each other. yields: who avoids the robot
            while it moves. stops: x, y, yaw and seconds of those of each.
        yaws: (n,) headings, radians. walked: (n,) ways so far, meters.
    """

    def __init__(self, world: World, cast: PeopleCast) -> None:
        self.world, self.speed = world, cast.speed
        self.model: Model = cast.model
        self.yields = tuple(role.yields for role in cast.people)
        self.stops = tuple(role.stops for role in cast.people)
        count = len(cast.people)
        walkers, marks = np.zeros((count, 9)), np.zeros((count, 4), dtype=np.int64)
        walkers[:, TO_GO] = math.inf
        counts = np.array([len(stops) for stops in self.stops], dtype=np.int64)
        marks[:, STANDING] = counts == 0
        places = np.zeros((count, int(counts.max(initial=1)), 3))
        for number, role in enumerate(cast.people):
            walkers[number, :2] = role.start
            for k, (x, y, _, seconds) in enumerate(role.stops):
                places[number, k] = x, y, seconds
        groups = [role.group for role in cast.people]
        firsts = np.array([groups.index(group) for group in groups], dtype=np.int64)
        self._people = PeopleMotion(walkers, marks, np.zeros((count, ROOM, 3)), places, counts, firsts)
        self._walls = world.derived("walls of people", Walls.of)
        self.yaws, self.walked = np.zeros(count), np.zeros(count)

    def copy(self) -> Crowd:
        """Return a crowd that goes on from here separately."""
        other, people = copy.copy(self), self._people
        other._people = people._replace(
            walkers=people.walkers.copy(), marks=people.marks.copy(), ways=people.ways.copy()
        )
        other.yaws, other.walked = self.yaws.copy(), self.walked.copy()
        return other

    @property
    def centers(self) -> Array:
        """The centers of the people, (n, 2) meters."""
        return self._people.walkers[:, :2].copy()

    @property
    def places(self) -> list[Vector]:
        """The centers of the people, meters."""
        return [(x, y) for x, y in self._people.walkers[:, :2].tolist()]

    @property
    def velocities(self) -> Array:
        """Their velocities, (n, 2) m/s."""
        return self._people.walkers[:, 2:4].copy()

    def step(self, robot: Disc | None, rest: float) -> None:
        """Advance by `DT`.

        Args:
            robot: where the robot is now; None without one. rest: time for which it has been at rest, seconds.
        """
        walkers, marks = self._people.walkers, self._people.marks
        for number in np.flatnonzero(marks[:, STANDING] & (self._people.counts > 0)):
            self.yaws[number] = self.stops[number][marks[number, STOP]][2]
        reached = self._reached(self._preferred(), robot, rest)
        walkers[:, 2:4] = reached
        walkers[:, :2] += reached * DT
        speeds = np.sqrt((reached * reached).sum(axis=1))
        self.walked += speeds * DT
        for number in np.flatnonzero((speeds > 0.2 * self.speed) & (marks[:, STANDING] == 0)):
            vx, vy = reached[number].tolist()
            self.yaws[number] = math.atan2(vy, vx)

    def _preferred(self) -> Array:
        """Return the velocities that people would have alone, (n, 2) m/s, and change what they are about."""
        preferred = np.empty((len(self.stops), 2))
        first = intend(self._people, preferred, 0, False, self.speed, 2.0)
        while first < len(self.stops):
            self._plan(first)
            first = intend(self._people, preferred, first, True, self.speed, 2.0)
        return preferred

    def _reached(self, preferred: Array, robot: Disc | None, rest: float) -> Array:
        """Return the next velocities of the people by their model, (n, 2) m/s; walls stop them in any case."""
        avoids = np.array(self.yields, dtype=np.bool_) | (rest >= REST)
        if robot is None:
            avoids[:], robot, rest = False, Disc(0.0, 0.0, 0.0, 0.0, 0.0), 0.0
        x, y, vx, vy, radius = map(float, robot)
        seen = OrcaRobot(x, y, vx, vy, radius, 1.0 if rest >= REST else 0.5, rest > 0.0)
        walkers, boxes, fastest = self._people.walkers, self._walls.boxes, self.speed
        if self.model == "orca":
            return velocities(walkers, preferred, avoids, seen, boxes, fastest, AVOIDANCE)
        walls = nearest_walls(walkers, boxes, fastest, AVOIDANCE)
        wanted = pushed(walkers, preferred, avoids, np.array([x, y, vx, vy]), walls, fastest, FORCES)
        return off_walls(walkers, wanted, seen, boxes, fastest, AVOIDANCE)

    def _plan(self, number: int) -> None:
        """Plan the way of a person to the next stop."""
        people = self._people
        x, y = people.walkers[number, :2].tolist()
        known = self.world.derived("ways of people", lambda _: KnownWays())
        path = known.between(self.world, (x, y), self.stops[number][people.marks[number, STOP]][:2])
        if len(path) > people.ways.shape[1]:
            ways = np.zeros((len(people.ways), 2 * len(path), 3))
            ways[:, : people.ways.shape[1]] = people.ways
            self._people = people = people._replace(ways=ways)
        if path:
            people.ways[number, : len(path)] = _measured(path)
        people.marks[number, PASSED], people.marks[number, POINTS] = 1, len(path)
        people.walkers[number, BEYOND] = people.ways[number, 1, 2] if path else 0.0


@lru_cache(maxsize=2 * WAYS)
def _measured(path: tuple[Vector, ...]) -> Array:
    """Return the points of a way and the length of the way after each, (n, 3) meters; not to be changed."""
    steps = [math.dist(*each) for each in pairwise(path)]
    # The sum from each point on, from the first step to the last.
    return np.array([(x, y, sum(steps[k:], 0.0)) for k, (x, y) in enumerate(path)])
