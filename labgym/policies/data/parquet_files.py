"""Reading of a dataset's parquet files, which may be damaged or made by others: hash, types, sizes, no gaps."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from labgym.errors import DocumentError
from labgym.policies.data.columns import arrow, map_schema, sample_schema
from labgym.policies.data.manifest import DatasetShard

MAX_FILE = 2 * 1024**3
"""Largest parquet file, bytes."""
MAX_UNPACKED = 4 * 1024**3
"""Largest size of a file's columns before compression, bytes; 100 000 samples take 2.5 GB."""
MAX_BATCH = 128 * 1024**2
"""Largest size of the rows that are decoded at one time, bytes."""
BATCH = 16
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
        for batch in file.iter_batches(batch_size=BATCH):
            if batch.nbytes > MAX_BATCH:
                raise DocumentError(path, "", f"{BATCH} rows take more than {MAX_BATCH} bytes; {REMEDY}")
            batch.validate(full=True)
            batches.append(batch)
        table = pa.Table.from_batches(batches, schema=schema)
    except DocumentError:
        raise
    except (pa.ArrowException, OSError, ValueError, KeyError, IndexError, TypeError, MemoryError) as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())[:160]
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
