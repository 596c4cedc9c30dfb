"""The error that refuses to write a protocol."""

from __future__ import annotations

from typing import Literal

from labgym.errors import LabgymError

Reason = Literal["language", "no-chemistry", "no-reaction", "unlisted", "unaccounted", "unsafe", "infeasible"]


class RefusalError(LabgymError, ValueError):
    """No protocol is written for a description or an experiment.

    Attributes:
        reason: kind of obstacle.
    """

    def __init__(self, reason: Reason, message: str) -> None:
        self.reason: Reason = reason
        super().__init__(message)
