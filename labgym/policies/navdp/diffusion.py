"""Diffusion over trajectories: adding noise for training, denoising for planning."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

import torch
from torch import Tensor

from labgym.errors import MissingDependencyError
from labgym.policies.navdp.config import DiffusionOptions
from labgym.policies.navdp.guidance import Guidance
from labgym.policies.navdp.network import NavDPNetwork


def make_schedule(options: DiffusionOptions) -> Any:
    """Return diffusers' DDPM scheduler with a squared-cosine schedule, noise prediction and clipped samples.

    Raises:
        MissingDependencyError: diffusers is not installed.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            from diffusers.schedulers.scheduling_ddpm import DDPMScheduler
    except ImportError:
        raise MissingDependencyError("diffusers", "policy 'navdp'", "train") from None
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
