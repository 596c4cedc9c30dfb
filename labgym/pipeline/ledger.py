"""What a run has finished: units of work, what they were made from, and the files that they left."""

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


class Unit(Record):
    """A finished unit of work.

    Attributes:
        inputs: digest of all that it was made from.
        files: digests of the files that it left, by path relative to the run.
    """

    inputs: str
    files: dict[str, str]


class LedgerFile(Document):
    """The ledger on disk."""

    SCHEMA: ClassVar[str] = "labgym.ledger/1"

    units: dict[str, Unit]


class Ledger:
    """Which units of a run need not be done again: same inputs, and their files still as they were left.

    A ledger that cannot be read counts as empty, so that a run can always be taken up.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._path = folder / "ledger.json"
        try:
            self._units = dict(LedgerFile.load(self._path).units)
        except DocumentError:
            self._units = {}

    def done(self, unit: str, inputs: Any) -> bool:
        """Tell whether a unit was finished with these inputs and its files are untouched."""
        known = self._units.get(unit)
        return (
            known is not None
            and known.inputs == canonical_hash(inputs)
            and all(_digest(self.folder / path) == digest for path, digest in known.files.items())
        )

    def record(self, unit: str, inputs: Any, files: Iterable[Path]) -> None:
        """Note that a unit is finished, at once on disk.

        Args:
            unit: its name.
            inputs: JSON data that it was made from.
            files: what it left; a folder stands for all that is in it.
        """
        left = sorted(
            path for given in files for path in ([given] if given.is_file() else given.rglob("*")) if path.is_file()
        )
        digests = {path.relative_to(self.folder).as_posix(): _digest(path) or "" for path in left}
        self._units[unit] = Unit(inputs=canonical_hash(inputs), files=digests)
        LedgerFile(units=dict(sorted(self._units.items()))).save(self._path)


@cache
def code_digest() -> str:
    """Return a digest of all that decides results besides options: the package, the catalogue and the protocols."""
    package = Path(labgym.__file__).resolve().parent
    files = [path for path in package.rglob("*") if path.suffix in {".py", ".j2"}]
    files += artefacts("assets").rglob("*.json")
    return files_digest(sorted(files))


def _digest(path: Path) -> str | None:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else None
