"""The command that shows the published results, and adds some."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from labgym.cli.arguments import THIS_PROCESS, Execution, OptionalPath, Texts
from labgym.cli.effects import refuses_idle_flags
from labgym.cli.outcome import DONE, complaints, written
from labgym.errors import DocumentError, UnknownNameError

if TYPE_CHECKING:
    from labgym.eval.leaderboard.labnav import LabNavResult

ALL = "all"
ROUTES = Path("runs/leaderboard")
"""Folder of the drives whose routes are published."""


@refuses_idle_flags("leaderboard")
def leaderboard(
    add: Annotated[tuple[Path, ...], arg(metavar="FOLDER [FOLDER ...]", help_behavior_hint="")] = (),
    out: OptionalPath = None,
    correlation: bool = False,
    routes: Texts = (),
    fresh_round: OptionalPath = None,
    execution: Execution = THIS_PROCESS,
) -> int:
    """Show the published results of LabNav and of lab30.

    Args:
        add: Folders of complete evaluations (labgym eval --suite labnav, --suite labnav-aisle or another of its tasks,
            or --suite lab30) to write among the published results of this installation first, if their actions give
            their rows when they are simulated again.
        out: Folder for the site of the published results: a leaderboard, a page for each policy, floors of episodes,
            and pairs of policies, in one index.html.
        correlation: Also show the rank correlations between the tasks of LabNav, over policies and over floors.
        routes: Built-in policies with published results, or all: drive the episodes that the site shows again, in
            runs/leaderboard, and publish the routes of those that end as published. Exit 1 if some do not.
        fresh_round: Folder of labgym submit check --fresh --out: publish its secret and receipts as the round of its
            name. The floors are then public, and the next check needs another secret.
    """
    from labgym.documents import read_json
    from labgym.eval.driving.files import SUMMARY
    from labgym.eval.labnav.summary import LabNavSummary
    from labgym.eval.leaderboard.lab30 import publish_lab30, published_lab30
    from labgym.eval.leaderboard.labnav import LabNavResult as Result
    from labgym.eval.leaderboard.labnav import publish, published_results
    from labgym.eval.leaderboard.receipts import published_rounds
    from labgym.eval.leaderboard.rounds import publish_round
    from labgym.eval.leaderboard.tables import correlation_tables, published_table
    from labgym.eval.reports.tables import leaderboard as lab30_table
    from labgym.eval.submission.check import simulated_problems

    for folder in add:
        data = read_json(folder / SUMMARY)
        of_labnav = isinstance(data, dict) and data.get("schema") == LabNavSummary.SCHEMA
        if of_labnav:
            Result.of(folder)  # is complete
        if problems := simulated_problems(folder):
            more = f", and {len(problems) - 1} problems more" if len(problems) > 1 else ""
            raise DocumentError(folder, "", f"{problems[0]}{more}")
        written(publish(folder) if of_labnav else publish_lab30(folder))
    if fresh_round is not None:
        for path in publish_round(fresh_round):
            written(path)
    results, lab30 = published_results(), published_lab30()
    tables = [
        *([published_table(results, published_rounds())] if results else []),
        *([lab30_table(lab30)] if lab30 else []),
    ]
    for table in (*tables, *(correlation_tables(results) if correlation and results else ())):
        print(f"\n{table.text()}\n")
    code = publish_routes(results, routes, execution) if routes else DONE
    if out is not None:
        from labgym.eval.reports.labnav_report import write_leaderboard

        written(write_leaderboard(out, results))
    return code


def publish_routes(results: Sequence[LabNavResult], names: Sequence[str], execution: Execution) -> int:
    """Publish the routes of the episodes that the site shows, for some policies, and return the exit code.

    Raises:
        UnknownNameError: a policy is not built in, or has no published result.
    """
    from labgym.eval.labnav.suites import PREFIX, load_labnav
    from labgym.eval.leaderboard.drives import publish_drives
    from labgym.eval.reports.site.entries import Entry
    from labgym.eval.reports.site.episodes import MOST_EPISODES, chosen
    from labgym.policies.registry import BUILT_IN

    publishable = {one.summary.policy: one for one in results if one.summary.policy in BUILT_IN}
    for name in names:
        if name not in publishable and name != ALL:
            raise UnknownNameError("built-in policy with a published result", name, (*publishable, ALL))
    keys = chosen([Entry.of_result(one) for one in results], list(load_labnav(PREFIX).by_key), MOST_EPISODES)
    problems: list[str] = []
    for name, result in publishable.items():
        if name in names or ALL in names:
            published = publish_drives(result, keys, ROUTES, execution.options())
            written(published.path)
            problems += [f"not as published: {sentence}" for sentence in published.differing]
    return complaints(problems)
