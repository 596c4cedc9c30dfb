"""The room of a boxed process: a private folder and fresh descriptors, which the host makes and removes."""

from __future__ import annotations

import contextlib
import fcntl
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

OUTPUT_BYTES = 64 * 1024
"""Longest output of an episode that the host prints."""
ERROR_LINE = "The policy raised an error; later tracebacks are left out."
"""Line before the traceback of an error."""
PREFIX = "labgym-box-"
"""Beginning of the names of rooms in the folder for temporary files."""
LOCK = "lock"
"""File of a room that its host keeps locked."""
FURNISHING_S = 60.0
"""Age below which a room may belong to a host that has not locked it yet, seconds."""
HOMES = ("HOME", "TMPDIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "MPLCONFIGDIR")
"""Environment variables that name the private folder."""


class PrivateRoom:
    """A folder that exists for one episode, and a file for what the episode prints.

    The file is outside of the folder, so that the episode cannot replace it.

    Args:
        quiet: whether the host leaves out the traceback of an error. The episode does not know: it would learn that an
            earlier one failed.

    Attributes:
        private: the folder.
    """

    def __init__(self, quiet: bool) -> None:
        self._quiet = quiet
        self._place = Path(tempfile.mkdtemp(prefix=PREFIX))
        self._lock = os.open(self._place / LOCK, os.O_RDONLY | os.O_CREAT, 0o600)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        self.private, self._output = self._place / "tmp", self._place / "output"
        self.private.mkdir()
        self._output.touch()

    def settle(self, kept: int) -> None:
        """Move this process into the room: its folders, its output, and no descriptor that another process has.

        Descriptors share their position and flags with those that they were copied from: a note to later episodes.

        Args:
            kept: descriptor that stays open, besides the standard ones.
        """
        nothing = os.open(os.devnull, os.O_RDONLY)
        output = os.open(self._output, os.O_WRONLY | os.O_APPEND)
        for target, source in ((0, nothing), (1, output), (2, output)):
            os.dup2(source, target)
        for number in [int(entry.name) for entry in Path("/proc/self/fd").iterdir()]:
            if number > 2 and number != kept:
                with contextlib.suppress(OSError):
                    os.close(number)
        os.environ.update(dict.fromkeys(HOMES, str(self.private)))
        tempfile.tempdir = None

    def remove(self) -> None:
        """Print what the episode printed, and remove the folder."""
        with contextlib.suppress(OSError), self._output.open("rb") as stream:
            text = stream.read(OUTPUT_BYTES).decode(errors="replace")
            text = text.partition(f"\n{ERROR_LINE}\n")[0] if self._quiet else text
            # Other characters could command the terminal.
            sys.stderr.write("".join(letter for letter in text if letter.isprintable() or letter in "\n\t"))
            sys.stderr.flush()
        _remove(self._place)
        os.close(self._lock)


def remove_left_rooms() -> None:
    """Remove the rooms of this user's hosts that were killed: nobody holds their locks."""
    for place in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        with contextlib.suppress(OSError):
            facts = place.lstat()
            if facts.st_uid != os.geteuid() or time.time() - facts.st_mtime < FURNISHING_S:
                continue
            lock = os.open(place / LOCK, os.O_RDONLY | os.O_NOFOLLOW)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                _remove(place)
            finally:
                os.close(lock)


def _remove(place: Path) -> None:
    shutil.rmtree(place, ignore_errors=True)
    if place.exists():  # a folder without rights, or too deep
        for command in (["chmod", "-R", "u+rwX"], ["rm", "-rf"]):
            subprocess.run([*command, "--", str(place)], stderr=subprocess.DEVNULL, check=False)
