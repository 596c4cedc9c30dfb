"""Generated training layouts as files of a folder that is bounded in size: each is generated once, by any run."""

from __future__ import annotations

import hashlib
import os
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from labgym.counts import is_real
from labgym.documents import canonical_hash, json_bytes, parse_json, write_bytes
from labgym.envs.training import LayoutSource, TrainingRooms, training_floor
from labgym.errors import LabgymError, OptionError
from labgym.layouts import Layout

FOLDER_MB = 256.0
"""Default size of the folder, megabytes: about 6,000 rooms or 5,000 floors."""
LARGEST = 16_000_000
"""Largest file that is read, bytes."""
PRUNED = 0.9
"""Share of the size that remains when old files are removed."""


@dataclass(frozen=True)
class LayoutFiles:
    """The layouts of labgym's own sources, by source, number, code and catalog; those used longest ago are removed.

    A file holds the SHA-256 of the document in its first line. A broken file is written anew, so that a layout
    always equals the one that its source returns.

    Attributes:
        folder: where the files are; created when the first one is written.
        megabytes: size up to which files remain.

    Raises:
        OptionError: the size is not above 0.
    """

    folder: Path
    megabytes: float = FOLDER_MB

    def __post_init__(self) -> None:
        if not is_real(self.megabytes) or self.megabytes <= 0.0:
            raise OptionError(f"folder_mb is {self.megabytes!r}, expected a number of megabytes above 0")

    def layout(self, source: LayoutSource, number: int) -> Layout:
        """Return a layout of a source, from its file if there is one; other sources than labgym's are not stored.

        Raises:
            InfeasibleError: as the source.
        """
        name = _name_of(source, number)
        if name is None:
            return source(number)
        path = self.folder / name[:2] / f"{name}.json"
        layout = _stored(path)
        if layout is None:
            layout = source(number)
            with suppress(OSError):  # A full disk costs time, not the training.
                document = json_bytes(layout.to_json())
                write_bytes(path, [hashlib.sha256(document).hexdigest().encode(), b"\n", document])
                self._prune(path)
        return layout

    def _prune(self, latest: Path) -> None:
        """Remove the files used longest ago if all together are too large."""
        files: list[tuple[float, int, Path]] = []
        for path in self.folder.glob("??/*.json"):
            with suppress(FileNotFoundError):  # Another worker has removed it.
                state = path.stat()
                files.append((state.st_mtime, state.st_size, path))
        total, limit = sum(size for _, size, _ in files), self.megabytes * 1e6
        if total <= limit:
            return
        for _, size, path in sorted(files):
            if total <= PRUNED * limit:
                break
            if path != latest:
                path.unlink(missing_ok=True)
                total -= size


def _name_of(source: LayoutSource, number: int) -> str | None:
    """Return the name of a layout's file: a digest of all that decides the layout; None for a foreign source."""
    if source is training_floor:
        kind = "floors"
    elif isinstance(source, TrainingRooms):
        protocol = "" if source.protocol is None else canonical_hash(source.protocol.model_dump(mode="json"))
        kind = f"rooms {protocol} {source.profile}"
    else:
        return None
    from labgym.assets import Catalog
    from labgym.runs import code_digest

    return canonical_hash([kind, int(number), code_digest(), Catalog.load().digest])


def _stored(path: Path) -> Layout | None:
    """Return the layout of a file; None if it does not exist or is broken."""
    try:
        if path.stat().st_size > LARGEST:
            return None
        digest, _, document = path.read_bytes().partition(b"\n")
        if hashlib.sha256(document).hexdigest().encode() != digest:
            return None
        layout = Layout.parse(parse_json(document, path), path)
        os.utime(path)
    except (OSError, LabgymError):
        return None
    return layout
