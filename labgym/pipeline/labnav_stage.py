"""The stage that drives the small suite of LabNav and compares its rows with the published ones."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from labgym.documents import write_bytes
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.files import EPISODES
from labgym.eval.labnav.suites import CHECK, MINI_GOALS, MINI_SECONDS, load_labnav
from labgym.eval.labnav.together import FOLDER, drive_together
from labgym.eval.leaderboard.lab30 import published_lab30
from labgym.eval.leaderboard.labnav import agreement, published_results, read_rows
from labgym.eval.leaderboard.tables import published_table
from labgym.eval.reports.tables import leaderboard
from labgym.pipeline.config import LABNAV, SHOWN
from labgym.runs import ExecutorOptions, RunFolder
from labgym.table import Table, number


def drive_mini(policies: Sequence[str], folder: RunFolder, executor: ExecutorOptions) -> None:
    """Drive the small suite by all policies, and write rows and routes into the run's folder."""
    for policy, files in drive_together(policies, load_labnav(CHECK), folder, executor).items():
        for name, content in files.items():
            write_bytes(folder.path / FOLDER / policy / name, content)


def published_tables(folder: Path) -> tuple[tuple[Table, ...], tuple[str, ...]]:
    """Return the published tables and the check of a run's LabNav drives, with a sentence for each row that differs.

    Args:
        folder: of the run; without drives of LabNav there are no tables.

    Raises:
        DocumentError: a file is broken.
    """
    paths = {path.parent.name: path for path in sorted((folder / FOLDER).glob(f"*/{EPISODES}"))}
    if not paths:
        return (), ()
    published = published_results()
    tables = [published_table(published)] if published else []
    lab30 = published_lab30(SHOWN)
    tables += [leaderboard(lab30)] if lab30 else []
    outcomes = {result.summary.policy: result.by_key for result in published}
    rows = {policy: read_rows(paths[policy]) for policy in dict.fromkeys((*LABNAV, *paths)) if policy in paths}
    lines: list[tuple[str, ...]] = []
    problems: list[str] = []
    missing: dict[tuple[str, ...], list[str]] = {}
    tasks = list(dict.fromkeys(row.task for own in rows.values() for row in own))
    for policy, own in rows.items():
        result = agreement(own, outcomes.get(policy, {}), MINI_SECONDS)
        problems += result.differing
        if result.compared and result.missing:
            missing.setdefault(result.missing, []).append(policy)
        shares = [_mean([row for row in own if row.task == task]) for task in tasks]
        lines.append((policy, *shares, f"{result.equal} of {result.compared}" if result.compared else "-"))
    notes = (
        f"Mean scores of the first episodes of each task, cut off after {MINI_SECONDS:g} s: too few to compare "
        "policies, they check the installation.",
        "Equal: rows that are those of the published table; - where the policy has none there. Of a shift, its first "
        f"{MINI_GOALS} drives are compared, up to the first one that is cut off.",
        *(
            f"Not compared, for they are not published: {', '.join(each)} of {', '.join(missing[each])}."
            for each in missing
        ),
    )
    mini = Table(f"Check of LabNav, suite {CHECK}", ("Policy", *tasks, "Equal"), tuple(lines), notes)
    return (*tables, mini), tuple(problems)


def _mean(rows: Sequence[LabNavRow]) -> str:
    return number(sum(row.score for row in rows) / len(rows), 2) if rows else "-"
