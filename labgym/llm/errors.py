"""Errors of the language model client."""

from __future__ import annotations

from typing import Literal

from labgym.errors import LabgymError

Reason = Literal[
    "not_configured",
    "unreachable",
    "timeout",
    "unauthorized",
    "rate_limited",
    "rejected",
    "server",
    "oversize",
    "malformed",
    "refused",
    "empty",
    "truncated",
    "not_recorded",
]


class LanguageModelError(LabgymError):
    """A question without a usable answer. The message names the remedy and never contains the key.

    Attributes:
        reason: kind of failure, for callers that can continue without an answer.
        reply: text of an unusable reply, else "".
    """

    def __init__(self, reason: Reason, message: str, reply: str = "") -> None:
        self.reason = reason
        self.reply = reply
        super().__init__(" ".join(message.split()))

    def __reduce__(self) -> tuple[object, ...]:
        return LanguageModelError, (self.reason, str(self), self.reply)
