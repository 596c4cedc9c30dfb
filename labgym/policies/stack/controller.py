"""The local controller: model predictive path integral control over sampled velocities."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.geometry import Array, wrap_angle
from labgym.navigation import Pose
from labgym.policies.stack.costmap import Costmap
from labgym.policies.stack.people import TrackedPerson, approach_cost, way_cost
from labgym.policies.stack.planner import PlannedPath

PATH_AHEAD_M = 3.0
"""Length of the path by which sequences are judged, meters."""
LINE_CLEARANCE_M, LINE_START_M = 0.24, 0.3
"""Clearance of a straight line that the robot can drive, and distance from the robot within which it does not count,
meters."""
LINE_SAMPLES, FIRST_PATH_POINTS = 16, 8
"""Points of that line that are looked up, and the number of points of the path that are always used."""


@dataclass(frozen=True)
class ControllerOptions:
    """Options of `Controller`.

    Attributes:
        samples: number of random sequences in addition to the fixed arcs.
        horizon: control steps that a sequence covers.
        knots: points between which the noise of a sequence is interpolated, so that it is smooth.
        spread: standard deviations of the noise, m/s and rad/s.
        temperature: of the weights of the sequences, in units of cost.
        contact: clearance below which a sequence touches something, meters.
        tight: clearance below which driving costs steeply more. comfort: clearance beyond which more has no benefit.
        progress: cost per meter of path that is left at the end. detour: cost per meter away from the path, as a
            multiple of it.
    """

    samples: int = 160
    horizon: int = 18
    knots: int = 5
    spread: tuple[float, float] = (0.25, 0.6)
    temperature: float = 0.5
    contact: float = 0.272
    tight: float = 0.30
    comfort: float = 0.45
    progress: float = 10.0
    detour: float = 1.5


@dataclass(frozen=True)
class MotionLimits:
    """Limits of the commands.

    Attributes:
        acceleration, braking: along the way, m/s2. turn_acceleration: rad/s2. lateral: of v w, m/s2.
        speed, reverse: greatest velocities forward and backward, m/s.
    """

    acceleration: float = 1.0
    braking: float = 1.4
    turn_acceleration: float = 3.0
    lateral: float = 1.0
    speed: float = ROBOT.v_max
    reverse: float = -ROBOT.v_min


@dataclass(frozen=True)
class Shaping:
    """A filter of forward velocities: each that is driven is a mean of the latest ones.

    Attributes:
        weights: of the latest velocities, newest first. history: as many velocities before the sequences, oldest first,
            m/s.
    """

    weights: tuple[float, ...]
    history: tuple[float, ...]

    def driven(self, sequences: Array) -> Array:
        """Return the velocities (n, steps, 2) that are driven for sequences of them."""
        count, steps = sequences.shape[:2]
        before = np.broadcast_to(np.array(self.history), (count, len(self.history)))
        speeds = np.concatenate([before, sequences[..., 0]], axis=1)
        first = len(self.history)
        means = sum(weight * speeds[:, first - age : first - age + steps] for age, weight in enumerate(self.weights))
        return np.stack([np.asarray(means), sequences[..., 1]], axis=-1)


class Controller:
    """Chooses the velocities of the next control step.

    Each step simulates sequences of velocities within the limits: arcs, braking, and the last plan with smooth noise
    (G. Williams, A. Aldrich and E. A. Theodorou, Journal of Guidance, Control, and Dynamics 40(2), 2017). A sequence is
    judged by the length of path left at its end, its clearance, people at their predicted places, and its changes. The
    next plan is the mean of all, weighted by exp(-cost / temperature), or the best sequence if that mean is worse.

    Args:
        rng: draws the noise. limits: of the commands. robot: its limits. options: of the controller.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        limits: MotionLimits | None = None,
        robot: RobotSpec = ROBOT,
        options: ControllerOptions | None = None,
    ) -> None:
        self._rng, self._robot = rng, robot
        self.limits, self._options = limits or MotionLimits(), options or ControllerOptions()
        self._last: Array = np.zeros((self._options.horizon, 2))
        times = np.linspace(0.0, 1.0, self._options.horizon)
        knots = np.linspace(0.0, 1.0, self._options.knots)
        self._basis: Array = np.array([np.interp(times, knots, row) for row in np.eye(self._options.knots)]).T

    def restart(self) -> None:
        """Forget the last plan: the robot stands."""
        self._last[:] = 0.0

    @property
    def fastest_soon(self) -> float:
        """Greatest speed in the first half of the last plan, m/s."""
        return float(np.abs(self._last[: self._options.horizon // 2, 0]).max())

    def command(
        self,
        pose: Pose,
        velocity: tuple[float, float],
        plan: PlannedPath,
        costmap: Costmap,
        people: tuple[TrackedPerson, ...] = (),
        speed: float = math.inf,
        shaping: Shaping | None = None,
    ) -> tuple[float, float]:
        """Return the velocities to command, m/s and rad/s.

        Args:
            pose: of the robot in the map's frame when the command takes effect.
            velocity: its velocities then.
            plan: the path. costmap: clearance. people: those to keep away from.
            speed: limit of the forward velocity in addition to `limits`, m/s.
            shaping: the filter that forward velocities pass before they are driven.
        """
        start = velocity if shaping is None else (shaping.history[-1], velocity[1])
        sequences = self._sequences(start, min(speed, self.limits.speed))
        ahead = visible(plan, pose, costmap)
        cost = self._cost(pose, velocity, sequences, ahead, costmap, people, shaping)
        weight = np.exp(-(cost - cost.min()) / self._options.temperature)
        mean = np.tensordot(weight / weight.sum(), sequences, axes=1)
        best = sequences[int(np.argmin(cost))]
        mean_cost = self._cost(pose, velocity, mean[None], ahead, costmap, people, shaping)[0]
        self._last = mean if mean_cost <= cost.min() + 0.5 * self._options.temperature else best.copy()
        return float(self._last[0, 0]), float(self._last[0, 1])

    def _sequences(self, velocity: tuple[float, float], fastest: float) -> Array:
        """Return the sequences of velocities within the limits, (n, horizon, 2)."""
        options, robot = self._options, self._robot
        before = np.concatenate([self._last[1:], self._last[-1:]])
        knots = self._rng.standard_normal((options.samples, options.knots, 2)) * np.array(options.spread)
        noisy = before + np.einsum("tk,nkd->ntd", self._basis, knots)
        speeds = np.array([0.15, 0.35, 0.6, 0.8, 1.0]) * min(fastest, robot.v_max)
        rates = robot.w_max * np.array([-0.9, -0.6, -0.35, -0.15, 0.0, 0.15, 0.35, 0.6, 0.9])
        arcs = np.stack(np.meshgrid(speeds, rates, indexing="ij"), axis=-1).reshape(-1, 2)
        spins = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, -1.0], [-0.15, 0.0], [-0.3, 0.0], [-0.3, 0.5], [-0.3, -0.5]])
        steady = np.repeat(np.concatenate([arcs, spins])[:, None, :], options.horizon, axis=1)
        commands = np.concatenate([before[None], steady, noisy])
        commands[..., 0] = np.clip(
            commands[..., 0], -min(self.limits.reverse, fastest), max(min(fastest, robot.v_max), 0.0)
        )
        commands[..., 1] = np.clip(commands[..., 1], -robot.w_max, robot.w_max)
        return limited(commands, velocity, self.limits, robot.control_dt)

    def _cost(
        self,
        pose: Pose,
        velocity: tuple[float, float],
        sequences: Array,
        path: tuple[Array, Array],
        costmap: Costmap,
        people: tuple[TrackedPerson, ...],
        shaping: Shaping | None,
    ) -> Array:
        """Return the costs of sequences, (n,)."""
        options, dt = self._options, self._robot.control_dt
        poses = rollouts(pose, velocity, sequences if shaping is None else shaping.driven(sequences), dt)
        count, steps = sequences.shape[:2]
        clearance = costmap.clearance(poses[..., :2].reshape(-1, 2)).reshape(count, steps)
        moving = np.abs(sequences[..., 0]) > 0.02
        lack = np.minimum(np.maximum((options.comfort - clearance) / (options.comfort - options.tight), 0.0), 2.0)
        steep = np.minimum(np.maximum((options.tight - clearance) / (options.tight - options.contact), 0.0), 1.0)
        here = float(clearance[:, 0].max(initial=0.0))
        touching = moving & (clearance < min(options.contact, here - 0.005))
        soonest = np.where(touching.any(axis=1), steps - np.argmax(touching, axis=1), 0)
        cost = (np.abs(sequences[..., 0]) * (0.6 * lack**2 + 3.0 * steep)).sum(axis=1) * dt
        cost += np.where(soonest > 0, 300.0 + 10.0 * soonest, 0.0)
        ahead, left = path
        end = poses[:, -1]
        away = np.hypot(end[:, None, 0] - ahead[:, 0], end[:, None, 1] - ahead[:, 1])
        total = left[None] + options.detour * away
        nearest = np.argmin(total, axis=1)
        cost += options.progress * total[np.arange(count), nearest]
        step = ahead[np.minimum(nearest + 1, len(ahead) - 1)] - ahead[np.maximum(nearest - 1, 0)]
        error = np.arctan2(step[:, 1], step[:, 0]) - end[:, 2]
        cost += 0.8 * (1.0 - np.cos(error)) * (left[nearest] > 0.1)
        start = velocity if shaping is None else (shaping.history[-1], velocity[1])
        changes = np.diff(sequences, axis=1, prepend=np.broadcast_to(np.array(start), (count, 1, 2)))
        cost += 2.0 * (changes[..., 0] ** 2).sum(axis=1) + 0.3 * (changes[..., 1] ** 2).sum(axis=1)
        slip = np.abs(sequences[..., 0] * sequences[..., 1]) - self.limits.lateral
        cost += 30.0 * np.maximum(slip, 0.0).sum(axis=1)
        cost += approach_cost(people, pose[:2], poses[..., :2], moving, dt)
        return np.asarray(cost + way_cost(people, end[:, :2]))


