"""The finished shards of a run, read one at a time: a dataset may be larger than the memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labgym.datasets.options import DriveOptions
from labgym.datasets.shard import episodes_file, steps_file
from labgym.datasets.tables import read_parquet
from labgym.errors import LabgymError
from labgym.runs import RunFolder

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True)
class FinishedShard:
    """A shard.

    Attributes:
        index: of the shard. files: content by path relative to the folder. record: its drives, as plain data.
    """

    index: int
    files: dict[str, bytes]
    record: Any
    options: DriveOptions

    @cached_property
    def steps(self) -> pa.Table:
        """The steps."""
        return read_parquet(self.files[steps_file(self.options, self.index)])

    @cached_property
    def episodes(self) -> pa.Table:
        """The episodes."""
        return read_parquet(self.files[episodes_file(self.index)])


class FinishedShards:
    """The shards of a run, in their order.

    Args:
        run: whose shards are all finished. options: of the dataset.
    """

    def __init__(self, run: RunFolder, options: DriveOptions) -> None:
        self._run, self._options = run, options

    @property
    def path(self) -> Path:
        """The folder of the run."""
        return self._run.path

    def __iter__(self) -> Iterator[FinishedShard]:
        for index in range(self._options.shards):
            output = self._run.output(f"{index:05d}")
            if output is None:
                raise LabgymError(
                    f"{self._run.path}: files of shard {index} were changed while it was merged; run again"
                )
            files, record = output
            yield FinishedShard(index, files, record, self._options)

    @property
    def records(self) -> Iterator[Any]:
        """The records of the shards."""
        return (shard.record for shard in self)
