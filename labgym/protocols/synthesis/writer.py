"""What a writer of protocols gets and gives, whether it works by templates or with a language model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol as Structural

from labgym.protocols.model import Protocol
from labgym.protocols.retrieval import Results
from labgym.protocols.synthesis.reading import Reading


@dataclass(frozen=True)
class Commission:
    """A description, read, with what the library has on it."""

    text: str
    reading: Reading
    context: Results


@dataclass(frozen=True)
class Draft:
    """A protocol as it was written, with what the writer assumed, one sentence each."""

    protocol: Protocol
    notes: tuple[str, ...]


class Writer(Structural):
    """Anything that writes a protocol for a commission, or raises a LabgymError."""

    def write(self, commission: Commission) -> Draft:
        """Return a protocol; it is examined afterwards, whoever wrote it."""
        ...
