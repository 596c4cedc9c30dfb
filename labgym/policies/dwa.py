"""A dynamic window over lidar returns: reactive, without a map."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from labgym.envs.robot import ROBOT, RobotSpec, turn_towards
from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.geometry import Array, rotate
from labgym.navigation import Pose
from labgym.policies.arrival import ArrivingPolicy
from labgym.policies.blockage import BlockageDetector
from labgym.policies.options import NonNegative, PolicyOptions, Positive
from labgym.policies.policy import EpisodeStart, Observation, Sensors
from labgym.policies.tracking import velocities_to_action
from labgym.policies.via_point import ViaPoints

Point = tuple[float, float]


CREEP_SPEED = 0.05
"""Speed at which the clearance of standing still is computed, m/s."""

DISC_MARGIN_M = 0.005
"""Margin by which the clear disc is smaller than the distance to the nearest return, meters."""


Count = Annotated[int, Field(ge=2)]


class DwaOptions(PolicyOptions):
    """Options of `DwaPolicy`.

    Attributes:
        radius: radius of the disc that is kept clear, meters.
        heading, clearance, velocity: weights of the objective's terms (alpha, beta and gamma of the paper).
        far: clearance along an arc beyond which more does not count, meters.
        horizon: time on the arc after which the heading is evaluated, seconds. The paper uses one step and a full
            brake; over that time the turn rates of a window hardly differ in heading, and clearance alone decides.
        braking: deceleration that limits the admissible velocities, m/s2.
        samples: numbers of forward velocities and of turn rates in the window.
        turn_in_place: bearing of the target beyond which the robot turns in place, radians.
    """

    radius: Positive = ROBOT.planning_radius - 0.01
    heading: NonNegative = 0.8
    clearance: NonNegative = 0.15
    velocity: NonNegative = 0.3
    far: Positive = 1.5
    horizon: Positive = 0.6
    braking: Positive = 1.0
    samples: tuple[Count, Count] = (7, 21)
    turn_in_place: NonNegative = 1.2


class DwaPolicy(ArrivingPolicy):
    """The dynamic window approach of D. Fox, W. Burgard and S. Thrun (IEEE Robotics & Automation Magazine 4(1), 1997).

    Each step considers the pairs (v, w) that the accelerations allow within the step, keeps those from which the robot
    can stop before the arc that they describe meets a lidar return, and takes the one that maximizes

        alpha heading(v, w) + beta dist(v, w) + gamma velocity(v, w),

    each term in [0, 1]: heading towards the target after some time on the arc, clearance along it, and speed.
    The paper steers for the goal alone and stops in front of wide obstacles. Here the target is a via point of the
    present scan (`ViaPoints`). There is no map: in a deep dead end the robot drives back and forth.

    Args:
        options: a `DwaOptions` or a mapping of those that differ from the defaults.

    Raises:
        UnknownNameError: an option does not exist.
        OptionError: an option is outside its limits.
    """

    name: ClassVar[str] = "dwa"
    observation: ClassVar[Sensors] = "lidar"

    options_type: ClassVar[type[PolicyOptions]] = DwaOptions

    def __init__(self, options: DwaOptions | Mapping[str, Any] | None = None) -> None:
        self._options = DwaOptions.of(options)
        self._robot: RobotSpec = ROBOT
        self._via = ViaPoints((0.0, 0.0))
        self._blockage = BlockageDetector()
        self._path: Array | None = None

    def reset(self, episode: EpisodeStart) -> None:
        """Store the goal and clear the via point."""
        super().reset(episode)
        self._via = ViaPoints(episode.goal)
        self._blockage = BlockageDetector(episode.robot)
        self._path = None

    def drive(self, observation: Observation, pose: Pose) -> NDArray[np.floating[Any]]:
        """Choose a target in the scan and the best velocities towards it."""
        points = lidar_points(np.asarray(observation["lidar"], dtype=np.float64))
        nearest = float(np.hypot(points[:, 0], points[:, 1]).min(initial=math.inf))
        # If something is already nearer than the radius, keep at least the present distance.
        radius = min(self._options.radius, nearest - DISC_MARGIN_M)
        target = self._via.target(points, pose, radius)
        self._path = np.array([pose[:2], target])
        tx, ty = rotate(target[0] - pose[0], target[1] - pose[1], -pose[2])
        bearing = math.atan2(ty, tx)
        v, w = (float(value) for value in observation["velocity"])
        self._blockage.blocked(v)
        if self._blockage.backing:
            return self._blockage.back_off()
        if abs(bearing) > self._options.turn_in_place and v < 0.2:
            return turn_towards(bearing, self._robot)
        best = self._best(v, w, points, (tx, ty), radius)
        self._blockage.note(best[0])
        return velocities_to_action(*best, self._robot)

    def planned_path(self) -> Array | None:
        """Return the straight line to the target; the robot may deviate from it to keep clear of obstacles."""
        return self._path

    def _best(self, v: float, w: float, points: Array, target: Point, radius: float) -> tuple[float, float]:
        """Return the best admissible velocities; if none is admissible, those of full braking."""
        options, robot = self._options, self._robot
        vs, ws = dynamic_window(v, w, options.samples, robot)
        # Standing still would otherwise always have the widest clearance.
        free = arc_clearance(np.maximum(vs, CREEP_SPEED), ws, points, radius)
        admissible = vs <= stopping_speed(free, options.braking, robot.control_dt) + 1e-9
        if not admissible.any():
            return max(0.0, v - robot.acceleration * robot.control_dt), w
        heading = 1.0 - heading_error(vs, ws, target, options.horizon) / math.pi
        clearance = np.minimum(free, options.far) / options.far
        score = options.heading * heading + options.clearance * clearance + options.velocity * vs / robot.v_max
        best = int(np.argmax(np.where(admissible, score, -math.inf)))
        return float(vs[best]), float(ws[best])


def lidar_points(ranges: Array) -> Array:
    """Return the hits of a scan (180,) as points (n, 2) in the robot frame, meters."""
    hit = ranges < RANGE
    angles = -math.pi + 2.0 * math.pi / LIDAR_RAYS * np.flatnonzero(hit)
    return np.asarray(ranges[hit, None] * np.column_stack([np.cos(angles), np.sin(angles)]))


def dynamic_window(
    v: float, w: float, samples: tuple[int, int] = (7, 21), robot: RobotSpec = ROBOT
) -> tuple[Array, Array]:
    """Return the pairs (v, w) that can be reached within one control step: V_d of the paper, forward only.

    The window is [v - a dt, v + a dt] x [w - b dt, w + b dt], cut to the robot's limits. It contains samples with
    v = 0 and w = 0 if these are inside.

    Returns:
        v (n,) in m/s and w (n,) in rad/s, n the product of the samples.
    """
    dv, dw = robot.acceleration * robot.control_dt, robot.turn_acceleration * robot.control_dt
    vs = np.linspace(min(max(v - dv, 0.0), robot.v_max), min(max(v + dv, 0.0), robot.v_max), samples[0])
    slowest, fastest = max(w - dw, -robot.w_max), min(w + dw, robot.w_max)
    ws = np.append(np.linspace(slowest, fastest, samples[1] - 1), min(max(0.0, slowest), fastest))
    grid = np.meshgrid(vs, ws, indexing="ij")
    return grid[0].ravel(), grid[1].ravel()


def arc_clearance(v: Array, w: Array, points: Array, radius: float) -> Array:
    """Return the distance that a disc travels along each arc before it touches a point: dist of the paper, closed form.

    On an arc of radius rho = v / |w| about the center c to the side, the disc's center at angle t from the start is at
    distance `radius` from p if cos(phi - t) = (rho^2 + q^2 - radius^2) / (2 rho q), with q = |p - c| and phi the angle
    of p about c from the start, in the direction of travel. A point that the disc already touches counts, with
    distance 0, if the motion leads towards it.

    Args:
        v: (n,) m/s, not negative. w: (n,) rad/s.
        points: (m, 2) in the robot frame, meters.
        radius: radius of the disc, meters.

    Returns:
        (n,) meters along the arc; inf if nothing is met within the full circle, and if v is 0.
    """
    free = np.full(len(v), math.inf)
    if len(points) == 0:
        return free
    x, y = points[:, 0], points[:, 1]
    touching = np.hypot(x, y) <= radius
    straight, moving = (np.abs(w) < 1e-6 * np.maximum(v, 1e-9)) & (v > 0.0), v > 0.0
    with np.errstate(invalid="ignore"):
        ahead = x - np.sqrt(radius**2 - y**2)
    line = np.where((np.abs(y) < radius) & (x > 0.0) & ~touching, ahead, math.inf)
    free[straight] = line.min()
    curved = moving & ~straight
    rho = (v[curved] / np.abs(w[curved]))[:, None]
    side = np.sign(w[curved])[:, None] * y
    q = np.hypot(x, side - rho)
    phi = np.arctan2(x, rho - side) % (2.0 * math.pi)
    cosine = (rho**2 + q**2 - radius**2) / np.maximum(2.0 * rho * q, 1e-12)
    with np.errstate(invalid="ignore"):
        angle = (phi - np.arccos(cosine)) % (2.0 * math.pi)
    free[curved] = np.where((np.abs(cosine) <= 1.0) & ~touching, rho * angle, math.inf).min(axis=1)
    if (touching & (x > 0.0)).any():
        free[moving] = 0.0
    return free


def stopping_speed(distance: Array, braking: float, delay: float) -> Array:
    """Return the largest admissible speed: V_a of the paper, v <= sqrt(2 dist b), with the control step's delay.

    The v that solves v delay + v^2 / (2 braking) = distance.

    Args:
        distance: (n,) to the obstacle, meters; may be inf.
        braking: deceleration, m/s2.
        delay: time before braking begins, seconds.

    Returns:
        (n,) m/s.
    """
    return np.asarray(np.sqrt((braking * delay) ** 2 + 2.0 * braking * distance) - braking * delay)


def heading_error(v: Array, w: Array, target: Point, horizon: float) -> Array:
    """Return the angle to the target, in [0, pi], at the robot's pose after some time on each arc.

    Args:
        v: (n,) m/s. w: (n,) rad/s.
        target: (x, y) in the robot frame, meters.
        horizon: time on the arc, seconds.
    """
    turn = w * horizon
    chord = v * horizon * np.sinc(turn / (2.0 * math.pi))
    x, y = chord * np.cos(turn / 2.0), chord * np.sin(turn / 2.0)
    error = np.arctan2(target[1] - y, target[0] - x) - turn
    return np.asarray(np.abs((error + math.pi) % (2.0 * math.pi) - math.pi))
