"""Condition "leg_payload": a beaker of liquid on the deck in some drives of an episode, full again in each of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from labgym.envs.checks import positive
from labgym.envs.conditions.beaker import Beaker
from labgym.envs.conditions.bodies import Body
from labgym.envs.conditions.payload import Slosh, beaker_of
from labgym.envs.parts.protocols import Condition, Motion, Presence
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.errors import OptionError

MOST_LEGS = 32
"""Greatest number of drives of an episode."""


@registered("condition")
@dataclass(frozen=True)
class LegPayload(Condition):
    """A beaker on the deck in some drives of an episode of several; at the start of each it is full and at rest.

    Its data has the measures of the `beaker`, and the `legs` in which the robot carries it, from 0. The outcome is that
    of `Payload` for the drive in progress.

    Attributes:
        beaker: the beaker, or a mapping of its measures. share: share of the drives; at least one has the beaker.
    """

    beaker: Beaker | Mapping[str, float] = field(default_factory=Beaker)
    share: float = 0.5
    name: str = "payload"
    kind: str = field(default="leg_payload", init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "beaker", beaker_of(self.beaker))
        positive(self, "share")
        if self.share > 1.0:
            raise OptionError(f"LegPayload: share is {self.share}, expected at most 1")

    def draw(self, task: Task, rng: np.random.Generator) -> dict[str, Any]:
        """Return the measures of the beaker and the drives in which it is carried."""
        count = 1 + len(task.following)
        legs = rng.permutation(count)[: max(1, round(self.share * count))]
        return {"beaker": asdict(beaker_of(self.beaker)), "legs": sorted(legs.tolist())}

    def begin(self, state: State, data: Any, rng: np.random.Generator) -> LegSlosh:  # noqa: ARG002
        """Return the liquid at rest."""
        return LegSlosh(state, *leg_payload_of(data))


class LegSlosh(Presence):
    """The liquid in the drive in progress; nothing in a drive without it."""

    visible = False

    def __init__(self, state: State, beaker: Beaker, legs: tuple[int, ...]) -> None:
        self._state, self._beaker, self._legs = state, beaker, frozenset(legs)
        self._leg = -1
        self._slosh: Slosh | None = None
        self._current()

    def substep(self, motion: Motion) -> str:
        """Advance the liquid by one physics step."""
        slosh = self._current()
        return "" if slosh is None else slosh.substep(motion)

    @property
    def bodies(self) -> Sequence[Body]:
        """The beaker on the robot, in a drive with it."""
        slosh = self._current()
        return () if slosh is None else slosh.bodies

    @property
    def outcome(self) -> dict[str, Any]:
        """Of the drive in progress: the greatest rise so far, meters, and whether the liquid was spilt."""
        slosh = self._current()
        return {"highest": 0.0, "spilt": False} if slosh is None else slosh.outcome

    def _current(self) -> Slosh | None:
        """Return the liquid of the drive in progress, at rest if the drive has just begun."""
        state = self._state
        if state.leg != self._leg:
            self._leg, carries = state.leg, state.leg in self._legs
            self._slosh = Slosh(self._beaker, state.pose, state.velocity, state.sideways) if carries else None
        return self._slosh


def leg_payload_of(data: Any) -> tuple[Beaker, tuple[int, ...]]:
    """Return the beaker and the drives in which it is carried.

    Raises:
        OptionError: the data is something else.
    """
    if not isinstance(data, Mapping) or set(data) != {"beaker", "legs"}:
        raise OptionError(f"payload is {str(data)[:60]!r}, expected a mapping of beaker and legs")
    legs = data["legs"]
    whole = isinstance(legs, list | tuple) and len(legs) <= MOST_LEGS
    if not whole or not all(type(leg) is int and 0 <= leg < MOST_LEGS for leg in legs):
        raise OptionError(f"legs are {str(legs)[:60]!r}, expected at most {MOST_LEGS} whole numbers below {MOST_LEGS}")
    return beaker_of(data["beaker"]), tuple(legs)


def carried(state: State) -> Beaker | None:
    """Return the beaker that the robot carries in the drive in progress, None without one."""
    data = state.conditions.get("payload")
    if data is None:
        return None
    if "legs" not in data:
        return beaker_of(data)
    beaker, legs = leg_payload_of(data)
    return beaker if state.leg in legs else None
