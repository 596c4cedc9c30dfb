"""Reading a dataset into arrays; its files may be damaged or made by others."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.errors import DocumentError, OptionError, one_line
from labgym.policies.data.columns import arrow, depth_of, map_schema, rgb_of, sample_schema
from labgym.policies.data.manifest import DatasetShard, load_manifest
from labgym.policies.data.maps import Maps
from labgym.policies.data.situations import PATH_POINTS

MAX_FILE = 2 * 1024**3
"""Largest parquet file, bytes."""

MAX_UNPACKED = 4 * 1024**3
"""Largest size of a file's columns before compression, bytes; 100 000 samples take 2.5 GB."""

MAX_BATCH = 128 * 1024**2
"""Largest size of the rows that are decoded at one time, bytes."""

BATCH_ROWS = 16

REMEDY = "make the dataset again with: labgym data"


def read_samples(folder: Path, shard: DatasetShard) -> Any:
    """Return the table of a shard's samples, with the columns of `sample_schema` and without nulls.

    Raises:
        DocumentError: the file is missing or damaged, or its hash is not the one in the manifest.
    """
    path = folder / f"samples/{shard.index:05d}.parquet"
    table = _table(path, _content(folder, path, shard), sample_schema(), shard.samples)
    if len(table) != shard.samples:
        raise DocumentError(path, "", f"has {len(table)} samples, the manifest says {shard.samples}; {REMEDY}")
    return table


def read_maps(folder: Path, shard: DatasetShard) -> Any:
    """Return the table of a shard's maps, with the columns of `map_schema` and without nulls.

    Raises:
        DocumentError: the file is missing or damaged, or its hash is not the one in the manifest.
    """
    path = folder / f"maps/{shard.index:05d}.parquet"
    return _table(path, _content(folder, path, shard), map_schema(), len(shard.layouts))


def _content(folder: Path, path: Path, shard: DatasetShard) -> bytes:
    """Return the bytes of a file whose hash the manifest records."""
    try:
        if path.stat().st_size > MAX_FILE:
            raise DocumentError(path, "", f"larger than {MAX_FILE} bytes")
        content = path.read_bytes()
    except OSError as error:
        problem = "missing" if isinstance(error, FileNotFoundError) else f"cannot be read ({error.strerror})"
        raise DocumentError(path, "", f"{problem}; {REMEDY}") from None
    recorded = shard.files.get(str(path.relative_to(folder).as_posix()))
    if hashlib.sha256(content).hexdigest() != recorded:
        raise DocumentError(path, "", f"its SHA-256 is not the one in the manifest; {REMEDY}")
    return content


def _table(path: Path, content: bytes, schema: Any, rows: int) -> Any:
    """Return the rows of a parquet file in small batches, so that a small file cannot fill the memory."""
    pa = arrow()
    try:
        file = pa.parquet.ParquetFile(pa.BufferReader(content))
        groups = [file.metadata.row_group(index) for index in range(file.metadata.num_row_groups)]
        if file.metadata.num_rows > rows or sum(group.total_byte_size for group in groups) > MAX_UNPACKED:
            raise DocumentError(path, "", f"has more than {rows} rows or {MAX_UNPACKED} bytes unpacked; {REMEDY}")
        _check_types(path, file.schema_arrow, schema)
        batches = []
        for batch in file.iter_batches(batch_size=BATCH_ROWS):
            if batch.nbytes > MAX_BATCH:
                raise DocumentError(path, "", f"{BATCH_ROWS} rows take more than {MAX_BATCH} bytes; {REMEDY}")
            batch.validate(full=True)
            batches.append(batch)
        table = pa.Table.from_batches(batches, schema=schema)
    except DocumentError:
        raise
    except (pa.ArrowException, OSError, ValueError, KeyError, IndexError, TypeError, MemoryError) as error:
        reason = one_line(error, 160)
        raise DocumentError(path, "", f"not a parquet file of a dataset ({reason}); {REMEDY}") from None
    _check_complete(path, table)
    return table


def _check_types(path: Path, actual: Any, expected: Any) -> None:
    for field in expected:
        index = actual.get_field_index(field.name)
        kind = actual.field(index).type if index >= 0 else None
        if kind != field.type:
            problem = "missing" if kind is None else f"of type {kind}, expected {field.type}"
            raise DocumentError(path, field.name, " ".join(f"the column is {problem}; {REMEDY}".split()))


def _check_complete(path: Path, table: Any) -> None:
    """Raise DocumentError for a null, in a column or within its lists; the paths of images are null by design."""
    pa = arrow()
    for name in table.column_names:
        column = table[name].combine_chunks()
        if pa.types.is_struct(column.type):
            parts = [column, column.field("bytes")]
        elif pa.types.is_list(column.type) or pa.types.is_fixed_size_list(column.type):
            parts = [column, column.flatten()]
        else:
            parts = [column]
        if any(part.null_count for part in parts):
            raise DocumentError(path, name, f"the column has a null; {REMEDY}")


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
