"""What a NavDP-style network is made of and how it was trained: `config.json` beside its weights."""

from __future__ import annotations

import math
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.documents import Document, Record

Positive = Annotated[float, Field(gt=0.0)]
Weight = Annotated[float, Field(ge=0.0)]
Count = Annotated[int, Field(ge=1)]


class NetworkOptions(Record):
    """The network's size.

    Attributes:
        memory: frames that it sees, the last one the present. channels: of the encoder's stages, each of which halves a
            frame. queries: learned tokens that the frames' tokens are condensed to.
        width, heads, layers: of the decoder.
        points: steps of a trajectory.
    """

    memory: Count = 3
    channels: Annotated[tuple[Count, ...], Field(min_length=3, max_length=4)] = (16, 40, 80)
    queries: Count = 16
    width: Count = 96
    heads: Count = 4
    layers: Count = 3
    points: Annotated[int, Field(ge=2)] = 24


class DiffusionOptions(Record):
    """The noise schedule, as published: squared cosine, the noise is predicted, samples are clipped to [-1, 1].

    Attributes:
        steps: of noising and of denoising.
        scale: the trajectory is the running sum of what is denoised, divided by this.
    """

    steps: Annotated[int, Field(ge=2, le=1000)] = 10
    scale: Positive = 4.0


class LossOptions(Record):
    """Weights and labels of the loss.

    L = noise (half with the goal, half without) MSE + critic (on the label path + on the same path turned) MSE. Each
    sample is used for one of each pair, drawn anew every time.

    Attributes:
        noise, critic: weights.
        horizon: a label path ends this far along the expert's, metres, or at the goal where that is nearer.
        margin: a point nearer to an obstacle than this is unsafe, metres: the planning radius.
        unsafe: value of a path all of whose points are unsafe. opening: value of each metre by which a path's end is
            farther from obstacles than its start.
        rotation: label paths are turned by up to this angle to either side, radians, for paths of less value.
    """

    noise: Weight = 0.8
    critic: Weight = 0.2
    horizon: Positive = 3.6
    margin: Positive = 0.30
    unsafe: float = -5.0
    opening: float = 0.5
    rotation: Weight = math.radians(60.0)


class TrainOptions(Record):
    """How a network is trained.

    Attributes:
        epochs: passes over the training samples.
        batch: samples in a step.
        rate, decay: of AdamW; the rate rises over `warmup` steps and falls along a cosine to the last one.
        average: share of the old in the running average of the weights, which is what is published.
        held_out: share of the layouts, the last ones, that is not trained on.
        samples: how many samples of the dataset to use; None takes all.
        threads: of torch; sums, and so the weights' last bits, depend on it.
        seed: of the initial weights, the order of samples, the mirroring and the noise.
    """

    epochs: Count = 12
    batch: Count = 64
    rate: Positive = 6e-4
    decay: Weight = 1e-3
    warmup: Annotated[int, Field(ge=0)] = 200
    average: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.998
    held_out: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.04
    samples: Count | None = None
    threads: Count = 1
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 0


class NavDPConfig(Document):
    """`config.json` of a trained planner."""

    SCHEMA: ClassVar[str] = "labgym.navdp/1"

    network: NetworkOptions = NetworkOptions()
    diffusion: DiffusionOptions = DiffusionOptions()
    loss: LossOptions = LossOptions()
    training: TrainOptions = TrainOptions()
