"""The published protocols, protocols by id or file, and statistics of protocols (table 1 of the paper)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import MappingProxyType

import numpy as np

from labgym.artefacts import artefacts
from labgym.errors import DocumentError, OptionError, UnknownNameError
from labgym.protocols.model import Protocol

DESCRIPTION_WORDS = 4
"""Texts of this many words describe an experiment and name none."""


def protocols() -> dict[str, Protocol]:
    """Return the published protocols by id, sorted by id; they are read once per process."""
    return dict(_published())


def get(protocol_id: str) -> Protocol:
    """Return a published protocol by id.

    Raises:
        UnknownNameError: no published protocol has that id; the error lists those that exist.
    """
    library = _published()
    if not isinstance(protocol_id, str) or protocol_id not in library:
        raise UnknownNameError("protocol", protocol_id, library)
    return library[protocol_id]


def resolve(protocol: Protocol | str | Path) -> Protocol:
    """Return the protocol that an argument names.

    Args:
        protocol: a `Protocol`, which is returned as it is; the path of a protocol's .json file; or the id of a
            published protocol. Text counts as a path if it ends in ".json" or contains a path separator.

    Raises:
        UnknownNameError: no published protocol has that id; the error lists those that exist.
        DocumentError: the file is missing or is not a protocol.
    """
    if isinstance(protocol, Protocol):
        return protocol
    if isinstance(protocol, Path) or (isinstance(protocol, str) and _is_path(protocol)):
        return Protocol.load(protocol)
    library = _published()
    if not isinstance(protocol, str) or protocol not in library:
        raise UnknownNameError("protocol (an id or a .json file)", protocol, library, remedy=_remedy(str(protocol)))
    return library[protocol]


def _is_path(text: str) -> bool:
    separated = "/" in text or "\\" in text
    return text.endswith(".json") or (separated and not _is_description(text))


def _is_description(text: str) -> bool:
    return len(text.split()) >= DESCRIPTION_WORDS and not _is_file(text)


def _is_file(text: str) -> bool:
    try:
        return Path(text).is_file()
    except (OSError, ValueError):  # Too long for a path, or with a null character.
        return False


def _remedy(text: str) -> str:
    """Return what to do instead with a text that names no protocol."""
    if _is_description(text):
        return "write a protocol from a description with: labgym protocols new TEXT --out FILE.json"
    return f"{text} is a file, but protocols are .json files" if _is_file(text) else ""


@lru_cache(maxsize=1)
def _published() -> MappingProxyType[str, Protocol]:
    library: dict[str, Protocol] = {}
    for file in sorted((artefacts("assets") / "protocols").glob("*.json")):
        protocol = Protocol.load(file)
        if protocol.id != file.stem:
            raise DocumentError(file, "id", f"expected {file.stem!r}, the name of the file, got {protocol.id!r}")
        library[protocol.id] = protocol
    return MappingProxyType(library)


@dataclass(frozen=True)
class Summary:
    """Mean, minimum, maximum and sample standard deviation (n - 1; 0 for a single value) of a count."""

    mean: float
    minimum: int
    maximum: int
    deviation: float


@dataclass(frozen=True)
class Statistics:
    """Summaries over a set of protocols; a move is a change of location between two steps."""

    count: int
    reagents: Summary
    instruments: Summary
    steps: Summary
    moves: Summary


def statistics(protocols: Iterable[Protocol]) -> Statistics:
    """Return the statistics of protocols.

    Raises:
        OptionError: no protocols.
    """
    chosen = list(protocols)
    if not chosen:
        raise OptionError("statistics need at least one protocol, got none")
    return Statistics(
        count=len(chosen),
        reagents=_summary([len(protocol.reagents) for protocol in chosen]),
        instruments=_summary([len(protocol.instruments) for protocol in chosen]),
        steps=_summary([len(protocol.steps) for protocol in chosen]),
        moves=_summary([protocol.moves for protocol in chosen]),
    )


def _summary(values: list[int]) -> Summary:
    deviation = float(np.std(values, ddof=1)) if len(values) > 1 else 0.0
    return Summary(float(np.mean(values)), min(values), max(values), deviation)
