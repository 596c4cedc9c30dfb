"""The published layouts (val, test) and the endless training layouts, with seeds that never meet.

Training seeds are under 10^9, validation seeds start at 10^9, test seeds at 2 * 10^9. A published split is a
folder of layout files beside `manifest.json`, which records how each was made and its hash.
"""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.errors import DocumentError, InfeasibleError, UnknownNameError
from labgym.layouts.generate import generate
from labgym.layouts.model import Layout
from labgym.layouts.rooms import room_presets
from labgym.layouts.rules.thresholds import Profile
from labgym.protocols import Protocol, protocols

TRAIN_SEEDS = 10**9
FIRST_SEED = {"val": 10**9, "test": 2 * 10**9}
ATTEMPTS = 32
"""Training layouts drawn before a protocol counts as infeasible."""
ROOM_CYCLE = ("default", "roomy", "tight", "default", "two_exits")
"""Rooms of the published layouts, protocol by protocol."""


class PublishedLayout(Record):
    """How a published layout was made, and the hash that it must have."""

    id: str
    protocol: str
    room: str
    seed: int
    hash: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class Manifest(Document):
    """The layouts of one split."""

    SCHEMA: ClassVar[str] = "labgym.manifest/1"

    split: str
    layouts: tuple[PublishedLayout, ...]

    def entry(self, layout_id: str) -> PublishedLayout:
        """Return the entry of a layout.

        Raises:
            UnknownNameError: the split has none of that id.
        """
        for entry in self.layouts:
            if entry.id == layout_id:
                return entry
        raise UnknownNameError(f"{self.split} layout", layout_id, [entry.id for entry in self.layouts])


@lru_cache
def manifest(split: str) -> Manifest:
    """Return the manifest of a published split.

    Raises:
        UnknownNameError: there is no such published split.
    """
    if split not in FIRST_SEED:
        raise UnknownNameError("published split", split, FIRST_SEED)
    return Manifest.load(artefacts("layouts") / split / "manifest.json")


def published(split: str) -> tuple[str, ...]:
    """Return the ids of a published split's layouts, in order.

    Raises:
        UnknownNameError: there is no such published split.
    """
    return tuple(entry.id for entry in manifest(split).layouts)


def load_published(split: str, layout_id: str) -> Layout:
    """Return a published layout.

    Raises:
        UnknownNameError: no such split, or no such layout in it.
        DocumentError: the file is broken or its hash is not the manifest's.
    """
    entry = manifest(split).entry(layout_id)
    path = artefacts("layouts") / split / f"{entry.id}.json"
    layout = Layout.load(path)
    if layout.hash != entry.hash:
        raise DocumentError(path, "placements", f"hash {layout.hash[:12]} is not the manifest's {entry.hash[:12]}")
    return layout


def make_published(split: str, index: int) -> Layout:
    """Make the layout of a split's index-th protocol anew: the next room of the cycle, the first seed that fits.

    Raises:
        UnknownNameError: there is no such published split.
        InfeasibleError: no preset holds the protocol.
    """
    if split not in FIRST_SEED:
        raise UnknownNameError("published split", split, FIRST_SEED)
    protocol = sorted(protocols())[index]
    shift = 0 if split == "test" else 2
    room = ROOM_CYCLE[(index + shift) % len(ROOM_CYCLE)]
    seed = FIRST_SEED[split] + index
    try:
        layout = generate(protocol, seed, room)
    except InfeasibleError:
        layout = generate(protocol, seed, "roomy")
    return layout.replace(id=f"{split}-{protocol}")


def publish(split: str, layouts: list[Layout], folder: Path) -> Manifest:
    """Write a split's layouts and its manifest under a folder."""
    entries = []
    for layout in layouts:
        layout.save(folder / split / f"{layout.id}.json")
        entries.append(
            PublishedLayout(
                id=layout.id,
                protocol=str(layout.protocol_id),
                room=layout.room.name,
                seed=int(layout.provenance.seed or 0),
                hash=layout.hash,
            )
        )
    written = Manifest(split=split, layouts=tuple(entries))
    written.save(folder / split / "manifest.json")
    return written


def train_layout(
    generator: np.random.Generator, protocol: Protocol | None = None, profile: str | Profile = "default"
) -> Layout:
    """Return a new training layout: a protocol (unless one is given), a room preset and a seed, all drawn.

    Raises:
        InfeasibleError: the protocol fits in none of the rooms drawn.
    """
    choices = [protocol] if protocol is not None else [found for found in protocols().values() if found.moves]
    rooms = list(room_presets())
    attempts = ATTEMPTS
    while True:
        chosen = choices[int(generator.integers(len(choices)))]
        room = rooms[int(generator.integers(len(rooms)))]
        try:
            return generate(chosen, int(generator.integers(TRAIN_SEEDS)), room, profile)
        except InfeasibleError:
            attempts -= 1
            if attempts == 0:
                raise
