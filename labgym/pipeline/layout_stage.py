"""The first stage of a run: one layout per protocol, loaded or generated, scored and compiled, in worker processes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from labgym.documents import json_bytes
from labgym.errors import OptionError
from labgym.eval import score
from labgym.layouts import Layout, generate, load_published
from labgym.layouts.batch import catalog_digest
from labgym.layouts.splits import manifest
from labgym.protocols import Protocol, protocols, resolve
from labgym.runs import ExecutorOptions, RunFolder, Shard, ShardOutput, run_shards
from labgym.scenes.files import mjcf_files

SPLIT = "test"
"""The published split that a run without a seed takes."""


@dataclass(frozen=True)
class LayoutJob:
    """A layout to load or to generate.

    Attributes:
        seed: seed to generate the layout with in the default room; None loads the published layout of that id.
        profile: thresholds that the layout is scored by, and generated with.
        published: hash of the published layout; None for a new one.
    """

    id: str
    protocol: Protocol
    seed: int | None
    profile: str
    published: str | None = None

    @property
    def inputs(self) -> dict[str, Any]:
        """The job as JSON data."""
        fields = {name: getattr(self, name) for name in ("id", "seed", "profile", "published")}
        return {**fields, "protocol": self.protocol.to_json()}

    @property
    def file(self) -> str:
        """Path of the layout relative to the run's folder."""
        return f"layouts/{self.id}.json"


def layout_jobs(seed: int | None, profile: str, only: Sequence[str] = ()) -> tuple[LayoutJob, ...]:
    """Return the jobs of a run: new layouts if there is a seed, else the published test layouts.

    Args:
        profile: thresholds that layouts are scored by, and new ones are generated with.
        only: ids or .json files of the protocols; empty for the whole library.

    Raises:
        OptionError: a protocol is not in the library and there is no seed, or two protocols have the same id.
        UnknownNameError: the library has no protocol of an id.
        DocumentError: a file is not a protocol.
    """
    chosen = [resolve(name) for name in only or protocols()]
    by_id = {protocol.id: protocol for protocol in chosen}
    if len(by_id) != len(chosen):
        raise OptionError(f"protocols {', '.join(only)} have the ids {', '.join(sorted(by_id))}: give each id once")
    if seed is not None:
        return tuple(LayoutJob(f"{name}-{seed}"[:80], by_id[name], seed, profile) for name in sorted(by_id))
    unpublished = [name for name, protocol in by_id.items() if protocols().get(name) != protocol]
    if unpublished:
        raise OptionError(f"protocol {unpublished[0]!r} has no published layout: give --seed to generate one")
    return tuple(
        LayoutJob(entry.id, by_id[entry.protocol], None, profile, entry.hash)
        for entry in manifest(SPLIT).layouts
        if entry.protocol in by_id
    )


def make_layouts(jobs: Sequence[LayoutJob], folder: RunFolder, executor: ExecutorOptions) -> tuple[Layout, ...]:
    """Load or generate the layouts of a run, score and compile them; return the layouts in the order of the jobs."""
    shards = [Shard(f"layout {job.id}", make_layout, (job,), inputs=job.inputs) for job in jobs]
    for _ in run_shards(shards, folder, executor, "layouts   ", guard={"catalog": catalog_digest}):
        pass
    return tuple(Layout.load(folder.path / job.file) for job in jobs)


def make_layout(job: LayoutJob) -> ShardOutput:
    """Return the files of a layout, its score and its scene.

    Raises:
        DocumentError: the published file does not have the manifest's hash.
        InfeasibleError: the room does not hold the protocol.
    """
    if job.seed is None:
        layout = load_published(SPLIT, job.id)
    else:
        layout = generate(job.protocol, job.seed, profile=job.profile).replace(id=job.id)
    files = {job.file: json_bytes(layout.to_json())}
    files[f"scores/{job.id}.json"] = json_bytes(score(layout, profile=job.profile).to_json())
    return ShardOutput(files | {f"scenes/{job.id}/{name}": content for name, content in mjcf_files(layout).items()})
