"""A dynamic window over lidar returns: reactive, without any map."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.geometry import rotate
from labgym.navigation import Pose
from labgym.policies.blockage import Blockage
from labgym.policies.policy import EpisodeStart, Observation, Policy, Sensors
from labgym.policies.tracking import turn_towards, velocities_to_action
from labgym.policies.via_point import ViaPoints

Array = NDArray[np.float64]
Point = tuple[float, float]


CREEP = 0.05
"""Speed that the clearance of standing still is judged by, m/s."""

SHRINK = 0.005
"""By how much the disc that is kept clear stays smaller than the distance to the nearest return, metres."""


@dataclass(frozen=True)
class DwaOptions:
    """Weights and samples.

    Attributes:
        radius: of the disc that is kept clear, metres.
        heading, clearance, velocity: weights of the objective's terms (alpha, beta and gamma of the paper).
        far: clearance along an arc beyond which more does not count, metres.
        horizon: time after which the heading is judged, seconds. The paper takes one step and a full brake, over which
            turn rates of one window hardly differ in heading, and clearance decides alone.
        braking: deceleration that admissible velocities are computed with, m/s2.
        samples: velocities forward and turn rates in the window.
        turn_in_place: bearing of the target beyond which it turns on the spot, radians.
    """

    radius: float = ROBOT.planning_radius - 0.01
    heading: float = 0.8
    clearance: float = 0.15
    velocity: float = 0.3
    far: float = 1.5
    horizon: float = 0.6
    braking: float = 1.0
    samples: tuple[int, int] = (7, 21)
    turn_in_place: float = 1.2


class DwaPolicy(Policy):
    """The dynamic window approach of D. Fox, W. Burgard and S. Thrun (IEEE Robotics & Automation Magazine 4(1), 1997).

    At each step it considers the pairs (v, w) that the accelerations allow within the step, keeps those from which the
    robot can still stop before the arc that they describe meets a lidar return, and takes the one with the largest

        alpha heading(v, w) + beta dist(v, w) + gamma velocity(v, w),

    each term in [0, 1]: heading towards the target after a while on the arc, clearance along it, and speed.
    The paper steers for the goal alone and stops in front of whatever is wider than it can see around. Here the target
    is a via point that the present scan offers (`ViaPoints`). There is no map: in a dead end deeper than that it
    drives to and fro, and its success rate says so.
    """

    name: ClassVar[str] = "dwa"
    observation: ClassVar[Sensors] = "lidar"

    def __init__(self, options: DwaOptions | None = None) -> None:
        self._options = options or DwaOptions()
        self._robot: RobotSpec = ROBOT
        self._via = ViaPoints((0.0, 0.0))
        self._blockage = Blockage()
        self._path: Array | None = None

    def reset(self, episode: EpisodeStart) -> None:
        """Note the goal and forget the via point."""
        self._robot = episode.robot
        self._via = ViaPoints(episode.goal)
        self._blockage = Blockage(episode.robot)
        self._path = None

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Choose a target in the scan, and the best velocities towards it."""
        x, y, yaw = (float(value) for value in observation["odometry"])
        pose: Pose = (x, y, yaw)
        points = lidar_points(np.asarray(observation["lidar"], dtype=np.float64))
        nearest = float(np.hypot(points[:, 0], points[:, 1]).min(initial=math.inf))
        # Nearer to something than it likes to be, it keeps what distance it has.
        radius = min(self._options.radius, nearest - SHRINK)
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
        """Return the straight line to the point that it steers for; it may leave it to keep clear of things."""
        return self._path

    def _best(self, v: float, w: float, points: Array, target: Point, radius: float) -> tuple[float, float]:
        """Return the best admissible velocities; where there are none, those of the hardest brake."""
        options, robot = self._options, self._robot
        vs, ws = dynamic_window(v, w, options.samples, robot)
        # Standing still would otherwise always have the widest clearance.
        free = arc_clearance(np.maximum(vs, CREEP), ws, points, radius)
        admissible = vs <= stopping_speed(free, options.braking, robot.control_dt) + 1e-9
        if not admissible.any():
            return max(0.0, v - robot.acceleration * robot.control_dt), w
        heading = 1.0 - heading_error(vs, ws, target, options.horizon) / math.pi
        clearance = np.minimum(free, options.far) / options.far
        score = options.heading * heading + options.clearance * clearance + options.velocity * vs / robot.v_max
        best = int(np.argmax(np.where(admissible, score, -math.inf)))
        return float(vs[best]), float(ws[best])


