"""The record of a training run: what it achieved so far, and where it goes on."""

from __future__ import annotations

from typing import ClassVar

from labgym.documents import Document


class Progress(Document):
    """How far a run has come.

    Attributes:
        legs: done. best: highest score on validation so far, the warm start's not among them; None before the
            first.
        records: of the warm start's rounds, the legs and the evaluations, in order.
    """

    SCHEMA: ClassVar[str] = "labgym.ppo-progress/1"

    legs: int = 0
    best: float | None = None
    records: tuple[dict[str, float | int | str | None], ...] = ()
