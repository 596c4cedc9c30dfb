"""What can go wrong between a question to a language model and an answer that can be used."""

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
    """A question that got no usable answer. The message says what to do and never holds the key.

    Attributes:
        reason: what kind of failure it is, for callers that can go on without an answer.
        reply: what the model said, where it said something that cannot be used, else "".
    """

    def __init__(self, reason: Reason, message: str, reply: str = "") -> None:
        self.reason = reason
        self.reply = reply
        super().__init__(" ".join(message.split()))

    def __reduce__(self) -> tuple[object, ...]:
        return LanguageModelError, (self.reason, str(self), self.reply)
