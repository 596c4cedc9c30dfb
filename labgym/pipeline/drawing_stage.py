"""The last stages of a run: plans with routes, rendered views, tables and the report."""

from __future__ import annotations

from html import escape
from pathlib import Path

from labgym.documents import write_text
from labgym.eval.drawing.pictures import save_picture, save_view, topdown
from labgym.eval.drawing.plan_drawing import Trace
from labgym.eval.reports.report import write_report
from labgym.eval.reports.results import ResultsFolder
from labgym.eval.reports.run_report import result_tables, run_report
from labgym.layouts import Layout
from labgym.pipeline.ledger import Ledger
from labgym.pipeline.workers import Work, work_through
from labgym.table import Table

VIEW_SIZE = (1280, 720)


def draw_pictures(results: ResultsFolder, ledger: Ledger, processes: int) -> dict[str, Path]:
    """Draw a plan of every layout with the routes driven in it; return the pictures' paths by layout id."""
    paths = {layout.id: ledger.folder / "pictures" / f"{layout.id}.png" for layout in results.layouts}
    units = []
    for layout in results.layouts:
        traces = results.traces(layout.id)
        inputs = [layout.id, layout.hash, [[trace.policy, trace.success, trace.points.tolist()] for trace in traces]]
        path = paths[layout.id]
        units.append(Work(f"picture {layout.id}", inputs, _draw, (layout, traces, path), (path,)))
    work_through("pictures", units, ledger, processes)
    return paths


def render_views(results: ResultsFolder, ledger: Ledger, processes: int, count: int) -> dict[str, Path]:
    """Render `count` layouts, spread evenly over all; return the views' paths by layout id."""
    count = min(count, len(results.layouts))
    sample = [results.layouts[index * len(results.layouts) // count] for index in range(count)]
    paths = {layout.id: ledger.folder / "views" / f"{layout.id}.png" for layout in sample}
    units = [
        Work(f"view {layout.id}", [layout.hash, VIEW_SIZE], _render, (layout, paths[layout.id]), (paths[layout.id],))
        for layout in sample
    ]
    work_through("views", units, ledger, processes)
    return paths


def write_results(
    results: ResultsFolder, pictures: dict[str, Path], views: dict[str, Path]
) -> tuple[tuple[Table, ...], list[Path]]:
    """Write the tables as text and Markdown, and the report; return the tables and the paths."""
    tables = result_tables(results)
    text = "\n\n\n".join(table.text() for table in tables) + "\n"
    markdown = "\n\n".join(f"**{escape(table.title, quote=False)}**\n\n{table.markdown()}" for table in tables) + "\n"
    paths = [
        write_text(results.folder / "tables.txt", text),
        write_text(results.folder / "tables.md", markdown),
        write_report(run_report(results, pictures, views), results.folder / "report.html"),
    ]
    return tables, paths


def _draw(layout: Layout, traces: tuple[Trace, ...], path: Path) -> None:
    save_picture(topdown(layout, layout.protocol, traces), path)


def _render(layout: Layout, path: Path) -> None:
    save_view(layout, path, "overview", *VIEW_SIZE)
