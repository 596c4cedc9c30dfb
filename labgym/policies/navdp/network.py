"""The network: from camera frames and a goal, the noise in a trajectory or the value of a trajectory."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from labgym.envs.sensors import IMAGE_SHAPE
from labgym.policies.learned.encoder import ImageStage, polar_goal
from labgym.policies.learned.weights import CONFIG, check_size, load_weights, save_weights
from labgym.policies.navdp.config import GROUPS, NavDPConfig

DEFAULT_SHRINK = 2
"""Default factor by which frames are smaller than the camera's images."""

NEAREST_DEPTH_M, FARTHEST_DEPTH_M = 0.1, 5.0
"""Range of valid depths, meters; nearer and farther ones become 0, as published."""

Bytes = NDArray[np.uint8]

GOAL_REACH_M = 10.0
"""Goal coordinates are clipped to this, meters."""

GOAL_SLOTS = 3
"""Tokens of the goal; with the token of the time they precede those of the frames."""


def frame_shape(shrink: int = DEFAULT_SHRINK) -> tuple[int, int]:
    """Return rows and columns of frames that are smaller than the camera's images by a factor."""
    return IMAGE_SHAPE[0] // shrink, IMAGE_SHAPE[1] // shrink


def frame(rgb: Bytes, depth: NDArray[np.floating], shrink: int = DEFAULT_SHRINK) -> Bytes:
    """Return a frame (h, w, 4): red, green, blue, and depth in steps of 2 cm, 0 for none.

    Args:
        rgb: (72, 128, 3). depth: (72, 128), planar, meters. shrink: factor of `frame_shape`.
    """
    size = frame_shape(shrink)[::-1]
    color = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
    distance = cv2.resize(np.asarray(depth, dtype=np.float32), size, interpolation=cv2.INTER_AREA)
    valid = (distance >= NEAREST_DEPTH_M) & (distance <= FARTHEST_DEPTH_M)
    coded = np.where(valid, np.rint(distance / FARTHEST_DEPTH_M * 255.0), 0.0).astype(np.uint8)
    return np.dstack([color, coded])


class NavDPNetwork(nn.Module):
    """A convolutional encoder of the frames and one decoder with two heads.

    The decoder reads a trajectory's steps and attends to [time, goal, goal, goal, frames]. As a denoiser it is causal.
    As a critic it sees the whole trajectory, but neither time nor goal.
    """

    causal: Tensor

    def __init__(self, config: NavDPConfig) -> None:
        super().__init__()
        options, self.config = config.network, config
        width = options.width
        self.stages = nn.Sequential(
            *(ImageStage(a, b, nn.GroupNorm(GROUPS, b)) for a, b in pairwise((4, *options.channels)))
        )
        rows, columns = (-(-side // 2 ** len(options.channels)) for side in frame_shape(options.shrink))
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
        """Return the frames as tokens (b, queries, width).

        Args:
            frames: (b, memory, h, w, 4) uint8 of `frame_shape`, the oldest first.
        """
        batch, memory = frames.shape[:2]
        images = frames.flatten(0, 1).permute(0, 3, 1, 2).float() / 255.0 - 0.5
        features = self.image(self.stages(images).flatten(2).transpose(1, 2)).unflatten(0, (batch, memory))
        tokens = (features + self.image_place).flatten(1, 2)
        condensed: Tensor = self.condense(self.queries.expand(batch, -1, -1), tokens)
        return condensed

    def noise(self, tokens: Tensor, noisy: Tensor, time: Tensor, goal: Tensor, with_goal: Tensor) -> Tensor:
        """Return the noise in steps, (b, points, 3).

        Args:
            tokens: (b, queries, width) of `encode`.
            noisy: (b, points, 3) steps with noise.
            time: (b,) index of the diffusion step.
            goal: (b, 2) in the robot frame, meters.
            with_goal: (b,) whether the network sees the goal.
        """
        hidden = torch.zeros(len(noisy), 1 + GOAL_SLOTS + tokens.shape[1], dtype=torch.bool)
        hidden[:, 1 : 1 + GOAL_SLOTS] = ~with_goal[:, None]
        goals = self.goal(polar_goal(goal.clamp(-GOAL_REACH_M, GOAL_REACH_M), GOAL_REACH_M))[:, None] + self.goal_slot
        memory = torch.cat([self.time(time)[:, None], goals, tokens], dim=1)
        read = self.decoder(self.step(noisy) + self.step_place, memory, self.causal, memory_key_padding_mask=hidden)
        noise: Tensor = self.noise_head(read)
        return noise

    def value(self, tokens: Tensor, steps: Tensor) -> Tensor:
        """Return the critic's values (b,) of trajectories.

        Args:
            tokens: (b, queries, width) of `encode`.
            steps: (b, points, 3).
        """
        read = self.decoder(self.step(steps) + self.step_place, tokens)
        values: Tensor = self.value_head(read.mean(dim=1))[:, 0]
        return values


def save_navdp(folder: str | Path, network: NavDPNetwork, config: NavDPConfig) -> None:
    """Write `config.json` and `weights.safetensors`."""
    config.save(Path(folder) / CONFIG)
    save_weights(network, folder)


def load_navdp(folder: str | Path) -> NavDPNetwork:
    """Return a trained network in evaluation mode.

    Raises:
        DocumentError: a file is missing or broken, or the weights belong to another network than the configuration.
    """
    path = Path(folder) / CONFIG
    config = NavDPConfig.load(path)
    check_size(lambda: NavDPNetwork(config), path)
    return load_weights(NavDPNetwork(config), folder)


def _decoder(width: int, heads: int, layers: int) -> nn.TransformerDecoder:
    layer = nn.TransformerDecoderLayer(width, heads, 4 * width, dropout=0.0, batch_first=True, norm_first=True)
    return nn.TransformerDecoder(layer, layers)
