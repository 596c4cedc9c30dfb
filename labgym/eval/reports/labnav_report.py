"""The report on evaluations of LabNav, and the site of the published results."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from labgym import __version__
from labgym.envs.labnav.tasks import FIGURE_TASKS
from labgym.errors import DocumentError, OptionError
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.suites import PREFIX
from labgym.eval.leaderboard.drives import published_drives
from labgym.eval.leaderboard.lab30 import published_lab30
from labgym.eval.leaderboard.labnav import LabNavResult, published_results
from labgym.eval.leaderboard.receipts import published_rounds
from labgym.eval.reports.labnav_tables import labnav_tables
from labgym.eval.reports.report import write_tables
from labgym.eval.reports.results import distinguished
from labgym.eval.reports.site.entries import Entry, ranked_entries, short_commit, with_published
from labgym.eval.reports.site.page import site_of, write_site
from labgym.eval.reports.tables import leaderboard
from labgym.table import Table


def report_labnav(
    folders: Sequence[str | Path], published: Sequence[LabNavResult] | None = None, out: str | Path | None = None
) -> tuple[tuple[Table, ...], tuple[Path, ...], tuple[str, ...]]:
    """Write the report on evaluations into a folder; return its tables, its files, and contradictions.

    Args:
        folders: of evaluations of one suite.
        published: results that the page shows, too; by default the published ones of the same episodes.
        out: where the report is written; by default the first folder.

    Raises:
        DocumentError: a folder holds no finished evaluation of LabNav.
        OptionError: the suites differ.
    """
    places = {Path(folder).resolve(): Path(folder) for folder in folders}
    evaluations = distinguished([LabNavEvaluation.read(folder) for folder in places.values()])
    suites = {(one.summary.suite, one.summary.hash): one for one in evaluations}
    if len(suites) > 1:
        a, b = list(suites.values())[:2]
        names = f"{a.summary.suite} ({a.folder}) and {b.summary.suite} ({b.folder})"
        raise OptionError(f"the evaluations are of different episodes: {names}; report them separately")
    for one in evaluations:
        if not one.summary.tasks:
            raise DocumentError(one.folder, "tasks", f"none; the tasks of LabNav are {', '.join(FIGURE_TASKS)}")
    tables = labnav_tables(evaluations)
    home = Path(folders[0] if out is None else out)
    home.mkdir(parents=True, exist_ok=True)
    results = published_results() if published is None else published
    problems = tuple(problem for one in evaluations for problem in one.problems)
    entries = with_published(evaluations, results)
    site = site_of(entries, evaluations[0].summary.suite, home, problems=problems, facts=_provenance(evaluations))
    return tables, (*write_tables(tables, home), write_site(site, home / "report.html")), problems


def write_leaderboard(folder: str | Path, results: Sequence[LabNavResult] | None = None) -> Path:
    """Write the site of the published results into a folder and return the path of its page.

    Args:
        folder: the folder. results: by default the published ones.

    Raises:
        DocumentError: a published file is broken.
        OptionError: no result is published.
    """
    results = published_results() if results is None else results
    if not results:
        raise OptionError("no results of LabNav are published here: add evaluations with labgym leaderboard --add")
    lab30, rounds = published_lab30(), published_rounds()
    site = site_of(
        ranked_entries([Entry.of_result(one, published_drives(one), rounds) for one in results]),
        PREFIX,
        Path(folder),
        title="LabNav leaderboard",
        other=[leaderboard(lab30)] if lab30 else [],
        facts=[
            ("labgym", __version__),
            *{one.summary.suite: (f"episodes of {one.summary.suite}", one.summary.hash) for one in results}.values(),
            *((one.summary.policy, _commits(one)) for one in results),
        ],
    )
    return write_site(site, Path(folder) / "index.html")


def _commits(result: LabNavResult) -> str:
    """Return the commits that drove a published result."""
    commits = dict.fromkeys(short_commit(commit) for each in result.commits.values() for commit in each)
    return f"seed {result.summary.seed}, commit {', '.join(commits) or 'not recorded'}"


def _provenance(evaluations: Sequence[LabNavEvaluation]) -> tuple[tuple[str, str], ...]:
    """Return how the evaluations were made: episodes, seed, code and commit."""
    return (
        ("labgym", __version__),
        (f"episodes of {evaluations[0].summary.suite}", evaluations[0].summary.hash),
        *((one.name, one.origin + (f", commit {one.commit}" if one.provenance else "")) for one in evaluations),
    )
