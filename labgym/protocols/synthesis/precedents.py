"""Conditions of a reaction that the library has already: what the text leaves open is done as there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from labgym.protocols.library import protocols
from labgym.protocols.model import Protocol
from labgym.protocols.retrieval import Results
from labgym.protocols.synthesis.roles import Part

HOLDING = ("Stir", "Heat", "Reflux")
SHARED = 2
"""How many reagents beside solvents a precedent shares with the reaction, its substrate one of them."""


@dataclass(frozen=True)
class Precedent:
    """How long and how hot a published protocol lets the same reagents react.

    Attributes:
        source: id of the protocol.
        temperature: degrees Celsius. duration: minutes.
    """

    source: str
    temperature: float
    duration: float


def precedent(context: Results, parts: Sequence[Part]) -> Precedent | None:
    """Return the first of the retrieved protocols that lets the same substrate and reagents react, or None."""
    substrates = {part.asset.name for part in parts if "substrate" in part.role}
    reagents = {part.asset.name for part in parts if "solvent" not in part.role}
    for hit in context.hits:
        protocol = protocols().get(hit.fragment.source)
        if protocol is None:
            continue
        shared = reagents & {use.name for use in protocol.reagents}
        if shared & substrates and len(shared) >= SHARED:
            found = _longest_hold(protocol)
            if found is not None:
                return found
    return None


def _longest_hold(protocol: Protocol) -> Precedent | None:
    held = [
        Precedent(protocol.id, step.temperature, step.duration)
        for step in protocol.steps
        if step.action in HOLDING and step.temperature is not None and step.duration is not None
    ]
    return max(held, key=lambda item: item.duration, default=None)