def lidar_points(ranges: Array) -> Array:
    """Return the returns of a scan (180,) that hit something as points (n, 2) in the robot frame, metres."""
    hit = ranges < RANGE
    angles = -math.pi + 2.0 * math.pi / LIDAR_RAYS * np.flatnonzero(hit)
    return np.asarray(ranges[hit, None] * np.column_stack([np.cos(angles), np.sin(angles)]))


def dynamic_window(
    v: float, w: float, samples: tuple[int, int] = (7, 21), robot: RobotSpec = ROBOT
) -> tuple[Array, Array]:
    """Return the pairs (v, w) that can be had within one control step: V_d of the paper, forward drive only.

    The window is [v - a dt, v + a dt] x [w - b dt, w + b dt], cut to the robot's limits; standing still and driving
    straight are among the samples where the window holds them.

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
    """Return how far a disc goes along each arc before it touches a point: dist of the paper, in closed form.

    On an arc of radius rho = v / |w| about the centre c to the side, the disc's centre at the angle t from the start
    is at the distance of `radius` from p where cos(phi - t) = (rho^2 + q^2 - radius^2) / (2 rho q), with q = |p - c|
    and phi the angle of p about c from the start, in the sense of travel. A point that the disc touches already
    counts, at 0, where the motion leads towards it.

    Args:
        v: (n,) m/s, not negative. w: (n,) rad/s.
        points: (m, 2) in the robot frame, metres.
        radius: of the disc, metres.

    Returns:
        (n,) metres along the arc; inf where nothing is met within the full circle, and where v is 0.
    """
    found = np.full(len(v), math.inf)
    if len(points) == 0:
        return found
    x, y = points[:, 0], points[:, 1]
    touching = np.hypot(x, y) <= radius
    straight, moving = (np.abs(w) < 1e-6 * np.maximum(v, 1e-9)) & (v > 0.0), v > 0.0
    with np.errstate(invalid="ignore"):
        ahead = x - np.sqrt(radius**2 - y**2)
    line = np.where((np.abs(y) < radius) & (x > 0.0) & ~touching, ahead, math.inf)
    found[straight] = line.min()
    curved = moving & ~straight
    rho = (v[curved] / np.abs(w[curved]))[:, None]
    side = np.sign(w[curved])[:, None] * y
    q = np.hypot(x, side - rho)
    phi = np.arctan2(x, rho - side) % (2.0 * math.pi)
    cosine = (rho**2 + q**2 - radius**2) / np.maximum(2.0 * rho * q, 1e-12)
    with np.errstate(invalid="ignore"):
        angle = (phi - np.arccos(cosine)) % (2.0 * math.pi)
    found[curved] = np.where((np.abs(cosine) <= 1.0) & ~touching, rho * angle, math.inf).min(axis=1)
    if (touching & (x > 0.0)).any():
        found[moving] = 0.0
    return found


def stopping_speed(distance: Array, braking: float, delay: float) -> Array:
    """Return the largest admissible speed: V_a of the paper, v <= sqrt(2 dist b), with the control step's delay.

    The v that solves v delay + v^2 / (2 braking) = distance.

    Args:
        distance: (n,) to the obstacle, metres; inf allowed.
        horizon: time after which the heading is judged, seconds. The paper takes one step and a full brake, over which
            turn rates of one window hardly differ in heading, and clearance decides alone.
        braking: deceleration, m/s2.
        delay: time before it sets in, seconds.
    """
    return np.asarray(np.sqrt((braking * delay) ** 2 + 2.0 * braking * distance) - braking * delay)


def heading_error(v: Array, w: Array, target: Point, horizon: float) -> Array:
    """Return the angle to the target, in [0, pi], from where the robot is after some time on each arc.

    Args:
        v: (n,) m/s. w: (n,) rad/s.
        target: (x, y) in the robot frame, metres.
        horizon: the time, seconds.
    """
    turned = w * horizon
    chord = v * horizon * np.sinc(turned / (2.0 * math.pi))
    x, y = chord * np.cos(turned / 2.0), chord * np.sin(turned / 2.0)
    error = np.arctan2(target[1] - y, target[0] - x) - turned
    return np.asarray(np.abs((error + math.pi) % (2.0 * math.pi) - math.pi))
