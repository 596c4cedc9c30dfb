"""The record of a training run: its results so far and where it resumes."""

from __future__ import annotations

from typing import Annotated, ClassVar, Self

from pydantic import Field, model_validator

from labgym.documents import Document


class Progress(Document):
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
