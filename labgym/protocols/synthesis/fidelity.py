"""Fidelity of a protocol to its description: every substance, amount and condition is accounted for.

A statement counts as kept if the protocol uses it: the reagent is listed with the amount, and a step has the
temperature, duration or pressure, or says it in its text. Products, yields, melting points and solvents that are
evaporated need not appear.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import takewhile

from labgym.assets import Catalog
from labgym.protocols.amounts import read_amount
from labgym.protocols.errors import RefusalError
from labgym.protocols.model import Protocol
from labgym.protocols.synthesis.products import within
from labgym.protocols.synthesis.reading import Clause, ParsedDescription
from labgym.protocols.synthesis.roles import COOLANTS, PROTECTIVE_GASES
from labgym.quantities import StatedCondition, durations, pressures, temperatures

SAME_TEMPERATURE, SAME_SHARE = 1.0, 0.03
"""Differences up to which a temperature, degrees Celsius, and a relative amount or duration count as the same."""
ENDING = ("Quench", "Acidify", "Basify", "Extract", "Wash", "Concentrate")
"""Actions with which the work-up begins."""
_BOILING = re.compile(r"(?:\bb\.?\s?p\.?|boil|沸点)[^.;。；]{0,25}$", re.IGNORECASE)
"""Text before the pressure that belongs to a boiling point."""
_PHYSICAL = re.compile(
    r"(?:\bm\.?\s?p\.?|\bb\.?\s?p\.?|melting (?:point|range)|boiling (?:point|range)|melts?|boils?|below|above|under|"
    r"exceed(?:s|ed|ing)?|熔点|沸点|熔程|低于|高于|不超过)\W{0,4}(?:of|at|is|:|=)?\s*$",
    re.IGNORECASE,
)
"""Text before a temperature that is a property of the product, or a limit."""


def refuse_unfaithful(description: ParsedDescription, protocol: Protocol, catalog: Catalog) -> None:
    """Raise an error unless a protocol keeps every statement of its description.

    Raises:
        RefusalError: it omits statements; names each of them.
    """
    lost = tuple(dict.fromkeys(unkept(description, protocol, catalog)))
    if lost:
        listed = ", ".join(repr(statement) for statement in lost[:6])
        message = f"{protocol.name!r} has no place for {listed}: reword or leave out"
        raise RefusalError("unaccounted", message)


def unkept(description: ParsedDescription, protocol: Protocol, catalog: Catalog) -> Iterator[str]:
    """Yield the statements of a description that a protocol does not keep, as written."""
    yield from description.unassigned
    yield from _substances(description, protocol, catalog)
    yield from _conditions(description, protocol)


def _substances(description: ParsedDescription, protocol: Protocol, catalog: Catalog) -> Iterator[str]:
    amounts = {use.name: use.amount for use in protocol.reagents}
    text = " ".join(step.text.lower() for step in protocol.steps)
    for clause in description.clauses:
        for mention in clause.mentions:
            aside = mention.name in COOLANTS or mention.name in PROTECTIVE_GASES or mention.name in clause.removed
            if mention.kind == "reagent" and mention.name not in amounts and not aside:
                yield mention.text
        for name, amount in clause.amounts.items():
            if name in amounts and not _keeps_amount(amounts[name], amount):
                yield f"{amount} of {name}"
        for mention in clause.mentions:
            if mention.kind == "instrument" and catalog.get(mention.name).category == "analytical":
                if mention.name not in protocol.instruments and mention.text.lower() not in text:
                    yield mention.text


def _keeps_amount(written: str, stated: str) -> bool:
    """Return whether an amount of the protocol has every quantity of a stated one, in words or as the same number."""
    if all(part.strip() in written for part in stated.split(",")):
        return True
    for entry in written.split(";"):
        ours, theirs = read_amount(entry), read_amount(stated)
        measured = [(ours.mass, theirs.mass), (ours.volume, theirs.volume)]
        pairs = [pair for pair in measured if pair[1] is not None] or [(ours.moles, theirs.moles)]
        if all(a is not None and b is not None and abs(a - b) <= SAME_SHARE * b for a, b in pairs):
            return ours.portions == theirs.portions
    return False


def _conditions(description: ParsedDescription, protocol: Protocol) -> Iterator[str]:
    text = description.text
    steps = protocol.steps
    words = " ".join(step.text for step in steps)
    for item in temperatures(text):
        if _is_property(description, item) or item.text in words or f"bath at {item.value:g} C" in words:
            continue
        if not any(s.temperature is not None and abs(s.temperature - item.value) <= SAME_TEMPERATURE for s in steps):
            yield item.text
    yield from _misplaced(description, protocol)
    for item in durations(text):
        is_kept = any(s.duration is not None and abs(s.duration - item.value) <= SAME_SHARE * item.value for s in steps)
        if not is_kept and item.text not in words and not within(item.start, description.products):
            yield item.text
    for item in pressures(text):
        boils = _BOILING.search(text[: item.start]) is not None
        if item.text not in words and not boils and not within(item.start, description.products):
            yield item.text


def _misplaced(description: ParsedDescription, protocol: Protocol) -> Iterator[str]:
    """Yield the durations of the reaction, as written, that no step before its end has."""
    steps = list(takewhile(lambda step: step.action not in ENDING, protocol.steps))
    words = " ".join(step.text for step in steps)
    for clause in takewhile(_is_reaction, description.clauses):
        for item in durations(clause.text):
            near = (s for s in steps if s.duration is not None)
            is_kept = any(abs((s.duration or 0.0) - item.value) <= SAME_SHARE * item.value for s in near)
            if not is_kept and item.text not in words:
                yield item.text


def _is_reaction(clause: Clause) -> bool:
    return clause.operation is None or clause.operation.phase == "reaction"


def _is_property(description: ParsedDescription, item: StatedCondition) -> bool:
    head = description.text[: item.start]
    return within(item.start, description.products) or _PHYSICAL.search(head) is not None
