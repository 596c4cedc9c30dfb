"""Task "glass": S L* / max(P, L*)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from labgym.envs.labnav.task import EASY_LENGTHS, LabNavTask, Level, Result, register, spl


def score(result: Result, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:  # noqa: ARG001
    """Return SPL."""
    return spl(result.success, result.shortest, result.path_length)


def _level(panes: int, framed: bool) -> Level:
    return Level(({"kind": "glass", "panes": panes, "framed": framed},), lengths=(4.0, 25.0))


TASK = register(
    LabNavTask(
        "glass",
        "drive among panes of glass that are on no map",
        {1: _level(1, True), 2: _level(1, False), 3: _level(2, False)},
        score,
        easy=replace(_level(0, True), lengths=EASY_LENGTHS),
    )
)
