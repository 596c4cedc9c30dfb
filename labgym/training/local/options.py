"""Options of the training of the local planner."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import Field

from labgym.counts import MAX_COUNT
from labgym.documents import Document
from labgym.envs.labnav.tasks import TASKS, TaskName

Count = Annotated[int, Field(ge=1, le=MAX_COUNT)]
Positive = Annotated[float, Field(gt=0.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Tasks = Annotated[tuple[TaskName, ...], Field(min_length=1)]
Validation = Annotated[int, Field(ge=1, le=3)]


class ImitationOptions(Document):
    """Options of the imitation of `stack` by DAgger (Ross, Gordon and Bagnell 2011).

    Attributes:
        seed: random seed of weights, choice of drives and order of samples.
        tasks: to practice.
        rounds: of drives and learning; in the first one the expert drives, in the others the network.
        drives: of each round. shard: drives of a unit of work.
        epochs: passes over all samples so far, after each round. last_epochs: after the last round.
        batch: samples of a gradient step. rate: learning rate of Adam, which falls along a half cosine in each round.
        validation: drives of a task on each floor of floors-val, by which the policy is judged at the end.
    """

    SCHEMA: ClassVar[str] = "labgym.local-imitation-options/1"

    seed: Annotated[int, Field(ge=0)] = 0
    tasks: Tasks = tuple(TASKS)
    rounds: Count = 4
    drives: Count = 224
    shard: Count = 8
    epochs: Count = 12
    last_epochs: Count = 40
    batch: Count = 512
    rate: Positive = 1e-3
    validation: Validation = 2


class ReinforcementOptions(Document):
    """Options of PPO (Schulman et al. 2017) from the weights of the imitation.

    Attributes:
        seed: random seed of the critic's weights, choice of drives, noise and order of samples.
        tasks: to practice, and to be judged by.
        iterations: number of updates. drives: of each. shard: drives of a unit of work.
        critic_iterations: first iterations, in which only the critic learns.
        epochs: passes over the drives of an iteration. batch: samples of a gradient step.
        rate: learning rate of Adam, which falls linearly to a tenth.
        discount: gamma, of each decision. trace: lambda of generalized advantage estimation.
        clip: range of the probability ratio.
        divergence: an update ends at 1.5 times this mean KL divergence from the weights before.
        entropy: weight of the entropy bonus. noise: standard deviation of the actions at the start.
        evaluate_every: iterations between two evaluations on floors-val. validation: drives of a task on each of its
            floors in an evaluation.
    """

    SCHEMA: ClassVar[str] = "labgym.local-ppo-options/1"

    seed: Annotated[int, Field(ge=0)] = 0
    tasks: Tasks = tuple(TASKS)
    iterations: Count = 40
    drives: Count = 64
    shard: Count = 4
    critic_iterations: Annotated[int, Field(ge=0)] = 1
    epochs: Count = 8
    batch: Count = 1024
    rate: Positive = 2e-4
    discount: Share = 0.995
    trace: Share = 0.95
    clip: Share = 0.2
    divergence: Positive = 0.02
    entropy: Annotated[float, Field(ge=0.0)] = 0.0
    noise: Positive = 0.15
    evaluate_every: Count = 20
    validation: Validation = 2
