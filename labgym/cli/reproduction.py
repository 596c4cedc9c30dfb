"""The commands that reproduce what was published: layouts by their hashes, and the tables of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from tyro.conf import OmitArgPrefixes

from labgym.cli.arguments import (
    THIS_PROCESS,
    Execution,
    OptionalPath,
    OptionalText,
    OptionalWholeNumber,
    Texts,
    allow_local_modules,
)
from labgym.cli.outcome import complaints, findings, written
from labgym.cli.scores import OptionalMode

if TYPE_CHECKING:
    from labgym.eval.scoring.judgement import JudgeOptions, Mode
    from labgym.paper.reproduction.figures import PublishedFigures
    from labgym.paper.reproduction.scope import Scope as StudyScope
    from labgym.paper.reproduction.study import Study

PublishedSplit = Literal["val", "test", "floors-val", "floors-seen", "floors-test"]
RUNS = Path("runs/reproduce")
"""Default folder of the studies, each in the subfolder of its name."""


def published(split: PublishedSplit = "test", out: OptionalPath = None) -> int:
    """Check the published layouts against their hashes, and regenerate them from their seeds.

    They are regenerated only if this version's generator made them; otherwise the release that made them is named.
    Exit 1 if a file or a regenerated layout does not have its hash.

    Args:
        split: The published split.
        out: Also write the layouts that this version makes from the same seeds, with a manifest, to OUT/SPLIT.
    """
    from labgym.layouts import splits

    outcome = splits.reproduce(split, out)
    if out is not None:
        written(out / split)
    print(outcome.notice)
    return complaints(outcome.problems) or findings(())


@dataclass(frozen=True)
class ScopeArguments:
    """The size of a study.

    Attributes:
        quick: A small version: few protocols, one seed.
        protocols: Ids or .json files of protocols; by default all 30, or some of them with --quick.
        seed: First seed of the layouts.
        seeds: Number of seeds of each protocol; by default 3, or 1 with --quick.
    """

    quick: bool = False
    protocols: Texts = ()
    seed: int = 0
    seeds: OptionalWholeNumber = None

    def scope(self, study: str) -> StudyScope:
        """Return protocols and seeds."""
        from labgym.paper.reproduction.scope import scope_of

        return scope_of(study, self.quick, self.protocols, self.seed, self.seeds)


Scope = OmitArgPrefixes[ScopeArguments]
WHOLE = ScopeArguments()


@dataclass(frozen=True)
class RunArguments:
    """The executor of a study and the folder of its files.

    Attributes:
        out: Folder of the results (index.html, figures.json, figures.csv, rows.jsonl); by default
            runs/reproduce/NAME.
        fresh: Move the files of the folder aside and start anew.
    """

    out: OptionalPath = None
    fresh: bool = False
    execution: Execution = THIS_PROCESS


Run = OmitArgPrefixes[RunArguments]
HERE = RunArguments()


def protocols(run: Run = HERE) -> int:
    """Table 1: counts per protocol, and the entries of the knowledge base (docs/reproduction.md)."""
    from labgym.paper.reproduction.protocols import ProtocolsStudy

    return _reproduced(ProtocolsStudy(), run)


def labbuilder(
    *,
    scenes: Path,
    library: OptionalText = None,
    run: Run = HERE,
) -> int:
    """Scenes of LabBuilder's authors: read, scored, repaired, driven in, and written again (docs/labbuilder.md).

    Repaired scenes are in OUT/layouts, and in LabBuilder's form in OUT/labbuilder/SCENE.

    Args:
        scenes: Folder of scenes (.json), with asset_bboxes.json and goal_pairs.json for all of them if there are any.
        library: Also evaluate scenes and published layouts by the rule set labbuilder, with LabBuilder's
            assets_annotated.json, or catalog, for labgym's sizes and flags.
    """
    from labgym.paper.labbuilder.study import LabBuilderStudy

    return _reproduced(LabBuilderStudy(scenes, library), run)


def comparison(scope: Scope = WHOLE, proposers: Texts = (), judge: OptionalMode = None, run: Run = HERE) -> int:
    """Table 2: layouts of labgym's generators, of the paper's rivals and of controls, under one set of metrics.

    Each proposer raw, with the phases of the paper alone, and with labgym's.

    Args:
        proposers: Proposers such as nothing heap sampler; by default all of docs/reproduction.md, and with a language
            model (LABGYM_LLM_BASE_URL, LABGYM_LLM_MODEL) those that ask it.
        judge: Let the configured vision-language model score pictures of each layout: strict, medium or lenient.
    """
    return _reproduced(_comparison(scope, judge, proposers), run)


def ablation(scope: Scope = WHOLE, proposers: Texts = (), judge: OptionalMode = None, run: Run = HERE) -> int:
    """Table 3: the method without annotations, protocol, optimization or refinement for navigation.

    Args:
        proposers: Proposers, as those of the comparison; by default sampler, with a language model also llm.
        judge: Let the configured vision-language model score pictures of each layout: strict, medium or lenient.
    """
    return _reproduced(_ablation(scope, judge, proposers), run)


def navigation(scope: Scope = WHOLE, policies: Texts = (), run: Run = HERE) -> int:
    """Table 4: policies in layouts before and after the refinement for navigation.

    Args:
        policies: Names of policies; by default astar, dwa, iplanner, navdp and ppo, with --quick astar and iplanner,
            as far as their packages are installed.
    """
    return _reproduced(_navigation(scope, policies), run)


def repair(
    draws: int = 6,
    seed: int = 1,
    profile: str = "default",
    run: Run = HERE,
) -> int:
    """Damage benchmark: laboratories damaged in ten kinds, 1 to 5 pieces each, and repaired (docs/reproduction.md).

    Args:
        draws: Number of cases of each kind and number of pieces; 6 make 300 cases.
        seed: Random seed of the cases.
        profile: Thresholds: default, strict, paper or code.
    """
    from labgym.paper.reproduction.repair import RepairStudy

    return _reproduced(RepairStudy(draws, seed, profile), run)


def nuisances(policy: str = "astar", tasks: Texts = (), level: int = 2, run: Run = HERE) -> int:
    """LabNav on floors-val with one nuisance off at a time: what drift, people, panes and others cost a policy.

    By default the files are in runs/reproduce/nuisances-POLICY (docs/labnav.md). They are no results of LabNav.

    Args:
        policy: A name such as astar (labgym policies lists them), module:Class, or a file.
        tasks: Tasks, such as aisle glass or with its level people-3; by default all eight.
        level: Level of the tasks that do not name it: 1, 2 or 3.
    """
    from labgym.eval.driving.files import short_name
    from labgym.paper.reproduction.nuisances import nuisance_study

    allow_local_modules()
    study = nuisance_study(policy, tasks, level)
    return _reproduced(study, run, f"{study.name}-{short_name(policy)}", study.entrant.foresees)


def all_(scope: Scope = WHOLE, scenes: OptionalPath = None, run: Run = HERE) -> int:
    """All of these but nuisances, one after the other, and a page that links to theirs.

    Each has its files in OUT/NAME, by default runs/reproduce/NAME.

    Args:
        scenes: Folder of scenes for labbuilder, which is left out without it.
    """
    from labgym.paper.labbuilder.study import LabBuilderStudy
    from labgym.paper.reproduction.everything import reproduce_all
    from labgym.paper.reproduction.protocols import ProtocolsStudy
    from labgym.paper.reproduction.repair import RepairStudy
    from labgym.paper.reproduction.study import PAGE

    studies: list[Study[Any]] = [ProtocolsStudy(), _comparison(scope), _ablation(scope), _navigation(scope)]
    seed = scope.seed + 1  # The benchmark's own default is 1.
    studies.append(RepairStudy(1, seed, pieces=(1, 3)) if scope.quick else RepairStudy(seed=seed))
    remarks = ["A small version: few protocols and one seed (--quick)."] if scope.quick else []
    if scenes is not None:
        studies.append(LabBuilderStudy(scenes))
    else:
        remarks.append("labbuilder is left out: name a folder of scenes with --scenes.")
    out = run.out if run.out is not None else RUNS
    for figures in reproduce_all(studies, out, run.execution.options(), run.fresh, remarks=remarks):
        _print(figures)
    return written(out / PAGE)


def _comparison(arguments: ScopeArguments, judge: Mode | None = None, names: Texts = ()) -> Study[Any]:
    from labgym.paper.reproduction.comparison import ComparisonStudy, comparison_variants, proposers
    from labgym.paper.reproduction.scope import model_name

    scope, model = arguments.scope("comparison"), model_name()
    variants = comparison_variants(proposers(bool(model), names))
    return ComparisonStudy(variants, scope.protocols, scope.seeds, model=model, judge=_judge(judge))


def _ablation(arguments: ScopeArguments, judge: Mode | None = None, names: Texts = ()) -> Study[Any]:
    from labgym.paper.reproduction.comparison import RepairAblation, ablation_variants, proposers
    from labgym.paper.reproduction.scope import model_name

    scope, model = arguments.scope("ablation"), model_name()
    chosen = proposers(bool(model), names or (("sampler", "llm") if model else ("sampler",)))
    variants = tuple(variant for proposer in chosen.items() for variant in ablation_variants(*proposer))
    return RepairAblation(variants, scope.protocols, scope.seeds, model=model, judge=_judge(judge))


def _judge(mode: Mode | None) -> JudgeOptions | None:
    """Return how the configured model judges.

    Raises:
        LanguageModelError: a judge, but no model is configured.
    """
    if mode is None:
        return None
    from labgym.eval.scoring.judgement import JudgeOptions
    from labgym.llm import LanguageModelConfig

    LanguageModelConfig.from_environment()
    return JudgeOptions(mode)


def _navigation(arguments: ScopeArguments, policies: Sequence[str] = ()) -> Study[Any]:
    from labgym.paper.reproduction.navigation import POLICIES, QUICK_POLICIES, NavigationStudy, installed

    scope = arguments.scope("navigation")
    chosen = tuple(policies) or installed(QUICK_POLICIES if arguments.quick else POLICIES)
    return NavigationStudy(chosen, "sampler", scope.protocols, scope.seeds)


def _reproduced(study: Study[Any], run: RunArguments, name: str = "", foresees: bool = False) -> int:
    """Run a study, print its tables and the path of its page.

    Args:
        study: the study. run: where it runs. name: of its folder, by default the study's.
        foresees: whether it drives a policy that foresees the world.
    """
    from labgym.eval.labnav.foresight import executor_for
    from labgym.paper.reproduction.study import PAGE, reproduce

    folder = run.out if run.out is not None else RUNS / (name or study.name)
    _print(reproduce(study, folder, executor_for(run.execution.options(), foresees), run.fresh))
    return written(folder / PAGE)


def _print(figures: PublishedFigures) -> None:
    for table in figures.tables:
        print(f"\n{table.table().text()}")
    print()
    for line in figures.summary:
        print(line)
