"""A user's catalog folder: entries, annotations and geometry, changed one entry at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from labgym.assets.catalog import FOLDER_VARIABLE, OWN_ASSETS, OWN_MESHES, AssetFile, Catalog, read_own
from labgym.assets.forge.annotating import ANNOTATIONS, NewEntry, SourceKey, annotated_files, new_entry, source_key
from labgym.assets.forge.engine import Options, Views, annotate, source_digest
from labgym.assets.forge.modelled import Annotator
from labgym.assets.forge.record import Annotation
from labgym.assets.meshes import FORMATS, MeshError
from labgym.assets.model import Asset
from labgym.assets.search import normalize, surface_forms
from labgym.documents import write_bytes
from labgym.errors import LabgymError, OptionError
from labgym.runs import ExecutorOptions
from labgym.runs.folder import only_writer
from labgym.temporary import sweep

Outcome = Literal["added", "replaced", "unchanged"]

DEFAULT_FOLDER = Path("labgym-assets")


@dataclass(frozen=True)
class Addition:
    """The outcome of adding one mesh file.

    Attributes:
        name: of the asset; "" if the file failed. outcome: the action taken; None if the file failed.
        notes: points for the user to check. problem: why the file failed, one line, else "".
    """

    path: Path
    name: str = ""
    outcome: Outcome | None = None
    notes: tuple[str, ...] = ()
    problem: str = ""


class OwnAssets:
    """A folder that `Catalog.load` merges with the published catalog, which itself is never changed.

    It holds `assets/NAME.json` (the entry), `annotations/NAME.json` (the origin of each field of an imported mesh), and
    `meshes/NAME-HASH.npz` and `.glb`. The entry is written last, so that a crash leaves the old state or the new.
    """

    def __init__(self, folder: Path | None = None) -> None:
        """Open a folder; by default the one that LABGYM_CATALOG names, else ./labgym-assets."""
        variable = os.environ.get(FOLDER_VARIABLE)
        self.folder = folder or (Path(variable) if variable else DEFAULT_FOLDER)
        if self.folder.exists() and not self.folder.is_dir():
            raise LabgymError(f"{self.folder}: not a folder; name another with --catalog")

    @property
    def is_active(self) -> bool:
        """Whether LABGYM_CATALOG names this folder, so that every command uses it."""
        variable = os.environ.get(FOLDER_VARIABLE)
        return bool(variable) and Path(str(variable)).resolve() == self.folder.resolve()

    def names(self) -> tuple[str, ...]:
        """Return the names of its assets, sorted.

        Raises:
            DocumentError: an entry or its geometry is broken.
        """
        return tuple(sorted(asset.name for asset in read_own(self.folder))) if self.folder.is_dir() else ()

    def annotation(self, name: str) -> Annotation:
        """Return the annotation of an imported asset.

        Raises:
            DocumentError: the asset has no record.
        """
        return Annotation.load(self._annotation_path(name))

    def find(self, source: str, options: Options) -> str | None:
        """Return the name of the asset that was added from a file of that SHA-256 with those options, or None."""
        return self._sources().get(source_key(source, options.recorded()))

    def add(
        self,
        path: Path,
        options: Options | None = None,
        replace: bool = False,
        annotator: Annotator | None = None,
        views: Views | None = None,
    ) -> tuple[str, Outcome]:
        """Annotate a mesh file and add its entry; return its name and the action taken.

        A file that was added with the same options is unchanged. Nothing is overwritten without `replace`.

        Raises:
            MeshError: the file cannot be used, or its name is taken by another file's asset.
            LabgymError: as `annotate`; the folder is then as it was.
            OptionError: another process writes into the folder.
        """
        options = options or Options()
        existing = self.find(source_digest(path), options)
        if existing is not None and not replace:
            return existing, "unchanged"
        entry = new_entry(annotate(path, options, Catalog.published(), annotator, views))
        with self.writing():
            return entry.name, self._put(path, entry, replace)

    def add_files(
        self,
        paths: Sequence[Path],
        options: Options | None = None,
        replace: bool = False,
        annotator: Annotator | None = None,
        views: Views | None = None,
        executor: ExecutorOptions | None = None,
    ) -> Iterator[Addition]:
        """Add mesh files and yield the outcome of each, in their order; a file that fails does not stop the others.

        Files are annotated on the executor; only this process writes, one entry at a time, so that a killed batch
        finds its finished files unchanged. A file whose annotation kills its worker fails; that needs worker processes.

        Raises:
            OptionError: another process writes into the folder, or an annotator with workers.
        """
        options, executor = options or Options(), executor or ExecutorOptions()
        if annotator is not None and executor != ExecutorOptions():
            raise OptionError("a language model annotates in this process: leave out --workers and --executor")
        with self.writing():
            sources = self._sources()
            annotated = annotated_files(paths, options, executor, annotator, views, () if replace else sources)
            for path, entry in annotated:
                yield self._added(path, entry, replace, sources)

    def _added(self, path: Path, entry: NewEntry, replace: bool, sources: dict[SourceKey, str]) -> Addition:
        """Write the entry of a file and return the outcome; note its source."""
        existing = sources.get(entry.source) if entry.source is not None else None
        if existing is not None and not replace:
            return Addition(path, existing, "unchanged")
        if entry.problem:
            return Addition(path, problem=entry.problem)
        try:
            outcome = self._put(path, entry, replace)
        except (LabgymError, OSError) as error:
            return Addition(path, problem=" ".join(str(error).split()))
        if entry.source is not None:
            sources[entry.source] = entry.name
        return Addition(path, entry.name, outcome, entry.notes)

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Be the only writer of the folder; remove the temporary files that killed processes left in it.

        Raises:
            OptionError: another process writes into the folder.
        """
        with only_writer(self.folder):
            sweep(self.folder, recursive=True)
            yield

    def add_reagent(self, reagent: Asset, replace: bool = False) -> Outcome:
        """Add a reagent in a standard pack, such as `labgym.assets.inference.infer` returns; return the action taken.

        Raises:
            OptionError: its name, or a synonym, is a published asset's, or it exists already and `replace` is False.
        """
        forms = {normalize(form): form for form in surface_forms(reagent)}
        for asset in Catalog.published():
            shared = next((forms[key] for form in surface_forms(asset) if (key := normalize(form)) in forms), None)
            if shared is not None:
                raise OptionError(f"{shared!r} is a name of the published asset {asset.name}; choose another name")
        path = self._entry_path(reagent.name)
        document = AssetFile(assets=(reagent,))
        exists = path.is_file()
        if exists and AssetFile.load(path) == document:
            return "unchanged"
        if exists and not replace:
            raise OptionError(f"{reagent.name!r} exists already in {self.folder}; give --overwrite, or another name")
        document.save(path)
        return "replaced" if exists else "added"

    def _put(self, path: Path, entry: NewEntry, replace: bool) -> Outcome:
        """Write the files of an entry, the entry itself last, and remove its previous geometry."""
        exists = self._entry_path(entry.name).is_file()
        if exists and not replace:
            taken = f"{entry.name!r} exists already in {self.folder}, from another file or with other options"
            raise MeshError(path, f"{taken}; give --overwrite, or another --name")
        for name, content in entry.files.items():
            write_bytes(self.folder / name, content)
        for old in (self.folder / OWN_MESHES).glob(f"{entry.name}-*"):
            if old.relative_to(self.folder).as_posix() not in entry.files:
                old.unlink()
        return "replaced" if exists else "added"

    def _sources(self) -> dict[SourceKey, str]:
        """Return the names of the assets that were added from mesh files, by the file and the options."""
        annotations = [Annotation.load(path) for path in sorted((self.folder / ANNOTATIONS).glob("*.json"))]
        present = [each for each in annotations if self._entry_path(each.asset).is_file()]
        return {source_key(each.source.sha256, each.source.options): each.asset for each in present}

    def _entry_path(self, name: str) -> Path:
        return self.folder / OWN_ASSETS / f"{name}.json"

    def _annotation_path(self, name: str) -> Path:
        return self.folder / ANNOTATIONS / f"{name}.json"


def mesh_files(paths: Sequence[Path], exclude: Path | None = None) -> Iterator[Path]:
    """Yield the mesh files that paths name: files as they are, of folders all files of a readable format, sorted.

    Args:
        exclude: folder that is skipped: the one that they are added to.

    Raises:
        MeshError: a folder holds none.
    """
    for path in paths:
        if not path.is_dir():
            yield path
            continue
        files = [
            file
            for file in sorted(path.rglob("*"))
            if file.suffix.lower() in FORMATS
            and file.is_file()
            and not (exclude is not None and file.resolve().is_relative_to(exclude.resolve()))
        ]
        if not files:
            raise MeshError(path, f"holds no mesh files ({', '.join(FORMATS)})")
        yield from files
