"""Terms that the scores of several tasks have in common: pure functions.

S is 1 if the robot came to rest in the goal's disc without a contact that ends the drive, else 0; L* is the length of
the shortest path of the 0.30 m disc to the success disc on the true floor, P the length driven, T the time taken, and
OT = L* / 1 m/s the time of a robot that is always at full speed.
"""

from __future__ import annotations

FULL_SPEED = 1.0
"""Speed of the ideal robot, m/s."""
SLOWEST = 8.0
"""Times OT beyond which being slower costs nothing more."""
DOCK_POSITION, DOCK_HEADING = 0.10, 0.10
"""Errors at which docking scores 0: meters and radians."""
PRECISE = (0.05, 0.05)
"""Errors below which a robot has docked by Nav2's criterion: meters and radians."""


def spl(success: bool, shortest: float, driven: float) -> float:
    """Return success weighted by path length, in [0, 1].

    Args:
        success: whether the goal was reached.
        shortest: L*, meters, positive.
        driven: P, meters.
    """
    return shortest / max(driven, shortest) if success else 0.0


def ideal_time(shortest: float) -> float:
    """Return OT, seconds, for L* in meters."""
    return shortest / FULL_SPEED


def timed(success: bool, shortest: float, time: float) -> float:
    """Return S OT / clip(T, OT, 8 OT), for L* in meters and T in seconds."""
    ideal = ideal_time(shortest)
    return ideal / min(max(time, ideal), SLOWEST * ideal) if success else 0.0


def docking_error(position: float, heading: float) -> float:
    """Return e = max(position error / 0.10 m, heading error / 0.10 rad)."""
    return max(position / DOCK_POSITION, abs(heading) / DOCK_HEADING)


def leg_score(success: bool, docked: bool, shortest: float, driven: float) -> float:
    """Return S L* / max(P, L*) of a drive of a chain, half of it out of the dock; 0 if it begins in its goal's disc."""
    if shortest <= 0.0:
        return 0.0
    return spl(success, shortest, driven) * (1.0 if docked else 0.5)
