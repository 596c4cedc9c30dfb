"""Condition "contacts": the physics advances by single steps, and the state names what the robot touches."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from labgym.envs.parts.protocols import Condition, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.envs.tasks import Task


@registered("condition")
@dataclass(frozen=True)
class Contacts(Condition):
    """Checks contacts after every physics step, instead of every 0.025 s, and names them in `State.touched`.

    Its data is None. The outcome has the names of all that the robot has touched so far.
    """

    name: str = "contacts"
    kind: str = field(default="contacts", init=False)

    def draw(self, task: Task, rng: np.random.Generator) -> None:
        """Return None: nothing is drawn."""

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> Touches:  # noqa: ARG002
        """Return the record of an episode."""
        return Touches()


class Touches(Presence):
    """The names of what the robot has touched, in order."""

    visible = False

    def __init__(self) -> None:
        self._names: dict[str, None] = {}

    def step(self, state: State) -> None:
        """Add what the robot touched in a control step."""
        self._names |= dict.fromkeys(state.touched)

    @property
    def outcome(self) -> list[str]:
        """The names so far."""
        return list(self._names)
