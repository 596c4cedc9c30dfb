"""Policies that try their box, as a user's module: `hostile:Noting`."""

from __future__ import annotations

import os
from pathlib import Path

import probes

from labgym.policies import EpisodeStart, Policy


class Noting(Policy):
    """Reads the notes of earlier episodes and leaves its own."""

    def __init__(self, folder: str) -> None:
        self.notes = probes.Notes(folder)
        (Path(folder) / "table.json").read_text()  # of its identity, so that it may be read while it drives

    def reset(self, episode: EpisodeStart) -> None:
        notes = self.notes.read()
        self.notes.leave()
        if notes:
            raise RuntimeError(f"notes {notes}")

    def act(self, observation: object) -> list[float]:
        return [0.5, 0.0]


class Plain(Noting):
    def __init__(self) -> None:
        pass

    def reset(self, episode: EpisodeStart) -> None:
        pass


class LookingUp(Noting):
    def __init__(self) -> None:
        pass

    def reset(self, episode: EpisodeStart) -> None:
        from labgym.layouts import load_published, published

        load_published("test", published("test")[0])


class TwoFaced(Noting):
    """Declares another sensor at each load."""

    def __init__(self) -> None:
        self.observation = "lidar" if os.getpid() % 2 else "depth"

    def reset(self, episode: EpisodeStart) -> None:
        pass


class Telling(Plain):
    def reset(self, episode: EpisodeStart) -> None:
        Path(os.environ["TMPDIR"], "note").write_text("x")
        raise RuntimeError(os.environ["TMPDIR"])


class Planning(Plain):
    """Has a path, other kinds of goals, and counts its episodes."""

    goal_kinds = ("point", "none")
    episodes = 0

    def reset(self, episode: EpisodeStart) -> None:
        self.episodes += 1

    def stop(self, observation: object) -> bool:
        return self.episodes == 3

    def act(self, observation: object) -> list[float]:
        return [0.1 * self.episodes, 0.0]

    def planned_path(self) -> list[list[float]] | None:
        return [[0.0, 0.0], [1.0, 0.5]] if self.episodes == 2 else None
