"""The shards of a description: a floor is drawn, furnished and measured; then the blind policies drive on it."""

from __future__ import annotations

import json
from collections.abc import Sequence

from labgym.errors import OptionError
from labgym.eval.variety.blind import blind_drives, blind_map, wall_map
from labgym.eval.variety.hood_walls import hood_walls
from labgym.eval.variety.rows import DriveRow, FloorRow
from labgym.eval.variety.sketch import FloorSketch, sketch_of
from labgym.layouts.drives import floor_drives
from labgym.layouts.places import furnished
from labgym.layouts.splits import load_published, manifest
from labgym.runs import ShardOutput
from labgym.runs.folder import SHARDS


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
    place, tidy = furnished(split, index, first)
    layout = place.cluttered(tidy)
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
