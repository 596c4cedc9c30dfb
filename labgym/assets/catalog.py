"""The catalogue: every asset that labgym knows, read once from the artefact folder."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.assets.archive import SHAPE, find_geometry
from labgym.assets.model import Asset, Kind
from labgym.assets.search import Match, SynonymIndex
from labgym.assets.sizes import size_problem
from labgym.documents import Document
from labgym.errors import DocumentError, UnknownNameError

FOLDER_VARIABLE = "LABGYM_CATALOG"
OWN_ASSETS = "assets"
"""Folder of the entries within a folder of one's own."""


class AssetFile(Document):
    """A file of the catalogue: assets that belong together."""

    SCHEMA: ClassVar[str] = "labgym.assets/1"

    assets: Annotated[tuple[Asset, ...], Field(max_length=5000)]


class Catalog:
    """All assets by canonical name, with a search over names and synonyms.

    Raises:
        DocumentError: two assets share a name.
    """

    def __init__(self, assets: Sequence[Asset], source: object = "catalogue") -> None:
        self.assets = tuple(sorted(assets, key=lambda asset: asset.name))
        self._by_name = {asset.name: asset for asset in self.assets}
        if len(self._by_name) != len(self.assets):
            names = [asset.name for asset in self.assets]
            twice = next(name for name in names if names.count(name) > 1)
            raise DocumentError(source, "assets", f"{twice!r} is defined twice; names must be unique")

    @classmethod
    def load(cls, folder: str | Path | None = None) -> Catalog:
        """Return the published catalogue with the assets of a folder of one's own; each is read once a process.

        Args:
            folder: what `labgym assets add` wrote to; by default the environment variable LABGYM_CATALOG names it.

        Raises:
            DocumentError: the folder does not exist, holds broken entries or geometry, or a name that is published.
        """
        own = str(folder) if folder is not None else os.environ.get(FOLDER_VARIABLE, "")
        return _with_own(own) if own else _published()

    @classmethod
    def published(cls) -> Catalog:
        """Return the published catalogue alone; read once a process."""
        return _published()

    @classmethod
    def read(cls, folder: str | Path) -> Catalog:
        """Read every JSON file below a folder.

        Raises:
            DocumentError: no such folder, a file that is no asset file, an implausible size, or a name defined twice.
        """
        files = sorted(Path(folder).rglob("*.json"))
        if not files:
            raise DocumentError(folder, "", "holds no asset files (*.json)")
        return cls([asset for file in files for asset in _read(file)], folder)

    def __len__(self) -> int:
        return len(self.assets)

    def __iter__(self) -> Iterator[Asset]:
        return iter(self.assets)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self._by_name

    @property
    def names(self) -> tuple[str, ...]:
        """Canonical names, sorted."""
        return tuple(self._by_name)

    def get(self, name: str) -> Asset:
        """Return the asset of exactly that canonical name.

        Raises:
            UnknownNameError: there is none; lists the nearest.
        """
        try:
            return self._by_name[name]
        except (KeyError, TypeError):
            raise UnknownNameError("asset", name, self._by_name) from None

    def find(self, text: str) -> Asset:
        """Return the asset that a free text names, in English, Chinese or as a formula.

        Canonical names, synonyms and CAS numbers are compared without regard to case, spacing and punctuation. A
        misspelling is forgiven where one asset is clearly the nearest; for reagents only a slip that cannot be the
        name of another substance.

        Raises:
            UnknownNameError: nothing is near enough; lists the nearest.
        """
        name = self._index.lookup(text) if isinstance(text, str) else None
        if name is None:
            raise UnknownNameError("asset", text, self._by_name)
        return self._by_name[name]

    def match(self, text: str) -> Match | None:
        """Return the asset that a free text names and how it was found, or None where `find` would refuse."""
        return self._index.match(text)

    def candidates(self, text: str, count: int = 5) -> tuple[Match, ...]:
        """Return the assets whose names or synonyms are spelt most like a text, best first, with their scores."""
        return self._index.candidates(text, count)

    def nearest(self, text: str, count: int = 5) -> tuple[str, ...]:
        """Return the canonical names whose names or synonyms are spelt most like a text, best first."""
        return self._index.nearest(text, count)

    def of_kind(self, kind: Kind) -> tuple[Asset, ...]:
        """Return the assets of a kind."""
        return tuple(asset for asset in self.assets if asset.kind == kind)

    @cached_property
    def _index(self) -> SynonymIndex:
        return SynonymIndex(self.assets)


def _read(file: Path) -> tuple[Asset, ...]:
    assets = AssetFile.load(file).assets
    for index, asset in enumerate(assets):
        problem = size_problem(asset)
        if problem is not None:
            raise DocumentError(file, f"assets.{index}.size", problem)
    return assets


def read_own(folder: str | Path) -> tuple[Asset, ...]:
    """Return the assets of a folder of one's own, their geometry found and checked.

    Raises:
        DocumentError: no such folder, or an entry or its geometry is broken.
    """
    if not Path(folder).is_dir():
        raise DocumentError(folder, "", f"no such folder; make it with labgym assets add, or unset {FOLDER_VARIABLE}")
    assets = [asset for file in sorted((Path(folder) / OWN_ASSETS).glob("*.json")) for asset in _read(file)]
    for asset in assets:
        if asset.shape.name == SHAPE:
            find_geometry(asset, Path(folder))
    return tuple(assets)


def forget_own() -> None:
    """Have folders of one's own read again: something was added."""
    _with_own.cache_clear()


@lru_cache(maxsize=8)
def _with_own(folder: str) -> Catalog:
    return Catalog([*_published().assets, *read_own(folder)], folder)


@lru_cache(maxsize=1)
def _published() -> Catalog:
    return Catalog.read(artefacts("assets") / "catalog")
