"""Checks of what a row says about people and a beaker of liquid: bounds that follow from its route without a drive."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.beaker import Beaker

Array = NDArray[np.float64]

WINDOWS_S = (0.6, 0.8, 1.2, 2.0)
"""Widths of the windows over which motion and liquid are compared, seconds."""
POSITION_M = 0.0045
"""Largest error of a position between two poses: rounding, and the bend of the path within a step of 0.1 s."""
FASTER = 2.0
"""People never walk faster than this factor times their usual speed."""
EPSILON = 1e-9


@dataclass(frozen=True)
class PeopleClaims:
    """Claims of a row about people; distances are between centers.

    Attributes:
        starts: (x, y) of each person at the start, meters. speed: usual speed, m/s. touch: distance of a touch, meters.
        close: distance below which somebody is close, meters.
        close_seconds: time with somebody close. least: least distance, meters; None without people.
        touched: whether the robot touched somebody.
    """

    starts: Sequence[tuple[float, float]]
    speed: float
    touch: float
    close: float
    close_seconds: float
    least: float | None
    touched: bool


@dataclass(frozen=True)
class LiquidClaim:
    """Claims of a row about a beaker: its measures, and the greatest rise of the liquid, meters."""

    beaker: Beaker
    rise: float


def people_problems(claims: PeopleClaims, poses: Array, control_dt: float) -> Iterator[str]:
    """Yield a sentence for each figure about people that the route contradicts.

    At time t a person is within t times the greatest speed of the place where the episode put it. A distance that is
    too small but possible is not named; it never raises a score.

    Args:
        claims: of the row. poses: (n, 3) x, y and yaw after each control step. control_dt: seconds.
    """
    seconds = (len(poses) - 1) * control_dt
    if not 0.0 <= claims.close_seconds <= seconds + EPSILON:
        yield f"close_seconds is {claims.close_seconds:g}, but the drive takes {seconds:g} s"
    if (claims.least is None) != (not claims.starts):
        yield f"least_distance is {claims.least}, with {len(claims.starts)} people"
    if claims.least is None or not claims.starts:
        return
    if (claims.close_seconds > 0.0) != (claims.least < claims.close) and len(poses) > 1:
        yield f"close_seconds is {claims.close_seconds:g}, but least_distance is {claims.least:.3f} m"
    if claims.touched and claims.least > claims.touch + EPSILON:
        yield f"the robot touched somebody, but least_distance is {claims.least:.3f} m"
    if not claims.touched and claims.least < claims.touch - EPSILON:
        yield f"least_distance is {claims.least:.3f} m, but the robot touched nobody"
    reach = FASTER * claims.speed * control_dt * np.arange(len(poses)) + POSITION_M
    apart = np.linalg.norm(poses[:, None, :2] - np.array(claims.starts)[None], axis=2).min(axis=1)
    moved = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1)
    nearest = np.minimum(apart[:-1] - reach[:-1], apart[1:] - reach[1:]) - moved - FASTER * claims.speed * control_dt
    least = min(float(apart[0]), float(nearest.min(initial=math.inf))) - POSITION_M
    if claims.least < least:
        yield f"least_distance is {claims.least:.3f} m, but nobody came within {least:.3f} m of its route"
    most_seconds = control_dt * float((nearest - POSITION_M < claims.close).sum())
    if claims.close_seconds > most_seconds + EPSILON:
        yield f"close_seconds is {claims.close_seconds:g}, but somebody was close for at most {most_seconds:g} s"
    most = apart[1:] + reach[1:]
    if len(most) and claims.least > most.min():
        yield f"least_distance is {claims.least:.3f} m, but somebody began within {most.min():.3f} m of its route"
    least_seconds = control_dt * float((most + control_dt * (FASTER * claims.speed + 1.0) < claims.close).sum())
    if claims.close_seconds < least_seconds - EPSILON:
        yield f"close_seconds is {claims.close_seconds:g}, but somebody was close for at least {least_seconds:g} s"


def liquid_problems(claim: LiquidClaim, poses: Array, control_dt: float) -> Iterator[str]:
    """Yield whether the liquid must have risen higher than a row says.

    Args:
        claim: of the row. poses: (n, 3) x, y and yaw after each control step, without contacts. control_dt: seconds.
    """
    least = least_rise(claim.beaker, poses[:, :2], control_dt)
    if claim.rise < least:
        yield f"highest is {claim.rise:.4f} m, but on its route the liquid rises by at least {least:.4f} m"


def least_rise(beaker: Beaker, places: Array, dt: float) -> float:
    """Return a lower bound of the greatest rise of the liquid of a robot that moved through places, meters.

    The surface obeys q'' + 2 z w q' + w^2 q = -x''. With a window p that is 0 outside of an interval, the integral of
    q (p'' - 2 z w p' + w^2 p) is that of -x p'', so that the greatest |q| is at least the latter divided by the
    integral of |p'' - 2 z w p' + w^2 p|. The places between two poses are taken on the straight line; what that and
    their rounding can change is deducted.

    Args:
        beaker: the beaker. places: (n, 2) every `dt` seconds, meters.
    """
    least, frequency = 0.0, beaker.frequency
    for width in WINDOWS_S:
        count = round(width / dt)
        if len(places) < count + 1:
            continue
        window = 0.5 - 0.5 * np.cos(2.0 * math.pi * np.arange(-1, count + 2) / count)
        window[[0, -1]] = 0.0
        weights = np.diff(window, 2) / dt
        moved = np.stack([np.convolve(places[:, axis], weights, "valid") for axis in (0, 1)], axis=1)
        times = np.linspace(0.0, width, 2001)
        rate = 2.0 * math.pi / width
        p, d = 0.5 - 0.5 * np.cos(rate * times), 0.5 * rate * np.sin(rate * times)
        dd = 0.5 * rate * rate * np.cos(rate * times)
        response = np.abs(dd - 2.0 * beaker.damping * frequency * d + frequency**2 * p).mean() * width
        surely = np.linalg.norm(moved, axis=1).max() - POSITION_M * np.abs(dd).mean() * width
        least = max(least, float(surely / response))
    return beaker.rise(least)
