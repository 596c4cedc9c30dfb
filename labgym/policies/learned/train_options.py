"""Training options that all planners have."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from labgym.counts import MAX_COUNT, MAX_PROCESSES
from labgym.documents import Record


class TrainOptions(Record):
    """Options that all planners are trained with.

    Attributes:
        epochs: passes over the training samples.
        batch: samples per gradient step.
        rate, decay: learning rate and weight decay of AdamW.
        held_out: share of the layouts, the last ones, that is used for validation and not trained on.
        samples: number of samples of the dataset to use; None uses all.
        threads: torch threads; the last bits of the weights depend on it.
        seed: random seed of the initial weights, the sample order, mirroring and noise.
    """

    epochs: Annotated[int, Field(ge=1, le=MAX_COUNT)]
    batch: Annotated[int, Field(ge=1, le=MAX_COUNT)]
    rate: Annotated[float, Field(gt=0.0)]
    decay: Annotated[float, Field(ge=0.0)] = 1e-3
    held_out: Annotated[float, Field(ge=0.0, lt=1.0)]
    samples: Annotated[int, Field(ge=1, le=MAX_COUNT)] | None = None
    threads: Annotated[int, Field(ge=1, le=MAX_PROCESSES)] = 1
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 0
