"""Copies of LabNav evaluations that somebody who cheats changes and signs again."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from labgym.eval.labnav.row import LabNavRow
from labgym.eval.labnav.summary import LabNavSummary
from labgym.runs.identity import RunIdentity
from labgym.runs.manifest import RunManifest, file_digest

Lines = list[dict[str, Any]]


class LabNavFolder:
    """A copy of an evaluation's folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def lines(self, name: str) -> Lines:
        return [json.loads(line) for line in (self.folder / name).read_text().splitlines()]

    def document(self, name: str) -> dict[str, Any]:
        return json.loads((self.folder / name).read_text())

    def write(self, name: str, data: Any) -> None:
        lines = data if isinstance(data, list) else [data]
        (self.folder / name).write_text("".join(f"{json.dumps(line)}\n" for line in lines))

    def change(self, change: Callable[[Lines, Lines], None]) -> None:
        """Change rows and routes, recompute the summary from them and sign everything."""
        rows, routes = self.lines("episodes.jsonl"), self.lines("routes.jsonl")
        change(rows, routes)
        self.write("episodes.jsonl", rows)
        self.write("routes.jsonl", routes)
        summary = LabNavSummary.load(self.folder / "summary.json")
        unique = {one.key: one for one in reversed([LabNavRow.model_validate(row) for row in rows])}
        summary.recomputed(tuple(reversed(unique.values()))).save(self.folder / "summary.json")
        self.sign()

    def sign(self) -> None:
        """Write the manifest that belongs to the files."""
        names = ("episodes.jsonl", "routes.jsonl", "summary.json")
        identity = RunIdentity.load(self.folder / "run.json")
        files = {name: file_digest(self.folder / name) or "" for name in names}
        RunManifest(run=identity.digest, files=files).save(self.folder / "manifest.json")
