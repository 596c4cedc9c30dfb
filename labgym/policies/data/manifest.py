"""Manifest of a dataset: options, columns, and for each shard its layouts and the hashes of its files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.documents import Document, Record, canonical_hash
from labgym.errors import OptionError
from labgym.policies.options import Share
from labgym.runs.identity import IDENTITY_FILE

MANIFEST = "manifest.json"

Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class DataOptions(Record):
    """Options that determine every byte of a dataset, given the versions of the package and of its dependencies.

    Attributes:
        samples: number of samples.
        seed: shard i draws from `SeedSequence([seed, i])`.
        shard: samples per shard.
        layout: samples per layout.
        drive: largest number of samples per drive. The last shard, layout and drive take the remainder.
        floors: share of the layouts that are training floors; the others are training rooms.
        led: share of the drives that a learner leads.
        learner: SHA-256 of the learner; None without one.
    """

    samples: Annotated[int, Field(ge=1, le=100_000_000)] = 50_000
    seed: Annotated[int, Field(ge=0, lt=2**53)] = 0
    shard: Annotated[int, Field(ge=1, le=100_000)] = 500
    layout: Annotated[int, Field(ge=1)] = 100
    drive: Annotated[int, Field(ge=1)] = 20
    floors: Share = 0.0
    led: Share = 0.0
    learner: Digest | None = None

    @property
    def shards(self) -> int:
        """Number of shards."""
        return -(-self.samples // self.shard)

    def size(self, index: int) -> int:
        """Return the number of samples in a shard."""
        return min(self.shard, self.samples - index * self.shard)


class DatasetLayout(Record):
    """A layout of the samples."""

    id: str
    protocol: str
    room: str
    seed: Annotated[int, Field(ge=0)]
    hash: Digest


class DatasetShard(Record):
    """Two parquet files with one number: samples, and the maps of their layouts.

    Attributes:
        files: SHA-256 by path relative to the dataset's folder.
    """

    index: Annotated[int, Field(ge=0)]
    samples: Annotated[int, Field(ge=1)]
    layouts: tuple[DatasetLayout, ...]
    files: dict[str, Digest]


class DatasetManifest(Document):
    """`manifest.json` of a dataset.

    Attributes:
        columns: Arrow types of the sample files by column.
        map_columns: Arrow types of the map files by column.
        complete: whether all shards are finished; only release 0.1 wrote manifests of unfinished datasets.
    """

    SCHEMA: ClassVar[str] = "labgym.dataset/1"

    options: DataOptions
    versions: dict[str, str]
    columns: dict[str, str]
    map_columns: dict[str, str]
    complete: bool
    shards: tuple[DatasetShard, ...]

    @property
    def digest(self) -> str:
        """SHA-256 of the manifest, and so of the whole dataset."""
        return canonical_hash(self.to_json())


def load_manifest(folder: str | Path) -> DatasetManifest:
    """Return the manifest of a dataset.

    Raises:
        OptionError: the dataset is unfinished.
        DocumentError: the manifest is missing or broken.
    """
    path = Path(folder) / MANIFEST
    if not path.exists() and (Path(folder) / IDENTITY_FILE).exists():
        raise OptionError(f"{folder} holds an unfinished dataset; finish it with: labgym data --out {folder}")
    return DatasetManifest.load(path)
