"""The figures of a split, of one of its families or of the whole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from labgym.documents import Record
from labgym.eval.variety.rows import WALLS, DriveRow, FloorRow
from labgym.navigation.drives import SHORTEST

DETOURS = (1.1, 1.3)
NARROW = 0.90
"""A neck below this is narrow, meters: the least width of ways where people walk (BG RCI 6.2.1)."""


class DriveFigures(Record):
    """Figures of some drives; shares are of the drives with a path, null without one.

    Attributes:
        drives: number of drives. unreachable: number of them without a path.
        length: median of L*, meters.
        detour_1, detour_3: share with a detour of at least 1.1 and 1.3.
        neck, widest_neck: share whose narrowest gap on the shortest path, and on the widest way, is under 0.90 m.
        short: number of drives under 2 m.
        blind: share that the policy that knows the mean of other floors drives without touching anything.
        blind_walls: the same of the policy that knows how far from walls furniture stands.
    """

    drives: int
    unreachable: int
    length: float | None
    detour_1: float | None
    detour_3: float | None
    neck: float | None
    widest_neck: float | None
    short: int
    blind: float | None
    blind_walls: float | None

    @classmethod
    def of(cls, rows: Iterable[DriveRow]) -> DriveFigures:
        """Return the figures of drives."""
        every = list(rows)
        rows = [row for row in every if row.length is not None]
        lengths = np.array([row.length for row in rows])
        detours = np.array([row.detour for row in rows])
        return cls(
            drives=len(every),
            unreachable=len(every) - len(rows),
            length=round(float(np.median(lengths)), 6) if rows else None,
            detour_1=_share(detours >= DETOURS[0]),
            detour_3=_share(detours >= DETOURS[1]),
            neck=_share(np.array([row.neck for row in rows]) < NARROW) if rows else None,
            widest_neck=_share(np.array([row.widest_neck for row in rows]) < NARROW) if rows else None,
            short=int((lengths < SHORTEST).sum()),
            blind=_share([row.blind for row in rows if row.blind is not None]),
            blind_walls=_share([row.blind_walls for row in rows if row.blind_walls is not None]),
        )


class GroupFigures(Record):
    """Figures of a split, or of one family of it.

    Attributes:
        split: the split. family: the family; null for the whole split.
        floors: number of floors. area: median floor area, square meters. rooms: mean number of rooms.
        objects: median number of placements.
        accepted: figures of the episodes. unfiltered: figures of all drives that were tried.
        overlap: mean overlap of the furniture of two floors of one family and about one size; null without a pair.
        pairs: number of such pairs.
        hoods: number of hoods by the wall behind them.
    """

    split: str
    family: str | None
    floors: int
    area: float
    rooms: float
    objects: float
    accepted: DriveFigures
    unfiltered: DriveFigures
    overlap: float | None
    pairs: int
    hoods: dict[str, int]

    @property
    def acceptance(self) -> float:
        """Share of the drives that were tried that are episodes."""
        return self.accepted.drives / max(self.unfiltered.drives, 1)

    @property
    def rarest_wall(self) -> float | None:
        """Share of hoods on the wall with the fewest; None without hoods."""
        total = sum(self.hoods.values())
        return min(self.hoods.values()) / total if total else None


def group_figures(
    split: str, family: str | None, floors: Sequence[FloorRow], drives: Sequence[DriveRow], overlaps: Sequence[float]
) -> GroupFigures:
    """Return the figures of some floors, their drives and the overlaps of their pairs."""
    hoods = Counter(wall for floor in floors for wall in floor.hoods)
    return GroupFigures(
        split=split,
        family=family,
        floors=len(floors),
        area=float(np.median([floor.area for floor in floors])),
        rooms=round(float(np.mean([floor.rooms for floor in floors])), 3),
        objects=float(np.median([floor.objects for floor in floors])),
        accepted=DriveFigures.of(row for row in drives if row.accepted),
        unfiltered=DriveFigures.of(drives),
        overlap=round(float(np.mean(overlaps)), 6) if len(overlaps) else None,
        pairs=len(overlaps),
        hoods={wall: hoods[wall] for wall in WALLS},
    )


def _share(flags: Sequence[bool | None] | np.ndarray) -> float | None:
    return round(float(np.mean(np.asarray(flags, dtype=np.float64))), 6) if len(flags) else None


BLIND_FLOORS = 90
"""Number of other floors whose furniture the blind policies know."""


@dataclass(frozen=True)
class SplitLimit:
    """A limit and the value of a split.

    Attributes:
        name: what is limited.
        value: the split's value; None without one.
        limit: the limit. relation: how the value must relate to it.
        digits: decimals that are printed.
    """

    name: str
    value: float | None
    limit: float
    relation: Literal[">=", "<", "="]
    digits: int = 2

    @property
    def reached(self) -> bool:
        """Whether the value is on the right side of the limit."""
        if self.value is None:
            return False
        return {">=": self.value >= self.limit, "<": self.value < self.limit, "=": self.value == self.limit}[
            self.relation
        ]


def bars(figures: GroupFigures) -> tuple[SplitLimit, ...]:
    """Return the bars of a split with its values."""
    episodes = figures.accepted
    return (
        SplitLimit("median length of the shortest path, m", episodes.length, 8.0, ">="),
        SplitLimit("share of episodes with a detour of at least 1.1", episodes.detour_1, 0.60, ">="),
        SplitLimit("share of episodes with a detour of at least 1.3", episodes.detour_3, 0.30, ">="),
        SplitLimit("share of episodes whose widest way is under 0.90 m", episodes.widest_neck, 0.30, ">="),
        SplitLimit("episodes under 2 m", float(episodes.short), 0.0, "=", 0),
        SplitLimit("share of episodes driven blind, by the mean of other floors", episodes.blind, 0.40, "<"),
        SplitLimit("share of episodes driven blind, by distance from walls", episodes.blind_walls, 0.40, "<"),
        SplitLimit("overlap of furniture of two floors of a family", figures.overlap, 0.45, "<"),
        SplitLimit("share of hoods on the rarest wall", figures.rarest_wall, 0.10, ">="),
    )
