"""A person's drives on disk, in the files of an evaluation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from labgym.documents import json_bytes, write_bytes
from labgym.errors import OptionError
from labgym.eval.driving.drive import LabNavDrive, TransitionDrive
from labgym.eval.driving.files import EPISODES, SUMMARY, drive_files
from labgym.eval.driving.record import NavigationSummary
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.labnav.summary import summarise
from labgym.layouts import Layout
from labgym.suites import Suite
from labgym.viewer.episodes import ViewerEpisode


class DriveRecords:
    """Writes drives into a folder, as `labgym eval` does; a repeated episode replaces the earlier drive.

    The folder has rows, routes, times, the summary of the episodes driven so far and, without a published split, the
    layouts. It has no identity and no manifest: nobody can run a person again.

    Args:
        folder: a new folder; it is created with the first drive.
        episodes: the episodes of the suite. suite: their rules. label: name of the driver.

    Raises:
        OptionError: the folder has episodes.
    """

    def __init__(self, folder: Path, episodes: Sequence[ViewerEpisode], suite: Suite, label: str) -> None:
        _check_empty(folder)
        self._folder, self._expected, self._suite, self._label = folder, len(episodes), suite, label
        self._layouts: dict[str, Layout] = {episode.layout.id: episode.layout for episode in episodes}
        self._drives: dict[str, TransitionDrive] = {}

    def add(self, drive: TransitionDrive) -> None:
        """Write the files with another drive."""
        self._drives[drive.row.key] = drive
        files = drive_files(self._drives.values())
        files[SUMMARY] = json_bytes(self._summary().to_json())
        if self._suite.split is None:
            files |= {f"layouts/{name}.json": json_bytes(layout.to_json()) for name, layout in self._layouts.items()}
        _write(self._folder, files)

    def _summary(self) -> NavigationSummary:
        summary = NavigationSummary(
            suite=self._suite,
            policy=self._label,
            options={},
            privileged=True,
            seed=0,
            layouts={name: layout.hash for name, layout in self._layouts.items()},
            episodes=0,
            expected=self._expected,
            errors=0,
            unreachable=0,
            complete=False,
            metrics={},
        )
        return summary.recomputed(tuple(drive.row for drive in self._drives.values()))


class LabNavRecords:
    """Writes drives of LabNav into a folder, as `labgym eval` does; a repeated episode replaces the earlier drive.

    The folder has rows, routes, times and the summary of the episodes driven so far. It has no identity and no
    manifest.

    Args:
        folder: a new folder; it is created with the first drive. suite: the suite. label: name of the driver.

    Raises:
        OptionError: the folder has episodes.
    """

    def __init__(self, folder: Path, suite: LabNavSuite, label: str) -> None:
        _check_empty(folder)
        self._folder, self._suite, self._label = folder, suite, label
        self._drives: dict[str, LabNavDrive] = {}

    def add(self, drive: LabNavDrive) -> None:
        """Write the files with another drive."""
        self._drives[drive.row.key] = drive
        rows = tuple(each.row for each in self._drives.values())
        summary = summarise(
            self._suite,
            rows,
            policy=self._label,
            options={},
            track=drive.row.track,
            sensors="lidar",
            seed=0,
            latency=0.0,
        )
        _write(self._folder, {**drive_files(self._drives.values()), SUMMARY: json_bytes(summary.to_json())})


def _check_empty(folder: Path) -> None:
    if (folder / EPISODES).exists():
        raise OptionError(f"{folder} has episodes: name another folder with --out")


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, content)
