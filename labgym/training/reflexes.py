"""The nearest command of a robot that touches nothing in the next second, from a scan and the people in sight."""

from __future__ import annotations

import math

from labgym.envs.conditions.cast import RADIUS as PERSON_RADIUS
from labgym.envs.robot import ROBOT
from labgym.geometry import Array
from labgym.machine_code import entry

HOLD_STEPS, STEPS = 5, 12
"""Control steps for which a command is held before the robot brakes, and those that are looked ahead."""
SLOWER = (1.0, 0.6, 0.3, 0.12, 0.0)
"""Shares of the wanted speed that are tried."""
ASIDE = (0.0, -0.2, 0.2, -0.45, 0.45, -0.8, 0.8)
"""Differences from the wanted turn that are tried, as actions."""
SPEED_PRICE, TURN_PRICE = 1.0, 0.7
"""Price of an action that is lost by slowing down, and by turning otherwise."""
TIGHT_M, TIGHT_PRICE = 0.08, 0.4
"""Clearance below which less costs, meters, and the price at none."""
TOUCH_M, PERSON_M = 0.015, 0.12
"""Least clearance from things and from people, meters."""
PRESSED_M, PRESSING, LEAVING = 0.75, 0.2, 0.05
"""Distance within which somebody who does not walk away faster than `PRESSING` counts as walking at the robot, m and
m/s; and least speed at which a robot that is nearer than allowed moves away."""
PACE = 1.0
"""Speed of those people, m/s."""
MEETING_STEPS, MEETING_M, MEETING_PRICE = 25, 0.5, 1.5
"""Control steps within which meeting people has a price, the gap at which it has none, and the price at no gap."""
V_MAX, W_MAX, RADIUS, DT = ROBOT.v_max, ROBOT.w_max, ROBOT.chassis_radius, ROBOT.control_dt
DV, DW = ROBOT.acceleration * ROBOT.control_dt, ROBOT.turn_acceleration * ROBOT.control_dt


@entry
def nearest_safe(
    points: Array, people: Array, velocity: tuple[float, float], forward: float, turn: float
) -> tuple[float, float]:
    """Return the action nearest to a wanted one that touches nothing if the robot brakes after it.

    Args:
        points: (n, 2) of what stands around, robot frame, meters.
        people: (m, 4) places and velocities of those in sight, robot frame, meters and m/s.
        velocity: of the robot, m/s and rad/s. forward, turn: the wanted action.
    """
    best, chosen = math.inf, (0.0, turn)
    for share in SLOWER:
        for aside in ASIDE:
            speed, rate = share * forward, min(max(turn + aside, -1.0), 1.0)
            price = SPEED_PRICE * (forward - speed) + TURN_PRICE * abs(rate - turn)
            if price < best:
                price += _crowding(people, velocity, V_MAX * speed, W_MAX * rate)
                price += _risk(points, people, velocity, V_MAX * speed, W_MAX * rate)
                if price < best:
                    best, chosen = price, (speed, rate)
    return chosen


@entry
def _moved(
    motion: tuple[float, float, float, float, float], speed: float, rate: float
) -> tuple[float, float, float, float, float]:
    """Return x, y, yaw and the velocities of a robot one control step later."""
    x, y, yaw, v, w = motion
    v += min(max(speed - v, -DV), DV)
    w += min(max(rate - w, -DW), DW)
    yaw += DT * w
    return x + DT * v * math.cos(yaw), y + DT * v * math.sin(yaw), yaw, v, w


@entry
def _risk(points: Array, people: Array, velocity: tuple[float, float], speed: float, rate: float) -> float:
    """Return the price of coming near things; inf if something is touched."""
    motion, least = (0.0, 0.0, 0.0, velocity[0], velocity[1]), math.inf
    for step in range(STEPS):
        motion = _moved(motion, speed if step < HOLD_STEPS else 0.0, rate)
        x, y, _, v, _ = motion
        if v == 0.0:
            if step >= HOLD_STEPS:
                break
            continue
        time = DT * (step + 1)
        for k in range(len(people)):
            now = math.hypot(people[k, 0], people[k, 1])
            vx, vy = people[k, 2], people[k, 3]
            leaving = (vx * people[k, 0] + vy * people[k, 1]) / now
            if now < PRESSED_M and leaving < PRESSING:
                vx, vy = -PACE * people[k, 0] / now, -PACE * people[k, 1] / now
            away = math.hypot(people[k, 0] + vx * time - x, people[k, 1] + vy * time - y)
            if away < min(RADIUS + PERSON_RADIUS + PERSON_M, now + LEAVING * time):
                return math.inf
        for k in range(len(points)):
            square = (points[k, 0] - x) ** 2 + (points[k, 1] - y) ** 2
            if square < least:
                least = square
    clearance = math.sqrt(least) - RADIUS
    if clearance < TOUCH_M:
        return math.inf
    return TIGHT_PRICE * max(0.0, 1.0 - clearance / TIGHT_M)


@entry
def _crowding(people: Array, velocity: tuple[float, float], speed: float, rate: float) -> float:
    """Return the price of meeting people in the next seconds if all go on as they do."""
    motion, most = (0.0, 0.0, 0.0, velocity[0], velocity[1]), 0.0
    for step in range(MEETING_STEPS if len(people) else 0):
        motion = _moved(motion, speed, rate if step <= HOLD_STEPS else 0.0)
        x, y = motion[:2]
        time = DT * (step + 1)
        for k in range(len(people)):
            away = math.hypot(people[k, 0] + people[k, 2] * time - x, people[k, 1] + people[k, 3] * time - y)
            near = 1.0 - (away - RADIUS - PERSON_RADIUS) / MEETING_M
            most = max(most, near * (1.0 - 0.5 * step / MEETING_STEPS))
    return MEETING_PRICE * most
