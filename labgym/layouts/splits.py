"""The published splits and generated training rooms; all use disjoint seeds.

Seeds of training rooms are below 10^9, those of the rooms of val start at 10^9, of test at 2 * 10^9; the splits of
floors have others (`labgym.layouts.places`). A published split is a folder of layout files with `manifest.json`, which
records the generator's version and, for each layout, what it was made from, and its hash.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

import numpy as np
from pydantic import Field
from tqdm import tqdm

from labgym.artefacts import artefacts
from labgym.documents import Document, Record
from labgym.errors import DocumentError, InfeasibleError, UnknownNameError, check_name
from labgym.layouts.generate import FURNISHER, GENERATOR, generate
from labgym.layouts.model import Layout
from labgym.layouts.places import MADE_UNDER, layout_at
from labgym.layouts.rooms import PUBLISHED_PRESETS
from labgym.layouts.rules.thresholds import Profile
from labgym.protocols import Protocol, protocols

TRAIN_SEEDS = 10**9
FIRST_SEED = {"val": 10**9, "test": 2 * 10**9}
PublishedSplit = Literal["val", "test", "floors-val", "floors-seen", "floors-test"]
PUBLISHED: tuple[PublishedSplit, ...] = get_args(PublishedSplit)
"""Names of the published splits."""
ATTEMPTS = 32
"""Number of training layouts that are tried before a protocol counts as infeasible."""


class PublishedLayout(Record):
    """The arguments of a published layout, and its hash.

    Attributes:
        protocol: id of its first protocol. protocols: ids of all; None for a room, which has one.
        room: name of its room or floor.
        seed: its random seed.
        family, clutter: family of the floor, and its level of clutter; None for a room.
        place: its place in a split of floors, such as floors-test/17; None for a room.
    """

    id: str
    protocol: str
    room: str
    seed: int
    hash: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]
    place: Annotated[str, Field(pattern=r"^[a-z-]+/[0-9]+$")] | None = None
    family: str | None = None
    clutter: Annotated[int, Field(ge=0, le=3)] | None = None
    protocols: Annotated[tuple[str, ...], Field(max_length=100)] | None = None

    @classmethod
    def of(cls, layout: Layout) -> PublishedLayout:
        """Return the entry of a layout that this version's generator made."""
        options, place = layout.provenance.options, layout.provenance.options.get("place")
        entry = cls(
            id=layout.id,
            protocol=str(layout.protocol_id),
            room=layout.floor.name,
            seed=int(layout.provenance.seed or 0),
            hash=layout.hash,
        )
        if place is None:
            return entry
        names = tuple(protocol.id for protocol in layout.protocols)
        floor = {"place": place, "family": options["family"], "clutter": options.get("clutter", 0), "protocols": names}
        return entry.model_copy(update=floor)


