"""Waiting: when a robot among people has to rest."""

from __future__ import annotations

import math

from labgym.navigation import Pose
from labgym.policies.stack.people import Person

AT_REST = 0.05
"""Speed below which the robot rests, m/s."""
TOUCHING = 0.66
"""Distance of a person's center within which the robot rests, meters: nobody walks into a robot at rest."""
SET_OFF, RECEDING = 1.15, 0.2
"""A robot at rest does not set off while a person who walks is within this distance, meters, unless they recede faster,
m/s."""
BESIDE = 0.85
"""Distance within which it does not set off while a person stands there, meters."""
SOON, CLOSE = 1.0, 0.72
"""A robot brakes for a person who walks if they would be within this distance, meters, within this time, seconds."""
BRAKING, LATE = 1.4, 0.2
"""Deceleration of the robot, m/s2, and time by which it comes late, seconds."""


class Waiting:
    """Decides whether the robot has to rest.

    Attributes:
        resting: the latest decision.
    """

    def __init__(self) -> None:
        self.resting = False

    def step(self, pose: Pose, speed: float, people: tuple[Person, ...]) -> bool:
        """Return whether a robot at a pose and a speed, m/s, has to rest for people."""
        self.resting = any(self._holds(person, pose, speed) for person in people)
        return self.resting

    def _holds(self, person: Person, pose: Pose, speed: float) -> bool:
        """Return whether a person makes the robot rest."""
        dx, dy = person.place[0] - pose[0], person.place[1] - pose[1]
        away = math.hypot(dx, dy)
        if away < TOUCHING and not (abs(speed) > AT_REST and _parting(person, pose, speed)):
            return True
        if person.walking and (_meet(person, pose, speed) or too_late(person, pose, speed)):
            return True
        if abs(speed) > AT_REST or away > (SET_OFF if person.walking else BESIDE):
            return False
        # One who stands next to a robot at rest may have been stopped by it, and walks on when it moves.
        return (person.velocity[0] * dx + person.velocity[1] * dy) / away < RECEDING


def too_late(
    person: Person, pose: Pose, speed: float, braking: float = BRAKING, late: float = LATE, near: float = TOUCHING
) -> bool:
    """Return whether one who comes nearer is too near by the time at which the robot has braked to rest.

    Args:
        person: at a velocity. pose, speed: of the robot, m/s.
        braking: its deceleration, m/s2. late: time after which it begins, seconds. near: distance that is too near, m.
    """
    if speed <= AT_REST or _parting(person, pose, speed):
        return False
    time = speed / braking + late
    way = speed * speed / (2.0 * braking) + speed * late / 2.0
    dx = person.place[0] + person.velocity[0] * time - pose[0] - way * math.cos(pose[2])
    dy = person.place[1] + person.velocity[1] * time - pose[1] - way * math.sin(pose[2])
    return math.hypot(dx, dy) < near


def _parting(person: Person, pose: Pose, speed: float) -> bool:
    """Return whether a person falls behind a robot that drives on: one that brakes would be touched."""
    px, py = person.place[0] - pose[0], person.place[1] - pose[1]
    vx = person.velocity[0] - speed * math.cos(pose[2])
    vy = person.velocity[1] - speed * math.sin(pose[2])
    return vx * px + vy * py > -0.05 * math.hypot(px, py)


def _meet(person: Person, pose: Pose, speed: float) -> bool:
    """Return whether a robot that drives straight on and a person who does come near each other soon."""
    px, py = person.place[0] - pose[0], person.place[1] - pose[1]
    vx = person.velocity[0] - speed * math.cos(pose[2])
    vy = person.velocity[1] - speed * math.sin(pose[2])
    time = min(max(-(px * vx + py * vy) / max(vx * vx + vy * vy, 1e-9), 0.0), SOON)
    return time > 0.0 and math.hypot(px + vx * time, py + vy * time) < CLOSE
