"""Diffusion over trajectories: their steps, noise for training, denoising with guidance, and sampling."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from labgym.errors import optional_package
from labgym.geometry import Array, to_world
from labgym.navigation import Pose
from labgym.policies.distance_field import DistanceField
from labgym.policies.navdp.config import DiffusionOptions
from labgym.policies.navdp.network import Bytes, NavDPNetwork

GRADIENT_STEPS = 4
"""Gradient steps in one denoising step."""

SMOOTHING_POINTS = 4
"""A point's push moves its neighbors too, by shares that fall to 0 over this many points."""


@dataclass(frozen=True, eq=False)
class Guidance:
    """Descends the cost C = 1/2 sum_k max(0, margin - d(p_k))^2 over the points p_k of a trajectory.

    d is the distance to the nearest obstacle seen. The gradient with respect to the points is smoothed along the
    trajectory, which keeps its shape, and fades out towards the robot, whose place is given.

    Attributes:
        clearance: distances to the obstacles.
        pose: of the robot, in the frame of the clearance.
        margin: distance beyond which an obstacle costs nothing, meters.
        scale: of the steps (`DiffusionOptions.scale`).
        last: number of denoising steps, from the end, that are guided.
    """

    clearance: DistanceField
    pose: Pose
    margin: float
    scale: float
    last: int

    def guided(self, steps: Tensor) -> Tensor:
        """Return steps (n, points, 3) after some gradient steps, in [-1, 1]; the turns stay."""
        points = steps[..., :2].numpy().astype(np.float64).cumsum(axis=1) / self.scale
        smoothing = _smoothing(points.shape[1])
        for _ in range(GRADIENT_STEPS):
            points = points + smoothing @ self.push(points)
        moved = np.diff(points, axis=1, prepend=np.zeros((len(points), 1, 2))) * self.scale
        xy = torch.from_numpy(moved).to(steps.dtype).clamp(-1.0, 1.0)
        return torch.cat([xy, steps[..., 2:]], dim=2)

    def push(self, points: Array) -> Array:
        """Return the negative gradient of the cost at points (n, k, 2) of the robot frame, meters; same shape."""
        there = to_world(points.reshape(-1, 2), self.pose)
        distance, slope = self.clearance.with_gradient(there)
        push = np.maximum(self.margin - distance, 0.0)[:, None] * slope
        cosine, sine = np.cos(self.pose[2]), np.sin(self.pose[2])
        ahead, left = cosine * push[:, 0] + sine * push[:, 1], cosine * push[:, 1] - sine * push[:, 0]
        return np.stack([ahead, left], axis=-1).reshape(points.shape)


def _smoothing(count: int) -> Array:
    """Return the matrix (count, count) that smooths pushes along a trajectory, weaker near the robot."""
    apart = np.abs(np.arange(count)[:, None] - np.arange(count))
    kernel = np.maximum(1.0 - apart / SMOOTHING_POINTS, 0.0) / SMOOTHING_POINTS
    return np.asarray(np.minimum(np.arange(1, count + 1) / SMOOTHING_POINTS, 1.0)[:, None] * kernel)


MIRROR_STEP = torch.tensor([1.0, -1.0, -1.0])
"""Mirrors a step (dx, dy, dtheta): left becomes right."""


def steps_of(path: Tensor, scale: float) -> Tensor:
    """Return paths as steps (b, n - 1, 3), each in [-1, 1].

    The heading turns to the path's direction as fast as the bound allows.

    Args:
        path: (b, n, 2) from the origin, robot frame, meters.
        scale: meters and radians are multiplied by this.
    """
    moves = path[:, 1:] - path[:, :-1]
    headings = torch.atan2(moves[..., 1], moves[..., 0])
    heading = torch.zeros(len(path), dtype=path.dtype)
    turns = []
    for k in range(moves.shape[1]):
        error = torch.remainder(headings[:, k] - heading + math.pi, 2.0 * math.pi) - math.pi
        turn = error.clamp(-1.0 / scale, 1.0 / scale)
        turns.append(turn)
        heading = heading + turn
    steps = torch.cat([moves, torch.stack(turns, dim=1)[..., None]], dim=2)
    return (scale * steps).clamp(-1.0, 1.0)


def points_of(steps: Tensor, scale: float) -> Tensor:
    """Return the points (b, n, 2), meters, that steps (b, n, 3) lead through, without the origin."""
    return steps[..., :2].cumsum(dim=1) / scale


def first_part(path: Tensor, length: Tensor, horizon: float, count: int) -> Tensor:
    """Return the first meters of paths as `count` + 1 points at even distances, (b, count + 1, 2).

    Args:
        path: (b, n, 2) at even distances from the robot to the goal.
        length: (b,) of the paths, meters.
        horizon: where the part ends along the path, meters; at the goal if that is nearer.
        count: number of steps.
    """
    share = (horizon / length.clamp(min=1e-6)).clamp(max=1.0)
    place = share[:, None] * torch.linspace(0.0, 1.0, count + 1) * (path.shape[1] - 1)
    before = place.floor().long().clamp(max=path.shape[1] - 2)
    part = (place - before)[..., None]
    first = torch.gather(path, 1, before[..., None].expand(-1, -1, 2))
    second = torch.gather(path, 1, (before + 1)[..., None].expand(-1, -1, 2))
    return first + part * (second - first)


