"""Temporary files and folders next to their destination; those that a killed process left behind are swept.

Their names begin with `PREFIX`. The process that writes one holds a lock (`flock`) on it, which the kernel releases
when the process dies, so that `sweep` removes only what nobody is writing.
"""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PREFIX = ".labgym-tmp-"

_swept: set[str] = set()
"""Folders that this process has swept on writing into them."""


@contextmanager
def temporary_file(folder: Path) -> Iterator[tuple[int, Path]]:
    """Yield the descriptor and the path of a locked temporary file; afterwards, close and remove it unless renamed.

    The first temporary file of a process in a folder sweeps the folder.
    """
    _sweep_once(folder)
    handle, path = _locked_file(folder)
    try:
        yield handle, path
    finally:
        path.unlink(missing_ok=True)
        os.close(handle)


@contextmanager
def temporary_folder(folder: Path) -> Iterator[Path]:
    """Yield an empty, locked temporary folder below `folder`, and remove it afterwards; sweeps as `temporary_file`."""
    _sweep_once(folder)
    path, handle = _locked_folder(folder)
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)
        os.close(handle)


def sweep(folder: Path, recursive: bool = False) -> int:
    """Remove the temporary files and folders that no living process writes; return how many were removed."""
    removed = 0
    with suppress(FileNotFoundError), os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.startswith(PREFIX):
                removed += _remove_if_abandoned(Path(entry.path), entry.is_dir(follow_symlinks=False))
            elif recursive and entry.is_dir(follow_symlinks=False):
                removed += sweep(Path(entry.path), recursive=True)
    return removed


def _sweep_once(folder: Path) -> None:
    name = os.fspath(folder)
    if name not in _swept:
        sweep(folder)
        if len(_swept) < 10_000:
            _swept.add(name)


def _locked_file(folder: Path) -> tuple[int, Path]:
    while True:
        handle, name = tempfile.mkstemp(dir=folder, prefix=PREFIX)
        fcntl.flock(handle, fcntl.LOCK_EX)
        if os.fstat(handle).st_nlink:
            return handle, Path(name)
        os.close(handle)  # Swept between its creation and the lock.


def _locked_folder(folder: Path) -> tuple[Path, int]:
    while True:
        path = Path(tempfile.mkdtemp(dir=folder, prefix=PREFIX))
        try:
            handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        except FileNotFoundError:
            continue
        with suppress(OSError):  # A network file system may not lock folders; sweep cannot lock it either.
            fcntl.flock(handle, fcntl.LOCK_EX)
        if path.is_dir():
            return path, handle
        os.close(handle)


def _remove_if_abandoned(path: Path, is_folder: bool) -> bool:
    try:
        handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY if is_folder else os.O_RDWR | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        if is_folder:
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)
    except OSError:
        return False
    finally:
        os.close(handle)
    return True
