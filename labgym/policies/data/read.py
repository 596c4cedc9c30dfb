"""Reading a dataset into arrays."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.errors import OptionError
from labgym.policies.data.columns import arrow, depth_of, rgb_of
from labgym.policies.data.make import MANIFEST
from labgym.policies.data.manifest import DatasetManifest
from labgym.policies.data.maps import Maps
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
        DocumentError: the manifest is missing or broken.
        OptionError: no shard is finished.
        MissingDependencyError: pyarrow is not installed.
    """
    pa, folder = arrow(), Path(folder)
    tables: list[Any] = []
    maps: list[Maps] = []
    places: list[NDArray[np.int64]] = []
    for shard in DatasetManifest.load(folder / MANIFEST).shards:
        if samples is not None and sum(len(table) for table in tables) >= samples:
            break
        table = pa.parquet.read_table(folder / f"samples/{shard.index:05d}.parquet")
        tables.append(table)
        places.append(table["map_index"].to_numpy() + len(maps))
        maps += _maps(pa.parquet.read_table(folder / f"maps/{shard.index:05d}.parquet"))
    if not tables:
        raise OptionError(f"{folder} has no finished shard; make the dataset with: labgym data --out {folder}")
    images = (image["bytes"] for table in tables for image in table["observation.images.depth"].to_pylist())
    return Dataset(
        depth=np.stack([depth_of(image) for image in images])[:samples],
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
        DocumentError: the manifest is missing or broken.
        MissingDependencyError: pyarrow is not installed.
    """
    pa, folder = arrow(), Path(folder)
    for shard in DatasetManifest.load(folder / MANIFEST).shards:
        column = pa.parquet.read_table(folder / f"samples/{shard.index:05d}.parquet")["observation.images.rgb"]
        for image in column.to_pylist():
            if samples == 0:
                return
            samples -= 1
            yield rgb_of(image["bytes"])


def _column(tables: list[Any], name: str, width: int) -> NDArray[np.float32]:
    parts = [table[name].combine_chunks() for table in tables]
    flat = [(part.flatten() if width > 1 else part).to_numpy(zero_copy_only=False) for part in parts]
    return np.concatenate(flat).astype(np.float32).reshape(-1, width)


def _maps(table: Any) -> list[Maps]:
    return [
        Maps(
            cost=np.asarray(row["cost"], np.float32).reshape(row["rows"], row["columns"]),
            distance=np.asarray(row["distance"], np.float32).reshape(row["rows"], row["columns"]),
            origin=(row["origin"][0], row["origin"][1]),
            resolution=row["resolution"],
        )
        for row in table.to_pylist()
    ]
