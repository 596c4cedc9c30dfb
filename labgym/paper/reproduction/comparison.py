"""Table 2: generators of layouts, under one set of metrics."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from labgym.documents import Record, canonical_hash
from labgym.eval.reports.paper import PaperTable, paper
from labgym.eval.scoring.judgement import JudgeOptions
from labgym.layouts.method import Method, proposer_names
from labgym.paper.reproduction.cases import ROOM, LayoutRow, StudyVariant, layout_shards
from labgym.paper.reproduction.figures import PublishedFigures
from labgym.paper.reproduction.layout_tables import own_table, paper_table, second_table
from labgym.paper.reproduction.page import StudySection
from labgym.paper.reproduction.plates import comparison_section, failure_section
from labgym.paper.reproduction.study import Study, code_facts
from labgym.protocols import Protocol
from labgym.runs import Shard

PICTURED = 2
"""Number of protocols whose layouts are drawn next to each other."""


@dataclass(frozen=True)
class LayoutStudy(Study[LayoutRow]):
    """Layouts of several variants for the same protocols and seeds, scored alike.

    Attributes:
        variants: what is compared. protocols: requests. seeds: seeds of each.
        profile: thresholds.
        model: name of the language model that some variants and the judge ask; empty without one.
        judge: how the model judges pictures of the layouts; None for no judge.
    """

    variants: tuple[StudyVariant, ...]
    protocols: tuple[Protocol, ...]
    seeds: range
    profile: str = "default"
    model: str = ""
    judge: JudgeOptions | None = None
    unit: ClassVar[str] = "layout"
    row: ClassVar[type[Record]] = LayoutRow
    title: ClassVar[str]
    heading: ClassVar[str]

    def inputs(self) -> dict[str, Any]:
        """Return variants, protocols by hash, seeds and thresholds."""
        return {
            "variants": [variant.inputs() for variant in self.variants],
            "protocols": {protocol.id: canonical_hash(protocol.to_json()) for protocol in self.protocols},
            "seeds": list(self.seeds),
            "room": ROOM,
            "profile": self.profile,
            "model": self.model,
            "judge": None if self.judge is None else [self.judge.label, self.judge.samples],
        }

    def shards(self) -> Sequence[Shard]:
        """Return a shard for each variant, protocol and seed."""
        return layout_shards(self.variants, self.protocols, self.seeds, self.profile, self.judge)

    @abstractmethod
    def printed(self) -> PaperTable:
        """Return the paper's table."""

    def figures(self, rows: Sequence[LayoutRow]) -> PublishedFigures:
        """Return the table with the paper's columns, and one of further metrics."""
        printed = self.printed()
        return PublishedFigures(
            study=self.name,
            title=self.title,
            source=printed.source.partition(":")[0],
            summary=self.summary(rows),
            facts={
                "rules": f"paper and touchstone, profile {self.profile}",
                "protocols": f"{len(self.protocols)}: {', '.join(protocol.id for protocol in self.protocols)}",
                "seeds": f"{self.seeds[0]} to {self.seeds[-1]}" if len(self.seeds) > 1 else str(self.seeds[0]),
                "room": f"preset {ROOM}",
                "language model": self.model or "none: seeded tables stand in for it",
                "judge": "none" if self.judge is None else f"{self.judge.label}, {self.judge.samples} samples",
                **code_facts(),
            },
            tables=(
                paper_table(rows, self.variants, printed, self.heading),
                own_table(rows, self.variants),
                second_table(rows, self.variants),
            ),
        )

    def summary(self, rows: Sequence[LayoutRow]) -> tuple[str, ...]:
        """Return the share of valid layouts of each variant under both versions, in words."""
        lines = []
        for variant in self.variants:
            own = [row for row in rows if row.variant == variant.key]
            first, second = sum(row.valid for row in own), sum(row.valid_2 for row in own)
            lines.append(f"{variant.title}: {first} and {second} of {len(own)}")
        return (f"Valid layouts under the rule sets paper and touchstone: {'; '.join(lines)}.",)

    def sections(self, rows: Sequence[LayoutRow], folder: Path) -> Sequence[StudySection]:
        """Return the layouts of some protocols by every variant, and the failures."""
        step = max(1, len(self.protocols) // PICTURED)
        chosen = self.protocols[::step][:PICTURED]
        return (
            *(comparison_section(rows, self.variants, one, folder, self.profile) for one in chosen),
            failure_section(rows, self.variants, self.protocols, folder, self.profile),
        )


@dataclass(frozen=True)
class ComparisonStudy(LayoutStudy):
    """labgym's generators and the paper's rivals."""

    name: ClassVar[str] = "comparison"
    title: ClassVar[str] = "Comparison with other generators"
    heading: ClassVar[str] = "Generators of layouts"

    def printed(self) -> PaperTable:
        """Return Table 2."""
        return paper().layouts


def comparison_variants(model: bool) -> tuple[StudyVariant, ...]:
    """Return the generators of the comparison that are installed.

    Args:
        model: whether a language model is configured.
    """
    whole = {"on_failure": "keep"}
    raw = {"optimise": False, "refine": False, **whole}
    candidates = (
        ("solver", "solver", whole),
        ("sampler", "sampler", whole),
        ("sampler", "sampler, dressed", {**whole, "dress": "always"}),
        ("sampler", "sampler, proposal alone", raw),
        *((("llm", "llm", whole), ("llm", "llm, proposal alone", raw)) if model else ()),
        ("holodeck", "holodeck", raw),
        ("sceneweaver", "sceneweaver", raw),
        ("holodeck+", "holodeck+", raw),
        *((("holodeck-llm", "holodeck-llm", raw), ("sceneweaver-llm", "sceneweaver-llm", raw)) if model else ()),
        *((("holodeck+-llm", "holodeck+-llm", raw),) if model else ()),
    )
    return tuple(
        StudyVariant(_key(title), title, Method(proposer=proposer, **arguments))
        for proposer, title, arguments in candidates
        if proposer in proposer_names()
    )


def _key(title: str) -> str:
    """Return a title as a name of folders."""
    return title.replace(",", "").replace("+", "-plus").replace(" ", "-")
