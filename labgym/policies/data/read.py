"""Reading a dataset into arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.errors import DocumentError, OptionError
from labgym.policies.data.columns import arrow, depth_of, rgb_of
from labgym.policies.data.manifest import DatasetShard, load_manifest
from labgym.policies.data.maps import Maps
from labgym.policies.data.parquet_files import REMEDY, read_maps, read_samples
from labgym.policies.data.situations import PATH_POINTS


@dataclass(frozen=True, eq=False)
class Dataset:
    """A dataset of n samples, without colors.

    Attributes:
        depth: (n, 72, 128) uint16, planar, millimeters.
        pose: (n, 3) x, y, yaw in the room frame.
        goal: (n, 2) in the robot frame, meters.
        path: (n, 64, 2) expert paths in the robot frame, meters.
        length: (n,) of the paths, meters.
        place: (n,) index of each sample's maps.
        drive: (n,) number of each sample's drive; the samples of a drive are consecutive.
        maps: one per layout.
    """

    depth: NDArray[np.uint16]
    pose: NDArray[np.float32]
    goal: NDArray[np.float32]
    path: NDArray[np.float32]
    length: NDArray[np.float32]
    place: NDArray[np.int64]
    drive: NDArray[np.int64]
    maps: tuple[Maps, ...]

    def __len__(self) -> int:
        return len(self.pose)


def load_dataset(folder: str | Path, samples: int | None = None) -> Dataset:
    """Return the finished shards of a dataset.

    Args:
        folder: folder of the dataset.
        samples: number of samples to read, the first ones; None reads all.

    Raises:
        DocumentError: the manifest or a file is missing or broken, or a file has another hash than recorded.
        OptionError: the dataset is unfinished.
        MissingDependencyError: pyarrow is not installed.
    """
    arrow()
    folder = Path(folder)
    tables: list[Any] = []
    maps: list[Maps] = []
    places: list[NDArray[np.int64]] = []
    for shard in load_manifest(folder).shards:
        if samples is not None and sum(len(table) for table in tables) >= samples:
            break
        table, shard_maps = read_samples(folder, shard), _maps(folder, shard)
        place = table["map_index"].to_numpy()
        if place.min() < 0 or place.max() >= len(shard_maps):
            raise DocumentError(folder, "map_index", f"shard {shard.index} names a map that it does not have; {REMEDY}")
        tables.append(table)
        places.append(place + len(maps))
        maps += shard_maps
    if not tables:
        raise OptionError(f"{folder} has no finished shard; make the dataset with: labgym data --out {folder}")
    images = (image for table in tables for image in table["observation.images.depth"].combine_chunks().field("bytes"))
    return Dataset(
        depth=np.stack([depth_of(image.as_py()) for image in images])[:samples],
        pose=_column(tables, "observation.state", 3)[:samples],
        goal=_column(tables, "observation.goal", 2)[:samples],
        path=_column(tables, "action", 2 * PATH_POINTS).reshape(-1, PATH_POINTS, 2)[:samples],
        length=_column(tables, "path_length", 1)[:samples, 0],
        place=np.concatenate(places)[:samples],
        drive=np.concatenate([table["episode_index"].to_numpy() for table in tables])[:samples],
        maps=tuple(maps),
    )


def pictures(folder: str | Path, samples: int) -> Iterator[NDArray[np.uint8]]:
    """Yield the RGB images (72, 128, 3) of a dataset's first samples.

    Raises:
        DocumentError: as `load_dataset`.
        MissingDependencyError: pyarrow is not installed.
    """
    arrow()
    folder = Path(folder)
    for shard in load_manifest(folder).shards:
        for image in read_samples(folder, shard)["observation.images.rgb"].combine_chunks().field("bytes"):
            if samples == 0:
                return
            samples -= 1
            yield rgb_of(image.as_py())


def _column(tables: list[Any], name: str, width: int) -> NDArray[np.float32]:
    parts = [table[name].combine_chunks() for table in tables]
    flat = [(part.flatten() if width > 1 else part).to_numpy(zero_copy_only=False) for part in parts]
    column = np.concatenate(flat).astype(np.float32).reshape(-1, width)
    if not np.isfinite(column).all():
        raise DocumentError("dataset", name, f"the column has a number that is not finite; {REMEDY}")
    return column


def _maps(folder: Path, shard: DatasetShard) -> list[Maps]:
    """Return the maps of a shard.

    Raises:
        DocumentError: the file is broken, or a map's size does not agree with its cells.
    """
    maps = []
    for index, row in enumerate(read_maps(folder, shard).to_pylist()):
        shape = (row["rows"], row["columns"])
        cost, distance = (np.asarray(row[name], np.float32) for name in ("cost", "distance"))
        numbers = (row["resolution"], *row["origin"], *shape)
        sized = min(shape) > 0 and cost.size == distance.size == shape[0] * shape[1]
        finite = np.isfinite(cost).all() and np.isfinite(distance).all() and np.isfinite(numbers).all()
        if not sized or not finite or row["resolution"] <= 0.0:
            problem = f"map {index} of shard {shard.index} has {cost.size} cells for {shape[0]} x {shape[1]}"
            raise DocumentError(folder, "maps", f"{problem}, or a number that is not finite; {REMEDY}")
        origin = (row["origin"][0], row["origin"][1])
        maps.append(Maps(cost.reshape(shape), distance.reshape(shape), origin, row["resolution"]))
    return maps
