"""The ledger of a run: finished units of work with digests of their inputs and files."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import labgym
from labgym.artefacts import artefacts
from labgym.documents import Document, Record, canonical_hash, files_digest
from labgym.errors import DocumentError


class FinishedUnit(Record):
    """A finished unit of work.

    Attributes:
        inputs: digest of the unit's inputs.
        files: digests of the files that it wrote, by path relative to the run's folder.
    """

    inputs: str
    files: dict[str, str]


class LedgerFile(Document):
    """The ledger on disk."""

    SCHEMA: ClassVar[str] = "labgym.ledger/1"

    units: dict[str, FinishedUnit]


class Ledger:
    """Finished units of a run: a unit is skipped if its inputs and its files are unchanged.

    A ledger that cannot be read counts as empty, so that a run can always be resumed.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._path = folder / "ledger.json"
        try:
            self._units = dict(LedgerFile.load(self._path).units)
        except DocumentError:
            self._units = {}

    def done(self, unit: str, inputs: Any) -> bool:
        """Return whether a unit was finished with these inputs and its files are unchanged."""
        entry = self._units.get(unit)
        return (
            entry is not None
            and entry.inputs == canonical_hash(inputs)
            and all(_digest(self.folder / path) == digest for path, digest in entry.files.items())
        )

    def record(self, unit: str, inputs: Any, files: Iterable[Path]) -> None:
        """Record a finished unit and save the ledger.

        Args:
            unit: name of the unit.
            inputs: JSON data that determines the unit's outcome.
            files: files or folders that it wrote; a folder stands for all files in it.
        """
        outputs = sorted(
            path for place in files for path in ([place] if place.is_file() else place.rglob("*")) if path.is_file()
        )
        digests = {path.relative_to(self.folder).as_posix(): _digest(path) or "" for path in outputs}
        self._units[unit] = FinishedUnit(inputs=canonical_hash(inputs), files=digests)
        LedgerFile(units=dict(sorted(self._units.items()))).save(self._path)


@cache
def results_digest(catalog: str) -> str:
    """Return a digest of what determines results in addition to options: package, artefacts and a catalog.

    Args:
        catalog: digest of the catalog in use, the user's own assets included.
    """
    package = Path(labgym.__file__).resolve().parent
    files = [path for path in package.rglob("*") if path.suffix in {".py", ".j2"}]
    files += artefacts("assets").rglob("*.json")
    return canonical_hash([catalog, files_digest(sorted(files))])


def _digest(path: Path) -> str | None:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None
