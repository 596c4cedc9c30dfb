"""The drives of the episodes of a configuration: single ones, whole protocols, or those of LabNav tasks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from labgym.envs.config import LABNAV, PointNavConfig
from labgym.envs.labnav.drawing import Drawer, drawer_of
from labgym.envs.labnav.pack import PackTasks
from labgym.envs.labnav.tasks import task_of
from labgym.envs.parts.protocols import Tasks
from labgym.envs.tasks import Task, TaskSource, goal_pair
from labgym.errors import OptionError, UnknownNameError
from labgym.navigation import goal_pairs

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
        task, _, level = name.removeprefix(LABNAV).partition("-")
        self._task = task
        if not level.isdecimal():
            raise UnknownNameError("LabNav task and level", name, [f"{LABNAV}{task}-{one}" for one in (1, 2, 3)])
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


class ProtocolTasks:
    """Draws a task from a source and goes on to the end of its protocol.

    The first drive is the protocol's first, or that of the reset option "pair", an index into
    `goal_pairs(layout, protocol)`; the others follow in the protocol's order.

    Args:
        source: chooses layout and protocol.
    """

    def __init__(self, source: Tasks) -> None:
        self._source = source

    def draw(self, rng: np.random.Generator, options: Mapping[str, Any], fresh: bool) -> Task:
        """Return the next task.

        Raises:
            OptionError: the options name a start or a goal, or the layout has no protocol.
            UnknownNameError, DocumentError: as the source.
        """
        for name in ("start", "goal"):
            if options.get(name) is not None:
                raise OptionError(f"a whole protocol has no option {name!r}: its drives go from location to location")
        others = {name: value for name, value in options.items() if name != "pair"}
        task = self._source.draw(rng, others, fresh)
        index = 0 if options.get("pair") is None else options["pair"]
        first = goal_pair(task.layout, index, task.protocol)
        return replace(task, pair=first, following=goal_pairs(task.layout, task.protocol)[first.index + 1 :])

    def close(self) -> None:
        """Close the source."""
        self._source.close()


def task_source(config: PointNavConfig, source: Tasks | None = None) -> Tasks:
    """Return what chooses the task of each episode.

    Args:
        source: chooses the layouts; None for what the configuration says.

    Raises:
        UnknownNameError, OptionError, DocumentError: as `TaskSource`.
        LabgymError: `floors` is no pack.
    """
    if config.tasks is not None:
        return config.tasks
    if config.floors is not None:
        return PackTasks(config.floors, config.drives.removeprefix(LABNAV), config.resident_mb)
    source = layout_source(config) if source is None else source
    if config.drives.startswith(LABNAV):
        return LabNavTasks(source, config.drives)
    return source if config.drives == "pair" else ProtocolTasks(source)


def ladder(config: PointNavConfig) -> list[tuple[PointNavConfig, Tasks]]:
    """Return the configurations of a curriculum, the easiest first, with their sources of tasks; without one, its own.

    Raises:
        UnknownNameError, OptionError, DocumentError, LabgymError: as `task_source`.
    """
    if config.curriculum is None:
        return [(config, task_source(config))]
    rungs, floors = config.rungs, layout_source(config)
    shared = [(rung.split, rung.training) == (config.split, config.training) for rung in rungs]
    return [(rung, task_source(rung, floors if same else None)) for rung, same in zip(rungs, shared, strict=True)]


def layout_source(config: PointNavConfig) -> TaskSource:
    """Return what chooses the layout of each episode.

    Raises:
        UnknownNameError, OptionError, DocumentError: as `TaskSource`.
    """
    return TaskSource(
        config.split,
        config.layout,
        config.protocol,
        training=config.training,
        resident_mb=config.resident_mb,
        profile=config.profile,
        episodes_per_layout=config.episodes_per_layout,
        pool=config.pool,
        senses=config.senses,
    )
