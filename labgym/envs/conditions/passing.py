"""The robot in a physics step among people and in front of a dock: distances, touches and rest, compiled.

The planar kernel carries these functions out within a control step; with MuJoCo, conditions call them after each step.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry

Array = NDArray[np.float64]

CLOSE_S, BESIDE_S, LEAST, SHARE, TICK, SUMS = 0, 1, 2, 3, 4, 5
"""Places in the sums of people: seconds with somebody nearer than `CLOSE`; seconds for which somebody has been within
1.5 m until now; least distance, meters; share of the present 0.1 s that is over; and its number."""
CLOSE, BESIDE = 1.0, 1.5
"""Distances between centers that the outcome reports, meters."""
AT_REST = 0.01
"""Speed below which the robot rests, m/s. At the 0.05 m/s of `RestEnding` a robot could creep through a crowd, which
makes way for what rests."""
RESTING_SPEED, RESTING_TURN = 0.05, 0.1
"""A robot below this speed, m/s, and this turn rate, rad/s, is at rest in a dock."""


class Company(NamedTuple):
    """People and docking of an episode, as the kernel reads and advances them.

    Attributes:
        before, after: (n, 2) centers of people at the begin and at the end of the present 0.1 s, meters.
        sums: (5,) of people. resting: (1,) seconds for which the robot has been at rest; (0,) without a dock.
    """

    before: Array
    after: Array
    sums: Array
    resting: Array


def nobody() -> Company:
    """Return the company of an episode without people and dock."""
    return Company(np.empty((0, 2)), np.empty((0, 2)), new_sums(), np.empty(0))


def new_sums() -> Array:
    """Return the sums of people at the begin of an episode."""
    sums = np.zeros(SUMS)
    sums[LEAST] = math.inf
    return sums


@entry
def pass_by(x: float, y: float, share: float, dt: float, before: Array, after: Array, sums: Array) -> tuple[int, float]:
    """Add a physics step to the sums of people; return the nearest person, -1 without any, and the distance, meters.

    Args:
        x, y: of the robot, meters. share: of the present 0.1 s that is over. dt: duration of the step, seconds.
        before, after, sums: as of `Company`.
    """
    best, least = -1, math.inf
    for k in range(len(before)):
        dx = before[k, 0] + (after[k, 0] - before[k, 0]) * share - x
        dy = before[k, 1] + (after[k, 1] - before[k, 1]) * share - y
        square = dx * dx + dy * dy
        if square < least:
            best, least = k, square
    sums[SHARE] = share
    distance = math.sqrt(least)
    if best >= 0:
        sums[LEAST] = min(sums[LEAST], distance)
        sums[CLOSE_S] += dt if distance < CLOSE else 0.0
        sums[BESIDE_S] = sums[BESIDE_S] + dt if distance < BESIDE else 0.0
    return best, distance


@entry
def moves(forward: float, left: float) -> bool:
    """Whether the robot moves, by its velocities in m/s; a turn on the spot is no motion."""
    return math.sqrt(forward * forward + left * left) >= AT_REST


@entry
def rested(resting: float, forward: float, left: float, turn: float, dt: float) -> float:
    """Return the seconds for which the robot has been at rest after a physics step."""
    still = math.sqrt(forward * forward + left * left) < RESTING_SPEED and abs(turn) < RESTING_TURN
    return resting + dt if still else 0.0
