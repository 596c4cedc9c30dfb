"""Drawing trajectories from frames, with the critic's values."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from labgym.policies.navdp.diffusion import sample_steps
from labgym.policies.navdp.frames import Bytes
from labgym.policies.navdp.guidance import Guidance
from labgym.policies.navdp.network import NavDPNetwork
from labgym.policies.navdp.trajectory import points_of


class DrawnTrajectories(NamedTuple):
    """Trajectories drawn at one place.

    Attributes:
        trajectories: (n, points, 2) in the robot frame, meters; all zeros for one that means "stop".
        values: (n,) of the critic.
    """

    trajectories: NDArray[np.float64]
    values: NDArray[np.float64]


@torch.inference_mode()
def draw_trajectories(
    network: NavDPNetwork,
    schedule: Any,
    frames: Sequence[Bytes],
    goal: tuple[float, float] | None,
    count: int,
    shortest: float,
    generator: torch.Generator,
    guidance: Guidance | None = None,
) -> DrawnTrajectories:
    """Draw trajectories and value them.

    Args:
        network, schedule: of `load_navdp` and `make_schedule`.
        frames: as many as the network remembers, the oldest first.
        goal: (x, y) in the robot frame, meters; None draws trajectories to anywhere.
        count: number of trajectories.
        shortest: shorter ones mean "stop", meters.
        generator: of the noise.
        guidance: pushes trajectories away from obstacles; None leaves them as the network draws them.
    """
    tokens = network.encode(torch.from_numpy(np.stack(frames))[None])
    target = None if goal is None else torch.tensor(goal, dtype=torch.float32)
    steps = sample_steps(network, schedule, tokens, target, count, generator, guidance)
    points = points_of(steps, network.config.diffusion.scale)
    values = network.value(tokens.expand(len(steps), -1, -1), steps)
    points[points[:, -1].norm(dim=1) < shortest] = 0.0
    return DrawnTrajectories(points.numpy().astype(np.float64), values.numpy().astype(np.float64))
