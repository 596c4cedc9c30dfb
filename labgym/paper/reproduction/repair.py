"""The damage benchmark: laboratories damaged in ten kinds, repaired, and judged by the rules and by other code."""

from __future__ import annotations

import json
import statistics
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from labgym.counts import whole_number
from labgym.documents import Record
from labgym.errors import OptionError
from labgym.layouts.rules.rule_sets import PAPER, rule_set
from labgym.layouts.rules.thresholds import profile as resolve_profile
from labgym.paper.damage import KINDS
from labgym.paper.repairs.cases import CLUTTER, DRAWS, PIECES, PLACES, RepairCase, cases
from labgym.paper.repairs.rows import RepairRow, repair_row
from labgym.paper.reproduction.figures import (
    FigureCell,
    FigureColumn,
    FigureLine,
    FigureTable,
    PublishedFigures,
    mean_cell,
    plain_cells,
)
from labgym.paper.reproduction.page import StudySection
from labgym.paper.reproduction.study import Study, code_facts, rows_output
from labgym.runs import Shard, ShardOutput
from labgym.runs.folder import SHARDS

MAX_DRAWS = 1000
LAST_SEED = 2**32 - 1
COLUMNS = (
    FigureColumn(key="cases", heading="Cases", digits=0),
    FigureColumn(key="repaired", heading="Repaired"),
    FigureColumn(key="clear", heading="v = 0"),
    FigureColumn(key="sound", heading="... and nothing missing, no facility error"),
    FigureColumn(key="confirmed", heading="Confirmed from outside"),
    FigureColumn(key="moved", heading="Objects moved"),
)
NOTES = (
    "Repaired: v = 0, nothing missing, no facility error, no wall unit left standing free, no more facility warnings "
    "than before the damage, and no finding of the independent judge (labgym.eval.outside) that the sound layout has "
    "not.",
    "Confirmed from outside: the independent judge finds nothing new.",
    "Objects moved: share of all objects, without what moves along on its support.",
)


@dataclass(frozen=True)
class RepairStudy(Study[RepairRow]):
    """The damage benchmark.

    Attributes:
        draws: number of cases of each kind and number of pieces. seed: of the cases. profile: name of the thresholds.
        pieces: numbers of damaged pieces.

    Raises:
        OptionError: the number of draws, of pieces or the seed is out of range.
        UnknownNameError: no profile has that name.
    """

    draws: int = DRAWS
    seed: int = 1
    profile: str = "default"
    pieces: tuple[int, ...] = PIECES
    name: ClassVar[str] = "repair"
    unit: ClassVar[str] = "shard"
    row: ClassVar[type[Record]] = RepairRow

    def __post_init__(self) -> None:
        if not 1 <= self.draws <= MAX_DRAWS:
            raise OptionError(f"draws {self.draws} must be 1 to {MAX_DRAWS}")
        whole_number("seed", self.seed, 0, LAST_SEED)
        if not self.pieces or not set(self.pieces) <= set(PIECES):
            raise OptionError(f"pieces {self.pieces} must be some of {', '.join(map(str, PIECES))}")
        resolve_profile(self.profile)

    def inputs(self) -> dict[str, Any]:
        """Return the arguments."""
        return {"draws": self.draws, "seed": self.seed, "profile": self.profile, "pieces": list(self.pieces)}

    def shards(self) -> Sequence[Shard]:
        """Return a shard for each kind and number of pieces."""
        groups: dict[str, list[RepairCase]] = {}
        for case in cases(self.draws, self.pieces):
            groups.setdefault(f"{case.kind}-{case.pieces}", []).append(case)
        return tuple(
            Shard(name, repair_cases, (name, tuple(group), self.seed, self.profile)) for name, group in groups.items()
        )

    def figures(self, rows: Sequence[RepairRow]) -> PublishedFigures:
        """Return the shares of repaired layouts by kind, by number of pieces and by place."""
        kinds = [_line(f"{kind}: {KINDS[kind].title}", [row for row in rows if row.kind == kind]) for kind in KINDS]
        numbers = [_line(f"{n}", [row for row in rows if row.pieces == n]) for n in self.pieces]
        places = [_line(place, here) for place in PLACES if (here := [row for row in rows if row.place == place])]
        repaired = sum(row.repaired for row in rows)
        least = min(KINDS, key=lambda kind: _share(rows, lambda row: row.kind == kind))
        summary = (
            f"{repaired} of {len(rows)} damaged layouts are repaired ({repaired / len(rows):.1%}); the kind with the "
            f"smallest share is {least} ({_share(rows, lambda row: row.kind == least):.1%}).",
            f"A repair moves {statistics.mean(row.moved_share for row in rows):.1%} of the objects on average.",
        )
        facts = {
            "rules": f"{PAPER.name}, profile {self.profile}",
            "cases": f"{len(KINDS)} kinds x {len(self.pieces)} numbers of pieces x {self.draws}, seed {self.seed}",
            "laboratories": f"generated: {', '.join(PLACES)}; levels of clutter {sorted(set(CLUTTER))}",
            **code_facts(),
        }
        everything = _line("all", rows)
        tables = (
            FigureTable(
                key="kinds", title="Repair by kind of damage", first="Damage", columns=COLUMNS,
                lines=(*kinds, everything), notes=NOTES,
            ),
            FigureTable(
                key="pieces", title="Repair by number of damaged pieces", first="Pieces", columns=COLUMNS,
                lines=tuple(numbers),
            ),
            FigureTable(
                key="places", title="Repair by laboratory", first="Laboratory", columns=COLUMNS, lines=tuple(places),
            ),
            _faults(rows),
        )  # fmt: skip
        return PublishedFigures(
            study=self.name, title="Repair of damaged layouts", source="", summary=summary, facts=facts, tables=tables
        )

    def sections(self, rows: Sequence[RepairRow], folder: Path) -> Sequence[StudySection]:
        """Return the cases that are not repaired."""
        del folder
        lines = tuple(
            f"{row.kind}, {row.pieces} pieces, draw {row.draw} ({row.protocol}, {row.place}, seed {row.seed}): "
            f"v {row.v}; {', '.join((*row.missing, *row.free_standing, *row.errors, *row.warnings, *row.outside))}"
            for row in rows
            if not row.repaired
        )
        return (StudySection("Cases that are not repaired", lines or ("None.",)),)


