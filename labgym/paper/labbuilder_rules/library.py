"""The library that the rules take sizes and flags from: the user's assets_annotated.json, or labgym's catalog."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from labgym.assets import Asset, Catalog
from labgym.documents import read_json, validating
from labgym.errors import DocumentError
from labgym.paper.labbuilder.scene import Tolerant

FLAGS = ("flammable", "glass_container", "heat_source", "acid", "base", "oxidizer", "reactive_metal")
"""The flags that rules name."""
REAGENT = "reagent"
CATALOG = "catalog"
"""Name of labgym's catalog in place of a file."""
MAX_BYTES = 32 * 1024 * 1024

Side = Annotated[float, Field(gt=0.0, le=100.0)]
Text = Annotated[str, Field(max_length=200)]


class _Box(Tolerant):
    short: Side
    long: Side
    height: Side


class _Geometry(Tolerant):
    bbox: _Box


class _Record(Tolerant):
    id: Text = ""
    name: Text = ""
    type: Text = ""
    geometry: _Geometry | None = None
    props: dict[str, Any] = Field(default_factory=dict)


class _File(Tolerant):
    assets: Annotated[tuple[_Record, ...], Field(min_length=1, max_length=20_000)]


@dataclass(frozen=True)
class Entry:
    """An asset of a library.

    Attributes:
        id, name: its names.
        kind: `reagent`, `instrument` or `room_asset`; empty if unknown.
        short, long, height: sides of its bounding box, meters; the long one lies along x at 0 degrees.
        flags: those of `FLAGS` that are set.
    """

    id: str
    name: str
    kind: str = ""
    short: float = 0.1
    long: float = 0.1
    height: float = 0.2
    flags: frozenset[str] = frozenset()

    @property
    def sides(self) -> tuple[float, float, float]:
        """Extents along x and y at 0 degrees, and height."""
        return self.long, self.short, self.height


UNKNOWN = Entry("", "")
"""What the rules take for an asset that the library lacks: a box of 0.1 x 0.1 x 0.2 m without flags."""


class Library:
    """Assets by name.

    Args:
        entries: the assets; of repeated names the first counts, in navigation the last.
        title: name of results under these flags.
    """

    def __init__(self, entries: Iterable[Entry], title: str = "labbuilder") -> None:
        self.entries, self.title = tuple(entries), title
        self._exact: dict[str, Entry] = {}
        self._folded: dict[str, Entry] = {}
        self._last: dict[str, Entry] = {}
        for entry in self.entries:
            for name in (entry.id, entry.name):
                self._exact.setdefault(name, entry)
                self._folded.setdefault(name.lower(), entry)
            self._last[entry.id] = entry

    def find(self, name: str) -> Entry | None:
        """Return the asset of a name: as it is, without its number, in any case, or as words joined to Pascal case."""
        if name in self._exact:
            return self._exact[name]
        base, _, number = name.rpartition("_")
        if number.isdigit() and base in self._exact:
            return self._exact[base]
        pascal = "".join(word.capitalize() for word in name.split("_"))
        return self._folded.get(name.lower()) or self._exact.get(pascal)

    def sized(self, name: str) -> Entry:
        """Return the asset of a name, `UNKNOWN` for a name that the library lacks."""
        return self.find(name) or UNKNOWN

    def flagged(self, name: str) -> Entry:
        """Return the asset that supplies flags: that of the name, or of the name without what follows its last `_`."""
        return self.find(name) or self.find(name.rpartition("_")[0] or name) or UNKNOWN

    def last(self, identifier: str) -> Entry | None:
        """Return the last asset with exactly an id."""
        return self._last.get(identifier)

    def with_entries(self, entries: Iterable[Entry]) -> Library:
        """Return the library with further assets behind its own."""
        return Library((*self.entries, *entries), self.title)


def open_library(name: str | Path) -> Library:
    """Return the library of a file of LabBuilder, or labgym's own for the name `catalog`.

    Raises:
        DocumentError: as `read_library`.
    """
    return catalog_library(Catalog.load()) if str(name) == CATALOG else read_library(name)


def read_library(path: str | Path) -> Library:
    """Read the file of assets of LabBuilder (assets_annotated.json). It is the user's: labgym ships no such file.

    Raises:
        DocumentError: the file is missing, too large or not JSON, or an asset is invalid; names the field.
    """
    data = read_json(path, MAX_BYTES)
    if not isinstance(data, dict) or "assets" not in data:
        raise DocumentError(path, "assets", "missing; LabBuilder's assets_annotated.json is an object with this list")
    with validating(path):
        records = _File.model_validate(data).assets
    return Library(_entry(record) for record in records)


def _entry(record: _Record) -> Entry:
    flags = frozenset(flag for flag in FLAGS if record.props.get(flag))
    entry = Entry(record.id, record.name, record.type, flags=flags)
    if record.geometry is None:
        return entry
    return replace(entry, **record.geometry.bbox.model_dump())


def catalog_library(catalog: Catalog) -> Library:
    """Return labgym's catalog as a library; results under its flags have another name."""
    return Library((catalog_entry(asset.name, asset) for asset in catalog), "labbuilder, flags of labgym's catalog")


def catalog_entry(name: str, asset: Asset) -> Entry:
    """Return an asset of labgym under a name, with its sizes along x and y, and its flags."""
    hazards = asset.hazards
    flags = {flag for flag in FLAGS if getattr(hazards, "active_metal" if flag == "reactive_metal" else flag)}
    kind = "room_asset" if asset.kind == "facility" else asset.kind
    size = asset.size
    return Entry(name, name, kind, size.depth, size.width, size.height, frozenset(flags))
