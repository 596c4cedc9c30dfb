"""The whole pipeline in order: layouts, evaluations, pictures, tables, report."""

from __future__ import annotations

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
from labgym.pipeline.layout_stage import layout_jobs, make_layout
from labgym.pipeline.ledger import Ledger
from labgym.pipeline.workers import Work, work_through
from labgym.table import Table


@dataclass(frozen=True)
class RunOutcome:
    """What came of a run.

    Attributes:
        tables: layout metrics and navigation metrics.
        written: the files and folders that a person would look at.
        problems: what went wrong without stopping the run, one sentence each.
        left_out: why policies of the default are missing, one sentence each.
    """

    tables: tuple[Table, ...]
    written: tuple[Path, ...]
    problems: tuple[str, ...]
    left_out: tuple[str, ...] = ()


class RunIdentity(Document):
    """`run.json`: which layouts a folder is for; written before the first of them."""

    SCHEMA: ClassVar[str] = "labgym.run/1"

    seed: int | None
    protocols: tuple[str, ...] = ()

    def claim(self, folder: Path) -> None:
        """Take a folder for this run.

        Raises:
            OptionError: the folder holds another run's layouts.
        """
        path = folder / "run.json"
        if path.exists() and (before := RunIdentity.load(path)) != self:
            raise OptionError(
                f"{folder} holds a run with seed {before.seed} and protocols {list(before.protocols) or 'all'}, not "
                f"{self.seed} and {list(self.protocols) or 'all'}; give another --name or remove it"
            )
        self.save(path)


def run_pipeline(config: RunConfig) -> RunOutcome:
    """Make the layouts, drive the policies through them, and write pictures, tables and a report.

    Work that the folder holds already, made from the same inputs by the same code, is not done again.

    Raises:
        UnknownNameError: a policy or a profile does not exist.
        OptionError: the folder holds another run.
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
    suite = "test" if config.seed is None and not config.protocols else layouts
    reports = [
        evaluate(policy, suite, workers=processes, out=folder / "navigation" / folder_name(policy), overwrite=True)
        for policy in policies
    ]
    problems = [f"policy {r.summary.policy}: {r.summary.errors} episodes failed" for r in reports if r.summary.errors]
    tables, written = _show(ResultsFolder.read(folder, policies), ledger, processes, config.views)
    places = (folder / "navigation", folder / "layouts", folder / "scenes")
    return RunOutcome(tables, (*places, *written), tuple(problems), left_out)


def report_folder(folder: Path, processes: int = 1) -> tuple[tuple[Table, ...], tuple[Path, ...]]:
    """Draw the routes, and write tables and report, for a folder of results; return the tables and what was written.

    Raises:
        DocumentError: there is nothing to report on, or a file of it is broken.
    """
    return _show(ResultsFolder.read(folder), Ledger(folder), processes, views=0)


def _show(
    results: ResultsFolder, ledger: Ledger, processes: int, views: int
) -> tuple[tuple[Table, ...], tuple[Path, ...]]:
    pictures = draw_pictures(results, ledger, processes)
    render_views(results, ledger, processes, views)
    rendered = {path.stem: path for path in sorted((results.folder / "views").glob("*.png"))}
    tables, written = write_results(results, pictures, rendered)
    folders = sorted({path.parent for path in (*pictures.values(), *rendered.values())})
    return tables, (*folders, *written)
