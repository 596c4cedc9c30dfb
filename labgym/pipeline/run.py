"""The stages of `labgym run` in order: layouts, evaluations, pictures, tables, report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from labgym.documents import Document
from labgym.errors import OptionError
from labgym.eval.driving.run_folder import folder_name
from labgym.eval.driving.runner import evaluate
from labgym.eval.reports.results import ResultsFolder
from labgym.layouts import Layout
from labgym.pipeline.config import RunConfig
from labgym.pipeline.drawing_stage import draw_pictures, render_views, write_results
from labgym.pipeline.layout_stage import SPLIT, layout_jobs, make_layout
from labgym.pipeline.ledger import Ledger
from labgym.pipeline.workers import Work, work_through
from labgym.table import Table


@dataclass(frozen=True)
class RunOutcome:
    """Results of a run.

    Attributes:
        tables: layout metrics and navigation metrics.
        paths: the files and folders of interest.
        problems: failures that did not stop the run, one sentence each.
        left_out: why default policies are missing, one sentence each.
    """

    tables: tuple[Table, ...]
    paths: tuple[Path, ...]
    problems: tuple[str, ...]
    left_out: tuple[str, ...] = ()


class RunIdentity(Document):
    """`run.json`: identity of the run stored in a folder, written before its first layout."""

    SCHEMA: ClassVar[str] = "labgym.run/1"

    seed: int | None
    protocols: tuple[str, ...] = ()

    def claim(self, folder: Path) -> None:
        """Claim a folder for this run.

        Raises:
            OptionError: the folder holds the layouts of another run.
        """
        path = folder / "run.json"
        if path.exists() and (previous := RunIdentity.load(path)) != self:
            raise OptionError(
                f"{folder} holds a run with seed {previous.seed} and protocols {list(previous.protocols) or 'all'}, "
                f"not {self.seed} and {list(self.protocols) or 'all'}; choose another --name or remove the folder"
            )
        self.save(path)


def run_pipeline(config: RunConfig) -> RunOutcome:
    """Make the layouts, evaluate the policies, and write pictures, tables and a report.

    Work that the folder already holds is skipped if its inputs and the code are unchanged.

    Raises:
        UnknownNameError: a policy, a protocol or a profile does not exist.
        OptionError: the folder holds another run.
        LabgymError: a worker process died.
    """
    folder, processes = config.folder, config.processes
    config.check()
    policies, left_out = config.runnable()
    RunIdentity(seed=config.seed, protocols=config.protocols).claim(folder)
    jobs = layout_jobs(config.seed, config.profile, config.protocols)
    ledger = Ledger(folder)
    work_through(
        "layouts",
        [Work(f"layout {job.id}", job.inputs, make_layout, (job, folder), job.files(folder)) for job in jobs],
        ledger,
        processes,
    )
    layouts = [Layout.load(job.files(folder)[0]) for job in jobs]
    suite = SPLIT if config.seed is None and not config.protocols else layouts
    reports = [
        evaluate(policy, suite, workers=processes, out=folder / "navigation" / folder_name(policy), overwrite=True)
        for policy in policies
    ]
    problems = tuple(
        f"policy {report.summary.policy}: {report.summary.errors} episodes failed"
        for report in reports
        if report.summary.errors
    )
    tables, paths = _show(ResultsFolder.read(folder, policies), ledger, processes, config.views)
    places = (folder / "navigation", folder / "layouts", folder / "scenes")
    return RunOutcome(tables, (*places, *paths), problems, left_out)


def report_folder(
    folder: Path, others: Sequence[Path] = (), processes: int = 1
) -> tuple[tuple[Table, ...], tuple[Path, ...]]:
    """Draw the routes and write tables and report of a folder of results; return the tables and the paths.

    Args:
        folder: a folder written by `labgym run` or `labgym eval`; the report is written there.
        others: further such folders, whose evaluations are shown in the same report.
        processes: number of processes that draw.

    Raises:
        DocumentError: the folder holds no results, or a file in it is broken.
        LabgymError: two folders hold an evaluation of the same policy.
    """
    return _show(ResultsFolder.read(folder, others=others), Ledger(folder), processes, views=0)


def _show(
    results: ResultsFolder, ledger: Ledger, processes: int, views: int
) -> tuple[tuple[Table, ...], tuple[Path, ...]]:
    pictures = draw_pictures(results, ledger, processes)
    render_views(results, ledger, processes, views)
    rendered = {path.stem: path for path in sorted((results.folder / "views").glob("*.png"))}
    tables, paths = write_results(results, pictures, rendered)
    folders = sorted({path.parent for path in (*pictures.values(), *rendered.values())})
    return tables, (*folders, *paths)
