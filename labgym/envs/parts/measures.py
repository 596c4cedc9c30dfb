"""Entries of the info."""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from operator import attrgetter
from typing import Any

import numpy as np

from labgym.envs.parts.protocols import Measure
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.errors import check_name


def _pose(state: State) -> Any:
    return np.array(state.pose)


def _goal(state: State) -> Any:
    return np.array(state.pair.goal)


def _protocol(state: State) -> str:
    return "" if state.task.protocol is None else state.task.protocol.id


def _legs(state: State) -> int:
    return 1 + len(state.task.following)


def _cost(state: State) -> float:
    return float(state.touches)


def _achieved_goal(state: State) -> Any:
    return np.array(state.pose[:2])


def _desired_goal(state: State) -> Any:
    return np.array(state.pair.goal[:2])


def _outcomes(state: State) -> Any:
    return {name: presence.outcome for name, presence in state.presences.items()}


def _conditions(state: State) -> Any:
    return deepcopy(state.conditions)


def _randomization(state: State) -> Any:
    return deepcopy(state.randomization)


VALUES: dict[str, Callable[[State], Any]] = {
    "pose": _pose,
    "goal": _goal,
    "distance": attrgetter("distance"),
    "success": attrgetter("success"),
    "collision": attrgetter("collision"),
    "contacts": attrgetter("contacts"),
    "clearance": attrgetter("clearance"),
    "path_length": attrgetter("path_length"),
    "shortest_path_length": attrgetter("shortest_path_length"),
    "layout": attrgetter("task.layout.id"),
    "protocol": _protocol,
    "pair": attrgetter("pair.index"),
    "time": attrgetter("time"),
    "reward_terms": attrgetter("terms"),
    "is_success": attrgetter("success"),
    "cost": _cost,
    "ending": attrgetter("ending"),
    "leg": attrgetter("leg"),
    "randomization": _randomization,
    "legs": _legs,
    "conditions": _conditions,
    "outcomes": _outcomes,
    "touched": attrgetter("touched"),
    "achieved_goal": _achieved_goal,
    "desired_goal": _desired_goal,
}
"""The measures of ours by name; the page of each environment says what they mean."""

STANDARD = (
    "pose", "goal", "distance", "success", "collision", "contacts", "clearance", "path_length",
    "shortest_path_length", "layout", "protocol", "pair", "time", "reward_terms",
)  # fmt: skip
"""The info of `LabPointNav-v0`."""

EXTENDED = (*STANDARD, "is_success", "cost", "ending", "achieved_goal", "desired_goal")
"""The info of `LabFloorNav-v0`."""


@registered("measure", "named")
class NamedMeasure(Measure):
    """One of our measures, by its name."""

    name: str

    def __post_init__(self) -> None:
        check_name("measure", self.name, VALUES)
        object.__setattr__(self, "value", VALUES[self.name])  # one call less for each entry

    def value(self, state: State) -> Any:
        """Return the value in a state."""
        return VALUES[self.name](state)
