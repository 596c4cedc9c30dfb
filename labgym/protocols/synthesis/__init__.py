"""Synthesis: protocols from free text, by templates or by another writer."""

from labgym.protocols.errors import RefusalError
from labgym.protocols.synthesis.reading import read
from labgym.protocols.synthesis.synthesis import synthesize
from labgym.protocols.synthesis.writer import Commission, Writer, WriterResult

__all__ = [
    "Commission",
    "RefusalError",
    "Writer",
    "WriterResult",
    "read",
    "synthesize",
]