def limited(commands: Array, velocity: tuple[float, float], limits: MotionLimits, dt: float) -> Array:
    """Return sequences (n, steps, 2) whose velocities change within the accelerations, beginning at `velocity`."""
    step = np.array([limits.acceleration, limits.turn_acceleration]) * dt
    slower = np.array([limits.braking, limits.turn_acceleration]) * dt
    last = np.broadcast_to(np.array(velocity), commands[:, 0].shape)
    driven = np.empty_like(commands)
    for k in range(commands.shape[1]):
        # Backwards it speeds up by what braking allows: nothing is gained by a third limit.
        last = np.minimum(np.maximum(commands[:, k], last - slower), last + step)
        driven[:, k] = last
    return driven


def rollouts(pose: Pose, velocity: tuple[float, float], sequences: Array, dt: float) -> Array:
    """Return the poses (n, steps, 3) after each step of sequences of velocities (n, steps, 2)."""
    previous = np.concatenate([np.broadcast_to(np.array(velocity), (len(sequences), 1, 2)), sequences[:, :-1]], axis=1)
    # A servo reaches its new velocity within the first part of the step.
    v, w = (0.3 * previous[..., axis] + 0.7 * sequences[..., axis] for axis in range(2))
    yaw = pose[2] + np.cumsum(w, axis=1) * dt
    middle = yaw - 0.5 * w * dt
    x = pose[0] + np.cumsum(v * np.cos(middle), axis=1) * dt
    y = pose[1] + np.cumsum(v * np.sin(middle), axis=1) * dt
    return np.stack([x, y, yaw], axis=-1)


