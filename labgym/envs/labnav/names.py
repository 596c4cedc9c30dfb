"""The names of LabNav's tasks, without what the tasks consist of."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from labgym.errors import UnknownNameError

ALL = ("aisle", "moved", "people", "odometry", "dock", "glass", "carry", "shift")
"""The eight tasks of the figure."""
POINT = "point"
"""The task of recorded drives that rest at a point; it has no score in the figure."""


def known_task(name: str) -> str:
    """Return the name of a task.

    Raises:
        UnknownNameError: no task has that name.
    """
    if name not in ALL:
        raise UnknownNameError("LabNav task", name, ALL)
    return name


def _valid(name: str) -> str:
    try:
        return known_task(name)
    except UnknownNameError as error:
        raise ValueError(str(error)) from None  # pydantic reports no other error


TaskName = Annotated[str, AfterValidator(_valid), Field(json_schema_extra={"enum": list(ALL)})]
"""Name of a task in a document."""
