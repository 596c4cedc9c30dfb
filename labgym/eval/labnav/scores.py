"""The score of an episode of each task, in [0, 1]: pure functions.

S is 1 if the robot came to rest in the goal's disc without a contact that ends the drive, else 0; L* is the length of
the shortest path of the 0.30 m disc to the success disc on the true floor, P the length driven, T the time taken, and
OT = L* / 1 m/s the time of a robot that is always at full speed:

    aisle            S OT / clip(T, OT, 8 OT)
    odometry, glass  S L* / max(P, L*)
    moved            S L* / max(P, L*) * m_r L* / (m_r L* + sum m_i d_i)
    people           0.4 S + 0.3 S OT / max(T, OT) + 0.3 S max(0, 1 - seconds nearer than 1.0 m / OT)
    dock             clip(ln(1 / e) / ln 10, 0, 1), e = max(position error / 0.10 m, heading error / 0.10 rad)
    carry            S OT / clip(T, OT, 8 OT) * clip(2 - n_max / freeboard, 0, 1)
    shift            mean over all legs of S_i L*_i / max(P_i, L*_i), half of it for a leg that ends out of its dock
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from labgym.envs.robot import ROBOT
from labgym.eval.driving.navigation_metrics import spl

FULL_SPEED = 1.0
"""Speed of the ideal robot, m/s."""
SLOWEST = 8.0
"""Times OT beyond which being slower costs nothing more."""
DOCK_POSITION, DOCK_HEADING = 0.10, 0.10
"""Errors at which docking scores 0: meters and radians."""
PRECISE = (0.05, 0.05)
"""Errors below which a robot has docked by Nav2's criterion: meters and radians."""
WEIGHTS = (0.4, 0.3, 0.3)
"""Of success, time and distance from people."""


def ideal_time(shortest: float) -> float:
    """Return OT, seconds, for L* in meters."""
    return shortest / FULL_SPEED


def timed(success: bool, shortest: float, time: float) -> float:
    """Return S OT / clip(T, OT, 8 OT), for L* in meters and T in seconds."""
    ideal = ideal_time(shortest)
    return ideal / min(max(time, ideal), SLOWEST * ideal) if success else 0.0


def effort(shortest: float, pushes: Iterable[tuple[float, float]], mass: float = ROBOT.mass) -> float:
    """Return m_r L* / (m_r L* + sum m_i d_i).

    Args:
        shortest: L*, meters.
        pushes: mass in kg and way in meters of each thing that was pushed.
        mass: of the robot, kg.
    """
    own = mass * shortest
    return own / (own + math.fsum(each * way for each, way in pushes))


def moved(success: bool, shortest: float, driven: float, pushes: Iterable[tuple[float, float]]) -> float:
    """Return SPL times the effort."""
    return spl(success, shortest, driven) * effort(shortest, pushes)


def people(success: bool, shortest: float, time: float, near: float) -> float:
    """Return the weighted sum of success, time and distance from people.

    Args:
        success: whether the goal was reached without touching a person.
        shortest: L*, meters. time: T, seconds. near: seconds nearer than 1.0 m to a person, center to center.
    """
    if not success:
        return 0.0
    ideal = ideal_time(shortest)
    terms = (1.0, ideal / max(time, ideal), max(0.0, 1.0 - near / ideal))
    return math.fsum(weight * term for weight, term in zip(WEIGHTS, terms, strict=True))


def docking_error(position: float, heading: float) -> float:
    """Return e = max(position error / 0.10 m, heading error / 0.10 rad)."""
    return max(position / DOCK_POSITION, abs(heading) / DOCK_HEADING)


def dock(rests: bool, position: float, heading: float) -> float:
    """Return clip(ln(1 / e) / ln 10, 0, 1); 0 for a robot that does not rest there, or touched something."""
    error = docking_error(position, heading)
    if not rests or error >= 1.0:
        return 0.0
    return min(-math.log10(error), 1.0) if error > 0.0 else 1.0


def carry(success: bool, shortest: float, time: float, rise: float, freeboard: float) -> float:
    """Return the timed score less what the liquid rose: all of it up to the freeboard, none from twice as high.

    Args:
        success, shortest, time: as for `timed`.
        rise: greatest rise of the liquid at the wall, n_max, meters. freeboard: meters.
    """
    return timed(success, shortest, time) * min(max(2.0 - rise / freeboard, 0.0), 1.0)


@dataclass(frozen=True)
class Leg:
    """A leg of a shift.

    Attributes:
        success: whether the robot rested in the goal's disc. docked: whether within 0.10 m and 0.10 rad of the pose.
        shortest: L* from where the leg began, meters. driven: P, meters.
    """

    success: bool
    docked: bool
    shortest: float
    driven: float


def shift(legs: Sequence[Leg], count: int) -> float:
    """Return the mean score of all legs of a shift; those that were not begun score 0.

    Args:
        legs: that were driven. count: of all legs.
    """
    scores = (leg_score(leg) for leg in legs)
    return math.fsum(scores) / count


def leg_score(leg: Leg) -> float:
    """Return S L* / max(P, L*), half of it out of the dock; 0 for a leg that begins in its goal's disc."""
    if leg.shortest <= 0.0:
        return 0.0
    return spl(leg.success, leg.shortest, leg.driven) * (1.0 if leg.docked else 0.5)
