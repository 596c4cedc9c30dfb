"""The people of a forecast as arrays, which compiled functions advance: the places of `Crowd` to the bit, sooner."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from functools import cache, lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions import crowd as rules
from labgym.envs.conditions.crowd import AVOIDANCE, DT, GAP, RADIUS, REST, Crowd
from labgym.envs.conditions.half_planes import Vector
from labgym.envs.conditions.orca import Disc
from labgym.envs.conditions.walls import Walls

Array = NDArray[np.float64]

NEAR = rules.ARRIVED, rules.QUEUE, rules.TAKEN, rules.LOOKAHEAD, rules.AHEAD
TIMES = rules.PROGRESS, rules.REPLAN, rules.GIVE_UP
TERMS = AVOIDANCE.horizon, AVOIDANCE.horizon_walls, AVOIDANCE.reach, AVOIDANCE.dt
POINTS = 32
"""Number of points of a way for which there is room at first."""


class CrowdArrays:
    """People who go on from a crowd as it is, separately; it must be of the model "orca".

    Args:
        crowd: the people. intend, velocities: the compiled functions.
    """

    def __init__(self, crowd: Crowd, intend: Callable[..., int], velocities: Callable[..., Array]) -> None:
        self._crowd, self._intend, self._velocities = crowd, intend, velocities
        walkers, count = crowd.walkers, len(crowd.walkers)
        self._walkers = np.array(
            [(w.x, w.y, w.vx, w.vy, w.waiting, w.group_wait, w.beyond, w.to_go, w.stalled) for w in walkers]
        ).reshape(-1, 9)
        self._marks = np.array([(w.stop, w.standing, w.passed, 0) for w in walkers], dtype=np.int64).reshape(-1, 4)
        self._ways = np.zeros((count, POINTS, 3))
        for number, walker in enumerate(walkers):
            self._lay(number, walker.path)
        self._counts = np.array([len(stops) for stops in crowd.stops], dtype=np.int64)
        self._stops = np.zeros((count, int(self._counts.max(initial=1)), 3))
        for number, stops in enumerate(crowd.stops):
            for k, (x, y, _, seconds) in enumerate(stops):
                self._stops[number, k] = x, y, seconds
        self._groups = np.array([group[0] for group in crowd.groups], dtype=np.int64)
        self._yields = np.array(crowd.yields, dtype=np.bool_)
        self._boxes = crowd.world.derived("walls of people", Walls.of).boxes

    def copy(self) -> CrowdArrays:
        """Return people who go on from here separately."""
        other = copy.copy(self)
        other._walkers, other._marks, other._ways = self._walkers.copy(), self._marks.copy(), self._ways.copy()
        return other

    @property
    def places(self) -> Array:
        """The centers of the people, (n, 2) meters."""
        return self._walkers[:, :2].copy()

    def step(self, robot: Disc, rest: float) -> None:
        """Advance by `DT`, as `Crowd.step`."""
        walkers, preferred = self._walkers, np.empty((len(self._walkers), 2))
        speed, first, planned = self._crowd.speed, 0, False
        while True:
            first = self._intend(
                walkers,
                self._marks,
                preferred,
                self._ways,
                self._stops,
                self._counts,
                self._groups,
                first,
                planned,
                speed,
                NEAR,
                TIMES,
                rules.PATIENCE,
                rules.TO_THE_RIGHT,
                DT,
                2.0,
            )
            if first == len(walkers):
                break
            self._plan(first)
            planned = True
        velocities = self._velocities(
            walkers,
            preferred,
            self._yields,
            (float(robot[0]), float(robot[1]), float(robot[2]), float(robot[3]), float(robot[4])),
            rest >= REST,
            rest > 0.0,
            self._boxes,
            speed,
            RADIUS,
            GAP,
            AVOIDANCE.neighbors,
            TERMS,
        )
        walkers[:, 2:4] = velocities
        walkers[:, :2] += velocities * DT

    def _plan(self, number: int) -> None:
        """Plan the way of a person to the next stop, as `Crowd`."""
        x, y = self._walkers[number, :2].tolist()
        path = self._crowd.way((x, y), self._crowd.stops[number][self._marks[number, 0]][:2])
        self._marks[number, 2] = 1
        self._lay(number, path)
        self._walkers[number, 6] = self._ways[number, 1, 2] if path else 0.0

    def _lay(self, number: int, path: tuple[Vector, ...]) -> None:
        """Note the way of a person."""
        if len(path) > self._ways.shape[1]:
            room = np.zeros((len(self._ways), 2 * len(path), 3))
            room[:, : self._ways.shape[1]] = self._ways
            self._ways = room
        self._marks[number, 3] = len(path)
        if path:
            self._ways[number, : len(path)] = measured(path)


@lru_cache(maxsize=2 * rules.WAYS)
def measured(path: tuple[Vector, ...]) -> Array:
    """Return the points of a way and the length of the way after each, (n, 3) meters; not to be changed."""
    steps = [math.dist(*each) for each in pairwise(path)]
    # As in `crowd._length`, to the bit: the sum from each point on, from the first step to the last.
    return np.array([(x, y, sum(steps[k:], 0.0)) for k, (x, y) in enumerate(path)])


def arrays_of(crowd: Crowd) -> CrowdArrays | None:
    """Return the people of a crowd as arrays; None without numba, and for another model than "orca"."""
    compiled = compiled_functions()
    return None if compiled is None or crowd.model != "orca" else CrowdArrays(crowd, *compiled)


@cache
def compiled_functions() -> tuple[Callable[..., int], Callable[..., Array]] | None:
    """Return the compiled functions of `CrowdArrays`, None without numba."""
    try:
        from labgym.envs.conditions.crowd_kernel import velocities
        from labgym.envs.conditions.walk_kernel import intend
    except ImportError:
        return None
    return intend, velocities
