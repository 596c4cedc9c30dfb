"""Copies of LabNav evaluations that somebody who cheats changes and signs again."""

from __future__ import annotations

from collections.abc import Callable

from signed_folders import Lines, SignedFolder

from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.labnav.summary import LabNavSummary


class LabNavFolder(SignedFolder):
    """A copy of an evaluation's folder."""

    def change_actions(self, change: Callable[[Lines], object]) -> None:
        """Change the lines of the actions and sign everything."""
        actions = self.lines("actions.jsonl")
        change(actions)
        self.write("actions.jsonl", actions)
        self.sign()

    def change(self, change: Callable[[Lines, Lines], object]) -> None:
        """Change rows and routes, recompute the summary from them and sign everything."""
        rows, routes = self.lines("episodes.jsonl"), self.lines("routes.jsonl")
        change(rows, routes)
        self.write("episodes.jsonl", rows)
        self.write("routes.jsonl", routes)
        summary = LabNavSummary.load(self.folder / "summary.json")
        unique = {one.key: one for one in reversed([LabNavRow.model_validate(row) for row in rows])}
        summary.recomputed(tuple(reversed(unique.values()))).save(self.folder / "summary.json")
        self.sign()
