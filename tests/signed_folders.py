"""Copies of evaluations that somebody who cheats changes and signs again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from labgym.runs.identity import RunIdentity
from labgym.runs.manifest import RunManifest, file_digest

Lines = list[dict[str, Any]]


class SignedFolder:
    """A copy of an evaluation's folder, in which everything can be changed and signed again."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def lines(self, name: str) -> Lines:
        return [json.loads(line) for line in (self.folder / name).read_text().splitlines()]

    def document(self, name: str) -> dict[str, Any]:
        return json.loads((self.folder / name).read_text())

    def write(self, name: str, data: Any) -> None:
        lines = [json.dumps(one) for one in data] if isinstance(data, list) else [json.dumps(data, indent=1)]
        (self.folder / name).write_text("".join(f"{line}\n" for line in lines))

    def sign(self) -> None:
        """Write the manifest that belongs to the files."""
        names = ("episodes.jsonl", "routes.jsonl", "actions.jsonl", "summary.json")
        identity = RunIdentity.load(self.folder / "run.json")
        files = {name: file_digest(self.folder / name) or "" for name in names}
        RunManifest(run=identity.digest, files=files).save(self.folder / "manifest.json")
