"""The command that shows the published results, and adds some."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from labgym.cli.arguments import OptionalPath
from labgym.cli.outcome import DONE, written


def leaderboard(
    add: Annotated[tuple[Path, ...], arg(metavar="FOLDER [FOLDER ...]", help_behavior_hint="")] = (),
    out: OptionalPath = None,
    correlation: bool = False,
) -> int:
    """Show the published results of LabNav and of lab30.

    Args:
        add: Folders of complete evaluations (labgym eval --suite labnav, --suite labnav-aisle or another of its tasks,
            --suite labnav-60, or --suite lab30) to write among the published results of this installation first.
        out: Folder for the site of the published results: a leaderboard, a page for each policy, floors of episodes,
            and pairs of policies, in one index.html.
        correlation: Also show the rank correlations between the tasks of LabNav, over policies and over floors.
    """
    from labgym.documents import read_json
    from labgym.eval.driving.files import SUMMARY
    from labgym.eval.labnav.summary import LabNavSummary
    from labgym.eval.leaderboard.correlation import correlation_tables
    from labgym.eval.leaderboard.lab30 import publish_lab30, published_lab30
    from labgym.eval.leaderboard.labnav import publish, published_results
    from labgym.eval.leaderboard.tables import published_table
    from labgym.eval.reports.tables import leaderboard as lab30_table

    for folder in add:
        data = read_json(folder / SUMMARY)
        of_labnav = isinstance(data, dict) and data.get("schema") == LabNavSummary.SCHEMA
        written(publish(folder) if of_labnav else publish_lab30(folder))
    results, lab30 = published_results(), published_lab30()
    tables = [*([published_table(results)] if results else []), *([lab30_table(lab30)] if lab30 else [])]
    for table in (*tables, *(correlation_tables(results) if correlation and results else ())):
        print(f"\n{table.text()}\n")
    if out is not None:
        from labgym.eval.reports.labnav_report import write_leaderboard

        written(write_leaderboard(out, results))
    return DONE
