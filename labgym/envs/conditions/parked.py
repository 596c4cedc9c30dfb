"""Condition "parked": things that stand on the floor besides the layout's own, and that every map shows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from labgym.envs.checks import finite
from labgym.envs.parts.protocols import Condition, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.errors import LabgymError, OptionError
from labgym.layouts import Layout, Placement

MOST = 64
"""Greatest number of things of an episode."""


@dataclass(frozen=True)
class ParkedThing:
    """A thing on the floor.

    Attributes:
        asset: name in the catalog. x, y: its middle in the room frame, meters. yaw: radians.
    """

    asset: str
    x: float
    y: float
    yaw: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.asset, str) or len(self.asset) > 64:
            raise OptionError(f"parked thing: asset is {str(self.asset)[:40]!r}, expected a name of the catalog")
        finite(self, "x", "y", "yaw")


@registered("condition", "parked")
class Parked(Condition):
    """Things that are parked on the floor. By default none: `labgym.envs.labnav.necks` parks them at a route.

    Attributes:
        things: `ParkedThing`s, or mappings of their fields.
    """

    things: tuple[ParkedThing | Mapping[str, Any], ...] = ()
    name: str = "parked"

    def __post_init__(self) -> None:
        object.__setattr__(self, "things", things_of(list(self.things)))

    def draw(self, task: Task, rng: np.random.Generator) -> list[dict[str, Any]]:  # noqa: ARG002
        """Return the things."""
        return plain_things(things_of(list(self.things)))

    def prepare(self, task: Task, data: Any) -> Task:
        """Return the task with the things in its layout.

        Raises:
            OptionError: the data is not a list of things, or an asset does not exist.
        """
        things = things_of(data)
        return task if not things else replace(task, layout=with_things(task.layout, things))

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Presence:  # noqa: ARG002
        """Return nothing that moves."""
        return _Still()


class _Still(Presence):
    """Parked things in an episode: they are part of the layout."""

    visible = False


def things_of(data: Any) -> tuple[ParkedThing, ...]:
    """Return the things in plain data.

    Raises:
        OptionError: not a list of at most 64 things.
    """
    if not isinstance(data, list | tuple) or len(data) > MOST:
        raise OptionError(f"condition 'parked': data is a {type(data).__name__}, expected a list of at most {MOST}")
    things = []
    for each in data:
        if isinstance(each, ParkedThing):
            things.append(each)
        elif isinstance(each, Mapping) and set(each) <= {"asset", "x", "y", "yaw"} and {"asset", "x", "y"} <= set(each):
            things.append(ParkedThing(**each))
        else:
            raise OptionError(f"condition 'parked': {str(each)[:60]!r} is not a mapping of asset, x, y and yaw")
    return tuple(things)


def plain_things(things: tuple[ParkedThing, ...]) -> list[dict[str, Any]]:
    """Return things as JSON data."""
    return [{"asset": each.asset, "x": each.x, "y": each.y, "yaw": each.yaw} for each in things]


def with_things(layout: Layout, things: tuple[ParkedThing, ...]) -> Layout:
    """Return a layout with more things on its floor.

    Raises:
        OptionError: an asset does not exist, or a place is out of bounds.
    """
    try:
        placements = [
            Placement(id=f"parked-{number}", asset=one.asset, position=(one.x, one.y, 0.0), yaw=one.yaw)
            for number, one in enumerate(things, 1)
        ]
        changed = layout.replace(placements=(*layout.placements, *placements))
        changed.check_references()
    except LabgymError as error:
        raise OptionError(f"condition 'parked': {error}") from None
    except ValueError as error:
        raise OptionError(f"condition 'parked': {' '.join(str(error).split())[:200]}") from None
    return changed
