"""From a description in English or Chinese to a protocol that passes every check."""

from __future__ import annotations

import re
from dataclasses import dataclass

from labgym.assets import Catalog
from labgym.protocols.language import language_of
from labgym.protocols.model import Protocol
from labgym.protocols.retrieval import Results
from labgym.protocols.synthesis.errors import RefusalError
from labgym.protocols.synthesis.precedents import context_of
from labgym.protocols.synthesis.reading import Reading, read
from labgym.protocols.synthesis.refusals import refuse_mixture, refuse_wish
from labgym.protocols.synthesis.template import TemplateWriter
from labgym.protocols.synthesis.writer import Commission, Writer
from labgym.protocols.validate import ProtocolError, examine

MAX_TEXT = 4000
_NO_AMOUNT = re.compile(
    r"(?<![\w.,-])(?:[-−]\s?\d+(?:\.\d+)?|0+(?:\.0+)?)\s?(?:[mkµu]?g|m?mol|[mµu]?l|equiv)\b", re.IGNORECASE
)


@dataclass(frozen=True)
class Synthesis:
    """A sound protocol, how it came about, and what could be better.

    Attributes:
        notes: what was assumed, one sentence each.
        advice: what the examination advises.
        context: what the library has on the description.
    """

    protocol: Protocol
    notes: tuple[str, ...]
    advice: tuple[str, ...]
    context: Results


def synthesize(text: str, writer: Writer | None = None, keyword_only: bool = False) -> Synthesis:
    """Write a protocol for a description.

    Args:
        text: what is to be done, in English or Chinese.
        writer: who writes it; templates by default, which give the same protocol for the same text.
        keyword_only: search the library without embeddings.

    Raises:
        RefusalError: the text is in another language, has no chemistry or no known reaction in it, names a substance
            that the catalogue lacks, or asks for something dangerous.
        ProtocolError: what was written has faults.
        LabgymError: what else the writer raises.
    """
    reading = _accepted(text)
    context = context_of(text, keyword_only)
    draft = (writer if writer is not None else TemplateWriter()).write(Commission(text, reading, context))
    refuse_wish(f"{draft.protocol.name}. {draft.protocol.product}.")
    refuse_mixture(use.name for use in draft.protocol.reagents)
    found = examine(draft.protocol)
    faults = [finding for finding in found if finding.severity == "fault"]
    if faults:
        raise ProtocolError(draft.protocol.id, faults)
    advice = tuple(f"{finding.message}; {finding.suggestion}" for finding in found)
    return Synthesis(draft.protocol, draft.notes, advice, context)


def _accepted(text: str) -> Reading:
    """Return the reading of a text that may be worked on.

    Raises:
        RefusalError: it may not.
    """
    if not text.isprintable() and any("\ud800" <= char <= "\udfff" for char in text):
        raise RefusalError("language", "the description has bytes that are no UTF-8 text: save it as UTF-8")
    if not text.strip() or len(text) > MAX_TEXT:
        raise RefusalError("no-chemistry", f"a description needs 1 to {MAX_TEXT} characters")
    refuse_wish(text)
    if language_of(text) == "unknown":
        raise RefusalError("language", "the description is in neither English nor Chinese, the languages read here")
    nothing = _NO_AMOUNT.search(text)
    if nothing:
        raise RefusalError("no-chemistry", f"{nothing[0].strip()!r} is no amount: give one above 0")
    reading = read(text)
    if reading.unlisted:
        near = Catalog.load().nearest(reading.unlisted[0], 3)
        hint = f"; nearest to {reading.unlisted[0]!r}: {', '.join(near)}" if near else ""
        names = ", ".join(repr(name[:60]) for name in reading.unlisted[:5])
        message = f"the catalogue has no {names}{hint}; add the reagent to the catalogue or name another"
        raise RefusalError("unlisted", message)
    refuse_mixture(mention.name for clause in reading.clauses for mention in clause.mentions)
    return reading
