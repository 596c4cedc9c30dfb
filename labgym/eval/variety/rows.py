"""The rows of a description: floors, and the drives that were tried on them."""

from __future__ import annotations

from labgym.documents import Record
from labgym.layouts import Layout
from labgym.layouts.places import SplitPlace
from labgym.navigation import Pose, TriedPair

DIGITS = 6
"""Decimals of lengths in rows."""


class FloorRow(Record):
    """A floor of a split.

    Attributes:
        split, index: its place. family: its family. seed: its seed.
        area: floor area, square meters. rooms: number of spaces that are no corridors.
        protocols: number of protocols. clutter: level of clutter. objects: number of placements.
        hoods: for each hood the wall behind it, named from the main door.
    """

    split: str
    index: int
    family: str
    seed: int
    area: float
    rooms: int
    protocols: int
    clutter: int
    objects: int
    hoods: tuple[str, ...]

    @classmethod
    def of(cls, place: SplitPlace, layout: Layout, hoods: list[str]) -> FloorRow:
        """Return the row of a layout at a place of a split."""
        return cls(
            split=place.split,
            index=place.index,
            family=place.population.family,
            seed=place.seed,
            area=round(float(place.floor.parameters["area"]), 2),
            rooms=sum(space.use != "corridor" for space in layout.floor.spaces),
            protocols=len(layout.protocols),
            clutter=place.clutter,
            objects=len(layout.placements),
            hoods=tuple(hoods),
        )


class DriveRow(Record):
    """A drive that was tried.

    Attributes:
        split, index: the floor.
        start, goal: poses (x, y, yaw), meters and radians; start_location, goal_location: their names.
        length: length of the shortest path L*, meters; null without a path, like the next three.
        detour: length as a multiple of the straight distance.
        neck: narrowest gap on the shortest path, meters, at most 3.
        widest_neck: narrowest gap on the widest way, meters, at most 3.
        accepted: whether it is an episode of the split.
        blind: whether the policy that knows the mean of other floors drives it without touching anything; null if it
            was not tried. blind_walls: the same of the policy that knows how far from walls furniture stands.
    """

    split: str
    index: int
    start: Pose
    goal: Pose
    start_location: str
    goal_location: str
    length: float | None
    detour: float | None
    neck: float | None
    widest_neck: float | None
    accepted: bool
    blind: bool | None = None
    blind_walls: bool | None = None

    @classmethod
    def of(cls, split: str, index: int, tried: TriedPair) -> DriveRow:
        """Return the row of a pair that was tried on a floor."""
        pair, measures = tried.pair, tried.measures
        values: tuple[float | None, ...] = (None,) * 4
        if measures is not None:
            values = (measures.length, measures.detour, measures.neck, measures.widest_neck)
        length, detour, neck, widest = (None if value is None else round(value, DIGITS) for value in values)
        return cls(
            split=split,
            index=index,
            start=pair.start,
            goal=pair.goal,
            start_location=pair.start_location,
            goal_location=pair.goal_location,
            length=length,
            detour=detour,
            neck=neck,
            widest_neck=widest,
            accepted=tried.accepted,
        )
