"""The stage that drives the small suite of LabNav and compares its rows with the published ones."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from labgym.documents import write_bytes
from labgym.eval.driving.files import EPISODES, ROUTES
from labgym.eval.labnav.row import LabNavRow
from labgym.eval.labnav.runner import record_line
from labgym.eval.labnav.suites import MINI, MINI_SECONDS, load_labnav
from labgym.eval.labnav.together import FOLDER, drive_together
from labgym.eval.leaderboard.check import agreement
from labgym.eval.leaderboard.lab30 import published_lab30
from labgym.eval.leaderboard.labnav import published_results, read_rows
from labgym.eval.leaderboard.tables import published_table
from labgym.eval.reports.tables import leaderboard
from labgym.pipeline.config import SHOWN
from labgym.runs import ExecutorOptions, RunFolder
from labgym.table import Table, number


def drive_mini(policies: Sequence[str], folder: RunFolder, executor: ExecutorOptions) -> None:
    """Drive the small suite by all policies, and write rows and routes into the run's folder."""
    driven = drive_together(policies, load_labnav(MINI), folder, executor)
    rows = [row for one in driven.rows.values() for row in one]
    routes = [route for one in driven.routes.values() for route in one.values()]
    write_bytes(folder.path / FOLDER / EPISODES, b"".join(map(record_line, rows)))
    write_bytes(folder.path / FOLDER / ROUTES, b"".join(map(record_line, routes)))


def published_tables(folder: Path) -> tuple[tuple[Table, ...], tuple[str, ...]]:
    """Return the published tables and the check of a run's LabNav drives, with a sentence for each row that differs.

    Args:
        folder: of the run; without drives of LabNav there are no tables.

    Raises:
        DocumentError: a file is broken.
    """
    path = folder / FOLDER / EPISODES
    if not path.is_file():
        return (), ()
    published = published_results()
    tables = [published_table(published)] if published else []
    lab30 = published_lab30(SHOWN)
    tables += [leaderboard(lab30)] if lab30 else []
    outcomes = {result.summary.policy: result.by_key for result in published}
    rows = read_rows(path)
    lines: list[tuple[str, ...]] = []
    problems: list[str] = []
    tasks = list(dict.fromkeys(row.task for row in rows))
    for policy in dict.fromkeys(row.policy for row in rows):
        own = [row for row in rows if row.policy == policy]
        result = agreement(own, outcomes.get(policy, {}), MINI_SECONDS)
        problems += result.differing
        shares = [_mean([row for row in own if row.task == task]) for task in tasks]
        lines.append((policy, *shares, f"{result.equal} of {result.compared}" if result.compared else "-"))
    notes = (
        f"Mean scores of the first episodes of each task, cut off after {MINI_SECONDS:g} s: too few to compare "
        "policies, they check the installation.",
        "Equal: rows that are those of the published table; - where the policy has none there.",
    )
    mini = Table(f"Check of LabNav, suite {MINI}", ("Policy", *tasks, "Equal"), tuple(lines), notes)
    return (*tables, mini), tuple(problems)


def _mean(rows: Sequence[LabNavRow]) -> str:
    return number(sum(row.score for row in rows) / len(rows), 2) if rows else "-"
