"""One layout of a variant of the method: generated for a protocol and a seed, scored, and kept in the run's folder."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pydantic import Field

from labgym.documents import Record, json_bytes
from labgym.errors import InfeasibleError
from labgym.eval.scoring.judgement import JudgeOptions
from labgym.eval.scoring.layout_report import LayoutReport
from labgym.eval.scoring.score import score
from labgym.layouts.generate import generate_assessed, resolve_request
from labgym.layouts.method import Method
from labgym.layouts.model import Layout
from labgym.layouts.phases import FAILURES
from labgym.layouts.rules.rule_sets import PAPER, TOUCHSTONE
from labgym.layouts.trace import Recorder
from labgym.llm import LanguageModel
from labgym.llm.errors import LanguageModelError
from labgym.llm.rounds import UNUSABLE
from labgym.paper.pure import optimized, refined
from labgym.paper.reproduction.blindfold import Hidden, blindfolded
from labgym.paper.reproduction.measures import origin_metrics, report_metrics, report_metrics_2
from labgym.paper.reproduction.study import rows_output
from labgym.protocols import Protocol
from labgym.runs import Shard, ShardOutput

ROOM = "bay"
"""Room preset of all layouts: 8 x 8 m, two doors."""
DESIGNERS = {"table": "seeded table"}
"""What stands in for a language model, by its name in provenance."""


@dataclass(frozen=True)
class StudyVariant:
    """A generator of layouts, as a line of a table.

    Attributes:
        key: name in paths and rows. title: name in tables.
        method: proposer and phases.
        hidden: what the method does not see.
        pure: whether the phases of the method are those of `labgym.paper.pure`.
    """

    key: str
    title: str
    method: Method
    hidden: Hidden = "nothing"
    pure: bool = False

    def inputs(self) -> dict[str, Any]:
        """Return what decides its layouts, and its names, as JSON data."""
        proposer = self.method.proposer
        return {
            "key": self.key,
            "title": self.title,
            "proposer": proposer if isinstance(proposer, str) else type(proposer).__name__,
            "method": self.method.options,
            "hidden": self.hidden,
            "pure": self.pure,
        }


class LayoutRow(Record):
    """A layout of a variant, or the reason why it has none.

    Attributes:
        variant: key of the variant. protocol: id. seed: seed.
        generator: name of what proposed the layout, from its provenance. made_by: the model or table that it asked.
        file: path of the layout in the folder; None without one, like all that follows.
        hash: of the layout.
        valid: whether it has no violation, no facility error and all required assets.
        v: number of hard violations.
        transitions: number of the protocol's transitions.
        metrics: metrics under the rule set `paper` by name; None if one does not apply. In addition the outcomes under
            `touchstone`, the share of the objects that stand where they were proposed (`survives`), the number of the
            others (`placed`), and the processor time (`cpu`, seconds), which alone differs from run to run.
        valid_2, metrics_2: the same under `touchstone`.
        failure: why there is no layout.
    """

    variant: str
    protocol: str
    seed: int
    generator: str = ""
    made_by: str = ""
    file: str | None = None
    hash: str | None = None
    valid: bool = False
    v: int | None = None
    transitions: int = 0
    metrics: dict[str, float | None] = Field(default_factory=dict)
    valid_2: bool = False
    metrics_2: dict[str, float | None] = Field(default_factory=dict)
    failure: str | None = None

    def layout(self, folder: Path) -> Layout | None:
        """Return the layout of the row from the run's folder; None without one."""
        return None if self.file is None else Layout.load(folder / self.file)


def layout_shards(
    variants: tuple[StudyVariant, ...],
    protocols: tuple[Protocol, ...],
    seeds: range,
    profile: str,
    judge: JudgeOptions | None = None,
) -> tuple[Shard, ...]:
    """Return a shard for each variant, protocol and seed, in this order."""
    return tuple(
        Shard(f"{variant.key}/{protocol.id}-{seed}", measure, (variant, protocol, seed, profile, judge))
        for variant in variants
        for protocol in protocols
        for seed in seeds
    )


