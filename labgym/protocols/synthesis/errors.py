"""Why no protocol is written."""

from __future__ import annotations

from typing import Literal

from labgym.errors import LabgymError

Reason = Literal["language", "no-chemistry", "no-reaction", "unlisted", "unsafe", "infeasible"]


class RefusalError(LabgymError, ValueError):
    """A description that no protocol is written for.

    Attributes:
        reason: what kind of obstacle it is.
    """

    def __init__(self, reason: Reason, message: str) -> None:
        self.reason: Reason = reason
        super().__init__(message)
