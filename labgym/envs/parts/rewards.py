"""Terms of the reward, and the weights of the usual ones.

Terms without a memory also take the columns of many episodes (`labgym.envs.vector.columns`) and return a column.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from labgym.counts import is_finite
from labgym.envs.parts.protocols import RewardTerm
from labgym.envs.parts.registry import registered
from labgym.envs.state import State
from labgym.errors import OptionError, check_name
from labgym.navigation import METHODS, Method


@registered("reward term", "progress", frozen=False)
class ProgressTerm(RewardTerm):
    """Meters by which the shortest path to the goal became shorter, for a disc of radius 0.30 m.

    Attributes:
        method: "grid", the shortest path on a 5 cm grid, or "exact", the shortest any-angle path.
    """

    weight: float = 1.0
    method: Method = "grid"
    name: str = "progress"

    def __post_init__(self) -> None:
        check_name("distance_to_go", self.method, METHODS)

    def reset(self, state: State) -> None:
        """Measure the way to the goal of the drive."""
        self._to_go = state.to_go(self.method)
        self._remaining = self._to_go.at(*state.pose[:2])

    def value(self, state: State) -> float:
        """Return the progress, meters."""
        remaining = self._to_go.at(*state.pose[:2])
        progress, self._remaining = self._remaining - remaining, remaining
        return progress


@registered("reward term", "success")
class SuccessTerm(RewardTerm):
    """1 when a goal is reached, by the rules of the endings; once a drive."""

    weight: float = 10.0
    name: str = "success"

    def value(self, state: State) -> float:
        """Return 1 or 0."""
        return state.success


@registered("reward term", "failure")
class FailureTerm(RewardTerm):
    """1 when an ending gives the verdict "failure".

    Attributes:
        onward: of several drives, names of the endings after which the next one begins; after others the drives that
            are not begun count, too, so that ending an episode early saves nothing.
    """

    weight: float = -10.0
    name: str = "failure"
    onward: tuple[str, ...] = ()

    def value(self, state: State) -> float:
        """Return the number of drives that failed by the latest action."""
        if not self.onward or not state.failed or state.ending in self.onward:
            return state.failed
        return 1 + len(state.task.following) - state.leg


@registered("reward term", "collision")
class CollisionTerm(RewardTerm):
    """1 if the robot touched something during the action."""

    weight: float = -0.1
    name: str = "collision"

    def value(self, state: State) -> float:
        """Return 1 or 0."""
        return state.collision


@registered("reward term", "time")
class TimeTerm(RewardTerm):
    """1 per action."""

    weight: float = -0.01
    name: str = "time"

    def value(self, state: State) -> float:  # noqa: ARG002
        """Return 1."""
        return 1


@registered("reward term", "clearance")
class ClearanceTerm(RewardTerm):
    """How far the robot intrudes on a margin around furniture and walls: 1 at contact, 0 at `margin` meters or more."""

    weight: float = -0.1
    margin: float = 0.3
    name: str = "clearance"

    def value(self, state: State) -> float:
        """Return the share of the margin that is lost."""
        share: float = np.maximum(0.0, 1.0 - state.clearance / self.margin)
        return share


@registered("reward term", "function")
class FunctionTerm(RewardTerm):
    """A term of the user's own.

    Attributes:
        name: its name. weight: factor on the value.
        function: returns the value in a state after an action; or its address "module:function", which lets an
            environment's specification be written as JSON.
    """

    name: str
    function: Callable[[State], float] | str
    weight: float = 1.0

    def __post_init__(self) -> None:
        if isinstance(self.function, str):
            module, _, name = self.function.partition(":")
            try:
                function = getattr(importlib.import_module(module), name)
            except (ImportError, AttributeError, ValueError) as error:
                raise OptionError(f"reward term {self.name!r}: {self.function!r} cannot be imported: {error}") from None
            object.__setattr__(self, "function", function)
        if not callable(self.function):
            raise OptionError(f"reward term {self.name!r}: {self.function!r} is not a function")

    def value(self, state: State) -> float:
        """Return the function's value."""
        function: Any = self.function
        return float(function(state))


def checked_terms(terms: tuple[RewardTerm, ...]) -> tuple[RewardTerm, ...]:
    """Return the terms.

    Raises:
        OptionError: a weight is not a finite number.
    """
    for term in terms:
        if not is_finite(term.weight):
            raise OptionError(f"weight of reward term {term.name!r} is {term.weight!r}, expected a finite number")
    return terms


@dataclass(frozen=True)
class RewardWeights:
    """Weight of each term of the usual reward.

    Attributes:
        progress: per meter by which the shortest path to the goal became shorter.
        success: once, when the goal is reached.
        collision: per action during which the robot touched something.
        time: per action.
        failure: once, when a rule ends the drive elsewhere; without a term if it is 0.
    """

    progress: float = 1.0
    success: float = 10.0
    collision: float = -0.1
    time: float = -0.01
    failure: float = 0.0

    def terms(self, method: Method = "grid", onward: tuple[str, ...] = ()) -> tuple[RewardTerm, ...]:
        """Return the terms.

        Args:
            method: how progress measures the way to the goal.
            onward: as of `FailureTerm`.
        """
        failure = (FailureTerm(self.failure, onward=onward),) if self.failure else ()
        return (
            ProgressTerm(self.progress, method),
            SuccessTerm(self.success),
            *failure,
            CollisionTerm(self.collision),
            TimeTerm(self.time),
        )
