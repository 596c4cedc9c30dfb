"""The format "parquet": a folder of files with the steps, and a file with the episodes."""

from __future__ import annotations

from collections.abc import Iterator

from labgym.datasets.options import DriveOptions
from labgym.datasets.shards import FinishedShards
from labgym.datasets.tables import parquet_bytes
from labgym.runs.folder import Content

EPISODES = "episodes.parquet"


def parquet_files(options: DriveOptions, shards: FinishedShards) -> Iterator[tuple[str, Content]]:  # noqa: ARG001
    """Yield the merged file, that of the episodes: the shards wrote `steps/*.parquet` themselves."""
    yield EPISODES, parquet_bytes([shard.episodes for shard in shards])