class Manifest(Document):
    """The layouts of a published split.

    Attributes:
        generator: version of the generator that made them (`labgym.layouts.GENERATOR`).
        furnisher: version of what made floors (`labgym.layouts.generate.FURNISHER`); None for rooms.
    """

    SCHEMA: ClassVar[str] = "labgym.manifest/1"

    split: str
    generator: Annotated[int, Field(ge=1)] = 1
    furnisher: Annotated[int, Field(ge=1)] | None = None
    layouts: tuple[PublishedLayout, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the manifest as JSON data; rooms have no place in a split of floors."""
        return {"schema": self.SCHEMA, **self.model_dump(mode="json", exclude_none=True)}

    @property
    def reproducible(self) -> bool:
        """Whether this version makes the same layouts again."""
        return self.generator == GENERATOR if self.furnisher is None else self.furnisher == FURNISHER

    @property
    def maker(self) -> str:
        """A sentence for messages: the version that made the layouts, and this one's."""
        if self.furnisher is None:
            name, own = f"generator {self.generator}", GENERATOR
        else:
            name, own = f"furnisher {self.furnisher}", FURNISHER
        return f"the layouts of {self.split} were made by {name}, this version has {own}: only their files are checked"

    def entry(self, layout_id: str) -> PublishedLayout:
        """Return the entry of a layout.

        Raises:
            UnknownNameError: the split has no layout of that id.
        """
        for entry in self.layouts:
            if entry.id == layout_id:
                return entry
        raise UnknownNameError(f"{self.split} layout", layout_id, [entry.id for entry in self.layouts])


@lru_cache
def manifest(split: str) -> Manifest:
    """Return the manifest of a published split.

    Raises:
        UnknownNameError: no published split has that name.
    """
    check_name("published split", split, PUBLISHED)
    return Manifest.load(artefacts("layouts") / split / "manifest.json")


def published(split: str) -> tuple[str, ...]:
    """Return the ids of a published split's layouts, in order.

    Raises:
        UnknownNameError: no published split has that name.
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


def mismatches(split: str) -> tuple[str, ...]:
    """Return a sentence for each published file that is missing, broken or does not have the manifest's hash.

    Raises:
        UnknownNameError: no published split has that name.
    """
    problems = []
    for layout_id in published(split):
        try:
            load_published(split, layout_id)
        except DocumentError as error:
            problems.append(str(error))
    return tuple(problems)


def make_again(entry: PublishedLayout) -> Layout:
    """Regenerate a published layout with this generator: from protocol, room preset and seed, or from its place.

    The result equals the published layout only if the manifest names this generator.

    Raises:
        UnknownNameError: the library has no such protocol, or the room preset does not exist.
        InfeasibleError: the room does not hold the protocol.
    """
    if entry.place is not None:
        split, _, index = entry.place.partition("/")
        return layout_at(split, int(index)).replace(id=entry.id)
    return generate(entry.protocol, entry.seed, entry.room, rules=MADE_UNDER).replace(id=entry.id)


def publish(split: str, layouts: Sequence[Layout], folder: Path) -> Manifest:
    """Write layouts that this generator made, and their manifest, to `folder/split`; return the manifest."""
    for layout in layouts:
        layout.save(folder / split / f"{layout.id}.json")
    entries = tuple(map(PublishedLayout.of, layouts))
    furnisher = FURNISHER if any(entry.place is not None for entry in entries) else None
    written = Manifest(split=split, generator=GENERATOR, furnisher=furnisher, layouts=entries)
    written.save(folder / split / "manifest.json")
    return written


@dataclass(frozen=True)
class Reproduction:
    """The outcome of checking a published split.

    Attributes:
        problems: a sentence for each file or regenerated layout that does not have the manifest's hash.
        notice: whether the layouts were regenerated, or which version made them.
    """

    problems: tuple[str, ...]
    notice: str


def reproduce(split: str, out: Path | None = None) -> Reproduction:
    """Check a published split, and regenerate its layouts if this version's generator made them.

    Args:
        split: name of a published split.
        out: folder to which the layouts that this version makes from the same entries are written, as `out/split`.

    Raises:
        UnknownNameError: no published split has that name.
        InfeasibleError: a room does not hold its protocol.
    """
    document = manifest(split)
    entries = document.layouts
    problems = list(mismatches(split))
    layouts = []
    if document.reproducible or out is not None:
        layouts = [make_again(entry) for entry in tqdm(entries, desc=split)]
    if out is not None:
        publish(split, layouts, out)
    if not document.reproducible:
        return Reproduction(tuple(problems), document.maker)
    for entry, layout in zip(entries, layouts, strict=True):
        if layout.hash != entry.hash:
            problems.append(f"{entry.id}: regenerated, its hash is {layout.hash[:12]}, published {entry.hash[:12]}")
    return Reproduction(tuple(problems), f"the {len(entries)} layouts of {split} were regenerated")


def train_layout(
    generator: np.random.Generator, protocol: Protocol | None = None, profile: str | Profile = "default"
) -> Layout:
    """Return a new training layout; the protocol (unless one is given), the room preset and the seed are drawn.

    Raises:
        InfeasibleError: none of the rooms drawn holds its protocol.
    """
    choices = [protocol] if protocol is not None else [one for one in protocols().values() if one.moves]
    rooms = list(PUBLISHED_PRESETS)
    attempts = ATTEMPTS
    while True:
        choice = choices[int(generator.integers(len(choices)))]
        room = rooms[int(generator.integers(len(rooms)))]
        try:
            return generate(choice, int(generator.integers(TRAIN_SEEDS)), room, profile, rules=MADE_UNDER)
        except InfeasibleError:
            attempts -= 1
            if attempts == 0:
                raise
