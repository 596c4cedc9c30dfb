"""A folder of one's own assets on disk: entries, annotations and geometry, changed one entry at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

from labgym.assets.catalog import FOLDER_VARIABLE, OWN_ASSETS, AssetFile, Catalog, read_own
from labgym.assets.forge.engine import Annotated, Options, Views, annotate, source_digest
from labgym.assets.forge.modelled import Annotator
from labgym.assets.forge.record import Annotation, Source
from labgym.assets.meshes import FORMATS, MeshError
from labgym.documents import write_bytes
from labgym.errors import LabgymError

Outcome = Literal["added", "replaced", "unchanged"]

DEFAULT_FOLDER = Path("labgym-assets")
ANNOTATIONS = "annotations"


class OwnAssets:
    """A folder that `Catalog.load` merges with the published catalogue, which itself is never changed.

    It holds `assets/NAME.json` (the entry), `annotations/NAME.json` (how each field was obtained), and
    `meshes/NAME-HASH.npz` and `.glb`. The entry is written last, so that a crash leaves the old state or the new.
    """

    def __init__(self, folder: Path | None = None) -> None:
        """Open a folder; by default the one that LABGYM_CATALOG names, else ./labgym-assets."""
        named = os.environ.get(FOLDER_VARIABLE)
        self.folder = folder or (Path(named) if named else DEFAULT_FOLDER)
        if self.folder.exists() and not self.folder.is_dir():
            raise LabgymError(f"{self.folder}: not a folder; name another with --catalog")

    def names(self) -> tuple[str, ...]:
        """Return the names of its assets, sorted.

        Raises:
            DocumentError: an entry or its geometry is broken.
        """
        return tuple(sorted(asset.name for asset in read_own(self.folder))) if self.folder.is_dir() else ()

    def annotation(self, name: str) -> Annotation:
        """Return how an asset was annotated.

        Raises:
            DocumentError: there is no such record.
        """
        return Annotation.load(self._annotation_path(name))

    def find(self, source: str, options: Options) -> str | None:
        """Return the name of the asset that was added from a file of that SHA-256 with those options, or None."""
        for path in sorted((self.folder / ANNOTATIONS).glob("*.json")):
            made = Annotation.load(path)
            if _same(made.source, source, options) and self._entry_path(made.asset).is_file():
                return made.asset
        return None

    def add(
        self,
        path: Path,
        options: Options | None = None,
        replace: bool = False,
        annotator: Annotator | None = None,
        views: Views | None = None,
    ) -> tuple[str, Outcome]:
        """Annotate a mesh file and add its entry; return its name and what was done.

        A file that was added with the same options is unchanged. Nothing is overwritten unless `replace` says so.

        Raises:
            MeshError: the file cannot be used, or its name is taken by another file's asset.
            LabgymError: as `annotate`; the folder is then as it was.
        """
        options = options or Options()
        known = self.find(source_digest(path), options)
        if known is not None and not replace:
            return known, "unchanged"
        made = annotate(path, options, Catalog.published(), annotator, views)
        name = made.asset.name
        exists = self._entry_path(name).is_file()
        if exists and not replace:
            taken = f"{name!r} exists already in {self.folder}, from another file or with other options"
            raise MeshError(path, f"{taken}; give --replace, or another --name")
        self._write(made)
        return name, "replaced" if exists else "added"

    def _write(self, made: Annotated) -> None:
        name = made.asset.name
        geometry = self.folder / str(made.asset.shape.parameters["file"])
        visual = geometry.with_suffix(".glb")
        write_bytes(geometry, made.geometry)
        write_bytes(visual, made.visual)
        made.annotation.save(self._annotation_path(name))
        AssetFile(assets=(made.asset,)).save(self._entry_path(name))
        for old in geometry.parent.glob(f"{name}-*"):
            if old not in (geometry, visual):
                old.unlink()

    def _entry_path(self, name: str) -> Path:
        return self.folder / OWN_ASSETS / f"{name}.json"

    def _annotation_path(self, name: str) -> Path:
        return self.folder / ANNOTATIONS / f"{name}.json"


def mesh_files(paths: Sequence[Path], but: Path | None = None) -> Iterator[Path]:
    """Yield the mesh files that paths name: files as they are, of folders all files of a readable format, sorted.

    Args:
        but: folder within them that is passed over: where they are added to.

    Raises:
        MeshError: a folder holds none.
    """
    for path in paths:
        if not path.is_dir():
            yield path
            continue
        found = [
            file
            for file in sorted(path.rglob("*"))
            if file.suffix.lower() in FORMATS
            and file.is_file()
            and not (but is not None and file.resolve().is_relative_to(but.resolve()))
        ]
        if not found:
            raise MeshError(path, f"holds no mesh files ({', '.join(FORMATS)})")
        yield from found


def _same(made: Source, source: str, options: Options) -> bool:
    return made.sha256 == source and made.options == options.given()