def visible(plan: PlannedPath, pose: Pose, costmap: Costmap) -> tuple[Array, Array]:
    """Return the points of the path ahead that a straight line leads to, (m, 2), and the length left after each, (m,).

    A path around an obstacle comes back to the robot's side of it: beyond what is visible, nearness to the path would
    draw the robot against the obstacle.
    """
    points, left = plan.ahead(PATH_AHEAD_M)
    start = np.array(pose[:2])
    share = np.linspace(0.0, 1.0, LINE_SAMPLES)
    samples = start + share[None, :, None] * (points[:, None] - start)
    clear = costmap.clearance(samples.reshape(-1, 2)).reshape(samples.shape[:2]) > LINE_CLEARANCE_M
    clear |= np.hypot(samples[..., 0] - start[0], samples[..., 1] - start[1]) < LINE_START_M
    hidden = np.asarray(~clear.all(axis=1))
    hidden[:FIRST_PATH_POINTS] = False
    count = int(np.argmax(hidden)) if hidden.any() else len(points)
    return points[:count], left[:count]


def bearing_of(plan: PlannedPath, pose: Pose, ahead: float = 0.5) -> float:
    """Return the bearing of the point of the path that is some meters ahead, radians."""
    points, _ = plan.ahead(ahead + 0.05)
    x, y = points[-1] - np.array(pose[:2])
    return wrap_angle(math.atan2(float(y), float(x)) - pose[2])
