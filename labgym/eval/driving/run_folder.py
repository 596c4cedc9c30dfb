"""The folder of an evaluation: rows and routes as they are driven, and what is kept when it goes on later."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path

from labgym.documents import write_text
from labgym.errors import OptionError
from labgym.eval.driving.drive import Drive, Key, Route
from labgym.eval.driving.episode_row import read_rows, row_line
from labgym.eval.driving.record import NavigationSummary, RunIdentity


class RunFolder:
    """The folder of a run; without one everything here does nothing."""

    def __init__(self, folder: Path | None, identity: RunIdentity) -> None:
        self._folder, self._identity = folder, identity

    def resume(self, expected: dict[str, tuple[str, int]]) -> dict[Key, Drive]:
        """Return the episodes that are there already, of layouts that are complete and unchanged.

        Raises:
            OptionError: the folder holds another run.
        """
        if self._folder is None:
            return {}
        path = self._folder / "run.json"
        kept: dict[Key, Drive] = {}
        if path.exists():
            before = RunIdentity.load(path)
            other = before.differences(self._identity)
            if other:
                raise OptionError(
                    f"{self._folder} holds a run with another {', '.join(other)} (policy {before.policy!r}, suite "
                    f"{before.suite.label}, seed {before.seed}); choose another folder or remove it"
                )
            if before.code == self._identity.code:
                kept = _complete(self._read(), expected)
        self._identity.save(path)
        self._write(list(kept.values()))
        return kept

    def append(self, drives: Sequence[Drive]) -> None:
        """Add a layout's episodes, at once on disk: the routes first, so that no row is without its route."""
        if self._folder is None or not drives:
            return
        lines = {"routes.jsonl": map(_route_line, drives), "episodes.jsonl": (row_line(drive.row) for drive in drives)}
        for name, texts in lines.items():
            with (self._folder / name).open("a", encoding="utf-8") as stream:
                stream.write("".join(texts))
                stream.flush()
                os.fsync(stream.fileno())

    def finish(self, summary: NavigationSummary, done: dict[Key, Drive]) -> None:
        """Write the episodes in the suite's order, and the summary."""
        if self._folder is None:
            return
        places = {layout: place for place, layout in enumerate(summary.layouts)}
        self._write([done[key] for key in sorted(done, key=lambda key: (places[key[0]], key[1]))])
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


def read_routes(path: str | Path) -> dict[Key, Route]:
    """Return the routes of a `routes.jsonl` by layout id and pair; lines that are none are left out."""
    path = Path(path)
    routes: dict[Key, Route] = {}
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines() if path.is_file() else ():
        try:
            data = json.loads(line)
            poses = tuple((float(x), float(y), float(yaw)) for x, y, yaw in data["poses"])
            routes[str(data["layout"]), int(data["pair"])] = poses
        except (ValueError, KeyError, TypeError):
            continue
    return routes


def _route_line(drive: Drive) -> str:
    poses = [[round(value, 3) for value in pose] for pose in drive.route]
    return json.dumps({"layout": drive.row.layout, "pair": drive.row.pair, "poses": poses}) + "\n"


def _complete(drives: Sequence[Drive], expected: dict[str, tuple[str, int]]) -> dict[Key, Drive]:
    """Return the episodes of layouts that are unchanged and have all their episodes."""
    found = {
        drive.row.key: drive
        for drive in drives
        if drive.row.layout in expected and drive.row.layout_hash == expected[drive.row.layout][0]
    }
    whole = {layout for layout, (_, count) in expected.items() if all((layout, pair) in found for pair in range(count))}
    return {key: drive for key, drive in found.items() if key[0] in whole and key[1] < expected[key[0]][1]}
