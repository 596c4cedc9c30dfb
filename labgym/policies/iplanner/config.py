"""Configuration of an iPlanner-style network and its training: `config.json` next to its weights."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field

from labgym.documents import Document, Record
from labgym.policies.options import Count, NonNegative, Positive, TrainOptions

Size = Annotated[int, Field(ge=1, le=4096)]
Target = Literal["cost-to-go", "expert", "goal"]


class IPlannerNetworkOptions(Record):
    """Size of the network.

    Attributes:
        channels: channels of the encoder's stages; each stage halves the image and has one residual block.
        goal_width: channels that the goal is spread over.
        key_points: points that the network predicts.
        path_points: points of the cubic path through the robot and the key points.
    """

    channels: Annotated[tuple[Size, ...], Field(min_length=2, max_length=5)] = (16, 32, 64)
    goal_width: Size = 16
    key_points: Annotated[int, Field(ge=2, le=4096)] = 5
    path_points: Annotated[int, Field(ge=3, le=4096)] = 51


class IPlannerLossOptions(Record):
    """Weights of the loss: the published terms and weights, without fear; `target`, `along` and `horizon` are ours.

    L = obstacle O + motion M + goal G. O is the sum of the cost map along the path; M the sum over the path's steps of
    the absolute difference from an even step; G = log(1 + distance by which the path's end misses its target). The
    published height term is zero on a flat floor and is left out, as is the published fear term.

    Attributes:
        obstacle, motion, goal: weights.
        target: where a path should end. "cost-to-go": where the length of the robot's shortest path to the goal has
            fallen by the horizon, or to 0 if the goal is nearer; this requires no expert. "expert": at the point a
            horizon along the expert path, or at the goal. "goal": at the goal itself, as published, which pulls a path
            against furniture that hides the goal.
        along: even steps divide the way to the target: the fall of the cost-to-go, or the length along the expert
            path. False divides the straight distance, as published, which makes paths cut corners. To the target
            "goal" it is always the straight distance.
        horizon: largest distance of the target along the way to the goal, meters; unused with the target "goal".
    """

    obstacle: NonNegative = 0.5
    motion: NonNegative = 2.0
    goal: NonNegative = 5.0
    target: Target = "expert"
    along: bool = True
    horizon: Positive = 3.5


class IPlannerTrainOptions(TrainOptions):
    """Training options.

    Attributes:
        plateau: factor on the learning rate when the held-out loss has not fallen for `patience` epochs.
        patience: epochs.
    """

    epochs: Count = 20
    batch: Count = 32
    rate: Positive = 1e-3
    held_out: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.05
    plateau: Annotated[float, Field(gt=0.0, le=1.0)] = 0.3
    patience: Annotated[int, Field(ge=0)] = 1


class IPlannerConfig(Document):
    """`config.json` of a trained planner. Version 3 names the target of the loss."""

    SCHEMA: ClassVar[str] = "labgym.iplanner/3"

    network: IPlannerNetworkOptions = IPlannerNetworkOptions()
    loss: IPlannerLossOptions = IPlannerLossOptions()
    training: IPlannerTrainOptions = IPlannerTrainOptions()

    @classmethod
    def parse(cls, data: Any, source: object = "document") -> Self:
        """Validate plain data read from `source`; version 2, whose network is the same, is read as well.

        Raises:
            DocumentError: another schema or an invalid field; names the source and the field.
        """
        if isinstance(data, dict) and data.get("schema") == "labgym.iplanner/2":
            data = {**data, "schema": cls.SCHEMA}
            if isinstance(loss := data.setdefault("loss", {}), dict):
                data["loss"] = _with_target(loss)
        return super().parse(data, source)


def _with_target(loss: dict[str, Any]) -> dict[str, Any]:
    """Return a loss of version 2, where a horizon of None stood for the goal itself, with its target named."""
    if loss.get("horizon", 0.0) is None:
        return {"target": "goal", **{name: value for name, value in loss.items() if name != "horizon"}}
    return {"target": "expert", **loss}
