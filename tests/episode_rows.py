"""Rows of episodes that several test files share."""

from __future__ import annotations

from typing import Any

from labgym.eval.driving.episode_row import TransitionRow


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