def repair_cases(name: str, group: Sequence[RepairCase], seed: int, profile: str) -> ShardOutput:
    """Return the rows of some cases; their processor times, which differ from run to run, are in a separate file."""
    rules = rule_set(PAPER, profile)
    results = [repair_row(case, seed, rules) for case in group]
    seconds = json.dumps([time for _, time in results]).encode()
    return rows_output(name, (row for row, _ in results), {f"{SHARDS}/{name}-seconds.json": seconds})


def _share(rows: Sequence[RepairRow], chosen: Callable[[RepairRow], bool]) -> float:
    outcomes = [row.repaired for row in rows if chosen(row)]
    return sum(outcomes) / len(outcomes) if outcomes else 1.0


def _line(name: str, rows: Sequence[RepairRow]) -> FigureLine:
    protocols = [row.protocol for row in rows]
    sound = [not (row.v or row.missing or row.free_standing or row.errors) for row in rows]
    measures: dict[str, list[float]] = {
        "repaired": [float(row.repaired) for row in rows],
        "clear": [float(row.v == 0) for row in rows],
        "sound": [float(one) for one in sound],
        "confirmed": [float(not row.outside) for row in rows],
        "moved": [row.moved_share for row in rows],
    }
    cells: dict[str, FigureCell] = plain_cells({"cases": float(len(rows))})
    cells |= {key: mean_cell(values, protocols, "share") for key, values in measures.items()}
    return FigureLine(name=name, cells=cells)


def _faults(rows: Sequence[RepairRow]) -> FigureTable:
    """Return how many layouts have each fault after the repair."""
    counts: Counter[str] = Counter()
    for row in rows:
        counts.update({"violations": row.v > 0, "missing": bool(row.missing), "free standing": bool(row.free_standing)})
        counts.update(f"error: {rule}" for rule in set(row.errors))
        counts.update(f"warning: {rule}" for rule in set(row.warnings))
        counts.update(f"outside: {kind}" for kind in set(row.outside))
    lines = tuple(
        FigureLine(name=fault, cells=plain_cells({"layouts": float(count)})) for fault, count in sorted(counts.items())
    )
    columns = (FigureColumn(key="layouts", heading="Layouts", digits=0),)
    return FigureTable(key="faults", title="Faults after the repair", first="Fault", columns=columns, lines=lines)
