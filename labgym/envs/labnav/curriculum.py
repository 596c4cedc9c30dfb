"""A ladder of drives for learners, from rooms to the headline of a LabNav task, and the rung of each episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np

from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.envs.config import PointNavConfig

Rule = Literal["mixed", "rising", "tasks"]
RULES: tuple[Rule, ...] = get_args(Rule)
WINDOW = 10
"""Number of episodes on a rung that decide whether to leave it."""
RISE, FALL = 0.8, 0.2
"""Least success rate at which the next rung is taken, and greatest one at which the one before is."""


@dataclass(frozen=True)
class Curriculum:
    """The ladder of an environment.

    Attributes:
        rule: "mixed" and "tasks" draw the rung of each episode, all with the same probability; "rising" begins on the
            first and climbs by the success rate of the last 10 episodes that ended, not counting those at the time
            limit.
        rungs: the configurations, the easiest first: rooms and floors at level 0, then level 1 to that of the id; with
            "tasks" those of several tasks.
    """

    rule: Rule
    rungs: tuple[PointNavConfig, ...]


@dataclass
class Climb:
    """The place of one environment on its ladder.

    Attributes:
        curriculum: the ladder. rung: of the episode in progress, from 0.
        results: whether the last episodes on this rung succeeded.
    """

    curriculum: Curriculum
    rung: int = 0
    results: list[bool] = field(default_factory=list)

    def record(self, success: bool) -> None:
        """Record an episode that ended, and with the rule "rising" change the rung."""
        self.results = [*self.results, success][-WINDOW:]
        if self.curriculum.rule != "rising" or len(self.results) < WINDOW:
            return
        rate = sum(self.results) / WINDOW
        step = int(rate >= RISE) - int(rate <= FALL)
        rung = min(max(self.rung + step, 0), len(self.curriculum.rungs) - 1)
        if rung != self.rung:
            self.rung, self.results = rung, []

    def next(self, rng: np.random.Generator) -> int:
        """Return the rung of the next episode."""
        if self.curriculum.rule != "rising":
            self.rung = int(rng.integers(len(self.curriculum.rungs)))
        return self.rung

    @property
    def state(self) -> list[int]:
        """The rung and the results, as plain numbers."""
        return [self.rung, *map(int, self.results)]

    def restore(self, state: Sequence[int]) -> None:
        """Go on from a state.

        Raises:
            OptionError: it is not one of this ladder.
        """
        if not state or not 0 <= state[0] < len(self.curriculum.rungs) or len(state) > WINDOW + 1:
            raise OptionError(f"state of the curriculum is {list(state)[:20]!r}, expected a rung and up to 10 results")
        self.rung, self.results = state[0], [bool(result) for result in state[1:]]
