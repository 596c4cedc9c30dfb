"""The first stage of a run: one layout per protocol, loaded or generated, scored and compiled, in worker processes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labgym.errors import OptionError
from labgym.eval import score
from labgym.layouts import generate, load_published
from labgym.layouts.splits import manifest
from labgym.protocols import Protocol, protocols, resolve
from labgym.scenes import write_mjcf

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

    def files(self, folder: Path) -> tuple[Path, Path, Path]:
        """Return the files of layout and score, and the folder of the scene."""
        return (
            folder / "layouts" / f"{self.id}.json",
            folder / "scores" / f"{self.id}.json",
            folder / "scenes" / self.id,
        )


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


def make_layout(job: LayoutJob, folder: Path) -> None:
    """Load or generate a layout, score it and compile it; write all three.

    Raises:
        DocumentError: the published file does not have the manifest's hash.
        InfeasibleError: the room does not hold the protocol.
    """
    if job.seed is None:
        layout = load_published(SPLIT, job.id)
    else:
        layout = generate(job.protocol, job.seed, profile=job.profile).replace(id=job.id)
    layout_file, score_file, scene = job.files(folder)
    layout.save(layout_file)
    score(layout, profile=job.profile).save(score_file)
    write_mjcf(layout, scene)
