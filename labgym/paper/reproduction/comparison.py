"""Tables 2 and 3: generators of layouts, and the method without one of its parts, under one set of metrics.

Two proposers are controls: no proposal, and a heap. A table in which they do as well as the others shows nothing of
those.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar, Literal, get_args

from labgym.documents import Record, canonical_hash
from labgym.errors import check_name
from labgym.eval.reports.paper import PaperTable, paper
from labgym.eval.scoring.judgement import JudgeOptions
from labgym.layouts.method import SOLVER, Method, Proposer
from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.paper.reproduction.cases import ROOM, LayoutRow, StudyVariant, layout_shards
from labgym.paper.reproduction.contrasts import contrast_table, losses
from labgym.paper.reproduction.figures import FEWEST_PROTOCOLS, PublishedFigures
from labgym.paper.reproduction.layout_tables import SAMPLER, own_table, paper_table, second_table
from labgym.paper.reproduction.page import StudySection
from labgym.paper.reproduction.plates import comparison_section, failure_section
from labgym.paper.reproduction.ranking import ranking_lines, ranking_shards
from labgym.paper.reproduction.study import Study, code_facts
from labgym.paper.rivals import HolodeckProposer, SceneWeaverProposer
from labgym.paper.rivals.chamber import chambers
from labgym.paper.rivals.language import SceneWeaverLanguageProposer
from labgym.paper.rivals.piece import RivalPiece, layout_of, named, numbers_in_use
from labgym.paper.rivals.plan import Grade, household_plan
from labgym.paper.rivals.protocol_plan import required_pieces
from labgym.protocols import Protocol
from labgym.runs import Shard


@dataclass(frozen=True)
class NothingProposer:
    """Proposes nothing: the room with its fixed objects."""

    def propose(self, request: Request) -> Layout:
        """Return the empty room."""
        return layout_of(request, (), "nothing", {})


@dataclass(frozen=True)
class HeapProposer:
    """Proposes all that the protocol requires in a heap at the center of the room, items in a heap on their piece."""

    def propose(self, request: Request) -> Layout:
        """Return the heap, in the largest laboratory space."""
        chamber, counts = chambers(request)[0], numbers_in_use(request)
        x, y = chamber.ground.width / 2.0, chamber.ground.depth / 2.0
        pieces: list[RivalPiece] = []
        for large in required_pieces(request):
            home = RivalPiece(named(counts, large.asset), large.asset, x, y, 0.0)
            pieces.append(home)
            for top in large.tops:
                spot = home.surface(0)
                pieces.append(RivalPiece(named(counts, top), top, spot.x, spot.y, 0.0, spot.z0, home.id, 0))
        return layout_of(request, [(chamber, pieces)], "heap", {})


Mode = Literal["raw", "pure", "full"]
"""What follows a proposal: nothing, the paper's phases alone (`labgym.paper.pure`), or labgym's."""
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
        """Return a shard for each variant, protocol and seed; with a judge also those that show whether it can rank."""
        layouts = layout_shards(self.variants, self.protocols, self.seeds, self.profile, self.judge)
        return (*layouts, *ranking_shards(self.judge))

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
        return (f"Valid layouts under the rule sets paper and touchstone: {'; '.join(lines)}.", *ranking_lines(rows))

    def sections(self, rows: Sequence[LayoutRow], folder: Path) -> Sequence[StudySection]:
        """Return the layouts of some protocols by every variant, and the failures."""
        step = max(1, len(self.protocols) // PICTURED)
        chosen = self.protocols[::step][:PICTURED]
        drawn = tuple(variant for variant in self.variants if not variant.pure)
        return (
            *(comparison_section(rows, drawn, one, folder, self.profile) for one in chosen),
            failure_section(rows, drawn, self.protocols, folder, self.profile),
        )


@dataclass(frozen=True)
class ComparisonStudy(LayoutStudy):
    """labgym's generators, the paper's rivals and controls, each raw, with the paper's phases and with labgym's."""

    name: ClassVar[str] = "comparison"
    title: ClassVar[str] = "Comparison with other generators"
    heading: ClassVar[str] = "Generators of layouts"

    def printed(self) -> PaperTable:
        """Return Table 2."""
        return paper().layouts

    def figures(self, rows: Sequence[LayoutRow]) -> PublishedFigures:
        """Return the tables, with the differences between proposers after the same phases."""
        figures = super().figures(rows)
        pairs = [(mode, self._after(mode), self._base(mode)) for mode in ("full", "pure")]
        contrasts = tuple(contrast_table(rows, mode, others, base) for mode, others, base in pairs if base is not None)
        return figures.model_copy(update={"tables": (*figures.tables, *contrasts)})

    def summary(self, rows: Sequence[LayoutRow]) -> tuple[str, ...]:
        """Return the valid layouts, and whether no proposal at all loses an outcome against the sampler's."""
        variants = {variant.key: variant for variant in self._after("full")}
        nothing, base = variants.get("nothing-full"), self._base("full")
        lines = super().summary(rows)
        if nothing is None or base is None or len(self.protocols) < FEWEST_PROTOCOLS:
            return lines
        lost = ", ".join(losses(rows, nothing, base))
        verdict = f"in {lost}" if lost else "in no outcome: after all phases, the table shows no use of the proposer"
        return (*lines, f"{nothing.title} is significantly worse than {base.title} {verdict}.")

    def _after(self, mode: Mode) -> tuple[StudyVariant, ...]:
        return tuple(variant for variant in self.variants if variant.key.endswith(f"-{mode}"))

    def _base(self, mode: Mode) -> StudyVariant | None:
        return next((variant for variant in self._after(mode) if variant.key == f"{SAMPLER}-{mode}"), None)


