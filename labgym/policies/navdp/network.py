"""The network: frames and a goal in; out, the noise in a trajectory, or what a trajectory is worth."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import torch
from safetensors.torch import load_file, save_file
from torch import Tensor, nn

from labgym.errors import DocumentError
from labgym.policies.navdp.config import NavDPConfig
from labgym.policies.navdp.frames import SHAPE

GOAL_REACH = 10.0
"""Goal coordinates are clipped to this, metres."""

GOAL_SLOTS = 3
"""Tokens that the goal is given in; with the time's they come before those of the frames."""

CONFIG, WEIGHTS = "config.json", "weights.safetensors"


class NavDPNetwork(nn.Module):
    """A convolutional encoder of the frames and one decoder with two heads.

    The decoder reads a trajectory's steps and attends to [time, goal, goal, goal, frames]. As denoiser it is causal;
    as critic it sees the whole trajectory, but neither time nor goal.
    """

    causal: Tensor

    def __init__(self, config: NavDPConfig) -> None:
        super().__init__()
        options, self.config = config.network, config
        width = options.width
        self.stages = nn.Sequential(*(_Stage(a, b) for a, b in pairwise((4, *options.channels))))
        rows, columns = (-(-side // 2 ** len(options.channels)) for side in SHAPE)
        self.image = nn.Linear(options.channels[-1], width)
        self.image_place = nn.Parameter(0.02 * torch.randn(options.memory, rows * columns, width))
        self.queries = nn.Parameter(0.02 * torch.randn(options.queries, width))
        self.condense = _decoder(width, options.heads, 1)
        self.goal = nn.Sequential(nn.Linear(3, width), nn.GELU(), nn.Linear(width, width))
        self.goal_slot = nn.Parameter(0.02 * torch.randn(GOAL_SLOTS, width))
        self.time = nn.Embedding(config.diffusion.steps, width)
        self.step = nn.Linear(3, width)
        self.step_place = nn.Parameter(0.02 * torch.randn(options.points, width))
        self.decoder = _decoder(width, options.heads, options.layers)
        self.noise_head = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, 3))
        self.value_head = nn.Sequential(nn.LayerNorm(width), nn.Linear(width, 1))
        causal = torch.ones(options.points, options.points, dtype=torch.bool).triu(1)
        self.register_buffer("causal", causal, persistent=False)

    def encode(self, frames: Tensor) -> Tensor:
        """Return what is seen as tokens (b, queries, width).

        Args:
            frames: (b, memory, 36, 64, 4) uint8, the oldest first.
        """
        batch, memory = frames.shape[:2]
        images = frames.flatten(0, 1).permute(0, 3, 1, 2).float() / 255.0 - 0.5
        features = self.image(self.stages(images).flatten(2).transpose(1, 2)).unflatten(0, (batch, memory))
        tokens = (features + self.image_place).flatten(1, 2)
        found: Tensor = self.condense(self.queries.expand(batch, -1, -1), tokens)
        return found

    def noise(self, seen: Tensor, noisy: Tensor, time: Tensor, goal: Tensor, goal_known: Tensor) -> Tensor:
        """Return the noise in steps, (b, points, 3).

        Args:
            seen: (b, queries, width) of `encode`. noisy: (b, points, 3). time: (b,) index of the diffusion step.
            goal: (b, 2) in the robot frame, metres. goal_known: (b,) whether the network may see it.
        """
        hidden = torch.zeros(len(noisy), 1 + GOAL_SLOTS + seen.shape[1], dtype=torch.bool)
        hidden[:, 1 : 1 + GOAL_SLOTS] = ~goal_known[:, None]
        goals = self.goal(_polar(goal))[:, None] + self.goal_slot
        memory = torch.cat([self.time(time)[:, None], goals, seen], dim=1)
        read = self.decoder(self.step(noisy) + self.step_place, memory, self.causal, memory_key_padding_mask=hidden)
        found: Tensor = self.noise_head(read)
        return found

    def value(self, seen: Tensor, steps: Tensor) -> Tensor:
        """Return what steps (b, points, 3) are worth in what is seen (b, queries, width): (b,)."""
        read = self.decoder(self.step(steps) + self.step_place, seen)
        found: Tensor = self.value_head(read.mean(dim=1))[:, 0]
        return found


class _Stage(nn.Module):
    """Halve the image, then one residual block."""

    def __init__(self, here: int, there: int) -> None:
        super().__init__()
        self.down = nn.Conv2d(here, there, 3, stride=2, padding=1)
        self.norm = nn.GroupNorm(8, there)
        self.first = nn.Conv2d(there, there, 3, padding=1)
        self.second = nn.Conv2d(there, there, 3, padding=1)

    def forward(self, features: Tensor) -> Tensor:
        down = torch.relu(self.norm(self.down(features)))
        return torch.relu(down + self.second(torch.relu(self.first(down))))


def save_navdp(folder: str | Path, network: NavDPNetwork, config: NavDPConfig) -> None:
    """Write `config.json` and `weights.safetensors`."""
    folder = Path(folder)
    config.save(folder / CONFIG)
    save_file({name: value.contiguous() for name, value in network.state_dict().items()}, folder / WEIGHTS)


def load_navdp(folder: str | Path) -> NavDPNetwork:
    """Return a trained network, ready to plan.

    Raises:
        DocumentError: a file is missing or broken, or the weights are of another network than the configuration's.
    """
    folder = Path(folder)
    network = NavDPNetwork(NavDPConfig.load(folder / CONFIG))
    try:
        network.load_state_dict(load_file(folder / WEIGHTS))
    except Exception as error:  # noqa: BLE001 - safetensors and torch each raise types of their own
        raise DocumentError(folder / WEIGHTS, "", " ".join(str(error).split())[:300]) from None
    return network.eval()


def _decoder(width: int, heads: int, layers: int) -> nn.TransformerDecoder:
    layer = nn.TransformerDecoderLayer(width, heads, 4 * width, dropout=0.0, batch_first=True, norm_first=True)
    return nn.TransformerDecoder(layer, layers)


def _polar(goal: Tensor) -> Tensor:
    """Return distance in tens of metres, cosine and sine of the bearing, (b, 3)."""
    clipped = goal.clamp(-GOAL_REACH, GOAL_REACH)
    distance = clipped.norm(dim=1, keepdim=True)
    return torch.cat([distance / GOAL_REACH, clipped / distance.clamp(min=1e-6)], dim=1)
