"""The last stages of a run: plans with routes, rendered views, tables and the report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from labgym.documents import write_bytes, write_text
from labgym.eval.drawing.pictures import picture_bytes, topdown, view_bytes
from labgym.eval.drawing.plan_drawing import DrivenPath
from labgym.eval.reports.report import write_report
from labgym.eval.reports.results import ResultsFolder
from labgym.eval.reports.run_report import result_tables, run_report
from labgym.layouts import Layout
from labgym.runs import ExecutorOptions, RunFolder, Shard, ShardOutput, run_shards
from labgym.table import Table

VIEW_SIZE = (1280, 720)
PICTURES, VIEWS = "pictures", "views"
"""Folders of the plans and of the rendered views."""


def draw_pictures(
    results: ResultsFolder, executor: ExecutorOptions, folder: RunFolder | None = None
) -> dict[str, Path]:
    """Draw a plan of every layout with the routes driven in it; return the pictures' paths by layout id.

    Args:
        results: the layouts and routes; the pictures are written into its folder.
        executor: where the plans are drawn.
        folder: the folder of the run, if it is one that is open; its unchanged pictures are not drawn again.
    """
    names = {layout.id: f"{PICTURES}/{layout.id}.png" for layout in results.layouts}
    shards = []
    for layout in results.layouts:
        traces = results.traces(layout)
        inputs = [layout.id, layout.hash, [[trace.policy, trace.success, trace.points.tolist()] for trace in traces]]
        shards.append(Shard(f"picture {layout.id}", _draw, (layout, traces, names[layout.id]), inputs=inputs))
    _write("pictures  ", shards, results.folder, executor, folder)
    return {layout: results.folder / name for layout, name in names.items()}


def render_views(results: ResultsFolder, executor: ExecutorOptions, folder: RunFolder, count: int) -> None:
    """Render `count` layouts, spread evenly over all."""
    count = min(count, len(results.layouts))
    sample = [results.layouts[index * len(results.layouts) // count] for index in range(count)]
    shards = [
        Shard(f"view {layout.id}", _render, (layout, f"{VIEWS}/{layout.id}.png"), inputs=[layout.hash, VIEW_SIZE])
        for layout in sample
    ]
    _write("views     ", shards, results.folder, executor, folder)


def write_results(
    results: ResultsFolder, pictures: dict[str, Path], views: dict[str, Path], first: tuple[Table, ...] = ()
) -> tuple[tuple[Table, ...], list[Path]]:
    """Write the tables as text and Markdown, and the report; return the tables and the paths.

    Args:
        results: the results. pictures, views: by layout id.
        first: tables that come before those of the results.
    """
    tables = (*first, *result_tables(results))
    text = "\n\n\n".join(table.text() for table in tables) + "\n"
    markdown = "\n\n".join(table.titled_markdown() for table in tables) + "\n"
    paths = [
        write_text(results.folder / "tables.txt", text),
        write_text(results.folder / "tables.md", markdown),
        write_report(run_report(results, pictures, views, first), results.folder / "report.html"),
    ]
    return tables, paths


def _write(
    title: str, shards: Sequence[Shard], place: Path, executor: ExecutorOptions, folder: RunFolder | None
) -> None:
    for _, output in run_shards(shards, folder, executor, title):
        for name, content in output.files.items() if folder is None else ():
            write_bytes(place / name, content)


def _draw(layout: Layout, traces: tuple[DrivenPath, ...], name: str) -> ShardOutput:
    return ShardOutput({name: picture_bytes(topdown(layout, layout.protocol, traces))})


def _render(layout: Layout, name: str) -> ShardOutput:
    return ShardOutput({name: view_bytes(layout, "overview", *VIEW_SIZE)})
