"""What an iPlanner-style network is made of and how it was trained: `config.json` beside its weights."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from labgym.documents import Document, Record

Positive = Annotated[float, Field(gt=0.0)]
Weight = Annotated[float, Field(ge=0.0)]


class NetworkOptions(Record):
    """The network's size.

    Attributes:
        channels: of the encoder's stages; each halves the image and has one residual block.
        goal_width: channels that the goal is spread over.
        key_points: points that it chooses on the path.
        path_points: points of the cubic path through the robot and the key points.
    """

    channels: Annotated[tuple[int, ...], Field(min_length=2, max_length=5)] = (16, 32, 64)
    goal_width: Annotated[int, Field(ge=1)] = 16
    key_points: Annotated[int, Field(ge=2)] = 5
    path_points: Annotated[int, Field(ge=3)] = 51


class LossOptions(Record):
    """Weights and thresholds of the loss: the published terms and weights; the last three options differ.

    L = obstacle O + motion M + goal G + fear BCE: O the sum of the cost map along the path, M the sum of what its steps
    differ in length from even ones, G = log(1 + how far its end is from where it is to end). The published height term
    is zero on a flat floor and left out.

    Attributes:
        obstacle, motion, goal, fear: weights.
        fear_length: fear is true where the highest cost over the path's first so many metres exceeds `fear_cost`.
        fear_cost: 1.0 is what our cost map holds 0.30 m from an obstacle: the robot's planning disc touches. The
            published 0.5, of another map, lies 0.39 m away here, where paths through laboratories often have to go.
        along: even steps are as long as the way to the path's end needs; with False as the straight line there needs,
            as published, which is a pull to cut corners.
        horizon: the path is to end at the place this far along the expert path, metres, or at the goal where that is
            nearer. With None it is to end at the goal itself, as published: behind furniture the goal then pulls
            the path against it.
    """

    obstacle: Weight = 0.5
    motion: Weight = 2.0
    goal: Weight = 5.0
    fear: Weight = 1.0
    fear_length: Positive = 2.0
    fear_cost: Positive = 1.0
    along: bool = True
    horizon: Positive | None = 3.5


class TrainOptions(Record):
    """How a network is trained.

    Attributes:
        epochs: passes over the training samples.
        batch: samples in a step.
        rate, decay: of AdamW.
        plateau: the rate is multiplied by this when the held-out loss has not fallen for `patience` epochs.
        held_out: share of the layouts, the last ones, that steers the rate and is not trained on.
        samples: how many samples of the dataset to use; None takes all.
        threads: of torch; sums, and so the weights' last bits, depend on it.
        seed: of the initial weights, the order of samples and the mirroring.
    """

    epochs: Annotated[int, Field(ge=1)] = 20
    batch: Annotated[int, Field(ge=1)] = 32
    rate: Positive = 1e-3
    decay: Weight = 1e-3
    plateau: Annotated[float, Field(gt=0.0, le=1.0)] = 0.3
    patience: Annotated[int, Field(ge=0)] = 1
    held_out: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.05
    samples: Annotated[int, Field(ge=1)] | None = None
    threads: Annotated[int, Field(ge=1)] = 1
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 0


class PlannerConfig(Document):
    """`config.json` of a trained planner."""

    SCHEMA: ClassVar[str] = "labgym.iplanner/1"

    network: NetworkOptions = NetworkOptions()
    loss: LossOptions = LossOptions()
    training: TrainOptions = TrainOptions()
