"""The catalog: an immutable value that holds the published assets and, on request, those of a user's folder.

`Catalog.load()` reads the environment variable LABGYM_CATALOG. Call it at the boundary (a command, an environment's
constructor, a public entry point) and pass the catalog on; no function of labgym.assets calls it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Annotated, Any, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.assets.archive import SHAPE, find_geometry
from labgym.assets.model import Asset, Kind
from labgym.assets.plausibility import size_problem
from labgym.assets.search import Match, SynonymIndex
from labgym.assets.structures import reagent_of
from labgym.assets.substances import Substance, weakened
from labgym.documents import Document, canonical_hash
from labgym.errors import DocumentError, LabgymError, MissingDependencyError, UnknownNameError

FOLDER_VARIABLE = "LABGYM_CATALOG"
OWN_ASSETS = "assets"
"""Folder of the entries within a user's catalog folder."""
OWN_MESHES = "meshes"
"""Folder of the geometry within a user's catalog folder."""
FileStates = tuple[tuple[str, int, int, int], ...]
"""Name, inode, size and modification time of each file of a folder."""


class AssetFile(Document):
    """A file of the catalog: assets that belong together."""

    SCHEMA: ClassVar[str] = "labgym.assets/1"

    assets: Annotated[tuple[Asset, ...], Field(max_length=5000)]


