"""The rows of a description: floors, and the drives that were tried on them."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence

from labgym.documents import Record
from labgym.errors import OptionError
from labgym.eval.variety.blind import blind_drives, blind_map, wall_map
from labgym.eval.variety.sketch import FloorSketch, main_entrance, sketch_of
from labgym.layouts import Layout
from labgym.layouts.drives import floor_drives
from labgym.layouts.places import SplitPlace, furnished
from labgym.layouts.splits import load_published, manifest
from labgym.navigation import Pose, TriedPair
from labgym.runs import ShardOutput
from labgym.runs.folder import SHARDS

WALLS = ("back", "left", "front", "right")
"""Walls as seen from the main door: the back wall is opposite, the door is in the front wall."""


def hood_walls(layout: Layout) -> list[str]:
    """Return the wall behind each hood of a layout, by the nearest of the four directions from the main door."""
    ahead = main_entrance(layout).pose[2] + math.pi / 2.0
    walls = []
    for placement in layout.placements:
        if layout.asset(placement.id).fume_hood:
            behind = layout.box(placement.id).yaw - math.pi / 2.0
            walls.append(WALLS[round((behind - ahead) / (math.pi / 2.0)) % 4])
    return walls


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


def survey(split: str, index: int, first: int | None, episodes: int, published: bool = False) -> ShardOutput:
    """Return the rows of a floor and its drives, and its sketch.

    Args:
        split, index, first: the floor, as for `furnished`.
        episodes: number of drives to accept.
        published: take the published layout. The rest, such as pairs that were not accepted, is regenerated.

    Raises:
        InfeasibleError: no seed of the place gives a layout.
        UnknownNameError: no such layout is published.
        OptionError: this version makes another layout than the published one.
    """
    place, tidy, layout = furnished(split, index, first)
    if published:
        made, layout = layout.hash, load_published(split, layout.id)
        if made != layout.hash:
            raise OptionError(
                f"this version makes another layout than the published {layout.id}; {manifest(split).maker}"
            )
    tried = floor_drives(layout, place.seed, episodes)
    floor = FloorRow.of(place, layout, hood_walls(layout))
    drives = [DriveRow.of(split, index, one).model_dump(mode="json") for one in tried]
    record = {"floor": floor.model_dump(mode="json"), "drives": drives}
    name = f"{SHARDS}/{split}/{index:05d}"
    return ShardOutput(
        {
            f"{name}.json": json.dumps(record, allow_nan=False).encode(),
            f"{name}.npz": sketch_of(tidy, layout).to_bytes(),
        }
    )


def drive_blind(
    name: str, floors: Sequence[int], sketches: Sequence[bytes], others: int, drives: Sequence[Sequence[DriveRow]]
) -> ShardOutput:
    """Return whether each blind policy drives freely, for each drive with a path on some floors of a family.

    Args:
        name: name of the shard.
        floors: numbers of the floors.
        sketches: of all floors of the family.
        others: number of other floors whose furniture the policies know: those that follow, in a circle.
        drives: for each of `floors` its drives.
    """
    known = [FloorSketch.from_bytes(data) for data in sketches]
    results = []
    for floor, rows in zip(floors, drives, strict=True):
        following = [known[(floor + k) % len(known)] for k in range(1, min(others, len(known) - 1) + 1)]
        ends = [(row.start[:2], row.goal[:2]) for row in rows]
        free = [blind_drives(known[floor], following, ends, knowledge) for knowledge in (blind_map, wall_map)]
        results.append(list(zip(*free, strict=True)))
    return ShardOutput({f"{SHARDS}/blind/{name}.json": json.dumps(results).encode()})
