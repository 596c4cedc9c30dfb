"""One writer at a time in a folder: a lock that a dead process does not hold."""

from __future__ import annotations

import fcntl
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from labgym.errors import OptionError

LOCK_FILE = ".lock"


@contextmanager
def only_writer(folder: Path) -> Iterator[None]:
    """Hold the lock of a folder, which is created if it does not exist.

    The lock is a `flock` on the empty file `.lock`; the kernel releases it when the process dies.

    Raises:
        OptionError: another process holds the lock, or the path is not a folder.
    """
    handle = _lock(folder)
    try:
        os.ftruncate(handle, 0)
        os.write(handle, f"process {os.getpid()} on {socket.gethostname()}".encode())
        yield
    finally:
        os.ftruncate(handle, 0)
        os.close(handle)


def _lock(folder: Path) -> int:
    path = folder / LOCK_FILE
    while True:
        if folder.exists() and not folder.is_dir():
            raise OptionError(f"{folder} is not a folder; name another one")
        folder.mkdir(parents=True, exist_ok=True)
        try:
            handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except FileNotFoundError:
            continue  # Moved aside since the line above.
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if path.exists() and os.path.samestat(os.fstat(handle), path.stat()):
                return handle
            os.close(handle)
        except BlockingIOError:
            writer = os.pread(handle, 200, 0).decode(errors="replace") or "another process"
            os.close(handle)
            raise OptionError(
                f"{folder} is in use: {writer} writes into it; wait for it, or choose another folder"
            ) from None
