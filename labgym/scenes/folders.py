"""Output folders that are written completely or not at all."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path

from labgym.documents import folder_path
from labgym.errors import LabgymError
from labgym.temporary import temporary_folder


@contextmanager
def whole_folder(folder: Path, entries: Collection[str], what: str) -> Iterator[Path]:
    """Yield an empty temporary folder, which is moved to `folder` if the block ends without an error.

    Args:
        folder: the destination; an existing folder of the same kind is replaced.
        entries: names that a folder of this kind may contain.
        what: name of the kind, for the error message.

    Raises:
        LabgymError: the destination exists and is of another kind, or its name is a file's.
    """
    folder_path(folder)
    if folder.exists() and not (folder.is_dir() and {entry.name for entry in folder.iterdir()} <= set(entries)):
        raise LabgymError(f"{folder}: exists and is not a {what}; name another folder or remove it")
    folder.parent.mkdir(parents=True, exist_ok=True)
    with temporary_folder(folder.parent) as temporary:
        fresh = temporary / "fresh"
        fresh.mkdir()
        yield fresh
        if folder.exists():
            folder.rename(temporary / "replaced")
        fresh.rename(folder)
