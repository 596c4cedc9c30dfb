"""The diffusion over trajectories: noise added for training, and denoised for planning."""

from __future__ import annotations

import warnings
from typing import Any

import torch
from torch import Tensor

from labgym.errors import MissingDependencyError
from labgym.policies.navdp.config import DiffusionOptions
from labgym.policies.navdp.network import NavDPNetwork


def make_schedule(options: DiffusionOptions) -> Any:
    """Return diffusers' DDPM scheduler: squared-cosine schedule, noise predicted, samples clipped.

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
    """Return steps (b, points, 3) with noise of the same shape mixed in, as much as at diffusion times (b,)."""
    mixed: Tensor = schedule.add_noise(steps, noise, time)
    return mixed


@torch.inference_mode()
def sampled(
    network: NavDPNetwork, schedule: Any, seen: Tensor, goal: Tensor, count: int, generator: torch.Generator
) -> Tensor:
    """Return trajectories drawn for one goal, as steps (count, points, 3) in [-1, 1].

    Args:
        seen: (1, queries, width) of `NavDPNetwork.encode`. goal: (2,) in the robot frame, metres.
    """
    options = network.config
    every = seen.expand(count, -1, -1)
    goals, known = goal.expand(count, -1), torch.ones(count, dtype=torch.bool)
    steps = torch.randn(count, options.network.points, 3, generator=generator)
    schedule.set_timesteps(options.diffusion.steps)
    for time in schedule.timesteps:
        noise = network.noise(every, steps, time.expand(count), goals, known)
        steps = schedule.step(noise, time, steps, generator=generator).prev_sample
    return steps
