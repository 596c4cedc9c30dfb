"""The rows of the damage benchmark: a case, what the repair did, and the verdict."""

from __future__ import annotations

import time

from labgym.documents import Record
from labgym.layouts.repairs import repair_layout
from labgym.layouts.rules.rule_sets import PAPER, RuleSet
from labgym.paper.repairs.cases import RepairCase, patient
from labgym.paper.repairs.verdict import verdict

DIGITS = 2
"""Decimals of processor times."""


class RepairRow(Record):
    """A case of the damage benchmark.

    Attributes:
        kind, pieces, draw: the case. place, protocol, seed: its laboratory.
        objects: number of placements of the damaged layout. damaged: ids of the damaged pieces.
        v_damaged, v: number of violations before and after the repair.
        moved, added: number of objects that the repair moved by themselves, and added.
        missing, free_standing, errors, warnings, outside: what is wrong after the repair, as in `Verdict`.
        repaired: whether nothing is wrong.
    """

    kind: str
    pieces: int
    draw: int
    place: str
    protocol: str
    seed: int
    objects: int
    damaged: tuple[str, ...]
    v_damaged: int
    v: int
    moved: int
    added: int
    missing: tuple[str, ...]
    free_standing: tuple[str, ...]
    errors: tuple[str, ...]
    warnings: tuple[str, ...]
    outside: tuple[str, ...]
    repaired: bool

    @property
    def moved_share(self) -> float:
        """The share of the objects that the repair moved."""
        return self.moved / self.objects


def repair_row(case: RepairCase, seed: int, rules: str | RuleSet = PAPER) -> tuple[RepairRow, float]:
    """Return the row of a case, and the processor time of the repair in seconds: damage, repair and judge a laboratory.

    Raises:
        LabgymError: no laboratory can be damaged in that way.
    """
    ill = patient(case, seed)
    layout = ill.damage.layout
    start = time.process_time()
    result = repair_layout(layout, rules=rules)
    seconds = time.process_time() - start
    judged = verdict(ill.sound, result.layout, layout.protocol, rules)
    kinds = [change.kind for change in result.changes]
    row = RepairRow(
        kind=case.kind,
        pieces=case.pieces,
        draw=case.draw,
        place=ill.place,
        protocol=ill.protocol,
        seed=ill.seed,
        objects=len(layout.placements),
        damaged=ill.damage.ids,
        v_damaged=result.before.v,
        v=judged.v,
        moved=sum(kind in ("moved", "resettled") for kind in kinds),
        added=kinds.count("added"),
        missing=judged.missing,
        free_standing=judged.free_standing,
        errors=judged.errors,
        warnings=judged.warnings,
        outside=judged.outside,
        repaired=judged.repaired,
    )
    return row, round(seconds, DIGITS)
