"""The facts that a policy's process declares and the errors that it reports: bounded JSON that is validated."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, get_args

from pydantic import Field, ValidationError

from labgym import errors
from labgym.counts import is_real
from labgym.documents import Record
from labgym.errors import LabgymError
from labgym.policies.fingerprint.reads import MAX_FILES
from labgym.policies.kernels import kernel_facts
from labgym.policies.policy import GoalKind, Policy, Sensors
from labgym.policies.process.box import denial
from labgym.policies.process.wire import GarbageError

MAX_TEXT = 500
"""Longest error text of an episode, characters."""
MAX_LOADING_TEXT = 2_000
"""Longest error text of loading a policy, characters; it may list names."""

MAX_LATENCY = 10.0
"""Longest latency that a policy may declare, seconds."""

ShortText = Annotated[str, Field(max_length=100)]

_KINDS = {kind.__name__: kind for kind in (errors.UnknownNameError, errors.OptionError, errors.MissingDependencyError)}
"""Errors of loading that keep their class; all others become LabgymError."""


class PolicyFacts(Record):
    """Declarations of a policy.

    Attributes:
        name, observation, privileged, foresees, exclusive, goal_kinds, stops, latency: the attributes of `Policy`.
        files: absolute paths of the files that belong to its identity (`Reads.files_of`). sources: those of its class.
        single_use: whether its process cannot be forked, because it has several threads or children, so that each
            episode loads the policy anew.
        kernels: `kernel_facts()` of its process.
    """

    name: Annotated[str, Field(min_length=1, max_length=200)]
    observation: Sensors
    privileged: bool
    foresees: bool = False
    exclusive: bool
    goal_kinds: Annotated[tuple[GoalKind, ...], Field(min_length=1, max_length=3)] = ("point",)
    stops: bool = False
    latency: Annotated[float, Field(ge=0.0, le=MAX_LATENCY)] = 0.0
    files: Annotated[tuple[Annotated[str, Field(max_length=4096)], ...], Field(max_length=MAX_FILES)]
    sources: Annotated[tuple[Annotated[str, Field(max_length=4096)], ...], Field(max_length=MAX_FILES)] = ()
    single_use: bool
    kernels: Annotated[dict[ShortText, ShortText | int], Field(max_length=16)]


DECLARED = ("name", "observation", "privileged", "foresees", "exclusive", "stops", "latency")
"""Facts that every load of a policy must declare alike: they decide what it receives."""


def facts_of(policy: Policy, files: Sequence[Path], sources: Sequence[Path], single_use: bool) -> PolicyFacts:
    """Return the facts of a policy.

    Raises:
        UnknownNameError: there is no such observation.
        ValidationError: another attribute has another type or is too long.
    """
    if policy.observation not in get_args(Sensors):
        raise errors.UnknownNameError("observation of the policy", policy.observation, get_args(Sensors))
    return PolicyFacts(
        name=_one_line(str(policy.name), 200),
        observation=policy.observation,
        privileged=bool(policy.privileged),
        foresees=bool(policy.foresees),
        exclusive=bool(policy.exclusive),
        goal_kinds=tuple(policy.goal_kinds),
        stops=bool(policy.stops),
        latency=declared_latency(policy),
        files=tuple(map(str, files)),
        sources=tuple(map(str, sources))[:MAX_FILES],
        single_use=single_use,
        kernels=kernel_facts(),
    )


def declared_latency(policy: Policy) -> float:
    """Return the latency that a policy declares, seconds.

    Raises:
        OptionError: it is not a number from 0 to 10.
    """
    latency = policy.latency
    if not is_real(latency) or not 0.0 <= latency <= MAX_LATENCY:
        shown = _one_line(repr(latency), 40)
        raise errors.OptionError(f"policy latency is {shown}, expected seconds from 0 to {MAX_LATENCY:g}")
    return float(latency)


def read_facts(content: bytes) -> PolicyFacts:
    """Return the facts in an answer.

    Raises:
        GarbageError: the bytes are not valid facts.
    """
    try:
        return PolicyFacts.model_validate_json(content, strict=True)
    except ValidationError as error:
        raise GarbageError(f"{error.error_count()} invalid fields in its facts") from None


def error_text(error: BaseException) -> str:
    """Return class and message of an error of a policy in one line."""
    try:
        message = str(error)
    except Exception:  # noqa: BLE001 - the policy's own error class may fail to print
        message = "(no message)"
    return _one_line(f"{type(error).__name__}: {message}{_reason(error)}", MAX_TEXT)


def _reason(error: BaseException) -> str:
    """Return the reason of an error in the box, to be appended to its message."""
    reason = denial(error)
    return f" ({reason})" if reason else ""


def encode_error(error: BaseException) -> bytes:
    """Return the content of an answer that reports an error while loading the policy."""
    if isinstance(error, LabgymError):
        return _encoded(_kind_of(error), _one_line(f"{error}{_reason(error)}", MAX_LOADING_TEXT))
    return _encoded("", error_text(error))


def encode_text(text: str) -> bytes:
    """Return the content of an answer that reports why an episode failed."""
    return _encoded("", _one_line(text, MAX_TEXT))


def read_text(content: bytes) -> str:
    """Return the text of an answer that reports an error.

    Raises:
        GarbageError: the bytes are not such an answer.
    """
    return _one_line(_decoded(content)[1], MAX_TEXT)


def read_error(content: bytes) -> LabgymError:
    """Return the error of an answer that reports one while loading the policy.

    Raises:
        GarbageError: the bytes are not such an answer.
    """
    name, text = _decoded(content)
    text = _one_line(text, MAX_LOADING_TEXT)
    kind = _KINDS.get(name, LabgymError)
    error = kind.__new__(kind, text)
    Exception.__init__(error, text)
    if isinstance(error, errors.UnknownNameError):
        error.message = text
    return error


def _kind_of(error: LabgymError) -> str:
    return next((name for name, kind in _KINDS.items() if isinstance(error, kind)), "")


def _encoded(kind: str, text: str) -> bytes:
    return json.dumps([kind, text], ensure_ascii=False).encode("utf-8", "replace")


def _decoded(content: bytes) -> tuple[str, str]:
    try:
        kind, text = json.loads(content)
    except (ValueError, TypeError, RecursionError):
        raise GarbageError("an error report that is not valid") from None
    if not (isinstance(kind, str) and isinstance(text, str)):
        raise GarbageError("an error report that is not text")
    return kind, text


def _one_line(text: str, longest: int) -> str:
    """Return a text without line breaks and control characters, shortened."""
    words = "".join(letter if letter.isprintable() else " " for letter in text[: 4 * longest]).split()
    return " ".join(words)[:longest]
