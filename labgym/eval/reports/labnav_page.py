"""The report on evaluations of LabNav: tables as text and Markdown, and a self-contained page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path

from labgym.documents import write_text
from labgym.errors import OptionError
from labgym.eval.drawing.palette import policy_colors
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.reports.environment import page_environment
from labgym.eval.reports.labnav_pictures import draw_routes, route_jobs
from labgym.eval.reports.labnav_tables import (
    ENDINGS,
    difficulty_tables,
    endings,
    headline,
    interval,
    labnav_tables,
    pair_table,
    ranked,
    score_tables,
    tasks_of,
)
from labgym.eval.reports.report import Picture, Tile
from labgym.eval.reports.results import named_apart
from labgym.table import Table

COLORS = {
    "success": "#3c8d4f",
    "contact": "#c8372d",
    "stuck": "#e08b1e",
    "lost": "#7b4fa3",
    "wrong place": "#b48ad1",
    "frozen": "#3f7fbf",
    "spilt": "#2bb3c0",
    "undocked": "#d9c22f",
    "time": "#98a1a8",
    "error": "#3a3f44",
}
"""Color of each ending."""


@dataclass(frozen=True)
class Share:
    """A part of a bar: an ending, its number of episodes, its share in percent, and its color."""

    name: str
    count: int
    percent: float
    color: str


@dataclass(frozen=True)
class PolicyCard:
    """The section on a policy: facts, and for each task its score and how its episodes ended."""

    name: str
    subtitle: str
    color: str
    bars: tuple[tuple[str, str, tuple[Share, ...]], ...]
    contacts: str


@dataclass(frozen=True)
class LabNavPage:
    """The contents of the page, in order."""

    title: str
    subtitle: str
    problems: tuple[str, ...]
    tiles: tuple[Tile, ...]
    scores: tuple[Table, ...]
    standings: tuple[tuple[str, str, str, float, float, float], ...]
    pairs: Table | None
    legend: tuple[tuple[str, str], ...]
    cards: tuple[PolicyCard, ...]
    difficulty: tuple[Table, ...]
    policies: tuple[tuple[str, str], ...]
    routes: tuple[Picture, ...]
    provenance: tuple[tuple[str, str], ...]


def report_labnav(
    folders: Sequence[str | Path], pictures: bool = True
) -> tuple[tuple[Table, ...], tuple[Path, ...], tuple[str, ...]]:
    """Write the report on evaluations into the first folder; return its tables, its files, and contradictions.

    Args:
        folders: of evaluations of one suite. pictures: whether to draw routes.

    Raises:
        DocumentError: a folder holds no finished evaluation of LabNav.
        OptionError: the suites differ.
    """
    places = {Path(folder).resolve(): Path(folder) for folder in folders}
    evaluations = named_apart([LabNavEvaluation.read(folder) for folder in places.values()], LabNavEvaluation.named)
    suites = {(one.summary.suite, one.summary.hash): one for one in evaluations}
    if len(suites) > 1:
        a, b = list(suites.values())[:2]
        names = f"{a.summary.suite} ({a.folder}) and {b.summary.suite} ({b.folder})"
        raise OptionError(f"the evaluations are of different episodes: {names}; report them separately")
    tables = labnav_tables(evaluations)
    page = labnav_page(evaluations, pictures)
    place = Path(folders[0])
    text = "\n\n\n".join(table.text() for table in tables) + "\n"
    markdown = "\n\n".join(f"**{escape(table.title, quote=False)}**\n\n{table.markdown()}" for table in tables) + "\n"
    paths = (
        write_text(place / "tables.txt", text),
        write_text(place / "tables.md", markdown),
        write_text(place / "report.html", render_labnav(page)),
    )
    return tables, paths, page.problems


def labnav_page(evaluations: Sequence[LabNavEvaluation], pictures: bool = True) -> LabNavPage:
    """Return the contents of the page on evaluations of one suite."""
    order = ranked(evaluations)
    colors = policy_colors([one.name for one in order])
    jobs, undrawn = route_jobs(order, colors) if pictures else ((), ())
    suite = order[0].summary
    return LabNavPage(
        title=f"LabNav: {', '.join(one.name for one in order[:4])}{' and others' if len(order) > 4 else ''}",
        subtitle=f"Suite {suite.suite}: navigation in chemistry laboratories at work",
        problems=(*(problem for one in order for problem in one.problems), *undrawn),
        tiles=_tiles(order),
        scores=score_tables(order),
        standings=_standings(order),
        pairs=pair_table(order) if len(order) > 1 else None,
        legend=tuple((name, COLORS[name]) for name in ENDINGS if any(endings(one)[name] for one in order)),
        cards=tuple(_card(one, colors[one.name]) for one in order),
        difficulty=difficulty_tables(order),
        policies=tuple(colors.items()),
        routes=tuple(map(draw_routes, jobs)),
        provenance=_provenance(order),
    )


def render_labnav(page: LabNavPage) -> str:
    """Return the page as HTML; all text is escaped."""
    return page_environment().get_template("labnav.html.j2").render(page=page)


def _tiles(order: Sequence[LabNavEvaluation]) -> tuple[Tile, ...]:
    best = next((one for one in order if one.summary.track == "deployed"), order[0])
    figure = best.summary.labnav
    label = f"{'LabNav' if figure is not None else 'mean score'} of {best.name}"
    value = f"{100.0 * headline(best):.1f}"
    return (
        Tile(label, value),
        Tile("policies", str(len(order))),
        Tile("tasks", str(len(tasks_of(order)))),
        Tile("episodes of a policy", str(max(len(one.rows) for one in order))),
    )


def _standings(order: Sequence[LabNavEvaluation]) -> tuple[tuple[str, str, str, float, float, float], ...]:
    """Return name, track, printed figure, and figure and interval in percent of the scale, the best first."""
    standings = []
    for one in order:
        figure = one.summary.labnav
        value = 100.0 * headline(one)
        low, high = (value, value) if figure is None else (figure.low or value, figure.high or value)
        text = f"{value:.1f}" if figure is None else interval(figure, 1)
        standings.append((one.name, one.summary.track, text, value, low, high))
    return tuple(standings)


def _card(evaluation: LabNavEvaluation, color: str) -> PolicyCard:
    summary = evaluation.summary
    bars = []
    for name, task in evaluation.tasks.items():
        counts = endings(evaluation, name)
        shares = tuple(
            Share(ending, counts[ending], 100.0 * counts[ending] / max(task.episodes, 1), COLORS[ending])
            for ending in ENDINGS
            if counts[ending]
        )
        bars.append((name.replace("-", " "), interval(task.score, 2), shares))
    touches: dict[str, int] = {}
    for task in summary.tasks:
        for kind, count in task.contact.items():
            touches[kind] = touches.get(kind, 0) + count
    words = ", ".join(f"{kind} {count}" for kind, count in sorted(touches.items(), key=lambda item: -item[1])[:12])
    latency = f", latency {summary.latency:g} s" if summary.latency else ""
    options = f", options {summary.options}" if summary.options else ""
    subtitle = f"{summary.track}, sees {summary.sensors}, seed {summary.seed}{latency}{options}"
    return PolicyCard(evaluation.name, subtitle, color, tuple(bars), words)


def _provenance(order: Sequence[LabNavEvaluation]) -> tuple[tuple[str, str], ...]:
    facts: list[tuple[str, str]] = [("episodes", order[0].summary.hash)]
    for one in order:
        code = "" if one.identity is None else one.identity.code[:12]
        sessions = one.provenance
        commit = f", commit {sessions[-1].commit or 'not a checkout'}" if sessions else ""
        dirty = " with changes" if sessions and sessions[-1].dirty else ""
        facts.append((one.name, f"{len(one.rows)} episodes, seed {one.summary.seed}, code {code}{commit}{dirty}"))
    return tuple(facts)
