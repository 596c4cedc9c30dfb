"""The interface of writers of protocols, which work by templates or with a language model."""

from __future__ import annotations

import typing
from dataclasses import dataclass

from labgym.assets import Catalog
from labgym.protocols.model import Protocol
from labgym.protocols.retrieval import SearchResults
from labgym.protocols.synthesis.reading import ParsedDescription


@dataclass(frozen=True)
class Commission:
    """The input of a writer.

    Attributes:
        text: the description as written.
        description: the parsed description.
        context: the nearest fragments of the library.
        catalog: the assets that the protocol may use.
    """

    text: str
    description: ParsedDescription
    context: SearchResults
    catalog: Catalog


@dataclass(frozen=True)
class WriterResult:
    """The output of a writer: a protocol, and the writer's assumptions, one sentence each."""

    protocol: Protocol
    notes: tuple[str, ...]


class Writer(typing.Protocol):
    """An object that writes a protocol for a commission, or raises a LabgymError."""

    def write(self, commission: Commission) -> WriterResult:
        """Return a protocol; `synthesize` examines it afterwards."""
        ...
