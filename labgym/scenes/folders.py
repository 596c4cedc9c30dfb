"""Output folders that are there whole or not at all."""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from labgym.errors import LabgymError


@contextmanager
def whole_folder(folder: Path, entries: Collection[str], what: str) -> Iterator[Path]:
    """Give an empty folder to fill beside `folder`, and move it there when the block ends without an error.

    Args:
        folder: where it goes; one of the same kind that is there already is replaced.
        entries: names that a folder of this kind has. what: its name for the error.

    Raises:
        LabgymError: the folder exists and holds something else.
    """
    if folder.exists() and not (folder.is_dir() and {entry.name for entry in folder.iterdir()} <= set(entries)):
        raise LabgymError(f"{folder}: exists and is not a {what}; name another folder or remove it")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as temporary:
        fresh = Path(temporary) / "fresh"
        fresh.mkdir()
        yield fresh
        if folder.exists():
            folder.rename(Path(temporary) / "replaced")
        fresh.rename(folder)
