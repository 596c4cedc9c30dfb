"""Table 4: policies in layouts before and after the refinement for navigation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, ClassVar

from labgym.documents import Record, canonical_hash
from labgym.errors import OptionError
from labgym.eval.driving.files import short_name
from labgym.eval.driving.intervals import bounded_mean
from labgym.eval.labnav.together import Entrant
from labgym.eval.reports.paper import paper
from labgym.layouts.method import Method
from labgym.paper.reproduction.cases import ROOM, StudyVariant
from labgym.paper.reproduction.drives import DRIVE_SEED, StudyDriveRow, drive_case
from labgym.paper.reproduction.figures import (
    FigureCell,
    FigureColumn,
    FigureLine,
    FigureTable,
    PublishedFigures,
    estimate_cell,
    mean_cell,
    paper_line,
)
from labgym.paper.reproduction.study import Study, code_facts
from labgym.policies.kernels import kernel_mode
from labgym.policies.process import close_shared_process
from labgym.policies.registry import BUILT_IN
from labgym.protocols import Protocol
from labgym.runs import Shard

PROPOSAL, BEFORE, AFTER = "proposal", "before", "after"
POLICIES = ("astar", "bug2", "dwa", "straight", "iplanner", "lidar-lstm", "navdp", "ppo", "ppo-depth")
QUICK_POLICIES = ("astar", "iplanner")
DIFFERENCES = {
    (BEFORE, AFTER): "with refinement minus without",
    (PROPOSAL, AFTER): "with refinement minus proposal alone",
}
COLUMNS = (
    FigureColumn(key="sr", heading="Success ↑"),
    FigureColumn(key="spl", heading="SPL ↑"),
    FigureColumn(key="free", heading="Success without contact ↑"),
    FigureColumn(key="path", heading="Transitions with a path ↑"),
)


@dataclass(frozen=True)
class NavigationStudy(Study[StudyDriveRow]):
    """Policies, each in the same laboratories before and after refinement.

    Attributes:
        policies: names or files. proposer: name of the proposer of the layouts.
        protocols, seeds: of the layouts. profile: thresholds.
        model: name of the language model that the proposer asks; empty without one.
    """

    policies: tuple[str, ...]
    proposer: str
    protocols: tuple[Protocol, ...]
    seeds: range
    profile: str = "default"
    model: str = ""
    name: ClassVar[str] = "navigation"
    unit: ClassVar[str] = "laboratory"
    row: ClassVar[type[Record]] = StudyDriveRow

    @property
    def labels(self) -> dict[str, str]:
        """The policies by their names in tables.

        Raises:
            OptionError: two have the same.
        """
        labels = {short_name(policy): policy for policy in self.policies}
        if len(labels) < len(self.policies):
            raise OptionError(f"policies {', '.join(self.policies)}: two have the same name; rename a file")
        return labels

    def variants(self) -> tuple[StudyVariant, ...]:
        """Return the proposal alone, and the paper's phases without and with the refinement.

        The optimization follows no facility rules: they keep ways clear, so that nothing would be left to refine.
        """
        proposal = Method(proposer=self.proposer, optimise=False, refine=False, on_failure="keep")
        before = Method(proposer=self.proposer, refine=False, facility=False, on_failure="keep")
        after = Method(proposer=self.proposer, facility=False, on_failure="keep")
        return (
            StudyVariant(PROPOSAL, "proposal alone", proposal),
            StudyVariant(BEFORE, "without refinement", before),
            StudyVariant(AFTER, "with refinement", after),
        )

    def inputs(self) -> dict[str, Any]:
        """Return policies, methods, protocols by hash, seeds and kernels."""
        return {
            "policies": {label: Entrant.of(policy).fingerprint for label, policy in self.labels.items()},
            "proposer": self.proposer,
            "variants": {variant.key: variant.method.options for variant in self.variants()},
            "protocols": {protocol.id: canonical_hash(protocol.to_json()) for protocol in self.protocols},
            "seeds": list(self.seeds),
            "room": ROOM,
            "profile": self.profile,
            "model": self.model,
            "kernels": kernel_mode(None).name,
        }

    def shards(self) -> Sequence[Shard]:
        """Return a shard for each policy, protocol and seed; those of a policy are consecutive."""
        return tuple(
            Shard(
                f"{label}/{protocol.id}-{seed}",
                drive_case,
                (label, policy, self.variants(), protocol, seed, self.profile),
            )
            for label, policy in self.labels.items()
            for protocol in self.protocols
            for seed in self.seeds
        )

    def figures(self, rows: Sequence[StudyDriveRow]) -> PublishedFigures:
        """Return Table 4, and the paired differences."""
        close_shared_process()  # Of the last policy, if the cases ran in this process.
        printed = paper().navigation
        counts = {(row.protocol, row.seed, row.index) for row in rows}
        return PublishedFigures(
            study=self.name,
            title="Navigation before and after refinement",
            source=printed.source.partition(":")[0],
            summary=(
                f"{len(counts)} transitions in {len(self.protocols) * len(self.seeds)} laboratories of the proposer "
                f"{self.proposer}: the proposals alone, and the layouts without and with refinement; by "
                f"{len(self.policies)} policies.",
            ),
            facts={
                "policies": ", ".join(self.labels),
                "proposer": self.proposer,
                "protocols": f"{len(self.protocols)}: {', '.join(protocol.id for protocol in self.protocols)}",
                "seeds": f"layouts {self.seeds[0]} to {self.seeds[-1]}, policies {DRIVE_SEED}",
                "room": f"preset {ROOM}",
                "rules": "success within 0.5 m, as in the published suites; rule set paper",
                "kernels": kernel_mode(None).name,
                **code_facts(),
            },
            tables=(self._table(rows), self._differences(rows)),
        )

    def _table(self, rows: Sequence[StudyDriveRow]) -> FigureTable:
        lines = []
        for policy in self.labels:
            for variant in self.variants():
                own = [row for row in rows if row.policy == policy and row.variant == variant.key]
                lines.append(FigureLine(name=f"{policy}, {variant.title}", cells=_means(own)))
        columns = COLUMNS
        return FigureTable(
            key="paper",
            title="Point-goal navigation",
            first="Policy",
            columns=columns,
            lines=(*lines, *(paper_line(row, columns) for row in paper().navigation.rows)),
            notes=(
                "Brackets: 95% intervals clustered by protocol; the paper gives none.",
                "All layouts but the proposals: optimized for geometry and chemistry alone, as in the paper "
                "(labgym generate --no-facility).",
                "A transition counts as failed, with SPL 0, if a location is not placed; SPL is also 0 if no path "
                "exists for a disc of 0.30 m.",
                "The paper's policies were trained in households, those that labgym ships in its laboratories: only "
                "the level of a policy that saw no laboratory compares with the paper's.",
            ),
        )

    def _differences(self, rows: Sequence[StudyDriveRow]) -> FigureTable:
        """Return what the refinement changes for each policy, and what the others lack of the first in its layouts."""
        groups: dict[tuple[str, str], list[StudyDriveRow]] = {
            (name, state): [] for name in self.labels for state in (PROPOSAL, BEFORE, AFTER)
        }
        for row in rows:
            groups[row.policy, row.variant].append(row)
        base, *others = self.labels
        pairs = {
            f"{name}, {title}": (groups[name, first], groups[name, second])
            for name in self.labels
            for (first, second), title in DIFFERENCES.items()
        }
        pairs |= {
            f"{name} minus {base}, with refinement": (groups[base, AFTER], groups[name, AFTER]) for name in others
        }
        return FigureTable(
            key="differences",
            title="Paired differences",
            first="Policy",
            columns=COLUMNS,
            lines=tuple(FigureLine(name=name, cells=_paired(*pair)) for name, pair in pairs.items()),
            notes=("Over the transitions that exist in both layouts.",),
        )


def installed(policies: Sequence[str]) -> tuple[str, ...]:
    """Return the built-in policies whose packages are installed."""
    torch = find_spec("torch") is not None
    return tuple(policy for policy in policies if torch or not BUILT_IN[policy].extra)


def _values(row: StudyDriveRow) -> dict[str, float]:
    free = row.success and row.contacts == 0
    return {"sr": float(row.success), "spl": row.spl, "free": float(free), "path": float(row.path)}


def _means(rows: Sequence[StudyDriveRow]) -> dict[str, FigureCell]:
    clusters = [row.protocol for row in rows]
    return {column.key: mean_cell([_values(row)[column.key] for row in rows], clusters, "share") for column in COLUMNS}


def _paired(first: Sequence[StudyDriveRow], second: Sequence[StudyDriveRow]) -> dict[str, FigureCell]:
    before, after = ({(row.protocol, row.seed, row.index): _values(row) for row in rows} for rows in (first, second))
    shared = [key for key in before if key in after]
    return {
        column.key: estimate_cell(
            bounded_mean(
                [after[key][column.key] - before[key][column.key] for key in shared], [key[0] for key in shared], -1.0
            ),
            [key[0] for key in shared],
        )
        for column in COLUMNS
    }