class Catalog:
    """All assets by canonical name, with a search over names and synonyms; immutable, comparable and hashable.

    Two catalogs are equal if all their assets are. A loaded catalog is pickled as its folder and digest and loaded
    again where it is unpickled; one made from a list of assets is pickled with its assets.

    Attributes:
        assets: sorted by name.
        folder: the user's folder that it was loaded with, absolute; None for the published catalog alone and for
            catalogs made from a list of assets.
        own: names of the assets of that folder.
        substances: the open substances that were added to another catalog.

    Raises:
        DocumentError: two assets share a name.
    """

    def __init__(self, assets: Sequence[Asset], source: object = "catalog") -> None:
        self.assets = tuple(sorted(assets, key=lambda asset: asset.name))
        self.folder: Path | None = None
        self.own: frozenset[str] = frozenset()
        self.substances: tuple[Substance, ...] = ()
        self._base: Catalog | None = None
        self._extended: dict[tuple[Substance, ...], Catalog] = {}
        self._is_loaded = False
        self._by_name = {asset.name: asset for asset in self.assets}
        if len(self._by_name) != len(self.assets):
            names = [asset.name for asset in self.assets]
            twice = next(name for name in names if names.count(name) > 1)
            raise DocumentError(source, "assets", f"{twice!r} is defined twice; names must be unique")

    @classmethod
    def load(cls, folder: str | Path | None = None) -> Catalog:
        """Return the published catalog together with the assets of a user's folder.

        A folder is read again only if one of its files changed; otherwise the same object is returned.

        Args:
            folder: folder written by `labgym assets add`; by default the one that LABGYM_CATALOG names, if any.

        Raises:
            DocumentError: the folder does not exist, an entry or its geometry is broken, or a name is published.
        """
        named = str(folder) if folder is not None else os.environ.get(FOLDER_VARIABLE, "")
        return _with_own(Path(named).resolve()) if named else _published()

    @classmethod
    def published(cls) -> Catalog:
        """Return the published catalog alone; it is read once per process."""
        return _published()

    @classmethod
    def read(cls, folder: str | Path) -> Catalog:
        """Read every JSON file below a folder.

        Raises:
            DocumentError: no such folder, a file that is not an asset file, an implausible size, or a duplicate name.
        """
        files = sorted(Path(folder).rglob("*.json"))
        if not files:
            raise DocumentError(folder, "", "holds no asset files (*.json)")
        return cls([asset for file in files for asset in _read(file)], folder)

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the names and digests of all assets: it identifies geometry, physics and chemistry, not texts."""
        return canonical_hash({asset.name: asset.digest for asset in self.assets})

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Catalog) and self.assets == other.assets)

    def __hash__(self) -> int:
        return hash(self.digest)

    def __reduce__(self) -> tuple[Any, ...]:
        if self._is_loaded:
            return _reloaded, (self.folder, self.digest)
        if self._base is not None:
            return _extended, (self._base, self.substances)
        return Catalog, (self.assets,)

    def __len__(self) -> int:
        return len(self.assets)

    def __iter__(self) -> Iterator[Asset]:
        return iter(self.assets)

    def __contains__(self, name: object) -> bool:
        return isinstance(name, str) and name in self._by_name

    def including(self, substances: Iterable[Substance]) -> Catalog:
        """Return the catalog with the open substances of a protocol added; itself if it has them all.

        Raises:
            LabgymError: a substance has the name of another asset, or a name or the structure of a reagent that has a
                hazard which the substance lacks.
        """
        new = {substance.name: substance for substance in substances if substance not in self.substances}
        for substance in new.values():
            self._check_open(substance)
        if not new:
            return self
        added = tuple(new[name] for name in sorted(new))
        if added not in self._extended:
            catalog = Catalog([*self.assets, *(substance.asset for substance in added)])
            catalog._base = self
            catalog.substances = (*self.substances, *added)
            catalog.folder, catalog.own = self.folder, self.own
            self._extended = {added: catalog}  # the last one: layouts of one protocol follow each other
        return self._extended[added]

    def _check_open(self, substance: Substance) -> None:
        if substance.name in self:
            raise LabgymError(f"open substance {substance.name!r} has the name of another asset: rename it")
        named = [self._index.exact(name) for name in substance.names]
        reagents = [self.get(match.name) for match in named if match is not None]
        if substance.smiles:
            with suppress(MissingDependencyError):
                same = reagent_of(substance.smiles, self.of_kind("reagent"))
                reagents += [] if same is None else [same]
        for reagent in reagents:
            flag = weakened(substance, reagent)
            if flag is not None:
                raise LabgymError(
                    f"open substance {substance.name!r} is {reagent.name} of the catalog by name or structure, but "
                    f"lacks its hazard {flag}: use {reagent.name}"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """Canonical names, sorted."""
        return tuple(self._by_name)

    def get(self, name: str) -> Asset:
        """Return the asset of exactly that canonical name.

        Raises:
            UnknownNameError: no asset has that name; lists the nearest five.
        """
        try:
            return self._by_name[name]
        except (KeyError, TypeError):
            raise self._unknown(name) from None

    def find(self, text: str) -> Asset:
        """Return the asset that a free text names, in English, Chinese or as a formula.

        Canonical names, synonyms and CAS numbers are compared without regard to case, spacing and punctuation. A
        misspelling is accepted if one asset is clearly the nearest; for reagents only if it cannot be the name of
        another substance.

        Raises:
            UnknownNameError: nothing is near enough; lists the nearest.
        """
        return self._by_name[self.require(text).name]

    def match(self, text: str) -> Match | None:
        """Return the asset that a free text names and how it was found, or None where `find` would refuse."""
        return self._index.match(text)

    def require(self, text: str) -> Match:
        """Return the asset that a free text means and how it was found.

        Raises:
            UnknownNameError: nothing is near enough; lists the nearest five.
        """
        match = self.match(text) if isinstance(text, str) else None
        if match is None:
            raise self._unknown(text)
        return match

    def candidates(self, text: str, count: int = 5) -> tuple[Match, ...]:
        """Return the assets whose names or synonyms are spelled most like a text, best first, with their scores."""
        return self._index.candidates(text, count)

    def nearest(self, text: str, count: int = 5) -> tuple[str, ...]:
        """Return the canonical names whose names or synonyms are spelled most like a text, best first."""
        return tuple(match.name for match in self.candidates(text, count))

    def of_kind(self, kind: Kind) -> tuple[Asset, ...]:
        """Return the assets of a kind."""
        return tuple(asset for asset in self.assets if asset.kind == kind)

    @cached_property
    def roles(self) -> tuple[Asset, ...]:
        """The assets that are no variants of others."""
        return tuple(asset for asset in self.assets if asset.variant_of is None)

    def variants(self, name: str, held_out: bool = False) -> tuple[Asset, ...]:
        """Return the variants of an asset, sorted by name: those for training, or those held out for test floors."""
        return tuple(a for a in self.assets if a.variant_of == name and a.held_out == held_out)

    def sizes(self, name: str) -> tuple[Asset, ...]:
        """Return an asset and its other sizes, the smallest first."""
        family = (asset for asset in self.assets if asset.family == self.get(name).family)
        return tuple(sorted(family, key=lambda asset: asset.size.width * asset.size.depth * asset.size.height))

    def _unknown(self, name: object) -> UnknownNameError:
        """Return the error for a name that the catalog lacks: the nearest five, and where other assets may be."""
        near = [f"{match.name} ({match.score:.2f})" for match in self.candidates(str(name), 5)]
        if self.folder is not None:
            remedy = f"the catalog folder {self.folder} does not have it either"
        else:
            remedy = f"an asset that you added yourself is found only if {FOLDER_VARIABLE} names its folder"
        return UnknownNameError("asset", name, self._by_name, near, remedy)

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
    """Return the assets of a user's folder, with their geometry located and checked.

    Raises:
        DocumentError: no such folder, or an entry or its geometry is broken.
    """
    if not Path(folder).is_dir():
        remedy = f"create it with labgym assets add, or unset {FOLDER_VARIABLE}"
        raise DocumentError(folder, "", f"no such folder; {remedy}")
    assets = [asset for file in sorted((Path(folder) / OWN_ASSETS).glob("*.json")) for asset in _read(file)]
    for asset in assets:
        if asset.shape.name == SHAPE:
            find_geometry(asset, Path(folder))
    return tuple(assets)


def _reloaded(folder: Path | None, digest: str) -> Catalog:
    """Return the catalog that was pickled.

    Raises:
        LabgymError: the installed catalog or the folder has changed since.
    """
    catalog = _published() if folder is None else Catalog.load(folder)
    if catalog.digest != digest:
        where = "the published catalog" if folder is None else f"the catalog in {folder}"
        raise LabgymError(
            f"{where} changed: its digest is {catalog.digest[:12]}, expected {digest[:12]}; "
            "start again with the current catalog"
        )
    return catalog


def _extended(base: Catalog, substances: tuple[Substance, ...]) -> Catalog:
    return base.including(substances)


def _file_states(folder: Path) -> FileStates:
    files = [*folder.glob(f"{OWN_ASSETS}/*.json"), *folder.glob(f"{OWN_MESHES}/*.npz")]
    stats = [(str(file.relative_to(folder)), file.stat()) for file in sorted(files) if file.exists()]
    return tuple((name, stat.st_ino, stat.st_size, stat.st_mtime_ns) for name, stat in stats)


_loaded: dict[Path, tuple[FileStates, Catalog]] = {}
"""The catalog of each folder that was loaded, with the state of its files at that time."""


def _with_own(folder: Path) -> Catalog:
    states = _file_states(folder)
    if folder not in _loaded or _loaded[folder][0] != states:
        own = read_own(folder)
        catalog = Catalog([*_published().assets, *own], folder)
        catalog.folder, catalog._is_loaded = folder, True
        catalog.own = frozenset(asset.name for asset in own)
        _loaded[folder] = states, catalog
    return _loaded[folder][1]


@lru_cache(maxsize=1)
def _published() -> Catalog:
    catalog = Catalog.read(artefacts("assets") / "catalog")
    catalog._is_loaded = True
    return catalog