def make_schedule(options: DiffusionOptions) -> Any:
    """Return diffusers' DDPM scheduler with a squared-cosine schedule, noise prediction and clipped samples.

    Raises:
        MissingDependencyError: diffusers is not installed.
    """
    with optional_package("diffusers", "policy 'navdp'", "train"), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from diffusers.schedulers.scheduling_ddpm import DDPMScheduler
    return DDPMScheduler(
        num_train_timesteps=options.steps,
        beta_schedule="squaredcos_cap_v2",
        prediction_type="epsilon",
        clip_sample=True,
    )


def noised(schedule: Any, steps: Tensor, noise: Tensor, time: Tensor) -> Tensor:
    """Return steps (b, points, 3) mixed with noise of the same shape, at diffusion times (b,)."""
    mixed: Tensor = schedule.add_noise(steps, noise, time)
    return mixed


class Denoising(NamedTuple):
    """Coefficients of one denoising step (Ho et al. 2020, equations 6, 7 and 15).

    Attributes:
        time: index of the diffusion step.
        signal, noise: shares of the clean steps and of the noise in the noisy ones.
        clean, noisy: shares of the clean and of the noisy steps in the mean of the result.
        spread: standard deviation of the result, 0 for the last step.
    """

    time: int
    signal: float
    noise: float
    clean: float
    noisy: float
    spread: float


def denoising(schedule: Any) -> Iterator[Denoising]:
    """Yield the denoising steps of a schedule, the noisiest first.

    The square roots are Python's, which are exact to the last bit on every processor. diffusers' own step takes them
    by torch, whose square root approximates by instructions that differ between processors.
    """
    shares = [float(share) for share in schedule.alphas_cumprod]
    for time in range(len(shares) - 1, -1, -1):
        here, before = shares[time], shares[time - 1] if time else 1.0
        beta = 1.0 - here / before
        yield Denoising(
            time=time,
            signal=math.sqrt(here),
            noise=math.sqrt(1.0 - here),
            clean=math.sqrt(before) * beta / (1.0 - here),
            noisy=math.sqrt(here / before) * (1.0 - before) / (1.0 - here),
            spread=math.sqrt((1.0 - before) / (1.0 - here) * beta),
        )


@torch.inference_mode()
def sample_steps(
    network: NavDPNetwork,
    schedule: Any,
    tokens: Tensor,
    goal: Tensor | None,
    count: int,
    generator: torch.Generator,
    guidance: Guidance | None = None,
) -> Tensor:
    """Return trajectories drawn for one goal or for none, as steps (count, points, 3) in [-1, 1].

    Args:
        network: the denoiser.
        schedule: of `make_schedule`.
        tokens: (1, queries, width) of `NavDPNetwork.encode`.
        goal: (2,) float32 in the robot frame, meters; None hides the goal's tokens, as half of the training does.
        count: number of trajectories.
        generator: generator of the noise.
        guidance: changes the predicted clean steps of the last denoising steps; None changes nothing.
    """
    options = network.config
    tokens = tokens.expand(count, -1, -1)
    goals = (torch.zeros(2) if goal is None else goal).expand(count, -1)
    with_goal = torch.full((count,), goal is not None)
    steps = torch.randn(count, options.network.points, 3, generator=generator)
    for step in denoising(schedule):
        noise = network.noise(tokens, steps, torch.full((count,), step.time), goals, with_goal)
        clean = ((steps - step.noise * noise) / step.signal).clamp(-1.0, 1.0)
        if guidance is not None and step.time < guidance.last:
            clean = guidance.guided(clean)
        steps = step.clean * clean + step.noisy * steps
        if step.time > 0:
            steps = steps + step.spread * torch.randn(steps.shape, generator=generator)
    return steps


class DrawnTrajectories(NamedTuple):
    """Trajectories drawn at one place.

    Attributes:
        trajectories: (n, points, 2) in the robot frame, meters; all zeros for one that means "stop".
        values: (n,) of the critic.
    """

    trajectories: NDArray[np.float64]
    values: NDArray[np.float64]


class TrajectorySampler:
    """Draws trajectories by a trained network and values them.

    Args:
        network: of `load_navdp`.

    Raises:
        MissingDependencyError: diffusers is not installed.
    """

    def __init__(self, network: NavDPNetwork) -> None:
        self.network, self._schedule = network, make_schedule(network.config.diffusion)

    @torch.inference_mode()
    def draw(
        self,
        frames: Sequence[Bytes],
        goal: tuple[float, float] | None,
        count: int,
        shortest: float,
        generator: torch.Generator,
        guidance: Guidance | None = None,
    ) -> DrawnTrajectories:
        """Return trajectories with their values.

        Args:
            frames: as many as the network remembers, the oldest first.
            goal: (x, y) in the robot frame, meters; None draws trajectories to anywhere.
            count: number of trajectories.
            shortest: shorter ones mean "stop", meters.
            generator: of the noise.
            guidance: pushes trajectories away from obstacles; None leaves them as the network draws them.
        """
        tokens = self.network.encode(torch.from_numpy(np.stack(frames))[None])
        target = None if goal is None else torch.tensor(goal, dtype=torch.float32)
        steps = sample_steps(self.network, self._schedule, tokens, target, count, generator, guidance)
        points = points_of(steps, self.network.config.diffusion.scale)
        values = self.network.value(tokens.expand(len(steps), -1, -1), steps)
        points[points[:, -1].norm(dim=1) < shortest] = 0.0
        return DrawnTrajectories(points.numpy().astype(np.float64), values.numpy().astype(np.float64))
