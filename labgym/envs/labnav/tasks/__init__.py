"""The tasks of LabNav, a module each: all modules of this folder register their task."""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
from typing import Annotated, Any

from pydantic import AfterValidator, Field

from labgym.envs.config import PointNavConfig
from labgym.envs.labnav.task import REWARD, STOPS, TASKS, LabNavTask, Level, Stop
from labgym.envs.parts.measures import EXTENDED
from labgym.errors import UnknownNameError, check_name

__all__ = ["FIGURE_TASKS", "HEADLINE", "TASKS", "TaskName", "condition_names", "config_of", "task_of"]

FIGURE_TASKS = ("aisle", "moved", "people", "odometry", "dock", "glass", "carry", "shift")
"""The eight tasks of the figure, in the order of tables."""
HEADLINE = 2
"""The level whose figure is the headline."""
MEASURES = (*EXTENDED, "touched", "outcomes")
ONWARD = ("stop", "stuck", "spill", "time")
"""Endings of a drive of a chain after which the next one begins."""

for _name in (*FIGURE_TASKS, *sorted({module.name for module in iter_modules(__path__)} - set(FIGURE_TASKS))):
    import_module(f"{__name__}.{_name}")


def task_of(name: str) -> LabNavTask:
    """Return a task.

    Raises:
        UnknownNameError: no task has that name.
    """
    check_name("LabNav task", name, TASKS)
    return TASKS[name]


def _valid(name: str) -> str:
    try:
        return task_of(name).name
    except UnknownNameError as error:
        raise ValueError(str(error)) from None  # pydantic reports no other error


TaskName = Annotated[str, AfterValidator(_valid), Field(json_schema_extra={"enum": list(TASKS)})]
"""Name of a task in a document."""


def config_of(
    name: str,
    level: int = HEADLINE,
    observation: str = "lidar",
    stop: Stop | None = "brake",
    delay: int = 0,
    properties: Level | None = None,
    **fields: Any,
) -> PointNavConfig:
    """Return the environment of a task.

    Args:
        name: of the task. level: 1 to 3.
        observation: "lidar", "depth" or "rgbd".
        stop: what ends a drive near its goal: "brake", the evaluator's brake; "action", a third component of the
            action, STOP; None, nothing.
        delay: number of control steps by which the robot obeys later.
        properties: those of the drives, by default those of the level.
        fields: further fields of `PointNavConfig`.

    Raises:
        UnknownNameError: there is no such task, level, observation or way to stop.
    """
    task = task_of(name)
    number = task.level(level) if properties is None else properties
    if stop is not None:
        check_name("stop", stop, STOPS)
    values: dict[str, Any] = {
        "observation": observation,
        "sensors": number.sensors(observation),
        "actions": task.actions(stop, delay, number.slip),
        "endings": task.endings(stop is not None),
        "onward": ONWARD if task.chain else (),
        "randomizations": number.randomizations,
        "conditions": ({"kind": "contacts"}, *number.conditions),
        "disc": task.radius,
        "distance_to_go": "exact",
        "weights": REWARD,
        "measures": (*MEASURES, "leg", "legs") if task.chain else MEASURES,
    }
    if fields.get("rewards") is not None:
        del values["weights"]
    return PointNavConfig(**(values | fields))


def condition_names(name: str, level: int) -> tuple[str, ...]:
    """Return the names of the conditions of a task at a level whose data an episode has.

    Raises:
        UnknownNameError: there is no such task or level.
    """
    return tuple(condition.name for condition in config_of(name, level).conditions if condition.name != "contacts")