def measure(
    variant: StudyVariant, protocol: Protocol, seed: int, profile: str, judge: JudgeOptions | None = None
) -> ShardOutput:
    """Generate and score a layout; a protocol without a layout is a row, not an error.

    Args:
        variant, protocol, seed, profile: what to generate.
        judge: how the configured vision-language model judges the layout; None for no judge.

    Raises:
        LanguageModelError: a model that is asked is not configured or cannot be reached.
    """
    name = f"{variant.key}/{protocol.id}-{seed}"
    start = time.process_time()
    try:
        layout, proposal = layout_of(variant, protocol, seed, profile)
    except InfeasibleError as error:
        return rows_output(
            name, [LayoutRow(variant=variant.key, protocol=protocol.id, seed=seed, failure=str(error)[:500])]
        )
    seconds = time.process_time() - start
    report = score(layout, protocol, PAPER, profile, contacts=False)
    if judge is not None:
        report = judged(report, layout, protocol, judge)
    second = score(layout, protocol, TOUCHSTONE, profile, contacts=False)
    metrics_2 = report_metrics_2(second)
    row = LayoutRow(
        variant=variant.key,
        protocol=protocol.id,
        seed=seed,
        generator=layout.provenance.generator,
        made_by=made_by(layout),
        file=f"layouts/{name}.json",
        hash=layout.hash,
        valid=report.passed,
        v=report.v,
        transitions=report.transitions,
        metrics=report_metrics(report)
        | {
            **{name: metrics_2[name] for name in ("walk", "reach", "facility")},
            **origin_metrics(layout, proposal),
            "cpu": round(seconds, 1),
        },
        valid_2=second.passed,
        metrics_2=metrics_2,
    )
    return rows_output(name, [row], {f"layouts/{name}.json": json_bytes(layout.to_json())})


def judged(report: LayoutReport, layout: Layout, protocol: Protocol, judge: JudgeOptions) -> LayoutReport:
    """Return a report with the scores of the configured model; without them if no answer is usable.

    Raises:
        LanguageModelError: the model is not configured or cannot be reached.
    """
    from labgym.eval.scoring.judge import Judge  # imported here because it loads the renderer

    with LanguageModel.from_environment() as model:
        try:
            return Judge(model, judge).completed(report, layout, protocol)
        except LanguageModelError as error:
            if error.reason not in UNUSABLE:
                raise
            return report


class _ProposalKeeper(Recorder):
    """Keeps the proposal of a layout, and records nothing else."""

    proposal: Layout

    def begin(self, layout: Layout, *_: Any, **__: Any) -> None:
        """Keep the first state."""
        if not hasattr(self, "proposal"):
            self.proposal = layout

    def trial(self, *_: Any, **__: Any) -> None:
        """Do nothing."""

    def refuse(self, *_: Any, **__: Any) -> None:
        """Do nothing."""

    def update(self, *_: Any) -> None:
        """Do nothing."""


def layout_of(variant: StudyVariant, protocol: Protocol, seed: int, profile: str) -> tuple[Layout, Layout]:
    """Return the layout of a variant, with the whole catalog and the whole protocol, and what was proposed for it.

    Raises:
        InfeasibleError: the room cannot hold what the variant must place.
    """
    request = resolve_request(protocol, seed, ROOM, profile, None, (), rules=PAPER)
    known, keeper, method = blindfolded(request, variant.hidden), _ProposalKeeper(), variant.method
    if variant.pure:
        layout, _ = generate_assessed(known, replace(method, optimise=False, refine=False), keeper)
        if method.optimise:
            layout = optimized(layout, known.protocol, known.rules)
        if method.refine:
            layout = refined(layout, known.protocol, known.rules, method.optimise)
        layout = _as_pure(layout, method)
    else:
        layout, _ = generate_assessed(known, method, keeper)
    whole = Layout(
        catalog=request.catalog,
        id=layout.id,
        protocols=(protocol,),
        floor=layout.floor,
        placements=layout.placements,
        provenance=layout.provenance,
    )
    return layout if variant.hidden == "nothing" else whole, keeper.proposal


def _as_pure(layout: Layout, method: Method) -> Layout:
    """Return a layout whose provenance names the method, and not the faults of the proposal."""
    proposed = layout.provenance.options.items()
    options = {name: value for name, value in proposed if name not in (FAILURES, "optimise", "refine")}
    provenance = layout.provenance.model_copy(update={"options": options | method.options | {"phases": "pure"}})
    return layout.replace(provenance=provenance)


def made_by(layout: Layout) -> str:
    """Return the language model that designed a layout, or what stood in for it; empty if the method has none."""
    options = layout.provenance.options
    return str(options["model"]) if "model" in options else DESIGNERS.get(str(options.get("designer", "")), "")
