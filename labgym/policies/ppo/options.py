"""What a training run is asked for; written beside its weights."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from labgym.documents import Document
from labgym.policies.ppo.inputs import Sensor

Count = Annotated[int, Field(ge=1)]
Positive = Annotated[float, Field(gt=0.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class TrainingOptions(Document):
    """A training run of PPO.

    Attributes:
        observation: the sensor.
        seed: of everything random.
        steps: control steps that PPO takes, all environments together; the warm start's are beside them.
        layouts: training layouts in the pool.
        environments: that are stepped in turn.
        horizon: control steps after which a training episode is truncated.

        cloning_rounds, cloning_steps: the warm start copies the expert for so many rounds of so many control steps; 0
            rounds leaves it out.
        cloning_epochs: passes over all that was gathered, after each round.
        cloning_rate: step size of Adam.

        rollout: control steps of each environment before each update.
        leg: updates between two checkpoints; each leg begins with new episodes, so that a run may go on from any.
        epochs, batch: passes over a rollout, and samples in a gradient step.
        rate: step size of Adam at the start; it falls to a tenth of this in a straight line.
        discount, trace: gamma and the lambda of generalised advantage estimation.
        clip: of the probability ratio.
        entropy: weight of the entropy bonus.
        noise: standard deviation of the actions when PPO begins.
        nearest, farthest: how far away, straight on, a goal may be when PPO begins, and when a third of its steps are
            done, metres.
        evaluate_every: legs between two evaluations on the validation split.
    """

    SCHEMA: ClassVar[str] = "labgym.ppo-options/1"

    observation: Sensor = "lidar"
    seed: Annotated[int, Field(ge=0)] = 0
    steps: Count = 200_000
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
    entropy: Annotated[float, Field(ge=0.0)] = 0.001
    noise: Positive = 0.3
    nearest: Positive = 5.0
    farthest: Positive = 15.0
    evaluate_every: Count = 6
