"""The site of a folder of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from urllib.parse import quote

from labgym.eval.drawing.plan_labels import readable_name
from labgym.eval.drawing.plan_panel import floor_size
from labgym.eval.driving.evaluation import TransitionEvaluation
from labgym.eval.driving.files import SUMMARY
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.suites import CHECK
from labgym.eval.labnav.together import FOLDER
from labgym.eval.reports.report import Card
from labgym.eval.reports.results import ResultsFolder
from labgym.eval.reports.site.entries import Entry, ranked_entries
from labgym.eval.reports.site.page import SiteContent, site_of
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


def run_site(
    results: ResultsFolder,
    pictures: Mapping[str, Path],
    views: Mapping[str, Path],
    first: Sequence[Table] = (),
    entries: Sequence[Entry] = (),
) -> SiteContent:
    """Return the site of a folder of results.

    Args:
        results: the results.
        pictures, views: top-down pictures and rendered views in the folder, by layout id.
        first: the published tables and the check of LabNav; the page shows them after those of the results.
        entries: policies that drove the small suite of LabNav, which come first.
    """
    site = site_of(
        ranked_entries(entries),
        CHECK,
        results.folder,
        title=f"labgym: {results.folder.resolve().name}",
        problems=results.problems,
        facts=_provenance(results),
    )
    return replace(
        site,
        subtitle="Laboratories generated from chemistry protocols, and robot navigation in them",
        tables=(*result_tables(results), *reversed(first)),
        views=tuple((_view_caption(results, name), _address(results, path)) for name, path in views.items()),
        cards=tuple(
            _card(results, layout, _address(results, pictures[layout.id]) if layout.id in pictures else "")
            for layout in results.layouts
        ),
    )


def run_entries(folder: Path) -> tuple[Entry, ...]:
    """Return the policies that drove the small suite of LabNav in a run's folder.

    Raises:
        DocumentError: a file is broken.
    """
    places = sorted(path.parent for path in (folder / FOLDER).glob(f"*/{SUMMARY}"))
    return tuple(Entry.driven(LabNavEvaluation.read(place)) for place in places)


def _address(results: ResultsFolder, path: Path) -> str:
    """Return the address of a file of the folder, relative to the page."""
    return quote(path.relative_to(results.folder).as_posix())


def _card(results: ResultsFolder, layout: Layout, picture: str) -> Card:
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
