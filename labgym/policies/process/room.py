"""The room of a boxed process: a private folder and fresh descriptors, which the host makes and removes."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

OUTPUT_BYTES = 64 * 1024
"""Longest output of an episode that the host prints."""
HOMES = ("HOME", "TMPDIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "MPLCONFIGDIR")
"""Environment variables that name the private folder."""


class PrivateRoom:
    """A folder that exists for one episode, and a file for what the episode prints.

    The file is outside of the folder, so that the episode cannot replace it.

    Attributes:
        private: the folder.
    """

    def __init__(self) -> None:
        self._place = Path(tempfile.mkdtemp(prefix="labgym-box-"))
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
            text = stream.read(OUTPUT_BYTES)
            if text:
                sys.stderr.buffer.write(text)
                sys.stderr.flush()
        shutil.rmtree(self._place, ignore_errors=True)
        if self._place.exists():  # a folder without rights, or too deep
            for command in (["chmod", "-R", "u+rwX"], ["rm", "-rf"]):
                subprocess.run([*command, "--", str(self._place)], stderr=subprocess.DEVNULL, check=False)
