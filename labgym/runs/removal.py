"""Removing folders of many files."""

from __future__ import annotations

import os
import shutil
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

THREADS = 8
PER_CALL = 200
"""Files that a thread removes before it takes the next ones."""


def remove_folder(folder: Path) -> None:
    """Remove a folder with its files, by several threads; what cannot be removed stays, and so does a link.

    Removing a file waits for the disk if its blocks are discarded at once (mount option `discard`), or for the server
    of a network file system: milliseconds each, which threads spend at the same time.
    """
    if folder.is_symlink():
        return
    with ThreadPoolExecutor(THREADS) as pool:
        for parent, _, names in os.walk(folder):
            paths = [os.path.join(parent, name) for name in names]  # noqa: PTH118 -- Path takes as long as the removal
            batches = [paths[start : start + PER_CALL] for start in range(0, len(paths), PER_CALL)]
            for _ in pool.map(_remove, batches):
                pass
    shutil.rmtree(folder, ignore_errors=True)


def _remove(paths: Sequence[str]) -> None:
    for path in paths:
        with suppress(OSError):
            os.unlink(path)  # noqa: PTH108
