"""Clauses of a description parted into those of the reaction and those of the work-up."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from labgym.assets import Catalog
from labgym.protocols.synthesis.operations import Operation
from labgym.protocols.synthesis.reading import Clause
from labgym.protocols.synthesis.transformations import Transformation

_DILUTES = re.compile(r"\bdilut|稀释", re.IGNORECASE)
QUENCHES = frozenset(
    (
        "HydrochloricAcid",
        "DeionizedWater",
        "AmmoniumChloride",
        "SodiumBicarbonate",
        "SodiumThiosulfate",
        "SodiumBisulfite",
    )
)
"""Reagents that end a reaction when they are added after its reaction time."""


def parted(kind: Transformation, clauses: Sequence[Clause], catalog: Catalog) -> tuple[list[Clause], list[Clause]]:
    """Return the clauses of the reaction and those after it.

    A clause after the reaction belongs to it where it brings in a reagent that the reaction needs, as copper chloride
    that a diazonium salt is poured into.
    """
    needed = {name for slot in kind.slots for name in (slot.asset, *slot.accepts)}
    ends = {kind.quench.asset} if kind.quench is not None else set()
    before: list[Clause] = []
    after: list[Clause] = []
    for clause in clauses:
        ending = _ending(kind, clause, before, catalog)
        clause = replace(clause, operation=ending) if ending is not None else clause
        phase = clause.operation.phase if clause.operation else "reaction"
        present = {name for earlier in before for name in earlier.names("reagent")}
        brings = set(clause.names("reagent")) & (needed - ends - present)
        reacting = phase == "reaction" and not after
        (before if reacting or (phase == "quench" and brings and not after) or not before else after).append(clause)
    return before, after


def _ending(kind: Transformation, clause: Clause, before: Sequence[Clause], catalog: Catalog) -> Operation | None:
    """Return the operation of a clause that ends a reaction which was left to react, or None.

    "stir 2 h, add dilute acid" quenches; "stir 2 h, dilute with ether" begins the extraction.
    """
    needed = {name for slot in kind.slots for name in (slot.asset, *slot.accepts)}
    reagents = set(clause.names("reagent"))
    adds = clause.operation is not None and clause.operation.action == "Add"
    if not adds or not reagents or not any(c.duration for c in before):
        return None
    if reagents <= QUENCHES - needed:
        return Operation("Quench", "quench", 0)
    organic = all(catalog.get(name).category == "organic_solvent" for name in reagents)
    return Operation("Extract", "workup", 0) if _DILUTES.search(clause.text) and organic else None
