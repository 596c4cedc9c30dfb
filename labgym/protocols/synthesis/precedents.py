"""Conditions of a reaction that the library has already: what the text leaves open is done as there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from labgym.protocols.experiments import Action, experiments
from labgym.protocols.library import protocols
from labgym.protocols.model import Step
from labgym.protocols.retrieval import Results, search
from labgym.protocols.synthesis.roles import Part

HOLDING = ("Stir", "Heat", "Reflux")
SHARED = 2
"""How many reagents beside solvents a precedent shares with the reaction, its substrate one of them."""


@dataclass(frozen=True)
class Precedent:
    """How long and how hot a published protocol or experiment lets the same reagents react.

    Attributes:
        source: its id.
        temperature: degrees Celsius. duration: minutes.
    """

    source: str
    temperature: float
    duration: float


def context_of(text: str, keyword_only: bool) -> Results:
    """Return what the library has on a text, best first: the nearest of all kinds, and the nearest protocols."""
    found = search(text, keyword_only=keyword_only)
    known = {hit.fragment.source for hit in found.hits}
    protocols_found = search(text, keyword_only=keyword_only, origin="protocol").hits
    added = (hit for hit in protocols_found if hit.fragment.source not in known)
    return replace(found, hits=tuple(sorted((*found.hits, *added), key=lambda hit: -hit.score)))


def precedent(context: Results, parts: Sequence[Part]) -> Precedent | None:
    """Return the first of what was retrieved that lets the same substrate and reagents react, or None."""
    substrates = {part.asset.name for part in parts if "substrate" in part.role}
    reagents = {part.asset.name for part in parts if "solvent" not in part.role}
    for hit in context.hits:
        taken, steps = _library_entry(hit.fragment.source)
        shared = reagents & taken
        if shared & substrates and len(shared) >= SHARED:
            found = _longest_hold(hit.fragment.source, steps)
            if found is not None:
                return found
    return None


def _library_entry(source: str) -> tuple[set[str], Sequence[Step | Action]]:
    """Return what a protocol or an experiment takes and what is done in it; nothing for a rule."""
    protocol, experiment = protocols().get(source), experiments().get(source)
    if protocol is not None:
        return {use.name for use in protocol.reagents}, protocol.steps
    if experiment is not None:
        return {material.name for material in experiment.materials}, experiment.actions
    return set(), ()


def _longest_hold(source: str, steps: Sequence[Step | Action]) -> Precedent | None:
    held = [
        Precedent(source, step.temperature, step.duration)
        for step in steps
        if (step.verb if isinstance(step, Action) else step.action) in HOLDING
        and step.temperature is not None
        and step.duration is not None
    ]
    return max(held, key=lambda item: item.duration, default=None)