def proposers(
    model: bool, names: Sequence[str] = (), quick: bool = False, sees: bool = False
) -> dict[str, str | Proposer]:
    """Return the proposers of the studies by title: controls, labgym's, the rivals and grades of their stand-in.

    Args:
        model: whether a language model is configured.
        names: titles; by default all, without the grades if the study is quick.
        sees: whether the language model also judges pictures, which SceneWeaver then shows it.

    Raises:
        UnknownNameError: no proposer has that title; lists all.
    """
    asked = ("llm", "holodeck-llm", "sceneweaver-llm", "holodeck+-llm") if model else ()
    graded: dict[str, str | Proposer] = {}
    for grade in get_args(Grade)[1:]:
        designer = partial(household_plan, grade=grade)
        graded[f"holodeck-{grade}"] = HolodeckProposer(designer=designer)
        graded[f"sceneweaver-{grade}"] = SceneWeaverProposer(designer=designer, grade=grade)
    named: dict[str, str | Proposer] = {
        name: name for name in (SAMPLER, SOLVER, "holodeck", "sceneweaver", "holodeck+", *asked)
    }
    if model and sees:
        named["sceneweaver-llm"] = SceneWeaverLanguageProposer(sees=True)
    every = {"nothing": NothingProposer(), "heap": HeapProposer(), **named, **graded}
    for name in names:
        check_name("proposer", name, every)
    chosen = names or [name for name in every if not quick or name not in graded]
    return {name: every[name] for name in chosen}


def comparison_variants(chosen: Mapping[str, str | Proposer]) -> tuple[StudyVariant, ...]:
    """Return each proposer alone (raw), with the paper's phases (pure), and with labgym's (full)."""
    variants = []
    for title, proposer in chosen.items():
        whole = Method(proposer=proposer, on_failure="keep")
        bare = replace(whole, dress="never")
        raw = replace(bare, optimise=False, refine=False)
        for mode, method in (("raw", raw), ("pure", bare), ("full", whole)):
            key = f"{variant_key(title)}-{mode}"
            variants.append(StudyVariant(key, f"{title}: {mode}", method, pure=mode == "pure"))
    return tuple(variants)


def variant_key(title: str) -> str:
    """Return a title as a name of folders."""
    return title.replace("+", "-plus")


@dataclass(frozen=True)
class RepairAblation(LayoutStudy):
    """The whole method and the method without one of its parts."""

    name: ClassVar[str] = "ablation"
    title: ClassVar[str] = "Ablation"
    heading: ClassVar[str] = "The method without one of its parts"

    def printed(self) -> PaperTable:
        """Return Table 3."""
        return paper().ablation


def ablation_variants(title: str, proposer: str | Proposer) -> tuple[StudyVariant, ...]:
    """Return the paper's four ablations in its order, what labgym adds to its phases, and the whole method.

    In the paper the optimization considers geometry and chemistry alone, and only the refinement considers navigation.
    labgym's optimization also follows facility rules, which keep fronts and ways clear. Without refinement for
    navigation both are left out; two further lines leave out one of them. The paper's ablations follow with the paper's
    phases alone.
    """
    whole = Method(proposer=proposer, on_failure="keep")
    bare = replace(whole, dress="never")
    variants = (
        *_parts(whole, replace(whole, refine=False, facility=False), pure=False),
        StudyVariant("rules-alone", "facility rules, without refinement", replace(whole, refine=False)),
        StudyVariant("refinement-alone", "refinement, without facility rules", replace(whole, facility=False)),
        StudyVariant("whole", "whole method", whole),
        *_parts(bare, replace(bare, refine=False), pure=True),
        StudyVariant("pure", "pure, whole method", bare, pure=True),
    )
    name = variant_key(title)
    return tuple(replace(one, key=f"{name}-{one.key}", title=f"{title}: {one.title}") for one in variants)


def _parts(whole: Method, unrefined: Method, pure: bool) -> tuple[StudyVariant, ...]:
    """Return the four ablations of a method.

    Args:
        unrefined: the method without refinement for navigation.
        pure: whether the phases are the paper's alone.
    """
    key, title = ("pure-", "pure, ") if pure else ("", "")
    return (
        StudyVariant(f"{key}annotations", f"{title}without annotations", whole, "annotations", pure),
        StudyVariant(f"{key}protocol", f"{title}without protocol", whole, "protocol", pure),
        StudyVariant(
            f"{key}optimization",
            f"{title}without geometric and chemical optimization",
            replace(whole, optimise=False),
            pure=pure,
        ),
        StudyVariant(f"{key}refinement", f"{title}without refinement for navigation", unrefined, pure=pure),
    )
