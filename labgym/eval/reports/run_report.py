"""The contents of the report page, from a folder of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from labgym.eval.drawing.plan_labels import readable_name
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.reports.report import Card, Picture, Report, Tile
from labgym.eval.reports.results import ResultsFolder
from labgym.eval.reports.tables import LAYOUT_COLUMNS, layout_table, leaderboard, navigation_table
from labgym.eval.scoring.layout_report import LayoutReport
from labgym.eval.scoring.score import aggregate
from labgym.layouts import Layout
from labgym.navigation import GoalPair, goal_pairs
from labgym.table import Table, number


def result_tables(results: ResultsFolder) -> tuple[Table, ...]:
    """Return the layout table and the navigation table, those for which there are results."""
    tables = [layout_table(aggregate(results.scores.values()))] if results.scores else []
    if results.evaluations:
        tables.append(_navigation([one.summary for one in results.evaluations]))
    return tuple(tables)


def _navigation(summaries: Sequence[NavigationSummary]) -> Table:
    if len({summary.suite for summary in summaries}) == 1 and summaries[0].suite.metrics != "navdp":
        return leaderboard(summaries)
    return navigation_table({one.policy: one.metrics for one in summaries}, f"suite {summaries[0].suite.label}")


def run_report(results: ResultsFolder, pictures: Mapping[str, Path], views: Mapping[str, Path]) -> Report:
    """Return the report on a folder of results.

    Args:
        results: the results.
        pictures: top-down pictures, PNG, by layout id.
        views: rendered views, PNG, by layout id.
    """
    plans = {name: Picture(name, path.read_bytes()) for name, path in pictures.items()}
    return Report(
        title=f"labgym: {results.folder.resolve().name}",
        subtitle="Laboratories generated from chemistry protocols, and robot navigation in them",
        tiles=_tiles(results),
        tables=result_tables(results),
        views=tuple(Picture(_view_caption(results, name), path.read_bytes()) for name, path in views.items()),
        cards=tuple(_card(results, layout, plans.get(layout.id)) for layout in results.layouts),
        provenance=_provenance(results),
    )


def _tiles(results: ResultsFolder) -> tuple[Tile, ...]:
    tiles = [Tile("layouts", str(len(results.layouts)))]
    if results.scores:
        tiles.append(Tile("objects per layout", number(aggregate(results.scores.values()).mean("obj"), 1)))
        tiles.append(Tile("hard violations", str(sum(score.v for score in results.scores.values()))))
    best = _best([evaluation.summary for evaluation in results.evaluations])
    if best is not None:
        rules = " (NavDP rules)" if best.suite.metrics == "navdp" else ""
        for name, heading in (("success", "SR"), ("spl", "SPL")):
            tiles.append(Tile(f"{heading} of {best.policy}{rules}", number(_headline(best, name), 3)))
    return tuple(tiles)


def _best(summaries: Sequence[NavigationSummary]) -> NavigationSummary | None:
    """Return the summary with the highest SPL, among policies without the true map if there are any."""
    candidates = [summary for summary in summaries if not summary.privileged] or summaries
    return max(candidates, key=lambda summary: _headline(summary, "spl") or 0.0, default=None)


def _headline(summary: NavigationSummary, metric: str) -> float | None:
    prefix = "navdp_" if summary.suite.metrics == "navdp" else ""
    return summary.metrics[prefix + metric].value


def _card(results: ResultsFolder, layout: Layout, picture: Picture | None) -> Card:
    score = results.scores.get(layout.id)
    room = layout.room
    return Card(
        id=layout.id,
        title=layout.protocol.name if layout.protocol else layout.id,
        subtitle=f"{layout.id}, {room.width:g} x {room.depth:g} m, {layout.hash[:12]}",
        picture=picture,
        metrics=_metrics(score) if score else (),
        violations=tuple(violation.message for violation in score.violations) if score else None,
        episodes=_episodes(results, layout),
    )


def _metrics(score: LayoutReport) -> tuple[tuple[str, str], ...]:
    return tuple(
        (
            heading.split(" ↑")[0].split(" ↓")[0],
            number(getattr(score, key), 0 if key in ("obj", "ob", "cn", "asset") else 3),
        )
        for key, heading, digits in LAYOUT_COLUMNS
    )


def _episodes(results: ResultsFolder, layout: Layout) -> Table | None:
    pairs = goal_pairs(layout) if layout.protocol else ()
    rows = [
        (
            _drive(pairs[row.pair], row.repeat, one.summary.suite.repeats),
            row.policy,
            "goal reached" if row.success else f"policy failed: {row.error}" if row.error else "time limit reached",
            number(row.spl, 3),
            number(row.path_length, 2),
            number(row.shortest_path_length, 2),
            number(row.time, 1),
            str(row.contacts),
        )
        for one in results.evaluations
        for row in one.of(layout.id)
        if row.pair < len(pairs)
    ]
    columns = ("goal pair", "policy", "outcome", "SPL", "driven, m", "shortest, m", "time, s", "contact steps")
    return Table(f"{len(rows)} episodes", columns, tuple(sorted(rows, key=lambda row: row[0]))) if rows else None


def _drive(pair: GoalPair, repeat: int, repeats: int) -> str:
    """Return the ends of a goal pair, with the number of the repeat if there are several."""
    ends = f"{readable_name(pair.start_location)} → {readable_name(pair.goal_location)}"
    return ends if repeats == 1 else f"{ends} ({repeat + 1} of {repeats})"


def _view_caption(results: ResultsFolder, name: str) -> str:
    protocol = next((layout.protocol for layout in results.layouts if layout.id == name), None)
    return f"{protocol.name} ({name})" if protocol else name


def _provenance(results: ResultsFolder) -> tuple[tuple[str, str], ...]:
    facts: list[tuple[str, str]] = []
    if results.scores:
        first = next(iter(results.scores.values()))
        facts.append(("layout metrics", f"{first.version}, profile {first.profile}"))
    if results.evaluations:
        summary = results.evaluations[0].summary
        record = summary.provenance
        facts += [
            ("suite", f"{summary.suite.label}, {summary.expected} episodes per policy, seed {summary.seed}"),
            ("policies", ", ".join(one.summary.policy for one in results.evaluations)),
            ("code", record.code),
            ("commit", f"{record.commit or 'not a checkout'}{' with changes' if record.dirty else ''}"),
            ("versions", ", ".join(f"{name} {version}" for name, version in record.versions.items())),
        ]
    generators = {f"{layout.provenance.generator} {layout.provenance.versions}" for layout in results.layouts}
    return (*facts, ("generators", "; ".join(sorted(generators))))
