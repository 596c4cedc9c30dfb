"""Precedents: conditions of the same reaction in the library, used if a text gives none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from labgym.assets import Catalog
from labgym.protocols.experiments import Action, experiments
from labgym.protocols.library import protocols
from labgym.protocols.model import Step
from labgym.protocols.retrieval import SearchResults, search
from labgym.protocols.synthesis.roles import Participant

HOLDING = ("Stir", "Heat", "Reflux")
SHARED = 2
"""Number of reagents besides solvents, among them the substrate, that a precedent shares with the reaction."""


@dataclass(frozen=True)
class Precedent:
    """The conditions under which a published protocol or experiment lets the same reagents react.

    Attributes:
        source: id of the protocol or experiment.
        temperature: degrees Celsius.
        duration: minutes.
    """

    source: str
    temperature: float
    duration: float


def context_of(text: str, keyword_only: bool, catalog: Catalog) -> SearchResults:
    """Return the fragments nearest to a text, best first: the nearest of all kinds, and the nearest protocols."""
    nearest = search(text, keyword_only=keyword_only, catalog=catalog)
    sources = {hit.fragment.source for hit in nearest.hits}
    nearest_protocols = search(text, keyword_only=keyword_only, origin="protocol", catalog=catalog).hits
    additional = (hit for hit in nearest_protocols if hit.fragment.source not in sources)
    return replace(nearest, hits=tuple(sorted((*nearest.hits, *additional), key=lambda hit: -hit.score)))


def precedent(context: SearchResults, parts: Sequence[Participant]) -> Precedent | None:
    """Return the best precedent with the same substrate and reagents, or None."""
    substrates = {part.asset.name for part in parts if "substrate" in part.role}
    reagents = {part.asset.name for part in parts if "solvent" not in part.role}
    for hit in context.hits:
        names, steps = _library_entry(hit.fragment.source)
        shared = reagents & names
        if shared & substrates and len(shared) >= SHARED:
            longest = _longest_hold(hit.fragment.source, steps)
            if longest is not None:
                return longest
    return None


def _library_entry(source: str) -> tuple[set[str], Sequence[Step | Action]]:
    """Return the reagents and the steps of a protocol or an experiment; nothing for a rule."""
    protocol, experiment = protocols().get(source), experiments().get(source)
    if protocol is not None:
        return {use.name for use in protocol.reagents}, protocol.steps
    if experiment is not None:
        return {material.name for material in experiment.materials}, experiment.actions
    return set(), ()


def _longest_hold(source: str, steps: Sequence[Step | Action]) -> Precedent | None:
    holds = [
        Precedent(source, step.temperature, step.duration)
        for step in steps
        if (step.verb if isinstance(step, Action) else step.action) in HOLDING
        and step.temperature is not None
        and step.duration is not None
    ]
    return max(holds, key=lambda item: item.duration, default=None)
