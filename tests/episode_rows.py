"""Rows of episodes that several test files share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from labgym.eval.driving.drive import Route
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.files import EpisodeRoute, read_lines


def row(layout: str = "one", pair: int = 0, **changes: Any) -> TransitionRow:
    """Return the row of an episode of 5 m that succeeds on the shortest path, with changes."""
    fields: dict[str, Any] = {
        "suite": "test/1",
        "split": "test",
        "layout": layout,
        "layout_hash": layout * 8,
        "protocol": "sub_01",
        "pair": pair,
        "policy": "a",
        "seed": 0,
        "start": (0.0, 0.0, 0.0),
        "goal": (3.0, 4.0, 0.0),
        "success": True,
        "spl": 1.0,
        "soft_spl": 0.9,
        "path_length": 5.0,
        "shortest_path_length": 5.0,
        "final_distance": 0.5,
        "contacts": 0,
        "min_clearance": 0.1,
        "steps": 60,
        "time": 6.0,
    }
    return TransitionRow(**{**fields, **changes})


def read_routes(path: Path) -> dict[str, Route]:
    """Return the routes in a `routes.jsonl`, by episode."""
    return {key: record.poses for key, record in read_lines(path, EpisodeRoute).checked(path, path.name).items()}
