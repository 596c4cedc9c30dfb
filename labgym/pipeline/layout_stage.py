"""The first stage of a run: a layout a protocol, made, scored and compiled, in worker processes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from labgym.eval import score
from labgym.layouts import Layout, generate
from labgym.layouts.splits import manifest
from labgym.protocols import protocols
from labgym.scenes import write_mjcf

PUBLISHED_PROFILE = "default"
"""The profile that published layouts are generated with."""


@dataclass(frozen=True)
class LayoutJob:
    """A layout to make.

    Attributes:
        made_for: thresholds that it is generated with. scored_by: thresholds that it is scored with.
        published: the hash that it must have, None where it is new.
    """

    id: str
    protocol: str
    seed: int
    room: str | None
    made_for: str
    scored_by: str
    published: str | None = None

    @property
    def inputs(self) -> dict[str, Any]:
        """The job as JSON data."""
        return asdict(self)

    def files(self, folder: Path) -> tuple[Path, Path, Path]:
        """Return where layout and score lie, and the folder of the scene."""
        return (
            folder / "layouts" / f"{self.id}.json",
            folder / "scores" / f"{self.id}.json",
            folder / "scenes" / self.id,
        )


def layout_jobs(seed: int | None, profile: str, only: Sequence[str] = ()) -> tuple[LayoutJob, ...]:
    """Return the jobs of a run: new layouts with a seed, or the published test layouts made again from theirs.

    Args:
        profile: thresholds that layouts are scored by, and new ones are generated with.
        only: protocols to take; none takes all.
    """
    wanted = set(only or protocols())
    if seed is not None:
        return tuple(LayoutJob(f"{name}-{seed}", name, seed, None, profile, profile) for name in sorted(wanted))
    return tuple(
        LayoutJob(entry.id, entry.protocol, entry.seed, entry.room, PUBLISHED_PROFILE, profile, entry.hash)
        for entry in manifest("test").layouts
        if entry.protocol in wanted
    )


def make_layout(job: LayoutJob, folder: Path) -> None:
    """Generate a layout, score it and compile it; write all three.

    Raises:
        InfeasibleError: the room cannot hold the protocol.
    """
    layout = generate(job.protocol, job.seed, job.room, job.made_for).replace(id=job.id)
    layout_file, score_file, scene = job.files(folder)
    layout.save(layout_file)
    score(layout, profile=job.scored_by).save(score_file)
    write_mjcf(layout, scene)


def differences(jobs: tuple[LayoutJob, ...], folder: Path) -> tuple[str, ...]:
    """Return a sentence for each layout that did not come out as published."""
    made = {job: Layout.load(job.files(folder)[0]).hash for job in jobs if job.published is not None}
    return tuple(
        f"layout {job.id}: made again it has hash {found[:12]}, the published one has {str(job.published)[:12]}"
        for job, found in made.items()
        if found != job.published
    )
