"""A person's drives on disk, in the files of an evaluation."""

from __future__ import annotations

from pathlib import Path

from labgym.documents import write_bytes
from labgym.errors import OptionError
from labgym.eval.driving.drive import Drive
from labgym.eval.driving.episode_row import Key
from labgym.eval.driving.files import EPISODES, drive_files


class DriveRecords:
    """Writes rows, routes and times of drives into a folder; a repeated episode replaces the earlier drive.

    Args:
        folder: a new folder; it is created with the first drive.

    Raises:
        OptionError: the folder has episodes.
    """

    def __init__(self, folder: Path) -> None:
        if (folder / EPISODES).exists():
            raise OptionError(f"{folder} has episodes: name another folder with --out")
        self._folder = folder
        self._drives: dict[Key, Drive] = {}

    def add(self, drive: Drive) -> None:
        """Write the files with another drive."""
        self._drives[drive.row.key] = drive
        self._folder.mkdir(parents=True, exist_ok=True)
        for name, content in drive_files(self._drives.values()).items():
            write_bytes(self._folder / name, content)
