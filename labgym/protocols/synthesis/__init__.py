"""Synthesis: protocols from free text, by templates or by a writer of one's own."""

from labgym.protocols.synthesis.errors import RefusalError
from labgym.protocols.synthesis.reading import Reading, read
from labgym.protocols.synthesis.synthesis import Synthesis, synthesize
from labgym.protocols.synthesis.template import TemplateWriter
from labgym.protocols.synthesis.writer import Commission, Draft, Writer

__all__ = [
    "Commission",
    "Draft",
    "Reading",
    "RefusalError",
    "Synthesis",
    "TemplateWriter",
    "Writer",
    "read",
    "synthesize",
]
