"""Configuration of a NavDP-style network and its training: `config.json` next to its weights."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from labgym.documents import Document, Record
from labgym.policies.options import Count, NonNegative, Positive, TrainOptions

Size = Annotated[int, Field(ge=1, le=4096)]

GROUPS = 8
"""Groups of the encoder's group normalization."""


class NavDPNetworkOptions(Record):
    """Size of the network.

    Attributes:
        memory: number of frames that it sees, the last one the present.
        shrink: factor by which frames are smaller than the camera's images, 72 x 128.
        channels: channels of the encoder's stages, multiples of 8 (group normalization); each halves a frame.
        queries: learned tokens that the frames' tokens are condensed to.
        width, heads, layers: size of the decoder; `heads` divides `width`.
        points: steps of a trajectory.
    """

    memory: Size = 3
    shrink: Literal[1, 2, 4] = 2
    channels: Annotated[tuple[Size, ...], Field(min_length=3, max_length=4)] = (16, 40, 80)
    queries: Size = 16
    width: Size = 96
    heads: Size = 4
    layers: Annotated[int, Field(ge=1, le=64)] = 3
    points: Annotated[int, Field(ge=2, le=4096)] = 24

    @classmethod
    def for_frames(cls, memory: int, shrink: Literal[1, 2, 4]) -> NavDPNetworkOptions:
        """Return the options for a number and size of frames; full images get a stage more, for as many tokens."""
        first = (8,) if shrink == 1 else ()
        return cls(memory=memory, shrink=shrink, channels=(*first, *cls.model_fields["channels"].default))

    @model_validator(mode="after")
    def _check_divisible(self) -> Self:
        if self.width % self.heads:
            raise ValueError(f"width {self.width} is not a multiple of heads {self.heads}; choose heads that divide it")
        uneven = [channels for channels in self.channels if channels % GROUPS]
        if uneven:
            raise ValueError(f"channels {uneven[0]} is not a multiple of {GROUPS}, the groups of the normalization")
        return self


class DiffusionOptions(Record):
    """The noise schedule, as published: squared cosine, noise prediction, samples clipped to [-1, 1].

    Attributes:
        steps: of noising and of denoising.
        scale: a trajectory is the running sum of the denoised steps, divided by this.
    """

    steps: Annotated[int, Field(ge=2, le=1000)] = 10
    scale: Positive = 4.0


class NavDPLossOptions(Record):
    """Weights and labels of the loss.

    L = noise MSE (half of the batch with the goal, half without) + critic MSE (half on the label path, half on the same
    path rotated). The halves are drawn anew each time.

    Attributes:
        noise, critic: weights.
        horizon: a label path ends this far along the expert's, meters, or at the goal if that is nearer.
        margin: a point nearer to an obstacle than this is unsafe, meters: the planning radius.
        unsafe: value of a path all of whose points are unsafe.
        opening: value per meter by which a path's end is farther from obstacles than its start.
        rotation: label paths are rotated by up to this angle to either side, radians, to give paths of lower value.
    """

    noise: NonNegative = 0.8
    critic: NonNegative = 0.2
    horizon: Positive = 3.6
    margin: Positive = 0.30
    unsafe: float = -5.0
    opening: float = 0.5
    rotation: NonNegative = math.radians(60.0)


class NavDPTrainOptions(TrainOptions):
    """Training options. The rate rises over `warmup` steps, then falls along a cosine until the last step.

    Attributes:
        warmup: gradient steps.
        average: share of the previous value in the running average of the weights; the average is what is published.
    """

    epochs: Count = 12
    batch: Count = 64
    rate: Positive = 6e-4
    held_out: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.04
    warmup: Annotated[int, Field(ge=0)] = 200
    average: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.998


class NavDPConfig(Document):
    """`config.json` of a trained planner."""

    SCHEMA: ClassVar[str] = "labgym.navdp/1"

    network: NavDPNetworkOptions = NavDPNetworkOptions()
    diffusion: DiffusionOptions = DiffusionOptions()
    loss: NavDPLossOptions = NavDPLossOptions()
    training: NavDPTrainOptions = NavDPTrainOptions()
