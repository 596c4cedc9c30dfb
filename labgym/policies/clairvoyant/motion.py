"""Tracking of a scheduled path: the motion of the clairvoyant reference."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.beaker import Beaker
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.geometry import rotate, wrap_angle
from labgym.navigation import Pose
from labgym.policies.clairvoyant.foreknowledge import Foreknowledge
from labgym.policies.clairvoyant.path import SPACING, clear_path, speed_limits
from labgym.policies.clairvoyant.schedule import Schedule, fastest_schedule
from labgym.policies.gentle import GentleCommands, GentleLimits
from labgym.policies.tracking import PathTracker, TrackingOptions, turn_towards, velocities_to_action

Array = NDArray[np.float64]

ACCELERATION, LATERAL = 1.2, 1.0
"""Limits without a beaker, along and across the way, m/s2: less than the robot's, to have some left for corrections."""
BODY, MARGIN = 0.30, 0.08
"""Radius of a person, and what is kept beyond it, meters."""
AGAIN = 1.0
"""Time after which the schedule is made anew, seconds."""
ENDING = 0.4
"""Length of path left below which a schedule stays, meters."""
OFF = 0.10
"""Deviation from the schedule at which it is made anew, meters."""
CORRECTION = 1.0
"""Speed per meter of deviation from the schedule, 1/s."""
FACING = 0.15
"""Deviation from the path's first heading below which the robot sets off, radians."""
LAST, AFTER = 0.03, 0.2
"""Length of path left, meters, and time after the schedule, seconds, at which the robot parks and turns."""


class Motion:
    """Drives from start to goal as fast as the limits allow, around people whose future is known.

    It plans the path once, on the true layout; turns to it; follows a schedule that waits or slows down for people; and
    ends at rest, at the goal's heading if one is asked for. With a beaker all limits follow from it.

    Args:
        world: what the robot knows. start, goal: poses in the room frame. heading: whether the goal's heading counts.
        short: distance before the goal at which to stop, meters. beaker: what it carries. robot: its limits.

    Attributes:
        path: (n, 2) meters; None if there is no way.
    """

    def __init__(
        self,
        world: Foreknowledge,
        start: Pose,
        goal: Pose,
        heading: bool = False,
        short: float = 0.0,
        beaker: Beaker | None = None,
        robot: RobotSpec = ROBOT,
    ) -> None:
        self._world, self._robot = world, robot
        gentle = None if beaker is None else GentleLimits.of(beaker, robot)
        self._commands = None if gentle is None else GentleCommands(gentle, robot)
        # The filter and the corrections of the schedule share the beaker's limit.
        self._acceleration = ACCELERATION if gentle is None else min(ACCELERATION, 0.9 * gentle.acceleration)
        path = clear_path(world.solids(), start, goal)
        if path is not None and short > 0.0:
            path = path[: max(2, len(path) - round(short / SPACING))]
        self.path: Array | None = path
        self._goal_yaw = goal[2] if heading else None
        self._schedule: Schedule | None = None
        self._place = 0
        self._set_off = False
        self._parked: PathTracker | None = None
        if path is not None:
            self._spacing = float(np.linalg.norm(path[1] - path[0]))
            self._limits = speed_limits(path, LATERAL if gentle is None else gentle.lateral, robot)

    @property
    def ended(self) -> bool:
        """Whether the robot rests at the end."""
        return self._parked is not None and self._parked.ended

    def action(self, pose: Pose, velocity: tuple[float, float], time: float) -> Array:
        """Return the action, (2,) in [-1, 1], at a pose in the room frame and a time of the episode, seconds."""
        path = self.path
        if path is None:
            return np.zeros(2)
        self._advance(path, pose)
        over = self._schedule is not None and time >= self._schedule.end + AFTER
        if self._parked is not None or over or self._left() < LAST:
            return self._park(path, pose, velocity)
        if not self._set_off:
            ahead = path[min(round(0.2 / SPACING), len(path) - 1)] - np.array(pose[:2])
            error = wrap_angle(math.atan2(float(ahead[1]), float(ahead[0])) - pose[2])
            if abs(error) > FACING:
                return turn_towards(error, self._robot)
            self._set_off = True
        return self._follow(path, pose, velocity, time)

    def _follow(self, path: Array, pose: Pose, velocity: tuple[float, float], time: float) -> Array:
        """Return the action that follows the schedule."""
        along = self._place * self._spacing
        if self._commands is not None:
            # Where the robot would be if the filter did not delay it.
            along += self._commands.limits.delay * self._robot.control_dt * self._commands.speed
            along = min(along, self._spacing * (len(path) - 1))
        old = self._schedule
        due = old is None or (self._left() > ENDING and time - old.start >= AGAIN)
        if due or old is None or abs(old.at(time)[0] - along) > OFF:
            speed = max(velocity[0], 0.0) if self._commands is None else self._commands.speed
            apart = self._robot.chassis_radius + BODY + MARGIN
            self._schedule = fastest_schedule(
                path, self._limits, self._acceleration, self._world.people, apart, time, along, speed
            )
        if self._schedule is None:
            # Nothing is safe but to rest: people walk around a robot at rest.
            return self._commanded(0.0, 0.0)
        place, _ = self._schedule.at(time)
        _, speed = self._schedule.at(time + self._robot.control_dt)
        v = speed + CORRECTION * (place - along) if speed > 0.0 else 0.0
        v = min(max(v, 0.0), float(self._limits[self._place]) + 0.05)
        ahead = 0.15 + 0.2 * max(velocity[0], 0.0)
        target = path[min(self._place + round(ahead / SPACING), len(path) - 1)]
        x, y = rotate(target[0] - pose[0], target[1] - pose[1], -pose[2])
        curvature = 2.0 * y / max(x * x + y * y, 0.01)
        return self._commanded(v, curvature)

    def _commanded(self, v: float, curvature: float) -> Array:
        if self._commands is not None:
            v = self._commands.command(v)
        return velocities_to_action(v, v * curvature, self._robot)

    def _park(self, path: Array, pose: Pose, velocity: tuple[float, float]) -> Array:
        """Return the action of the last piece: to rest, and to the heading."""
        if self._parked is None:
            options = TrackingOptions(rest=True, lateral_acceleration=LATERAL, braking=self._acceleration)
            self._parked = PathTracker(path[self._place :], self._robot, options, False, self._goal_yaw, self._commands)
        return self._parked.action(pose, velocity[0])

    def _advance(self, path: Array, pose: Pose) -> None:
        nearby = path[self._place : self._place + 25] - np.array(pose[:2])
        self._place += int(np.argmin((nearby**2).sum(axis=1)))

    def _left(self) -> float:
        """Return the length of the path ahead, meters."""
        return self._spacing * (len(self._limits) - 1 - self._place)
