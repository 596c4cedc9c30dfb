"""The folder of an evaluation: episodes and routes, written while driving and read again to resume."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path

from labgym.documents import append_text, write_text
from labgym.errors import OptionError
from labgym.eval.driving.drive import Drive, Route
from labgym.eval.driving.episode_row import Key, read_rows, row_line
from labgym.eval.driving.record import EvaluationIdentity, NavigationSummary


class RunFolder:
    """The folder of an evaluation. With `folder=None` every method does nothing.

    Args:
        folder: the folder, or None to write nothing.
        identity: the evaluation that the folder belongs to.
        overwrite: whether to replace the episodes of another evaluation, or of other code.
    """

    def __init__(self, folder: Path | None, identity: EvaluationIdentity, overwrite: bool = False) -> None:
        self._folder, self._identity, self._overwrite = folder, identity, overwrite

    def resume(self, expected: dict[str, tuple[str, tuple[Key, ...]]]) -> dict[Key, Drive]:
        """Return the episodes that need not be driven again: those of complete, unchanged layouts.

        Args:
            expected: hash and episodes of each layout, by layout id.

        Raises:
            OptionError: the folder holds episodes of another evaluation or of other code, and `overwrite` is off.
        """
        if self._folder is None:
            return {}
        path = self._folder / "run.json"
        episodes = self._read()
        if path.exists():
            previous = EvaluationIdentity.load(path)
            differences = previous.differences(self._identity)
            if differences and (episodes or differences != ("code",)) and not self._overwrite:
                raise OptionError(_refusal(self._folder, previous, differences))
            if differences:
                episodes = []
        resumed = _complete(episodes, expected)
        self._identity.save(path)
        self._write(list(resumed.values()))
        return resumed

    def append(self, drives: Sequence[Drive]) -> None:
        """Append a layout's episodes and flush them to disk, routes first, so that every row has its route."""
        if self._folder is None or not drives:
            return
        append_text(self._folder / "routes.jsonl", "".join(map(_route_line, drives)))
        append_text(self._folder / "episodes.jsonl", "".join(row_line(drive.row) for drive in drives))

    def finish(self, summary: NavigationSummary, done: dict[Key, Drive]) -> None:
        """Write the episodes in the suite's order, and the summary."""
        if self._folder is None:
            return
        places = {layout: place for place, layout in enumerate(summary.layouts)}
        self._write([done[key] for key in sorted(done, key=lambda key: (places[key[0]], *key[1:]))])
        summary.save(self._folder / "summary.json")

    def _write(self, drives: Sequence[Drive]) -> None:
        if self._folder is not None:
            write_text(self._folder / "routes.jsonl", "".join(map(_route_line, drives)))
            write_text(self._folder / "episodes.jsonl", "".join(row_line(drive.row) for drive in drives))

    def _read(self) -> list[Drive]:
        if self._folder is None:
            return []
        routes = read_routes(self._folder / "routes.jsonl")
        return [Drive(row, routes[row.key]) for row in read_rows(self._folder / "episodes.jsonl") if row.key in routes]


def default_folder(policy: str, suite: str | Path) -> Path:
    """Return where `labgym eval` writes by default: runs/POLICY-SUITE."""
    return Path("runs") / f"{folder_name(policy)}-{Path(suite).stem}"


def folder_name(policy: str) -> str:
    """Return the name of a policy as the name of a folder: `mine:GoToGoal` becomes mine_GoToGoal."""
    return re.sub(r"[^A-Za-z0-9._-]+", "_", policy)


def read_routes(path: str | Path) -> dict[Key, Route]:
    """Return the routes in a `routes.jsonl` by episode; lines that cannot be read are skipped."""
    path = Path(path)
    routes: dict[Key, Route] = {}
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines() if path.is_file() else ():
        try:
            data = json.loads(line)
            poses = tuple((float(x), float(y), float(yaw)) for x, y, yaw in data["poses"])
            routes[str(data["layout"]), int(data["pair"]), int(data.get("repeat", 0))] = poses
        except (ValueError, KeyError, TypeError):
            continue
    return routes


def _refusal(folder: Path, previous: EvaluationIdentity, differences: Sequence[str]) -> str:
    evaluation = f"policy {previous.policy!r}, suite {previous.suite.label}, seed {previous.seed}"
    remedy = "choose another folder, or overwrite its results (--overwrite)"
    return f"{folder} holds an evaluation that differs in {', '.join(differences)} ({evaluation}); {remedy}"


def _route_line(drive: Drive) -> str:
    poses = [[round(value, 3) for value in pose] for pose in drive.route]
    layout, pair, repeat = drive.row.key
    return json.dumps({"layout": layout, "pair": pair, "repeat": repeat, "poses": poses}) + "\n"


def _complete(drives: Sequence[Drive], expected: dict[str, tuple[str, tuple[Key, ...]]]) -> dict[Key, Drive]:
    """Return the episodes of unchanged layouts all of whose episodes are present."""
    unchanged = {
        drive.row.key: drive
        for drive in drives
        if drive.row.layout in expected and drive.row.layout_hash == expected[drive.row.layout][0]
    }
    return {
        key: unchanged[key] for _, keys in expected.values() if all(key in unchanged for key in keys) for key in keys
    }
