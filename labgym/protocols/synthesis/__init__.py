"""Synthesis: protocols from free text, by templates or by another writer."""

from labgym.protocols.errors import RefusalError
from labgym.protocols.synthesis.reading import ParsedDescription, read
from labgym.protocols.synthesis.synthesis import Synthesis, synthesize
from labgym.protocols.synthesis.template import TemplateWriter
from labgym.protocols.synthesis.writer import Commission, Writer, WriterResult

__all__ = [
    "Commission",
    "ParsedDescription",
    "RefusalError",
    "Synthesis",
    "TemplateWriter",
    "Writer",
    "WriterResult",
    "read",
    "synthesize",
]
