"""The reward of a drive: its score at the end, and on the way progress, time, nearness to people and slosh.

The drives of a shift are rewarded one by one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from labgym.envs.parts.endings import nearest_person
from labgym.envs.state import State

PROGRESS, TIME = 0.3, -0.01
"""Reward of a meter of path that is left behind, and of a control step."""
STRIDE = 0.2
"""Greatest progress that counts in a control step, meters: a path that is found again is no progress."""
PERSONAL, CLOSE = 1.0, -0.01
"""Distance of a person, meters, and the reward of a control step nearer than it."""
SLOSH = -4.0
"""Reward of a rise of the liquid by its freeboard, beyond half of it."""
SCORE, SUCCESS, CONTACT, FAILURE = 5.0, 2.0, -4.0, -1.0
"""Rewards at the end: of the task's score, of success, of a touch, and of any other failure."""
SCALE = 0.1
"""Factor on all of them that makes returns of order one."""


@dataclass
class Meter:
    """Measures what costs in each control step of a drive, from the true state.

    Attributes:
        costs: rewards, below 0, of the control steps so far.
        freeboard: of the beaker, meters; 0 without.
    """

    freeboard: float = 0.0
    costs: list[float] = field(default_factory=list)
    _highest: float = 0.0

    def begin_leg(self, freeboard: float) -> None:
        """Begin the next drive of a shift, with a beaker of this freeboard, meters, or 0 without one."""
        self.freeboard, self._highest = freeboard, 0.0

    def watch(self, state: State) -> None:
        """Note a control step."""
        cost = TIME
        if nearest_person(state) < PERSONAL:
            cost += CLOSE
        if self.freeboard > 0.0 and "payload" in state.presences:
            highest = float(state.presences["payload"].outcome["highest"]) / self.freeboard
            cost += SLOSH * (max(highest, 0.5) - max(self._highest, 0.5))
            self._highest = max(highest, self._highest)
        self.costs.append(cost)


def final_reward(score: float, success: bool, contact: bool) -> float:
    """Return the reward at the end of a drive."""
    if success:
        return SCORE * score + SUCCESS
    return CONTACT if contact else FAILURE


def rewards_of(
    costs: list[float], steps: list[int], progress: list[float], ends: Sequence[tuple[int, float]]
) -> NDArray[np.float64]:
    """Return the reward of each decision: what it cost until the next one, its progress, and the end of its drive.

    Args:
        costs: of all control steps. steps: the control step of each decision, ascending. progress: meters of path that
            were left behind from each decision to the next one.
        ends: number of decisions of each drive, and the reward at its end, which its last decision gets.
    """
    until = [*steps, len(costs)][1:]
    rewards = [
        math.fsum(costs[begin:end]) + PROGRESS * way for begin, end, way in zip(steps, until, progress, strict=True)
    ]
    decided = 0
    for count, final in ends:
        decided += count
        if count:
            rewards[decided - 1] += final
    return SCALE * np.array(rewards)
