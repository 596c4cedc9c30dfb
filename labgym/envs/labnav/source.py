"""The tasks of LabNav for training: drives drawn as those of the suites, on training floors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from labgym.envs.labnav.drawing import Drawer
from labgym.envs.labnav.shifts import drawer_of
from labgym.envs.labnav.tasks import task_of
from labgym.envs.parts.protocols import Tasks
from labgym.envs.protocol_tasks import ProtocolTasks
from labgym.envs.tasks import Task
from labgym.errors import UnknownNameError

PREFIX = "labnav-"
ATTEMPTS = 40
"""Number of drives that are drawn on a layout before its own drive is taken."""


class LabNavTasks:
    """Draws tasks of LabNav in the layouts of a source.

    On a layout where none of 40 drives is accepted, such as a small room, the source's own drive takes its place, with
    the conditions of the task. The same happens where the options name a drive, by "pair", "start" or "goal".

    Args:
        source: chooses the layouts. In `shift` its protocol, from a pair on, takes the place of a single drive.
        name: task and level, such as "labnav-aisle-2".

    Raises:
        UnknownNameError: there is no such task or level.
    """

    def __init__(self, source: Tasks, name: str) -> None:
        task, _, level = name.removeprefix(PREFIX).partition("-")
        self._task = task
        if not level.isdecimal():
            raise UnknownNameError("LabNav task and level", name, [f"{PREFIX}{task}-{one}" for one in (1, 2, 3)])
        self._level = int(level)
        chain = task_of(task).level(self._level) and task_of(task).chain
        self._source: Tasks = ProtocolTasks(source) if chain else source
        self._drawer: tuple[str, Drawer] | None = None

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any], fresh: bool) -> Task:
        """Return the next task; options and errors as of the source."""
        task = self._source.draw(rng, options, fresh)
        if any(options.get(name) is not None for name in ("pair", "start", "goal")):
            return task
        if self._drawer is None or self._drawer[0] != task.layout.hash:
            self._drawer = task.layout.hash, drawer_of(task.layout, self._task, self._level)
        for _ in range(ATTEMPTS):
            drawn = self._drawer[1].draw(rng)
            if drawn is not None:
                pair = replace(drawn.task.pair, index=task.pair.index)
                return replace(drawn.task, protocol=task.protocol, pair=pair, conditions=drawn.conditions)
        return task

    def close(self) -> None:
        """Close the source."""
        self._source.close()
