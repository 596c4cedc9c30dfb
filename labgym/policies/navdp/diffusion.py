"""Diffusion over trajectories: adding noise for training, denoising for planning."""

from __future__ import annotations

import warnings
from typing import Any

import torch
from torch import Tensor

from labgym.errors import MissingDependencyError
from labgym.policies.navdp.config import DiffusionOptions
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


@torch.inference_mode()
def sample_steps(
    network: NavDPNetwork, schedule: Any, tokens: Tensor, goal: Tensor, count: int, generator: torch.Generator
) -> Tensor:
    """Return trajectories drawn for one goal, as steps (count, points, 3) in [-1, 1].

    Args:
        network: the denoiser.
        schedule: of `make_schedule`.
        tokens: (1, queries, width) of `NavDPNetwork.encode`.
        goal: (2,) float32 in the robot frame, meters.
        count: number of trajectories.
        generator: generator of the noise.
    """
    options = network.config
    tokens = tokens.expand(count, -1, -1)
    goals, with_goal = goal.expand(count, -1), torch.ones(count, dtype=torch.bool)
    steps = torch.randn(count, options.network.points, 3, generator=generator)
    schedule.set_timesteps(options.diffusion.steps)
    for time in schedule.timesteps:
        noise = network.noise(tokens, steps, time.expand(count), goals, with_goal)
        steps = schedule.step(noise, time, steps, generator=generator).prev_sample
    return steps
