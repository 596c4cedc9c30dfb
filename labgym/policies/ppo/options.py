"""Options and progress of a training run, stored next to its weights."""

from __future__ import annotations

from typing import Annotated, ClassVar, Self

from pydantic import Field, model_validator

from labgym.counts import MAX_STEPS
from labgym.documents import Document
from labgym.policies.options import Count, NonNegative, Positive, Share
from labgym.policies.ppo.inputs import Sensor


class PPOOptions(Document):
    """Options of a training run of PPO.

    Attributes:
        observation: the sensor.
        seed: random seed of the whole run.
        steps: control steps of PPO, summed over the environments; those of the warm start come in addition.
        layouts: number of training layouts in the pool.
        environments: number of environments, stepped in turn.
        horizon: control steps after which a training episode is truncated.

        cloning_rounds: rounds of the warm start, which imitates the expert; 0 leaves it out.
        cloning_steps: control steps per round.
        cloning_epochs: passes over all data gathered so far, after each round.
        cloning_rate: learning rate of Adam.

        rollout: control steps of each environment before each update.
        leg: updates between two checkpoints; each leg begins with new episodes, so that a run can resume from any.
        epochs: passes over a rollout.
        batch: samples per gradient step.
        rate: initial learning rate of Adam; it falls linearly to a tenth of this.
        discount: gamma.
        trace: lambda of generalized advantage estimation.
        clip: clipping range of the probability ratio.
        entropy: weight of the entropy bonus.
        noise: standard deviation of the actions at the start of PPO.
        nearest: largest straight distance to a goal at the start of PPO, meters.
        farthest: the same after a third of the steps, meters.
        evaluate_every: legs between two evaluations on the validation split.
    """

    SCHEMA: ClassVar[str] = "labgym.ppo-options/1"

    observation: Sensor = "lidar"
    seed: Annotated[int, Field(ge=0)] = 0
    steps: Annotated[int, Field(ge=1, le=MAX_STEPS)] = 200_000
    layouts: Count = 120
    environments: Count = 16
    horizon: Count = 300

    cloning_rounds: Annotated[int, Field(ge=0)] = 5
    cloning_steps: Count = 16_000
    cloning_epochs: Count = 3
    cloning_rate: Positive = 1e-3

    rollout: Count = 256
    leg: Count = 4
    epochs: Count = 4
    batch: Count = 512
    rate: Positive = 2e-4
    discount: Share = 0.99
    trace: Share = 0.95
    clip: Share = 0.2
    entropy: NonNegative = 0.001
    noise: Positive = 0.3
    nearest: Positive = 5.0
    farthest: Positive = 15.0
    evaluate_every: Count = 6


class TrainingProgress(Document):
    """Progress of a run.

    Attributes:
        legs: number of finished legs.
        best: highest score on validation so far, without the warm start's; None before the first.
        records: records of the warm start's rounds, the legs and the evaluations, in order.
    """

    SCHEMA: ClassVar[str] = "labgym.ppo-progress/1"

    legs: Annotated[int, Field(ge=0)] = 0
    best: float | None = None
    records: tuple[dict[str, float | int | str | None], ...] = ()

    @model_validator(mode="after")
    def _check_records(self) -> Self:
        for index, record in enumerate(self.records):
            if not isinstance(record.get("kind"), str):
                raise ValueError(f"record {index} has no kind; train from the start with --fresh")
        return self
