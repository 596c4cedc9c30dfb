"""The tables of a description of splits: figures of each family, and bars of each split."""

from __future__ import annotations

from labgym.eval.variety.describe import SplitsSummary
from labgym.eval.variety.figures import DriveFigures, GroupFigures, bars
from labgym.eval.variety.rows import WALLS
from labgym.table import Table, number

FLOOR_COLUMNS = ("split", "family", "floors", "area, m²", "rooms", "objects", "overlap", *(f"{w} hoods" for w in WALLS))
DRIVE_COLUMNS = (
    "split",
    "family",
    "drives",
    "number",
    "no path",
    "L*, m",
    "detour >= 1.1",
    ">= 1.3",
    "neck < 0.90 m",
    "widest way < 0.90 m",
    "under 2 m",
    "blind by place",
    "blind by walls",
)


def tables(summary: SplitsSummary) -> tuple[Table, ...]:
    """Return a table of floors, one of drives, and one of bars for each split."""
    seeds = "the splits' own seeds" if summary.seed is None else f"development seeds from {summary.seed} on"
    floors = tuple(_floor_row(group) for group in summary.groups)
    drives = tuple(row for group in summary.groups for row in _drive_rows(group))
    return (
        Table(
            f"Floors, {seeds}",
            FLOOR_COLUMNS,
            floors,
            (
                "Area and objects are medians. Overlap: mean intersection over union of the furniture of two floors of",
                "a family and about one size, best of eight symmetries. Hoods: shares by wall, from the main door.",
            ),
        ),
        Table(
            f"Drives: episodes, and all that were tried, {seeds}",
            DRIVE_COLUMNS,
            drives,
            (
                "L*: median length of the shortest path. Neck: narrowest gap on the shortest path; widest way:",
                "narrowest gap on the widest way, which no other way avoids. Blind: shares that policies without",
                "sensors drive without touching anything. They know the walls, and the furniture of",
                f"{summary.known} floors: by its place, seen from the main door, or by its distance from walls.",
            ),
        ),
        *(_bar_table(group) for group in summary.groups if group.family is None),
    )


def _floor_row(group: GroupFigures) -> tuple[str, ...]:
    total = max(sum(group.hoods.values()), 1)
    return (
        group.split,
        group.family or "all",
        str(group.floors),
        number(group.area, 0),
        number(group.rooms, 1),
        number(group.objects, 0),
        number(group.overlap, 2),
        *(percent(group.hoods[wall] / total) for wall in WALLS),
    )


def _drive_rows(group: GroupFigures) -> tuple[tuple[str, ...], tuple[str, ...]]:
    share = percent(group.acceptance)
    return (
        _drive_row(group, f"episodes ({share})", group.accepted),
        _drive_row(group, "all tried", group.unfiltered),
    )


def _drive_row(group: GroupFigures, name: str, figures: DriveFigures) -> tuple[str, ...]:
    return (
        group.split,
        group.family or "all",
        name,
        str(figures.drives),
        str(figures.unreachable),
        number(figures.length, 1),
        percent(figures.detour_1),
        percent(figures.detour_3),
        percent(figures.neck),
        percent(figures.widest_neck),
        str(figures.short),
        percent(figures.blind),
        percent(figures.blind_walls),
    )


def _bar_table(group: GroupFigures) -> Table:
    rows = tuple(
        (
            bar.name,
            number(bar.value, bar.digits),
            f"{bar.relation} {bar.limit:g}",
            "yes" if bar.reached else "NO",
        )
        for bar in bars(group)
    )
    return Table(f"Bars of split {group.split}", ("bar", "value", "limit", "reached"), rows)


def percent(share: float | None) -> str:
    """Return a share in percent, a dash for None."""
    return "-" if share is None else f"{100.0 * share:.0f}%"
