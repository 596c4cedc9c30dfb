"""Entries of the info."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from labgym.envs.parts.protocols import Measure
from labgym.envs.state import State
from labgym.errors import UnknownNameError

VALUES: dict[str, Callable[[State], Any]] = {
    "pose": lambda state: np.array(state.pose),
    "goal": lambda state: np.array(state.goal),
    "distance": lambda state: state.distance,
    "success": lambda state: state.success,
    "collision": lambda state: state.collision,
    "contacts": lambda state: state.contacts,
    "clearance": lambda state: state.world.clearance(state.pose[0], state.pose[1]),
    "path_length": lambda state: state.path_length,
    "shortest_path_length": lambda state: state.world.shortest_length(state.pair),
    "layout": lambda state: state.task.layout.id,
    "protocol": lambda state: "" if state.task.protocol is None else state.task.protocol.id,
    "pair": lambda state: state.pair.index,
    "time": lambda state: state.time,
    "reward_terms": lambda state: state.terms,
    "is_success": lambda state: state.success,
    "cost": lambda state: float(state.touches),
    "ending": lambda state: state.ending,
    "leg": lambda state: state.leg,
    "achieved_goal": lambda state: np.array(state.pose[:2]),
    "desired_goal": lambda state: np.array(state.goal[:2]),
}
"""The measures of ours by name; the page of each environment says what they mean."""

STANDARD = (
    "pose", "goal", "distance", "success", "collision", "contacts", "clearance", "path_length",
    "shortest_path_length", "layout", "protocol", "pair", "time", "reward_terms",
)  # fmt: skip
"""The info of version 0."""


@dataclass(frozen=True)
class NamedMeasure(Measure):
    """One of our measures, by its name."""

    name: str
    kind: str = field(default="named", init=False)

    def __post_init__(self) -> None:
        if self.name not in VALUES:
            raise UnknownNameError("measure", self.name, VALUES)

    def value(self, state: State) -> Any:
        """Return the value in a state."""
        return VALUES[self.name](state)
