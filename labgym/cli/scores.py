"""The command that scores layouts."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import arg

from labgym.cli.arguments import THIS_PROCESS, Execution, LayoutNames, OptionalPath, OptionalText
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.labbuilder import LABBUILDER, flag_library
from labgym.cli.outcome import DONE, FAILED, written
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.eval.scoring.judgement import JudgeOptions, Mode
    from labgym.runs import ExecutorOptions

OptionalMode = Annotated[
    Literal["strict", "medium", "lenient"] | None, arg(metavar="{strict,medium,lenient}", help_behavior_hint="")
]
MAX_LISTED = 20
"""Largest number of layouts that are named as failing."""


@refuses_idle_flags("score")
def score(
    layout: LayoutNames,
    *,
    protocol: OptionalText = None,
    profile: str = "default",
    rules: str = "touchstone",
    library: OptionalText = None,
    regulations: OptionalText = None,
    as_json: Annotated[bool, arg(name="json")] = False,
    check: bool = False,
    out: OptionalPath = None,
    execution: Execution = THIS_PROCESS,
    fresh: bool = False,
    judge: OptionalMode = None,
    samples: int = 3,
) -> int:
    """Score a layout: geometry, feasibility and chemical safety; list violations and warnings.

    Of several layouts, or of a folder, print the means.

    Args:
        layout: A layout's .json file, or the id of a published layout; also several, or folders of layouts.
        protocol: Id or .json file of the protocol to score the layouts for; by default the layout's own.
        profile: Thresholds: default, strict, paper or code.
        rules: Rule set: touchstone; paper, the definitions of the paper's columns; or labbuilder, what the evaluator
            that the paper's authors released computes, also of their scenes (docs/labbuilder.md).
        library: With --rules labbuilder, LabBuilder's assets_annotated.json, or catalog, for labgym's sizes and flags.
        regulations: Print what each clause of a profile says about one layout: US, EN or CN.
        as_json: Print the whole report as JSON; of several layouts the means.
        check: Exit 1 if a layout has a violation or a facility error, or lacks a required asset.
        out: Folder for scores.jsonl, with the report of each layout. An interrupted command resumes.
        fresh: With --out, move the files of the folder aside and start anew.
        judge: Let the configured vision-language model judge pictures of each layout, strict, medium or lenient
            (docs/language-models.md); with --rules labbuilder, by the rubric of the paper's authors.
        samples: With --judge, number of answers about each layout; their spread is reported.
    """
    from labgym.eval.scoring.judgement import JudgeOptions
    from labgym.llm import LanguageModelConfig

    if not layout:
        raise OptionError("no layout; name a file, a published layout or a folder of layouts")
    if regulations is not None:
        return _rulings(layout, regulations, as_json, check)
    if rules == LABBUILDER:
        return _labbuilder(layout, library, as_json, judge)
    options = None if judge is None else JudgeOptions(judge, samples)
    if options is not None:
        LanguageModelConfig.from_environment()  # before anything is computed
    if len(layout) > 1 or out is not None or Path(layout[0]).is_dir():
        return _score_many(
            layout,
            protocol=protocol,
            profile=profile,
            rules=rules,
            as_json=as_json,
            check=check,
            out=out,
            executor=execution.options(),
            fresh=fresh,
            judge=options,
        )
    import labgym.eval
    from labgym.cli.describe import layout_score
    from labgym.envs.tasks import resolve_layout

    named = resolve_layout(layout[0])
    report = labgym.eval.score(named, protocol, rules, profile)
    if options is not None:
        from labgym.eval.scoring.judge import Judge
        from labgym.llm import LanguageModel

        with LanguageModel.from_environment() as model:
            report = Judge(model, options).completed(report, named, protocol)
    print(json.dumps(report.to_json(), indent=1, ensure_ascii=False) if as_json else layout_score(report))
    return DONE if report.passed or not check else FAILED


def _labbuilder(names: Sequence[str], library: str | None, as_json: bool, judge: Mode | None) -> int:
    from labgym.paper.labbuilder_rules.inputs import rated_scenes
    from labgym.paper.labbuilder_rules.quirks import MODES
    from labgym.paper.labbuilder_rules.verdict import both_modes, rules_table, verdict_values

    if judge is not None:
        return _rated(names, judge)
    assets = flag_library(library)
    verdicts = {name: both_modes(scene, assets) for name, scene in rated_scenes(names, assets)}
    if as_json:
        listed = {name: {mode: each.model_dump() for mode, each in both.items()} for name, both in verdicts.items()}
        print(json.dumps({"rules": assets.title, "scenes": listed}, indent=1, ensure_ascii=False))
        return DONE
    values = [verdict_values(both) for both in verdicts.values()]
    title = next(iter(verdicts)) if len(verdicts) == 1 else f"Means over {len(verdicts)} layouts"
    lines = {mode: [each[mode] for each in values] for mode in MODES}
    print(rules_table(f"{title}: {assets.title}", lines).table().text())
    return DONE


def _rated(names: Sequence[str], mode: Mode) -> int:
    """Print the points of the rubric of the rule set labbuilder, of each layout."""
    from labgym.envs.tasks import each_layout
    from labgym.llm import LanguageModel
    from labgym.paper.labbuilder_rules.rubric import rate

    with LanguageModel.from_environment() as model:
        for layout in each_layout(names):
            print(json.dumps({"layout": layout.id, "mode": mode, "points": rate(model, layout, mode).points()}))
    return DONE


def _rulings(names: Sequence[str], regulations: str, as_json: bool, check: bool) -> int:
    from labgym.cli.describe import regulation_table
    from labgym.envs.tasks import resolve_layout
    from labgym.layouts.rules.arrangement import Arrangement
    from labgym.layouts.rules.regulations import rulings

    if len(names) != 1:
        raise OptionError(f"--regulations takes one layout, got {len(names)}")
    layout = resolve_layout(names[0])
    layout.check_references()
    result = rulings(Arrangement.of(layout), regulations)
    listed = [ruling.model_dump(mode="json") for ruling in result]
    print(
        json.dumps(listed, indent=1, ensure_ascii=False)
        if as_json
        else regulation_table(layout.id, regulations, result)
    )
    return FAILED if check and any(ruling.outcome == "fail" for ruling in result) else DONE


def _score_many(
    names: Sequence[str],
    *,
    protocol: str | None,
    profile: str,
    rules: str,
    as_json: bool,
    check: bool,
    out: Path | None,
    executor: ExecutorOptions,
    fresh: bool,
    judge: JudgeOptions | None,
) -> int:
    from labgym.envs.tasks import each_layout
    from labgym.eval.reports.tables import layout_table
    from labgym.eval.scoring.layout_report import LayoutReport
    from labgym.eval.scoring.many import score_layouts
    from labgym.eval.scoring.score import aggregate

    failing: list[str] = []

    def noted(report: LayoutReport) -> LayoutReport:
        if not report.passed:
            failing.append(report.layout)
        return report

    reports = score_layouts(
        lambda: each_layout(names), out, protocol, profile, executor, fresh, rules=rules, judge=judge
    )
    summary = aggregate(noted(report) for report in reports)
    if as_json:
        print(json.dumps(summary.to_json(), indent=1, ensure_ascii=False))
    else:
        print(f"\n{layout_table(summary).text()}\n")
        listed = ", ".join(failing[:MAX_LISTED]) + (", ..." if len(failing) > MAX_LISTED else "")
        print(f"{summary.layouts - len(failing)} of {summary.layouts} layouts pass", end="")
        print(f"; failing: {listed}" if failing else "")
    if out is not None and not as_json:
        written(out)
    return FAILED if check and failing else DONE
