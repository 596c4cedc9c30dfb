"""Evaluations: `labgym eval`, and the reports, comparisons and intervals of their results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated

from tyro.conf import arg

from labgym.cli.arguments import (
    THIS_PROCESS,
    Execution,
    Folders,
    OptionalNumber,
    OptionalPath,
    OptionalText,
    OptionalWholeNumber,
    PolicyOptions,
    Texts,
    allow_local_modules,
    parse_options,
)
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import DONE, complaints, written
from labgym.errors import OptionError


@refuses_idle_flags("eval")
def eval_(
    *,
    policy: str = "astar",
    suite: Annotated[str, arg(aliases=("--split", "--task"))] = "test",
    layouts: Texts = (),
    protocol: OptionalText = None,
    seed: int = 0,
    out: OptionalPath = None,
    options: PolicyOptions = (),
    fresh: bool = False,
    execution: Execution = THIS_PROCESS,
    repeats: OptionalWholeNumber = None,
    jitter: bool = False,
    limits: PolicyOptions = (),
    kernels: OptionalText = None,
    latency: OptionalNumber = None,
) -> int:
    """Evaluate a policy: drive all episodes of a suite, or every goal pair of layouts.

    Args:
        policy: A name such as astar (labgym policies lists them), module:Class, an .onnx, .pt, .safetensors or .zip
            file, or the http:// URL of a policy server.
        suite: Name of a suite (lab30, val, navdp_compat, labnav, labnav-mini; lab30 is also test), a task of LabNav
            with its level (people-2), a suite's .json file, or a folder of labgym labnav. Where the layouts are not
            published, pass them by --layouts.
        layouts: Layouts to drive in instead of a suite: .json files, folders of them (such as labgym generate --count
            writes), or ids of published layouts.
        protocol: Id or .json file of the protocol to drive for in the layouts; by default the one they embed.
        seed: Random seed of the policy.
        out: Folder for episodes, routes and summary; by default runs/POLICY-SUITE. An interrupted evaluation resumes.
        options: Arguments of the policy, for example deterministic=false.
        fresh: Rename an existing folder to NAME.old-1, NAME.old-2, ... and start anew.
        repeats: Number of episodes per drive; by default the suite's.
        jitter: Displace the start of every episode by up to 2 cm and 2 degrees, clear of obstacles; a suite's .json
            file can set other values.
        limits: Limits of the policy's process: call_seconds=300 for one call of reset or act, load_seconds=600,
            memory_gb=8. A policy that exceeds one fails its episode.
        kernels: pinned (the default where the processor has AVX2) gives equal results on every such processor, native
            is faster.
        latency: LabNav: seconds by which actions come late at least; not less than the policy declares. A policy that
            is not built in is measured first: from 10 ms of CPU time per action on, it is charged in steps of 0.1 s.
    """
    from labgym.envs.tasks import resolve_layouts
    from labgym.eval.driving.files import default_folder
    from labgym.eval.evaluator import AnySuite, evaluate
    from labgym.eval.labnav.evaluation import LabNavEvaluation
    from labgym.eval.labnav.suites import cost, is_labnav, resolve_labnav
    from labgym.eval.reports.tables import evaluation_table
    from labgym.policies.process import ProcessLimits
    from labgym.suites import Jitter, load_suite, suite_of

    allow_local_modules()
    if policy == "?":
        from labgym.policies.registry import policy_table

        print(policy_table())
        return DONE
    rules: AnySuite
    given, displacement = resolve_layouts(layouts, protocol), Jitter() if jitter else None
    if is_labnav(suite):
        rules, given = resolve_labnav(suite, given), []
        name = rules.name
        print(cost(rules, policy))
    else:
        rules = suite_of(given) if given and not suite.endswith(".json") else load_suite(suite)
        repeated = rules.repeated(repeats, displacement)
        name = suite if not given and repeated is rules else repeated.name
    folder = out or default_folder(policy, name)
    result = evaluate(
        policy,
        rules,
        layouts=given,
        seed=seed,
        repeats=repeats,
        jitter=displacement,
        latency=latency,
        out=folder,
        fresh=fresh,
        options=parse_options(options),
        executor=execution.options(),
        limits=ProcessLimits.named(parse_options(limits)),
        kernels=kernels,
    )
    print(f"\n{evaluation_table(result).text()}\n")
    if isinstance(result, LabNavEvaluation) and result.thinking is not None and result.thinking.mark:
        print(f"{result.summary.policy} {result.thinking.mark}.\n")
    written(folder)
    return complaints(_failures({row.key: row.error for row in result.rows}))


def _failures(errors: Mapping[str, str | None]) -> list[str]:
    """Return how many episodes failed, and why the first did; the errors are by episode, None without one."""
    failed = [(key, error) for key, error in errors.items() if error is not None]
    if not failed:
        return []
    (key, error), count = failed[0], len(failed)
    return [f"the policy failed in {count} episode{'s' if count > 1 else ''}, first in {key}: {error}"]


@refuses_idle_flags("report")
def report(folders: Folders, workers: int = 1, out: OptionalPath = None) -> int:
    """Draw the routes and write tables and report.html for the results in folders.

    For folders of LabNav (labgym eval --suite labnav), report.html is a site: a leaderboard with the published results
    of the same episodes, a page for each policy, a viewer of episodes, and the pairs of policies that are apart. Films
    that labgym record wrote into FOLDER/films, such as people-2_floors-test-0000_1.mp4, are linked.

    Every figure is computed from the episodes. Exit 1 if a summary does not match them, or if files are damaged or were
    changed.

    Args:
        folders: Folders written by labgym run or labgym eval, for example runs/default. The report shows
            the policies of all.
        workers: Number of processes that draw.
        out: Folder for tables, pictures and report; by default the first of the folders.
    """
    from labgym.pipeline.run import report_folders

    if not folders:
        raise OptionError("no folder of results; name one, for example runs/default")
    outcome = report_folders(folders, workers, out)
    for table in outcome.tables:
        print(f"\n{table.text()}\n")
    print("Written:", *outcome.paths, sep="\n  ")
    return complaints(outcome.problems)


def compare(
    folders: Folders,
    policies: Texts = (),
    out: OptionalPath = None,
) -> int:
    """Compare two policies over the episodes that both drove: paired differences with 95% intervals.

    Prints the differences over all shared episodes, then by task, length, detour and protocol. Exit 1 if a summary does
    not match its episodes, or if files are damaged or were changed.

    Args:
        folders: Two folders written by labgym eval, or one folder of labgym run with --policies.
        policies: Names of the two policies, where a folder holds evaluations of several.
        out: A .json file for the comparison.
    """
    from labgym.eval.reports.comparison import chosen_evaluations, compare, comparison_tables

    evaluations = chosen_evaluations(folders, policies)
    comparison = compare(*evaluations)
    for table in comparison_tables(comparison):
        print(f"\n{table.text()}\n")
    if out is not None:
        written(comparison.save(out))
    return complaints([problem for one in evaluations for problem in one.problems])


def coverage(evaluations: int = 4000, seed: int = 0) -> int:
    """Simulate evaluations and print how often the 95% intervals of navigation metrics contain the truth.

    Args:
        evaluations: Number of simulated evaluations per cell of the table.
        seed: Random seed of the simulation.
    """
    from labgym.eval.driving import coverage as simulation
    from labgym.progress import progress_bar

    scenarios = list(simulation.scenarios())
    rows = [simulation.coverage_row(scenario, evaluations, seed) for scenario in progress_bar(scenarios, "coverage")]
    print(simulation.coverage_table(rows, evaluations, seed).text())
    return DONE
