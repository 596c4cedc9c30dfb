"""The shards of a run: one is made from episodes as parquet files, and finished ones are read one at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.datasets.driving import Drives, EpisodeFacts, RecordedEpisode
from labgym.datasets.options import DriveOptions
from labgym.datasets.tables import episode_table, parquet_bytes, read_parquet, step_table
from labgym.datasets.video import lerobot_videos
from labgym.errors import LabgymError
from labgym.eval.driving.runner import policy_process
from labgym.eval.labnav.foresight import in_place
from labgym.policies.process import PolicySource
from labgym.runs import RunFolder, ShardOutput
from labgym.runs.folder import SHARDS

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True)
class Attempt:
    """A drive of the expert, kept or dropped.

    Attributes:
        kept: whether it is in the dataset. success, score, ending: as in the table of episodes.
        steps: number of steps if it is kept, else 0.
    """

    kept: bool
    success: bool
    score: float
    ending: str
    steps: int = 0

    @classmethod
    def of(cls, facts: EpisodeFacts, steps: int | None) -> Attempt:
        """Return a drive that was kept with its number of steps, or dropped (None)."""
        return cls(steps is not None, facts.success, facts.score, facts.ending, steps or 0)


def steps_file(options: DriveOptions, index: int) -> str:
    """Return the path of the steps of a shard; those of other formats than parquet are merged at the end."""
    return f"steps/{index:05d}.parquet" if options.format == "parquet" else f"{SHARDS}/{index:05d}/steps.parquet"


def episodes_file(index: int) -> str:
    """Return the path of the episodes of a shard, which are merged at the end."""
    return f"{SHARDS}/{index:05d}/episodes.parquet"


def make_shard(options: DriveOptions, index: int, expert: PolicySource, files: str, kernels: str) -> ShardOutput:
    """Drive the episodes of a shard; they depend on the options and the index alone.

    Args:
        expert, files, kernels: as for `labgym.eval.driving.runner.drive_shard`.
    """
    driver = in_place(policy_process(expert, files, None, kernels), expert)
    drives = Drives(options, driver)
    steps, rows, attempts, observed = [], [], [], []
    try:
        observation, action = drives.spaces
        for number in options.numbers(index):
            episode: RecordedEpisode = drives.episode(number)
            steps.append(step_table(episode, observation, action))
            rows.append(episode_table(episode, observation, options))
            if options.format == "lerobot":
                observed += episode.steps.observations[:-1]
            attempts += [Attempt.of(each, None) for each in episode.dropped]
            attempts.append(Attempt.of(episode.facts, len(episode.steps)))
    finally:
        drives.close()
    content = {steps_file(options, index): parquet_bytes(steps), episodes_file(index): parquet_bytes(rows)}
    content |= lerobot_videos(index, observed)
    record: list[dict[str, Any]] = [asdict(each) for each in attempts]
    return ShardOutput(content, record)


def attempts_of(record: Any) -> list[Attempt]:
    """Return the drives of a shard's record."""
    return [Attempt(**each) for each in record]


def mean(values: list[float]) -> float:
    """Return the mean of values, 0 for none."""
    return float(np.mean(values)) if values else 0.0


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
