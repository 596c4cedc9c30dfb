"""`manifest.json`: the hash of each file of a finished run, checked when the files are read."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import ClassVar

from labgym.documents import Document, read_json
from labgym.errors import DocumentError

MANIFEST_FILE = "manifest.json"
MAX_MANIFEST_BYTES, MAX_MANIFEST_ELEMENTS = 512 * 2**20, 4_000_000
"""Largest manifest that is read, in bytes and in files: a million files take 120 MB."""


class RunManifest(Document):
    """The files of a finished run.

    Attributes:
        run: digest of the run's identity.
        files: SHA-256 by path relative to the folder, in the order of paths.
    """

    SCHEMA: ClassVar[str] = "labgym.run-manifest/1"

    run: str
    files: dict[str, str]

    @classmethod
    def read(cls, folder: Path) -> RunManifest | None:
        """Return the manifest of a folder, or None if the run has not finished or has a manifest of another kind.

        Raises:
            DocumentError: the manifest is broken.
        """
        path = folder / MANIFEST_FILE
        if not path.exists():
            return None
        data = read_json(path, MAX_MANIFEST_BYTES, MAX_MANIFEST_ELEMENTS)
        is_other = isinstance(data, dict) and data.get("schema", cls.SCHEMA) != cls.SCHEMA
        return None if is_other else cls.parse(data, path)

    def check(self, folder: Path, *names: str) -> None:
        """Check files of the folder against their hashes; all of them if none is named.

        Raises:
            DocumentError: a file is missing or was changed after the run wrote it.
        """
        for name in names or self.files:
            if name not in self.files:
                raise DocumentError(folder / name, "", f"not a file of this run ({MANIFEST_FILE} does not list it)")
            digest = file_digest(folder / name)
            if digest != self.files[name]:
                problem = "is missing" if digest is None else f"was changed: its hash is not the one in {MANIFEST_FILE}"
                raise DocumentError(folder / name, "", f"{problem}; restore it, or run again with --fresh")


def file_digest(path: Path) -> str | None:
    """Return the SHA-256 of a file, or None if it does not exist."""
    if not path.is_file():
        return None
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
