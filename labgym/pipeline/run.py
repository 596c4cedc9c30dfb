"""The stages of `labgym run` in order: layouts, evaluations, pictures, tables, report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from labgym.documents import canonical_hash
from labgym.errors import OptionError
from labgym.eval.driving.files import folder_name
from labgym.eval.evaluator import evaluate
from labgym.eval.labnav.evaluation import is_labnav_run
from labgym.eval.reports.results import ResultsFolder
from labgym.layouts.batch import catalog_digest
from labgym.pipeline.config import LABNAV, RunConfig
from labgym.pipeline.stages import (
    PICTURES,
    SPLIT,
    VIEWS,
    LayoutJob,
    draw_pictures,
    drive_mini,
    layout_jobs,
    make_layouts,
    published_tables,
    render_views,
    write_results,
)
from labgym.runs import ExecutorOptions, RunFolder, RunIdentity
from labgym.suites import load_suite, suite_of
from labgym.table import Table

DRIVES = "navigation"
"""Folder of the evaluations of a run."""


@dataclass(frozen=True)
class RunOutcome:
    """Results of a run or of a report.

    Attributes:
        tables: layout metrics and navigation metrics.
        paths: the files and folders of interest.
        problems: failures that did not stop the run, and contradictions in the folders, one sentence each.
        left_out: why default policies are missing, one sentence each.
    """

    tables: tuple[Table, ...]
    paths: tuple[Path, ...]
    problems: tuple[str, ...]
    left_out: tuple[str, ...] = ()


def run_pipeline(config: RunConfig, executor: ExecutorOptions | None = None) -> RunOutcome:
    """Make the layouts, evaluate the policies, and write pictures, tables and a report.

    Work that the folder already holds is kept; an interrupted run resumes. Each evaluation has its folder and
    its identity, so that a later run of the same layouts may show other policies.

    Args:
        config: the options of the run.
        executor: where layouts are made and policies drive; by default in `config.workers` local processes, which also
            draw the pictures.

    Raises:
        UnknownNameError: a policy, a protocol or a profile does not exist.
        OptionError: the folder holds another run, or an evaluation in it is another one.
        LabgymError: workers died.
    """
    config.check()
    policies, left_out = config.runnable()
    rivals, also_out = config.runnable(LABNAV) if config.labnav else ((), ())
    jobs = layout_jobs(config.seed, config.profile, config.protocols)
    here = ExecutorOptions(workers=config.processes)
    executor = executor or here
    with RunFolder.open(config.folder, _identity(config, jobs), config.fresh) as folder:
        layouts = make_layouts(jobs, folder, executor)
        suite = load_suite(SPLIT) if config.labnav else suite_of(layouts)
        chosen = suite if config.full else suite.first(layouts)
        given = () if config.labnav else layouts
        reports = [
            evaluate(policy, chosen, out=folder.path / DRIVES / folder_name(policy), executor=executor, layouts=given)
            for policy in policies
        ]
        if config.labnav:
            drive_mini(rivals, folder, executor)
        results = ResultsFolder.read(folder.path, [report.summary.policy for report in reports])
        pictures = draw_pictures(results, here, folder)
        render_views(results, here, folder, config.views)
        folder.finish({}, unlisted=(PICTURES, VIEWS))
        tables, paths, differing = _write(results, pictures, config.folder)
    problems = tuple(
        f"policy {report.summary.policy}: {report.summary.errors} episodes failed"
        for report in reports
        if report.summary.errors
    )
    places = tuple(config.folder / name for name in (DRIVES, "layouts", "scenes"))
    return RunOutcome(
        tables,
        (*places, *paths),
        (*problems, *results.problems, *differing),
        tuple(dict.fromkeys((*left_out, *also_out))),
    )


def report_folders(folders: Sequence[Path], processes: int = 1, out: Path | None = None) -> RunOutcome:
    """Write tables and report of folders of results into one; of transitions the routes are drawn, too.

    Args:
        folders: written by `labgym run` or `labgym eval`.
        processes: number of processes that draw.
        out: where the report is written; by default the first folder.

    Raises:
        DocumentError: a folder holds no results, or a file in it is broken.
        OptionError: some folders are of LabNav and others are not, or they are of different episodes of LabNav.
    """
    of_labnav = [folder for folder in folders if is_labnav_run(folder)]
    if of_labnav:
        from labgym.eval.reports.labnav_report import report_labnav

        for folder in folders:
            if folder not in of_labnav:
                raise OptionError(f"{of_labnav[0]} is of LabNav and {folder} is not: report them separately")
        return RunOutcome(*report_labnav(folders, out=out))
    results = ResultsFolder.read(folders[0], others=folders[1:])
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        results = replace(results, folder=out)
    tables, paths, differing = _write(results, draw_pictures(results, ExecutorOptions(workers=processes)), folders[0])
    return RunOutcome(tables, paths, (*results.problems, *differing))


def _identity(config: RunConfig, jobs: Sequence[LayoutJob]) -> RunIdentity:
    return RunIdentity.of(
        "run",
        seed=config.seed,
        profile=config.profile,
        protocols={job.protocol.id: canonical_hash(job.protocol.to_json()) for job in jobs},
        layouts={job.id: job.published for job in jobs},
        catalog=catalog_digest(),
        full=config.full,
    )


def _write(
    results: ResultsFolder, pictures: dict[str, Path], source: Path
) -> tuple[tuple[Table, ...], tuple[Path, ...], tuple[str, ...]]:
    """Write tables and report of a folder of results; return tables, paths, and what differs from published results."""
    views = {path.stem: path for path in sorted((source / VIEWS).glob("*.png"))}
    published, differing = published_tables(source)
    tables, paths = write_results(results, pictures, views, published)
    folders = sorted({path.parent for path in (*pictures.values(), *views.values())})
    return tables, (*folders, *paths), differing
