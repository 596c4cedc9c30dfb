"""The contents of the report page, from a folder of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from labgym.eval.drawing.plan_labels import readable_name
from labgym.eval.drawing.plan_panel import floor_size
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.reports.report import Card, Picture, Report, Tile
from labgym.eval.reports.results import ResultsFolder
from labgym.eval.reports.tables import LAYOUT_COLUMNS, layout_table, leaderboard, navigation_table
from labgym.eval.scoring.layout_report import LayoutReport
from labgym.eval.scoring.score import aggregate
from labgym.layouts import Layout
from labgym.navigation import GoalPair
from labgym.table import Table, number


def result_tables(results: ResultsFolder) -> tuple[Table, ...]:
    """Return the layout table and a navigation table for each suite, those for which there are results."""
    tables = [layout_table(aggregate(results.scores.values()))] if results.scores else []
    suites = list(dict.fromkeys(one.summary.suite.label for one in results.evaluations))
    groups = [[one for one in results.evaluations if one.summary.suite.label == suite] for suite in suites]
    return (*tables, *map(_navigation, groups))


def _navigation(evaluations: Sequence[TransitionEvaluation]) -> Table:
    """Return the table of evaluations on one suite."""
    suite = evaluations[0].summary.suite
    if suite.metrics == "navdp":
        return navigation_table({one.name: one.metrics for one in evaluations}, f"suite {suite.title}")
    return leaderboard(evaluations)


def run_report(
    results: ResultsFolder, pictures: Mapping[str, Path], views: Mapping[str, Path], first: Sequence[Table] = ()
) -> Report:
    """Return the report on a folder of results.

    Args:
        results: the results.
        pictures: top-down pictures, PNG, by layout id.
        views: rendered views, PNG, by layout id.
        first: tables that come before those of the results.
    """
    plans = {name: Picture(name, path.read_bytes()) for name, path in pictures.items()}
    return Report(
        title=f"labgym: {results.folder.resolve().name}",
        subtitle="Laboratories generated from chemistry protocols, and robot navigation in them",
        tiles=_tiles(results),
        tables=(*first, *result_tables(results)),
        views=tuple(Picture(_view_caption(results, name), path.read_bytes()) for name, path in views.items()),
        cards=tuple(_card(results, layout, plans.get(layout.id)) for layout in results.layouts),
        provenance=_provenance(results),
        problems=results.problems,
    )


def _tiles(results: ResultsFolder) -> tuple[Tile, ...]:
    tiles = [Tile("layouts", str(len(results.layouts)))]
    if results.scores:
        tiles.append(Tile("objects per layout", number(aggregate(results.scores.values()).mean("obj"), 1)))
        tiles.append(Tile("hard violations", str(sum(score.v for score in results.scores.values()))))
    best = _best(results.evaluations)
    if best is not None:
        navdp = best.summary.suite.metrics == "navdp"
        first = ("success", "SR") if navdp else ("collision_free", "Collision-free SR")
        for name, heading in (first, ("spl", "SPL")):
            label = f"{heading} of {best.name}{' (NavDP rules)' if navdp else ''}"
            tiles.append(Tile(label, number(_headline(best.summary, name), 3)))
    return tuple(tiles)


def _best(evaluations: Sequence[TransitionEvaluation]) -> TransitionEvaluation | None:
    """Return the evaluation with most drives without contact, then SPL; without the true map, if there are any."""
    candidates = [one for one in evaluations if not one.summary.privileged] or evaluations
    return max(candidates, key=lambda one: _merit(one.summary), default=None)


def _merit(summary: NavigationSummary) -> tuple[float, float]:
    first = "success" if summary.suite.metrics == "navdp" else "collision_free"
    return _headline(summary, first) or 0.0, _headline(summary, "spl") or 0.0


def _headline(summary: NavigationSummary, metric: str) -> float | None:
    prefix = "navdp_" if summary.suite.metrics == "navdp" else ""
    return summary.metrics[prefix + metric].value


def _card(results: ResultsFolder, layout: Layout, picture: Picture | None) -> Card:
    score = results.scores.get(layout.id)
    return Card(
        id=layout.id,
        title=layout.protocol.name if layout.protocol else layout.id,
        subtitle=f"{layout.id}, {floor_size(layout.floor)}, {layout.hash[:12]}",
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
    rows = [
        (
            _drive(pairs[row.pair], row.repeat, one.summary.suite.repeats),
            one.name,
            "goal reached" if row.success else f"policy failed: {row.error}" if row.error else "time limit reached",
            number(row.spl, 3),
            number(row.path_length, 2),
            number(row.shortest_path_length, 2),
            number(row.time, 1),
            str(row.contacts),
        )
        for one in results.evaluations
        for pairs in [one.summary.suite.pairs(layout) if one.in_layout(layout) else ()]
        for row in one.in_layout(layout)
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
        facts.append(("layout metrics", f"rules {first.rules}, profile {first.profile}"))
    for suite in dict.fromkeys(one.summary.suite.label for one in results.evaluations):
        names = [one.name for one in results.evaluations if one.summary.suite.label == suite]
        facts.append((f"suite {suite}", ", ".join(names)))
    facts += [fact for one in results.evaluations for fact in _origin(one)]
    generators = {f"{layout.provenance.generator} {layout.provenance.versions}" for layout in results.layouts}
    return (*facts, ("generators", "; ".join(sorted(generators))))


def _origin(evaluation: TransitionEvaluation) -> list[tuple[str, str]]:
    """Return how an evaluation was made: episodes, seed, code, versions and machines."""
    sessions, facts = evaluation.provenance, [(evaluation.name, evaluation.origin)]
    if sessions:
        facts.append(("commit", evaluation.commit))
        facts.append(("versions", ", ".join(f"{name} {version}" for name, version in sessions[-1].versions.items())))
    machines = {f"{one.host.name}: {one.host.cpu}, {one.host.cores} cores" for one in sessions if hasattr(one, "host")}
    return [*facts, *([("machine", "; ".join(sorted(machines)))] if machines else [])]
