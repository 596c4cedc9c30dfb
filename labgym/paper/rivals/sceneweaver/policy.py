"""The choice of a problem and of a tool: the seeded policy in the place of SceneWeaver's planner.

Public repository Scene-Weaver/SceneWeaver, `scenedesigner.py` (prompt of the planner): look for the lowest grade and
the physical problems, find the most serious problem, list the tools that fit with a confidence each, degrade the tool
of the last step if it has not solved the problem, use one tool a step, and stop if there is no serious problem.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np

from labgym.paper.rivals.sceneweaver.critic import Critique, Fault, SceneProblem

Tool = Literal["add", "crowd", "picture", "remove", "resize", "move", "rotate", "relate"]

CONFIDENCE: dict[Fault, dict[Tool, float]] = {
    "collision": {"move": 0.7, "remove": 0.5, "resize": 0.4},
    "outside": {"move": 0.7, "remove": 0.5, "resize": 0.4},
    "missing": {"add": 0.9},
    "monotonous": {"add": 0.8},
    "crowded": {"remove": 0.8, "resize": 0.5},
    "off the wall": {"relate": 0.8, "move": 0.5},
    "facing a wall": {"rotate": 0.8, "relate": 0.6},
    "seat astray": {"relate": 0.8, "rotate": 0.4, "remove": 0.2},
    "blocked": {"move": 0.7, "resize": 0.4, "remove": 0.3},
    "bare": {"add": 0.8, "crowd": 0.7},
    "empty": {"add": 0.8, "resize": 0.3},
}
"""Confidence in the tools that fit a fault: an assumption after the use cases on the tools' cards."""
DEGRADED = 0.4
"""Factor on the confidence in a tool that has not solved the problem."""
HOPELESS = 0.1
"""Confidence below which a tool is not used."""
NOISE = 0.2
"""Greatest random addition to a confidence."""


@dataclass(frozen=True)
class WeaverAction:
    """A step: the problem and the tool."""

    problem: SceneProblem
    tool: Tool


class Planner(Protocol):
    """Chooses the next step."""

    def choose(self, critique: Critique) -> WeaverAction | None:
        """Return the next step, None to stop."""

    def failed(self, action: WeaverAction) -> None:
        """Take note that a step was rolled back, or left its problem unsolved."""


@dataclass
class TablePlanner:
    """The most serious problem under the criterion with the lowest grade, and a tool by its confidence."""

    generator: np.random.Generator
    degraded: dict[tuple[SceneProblem, Tool], float] = field(default_factory=dict)

    def choose(self, critique: Critique) -> WeaverAction | None:
        """Return the next step: physical problems first, then by grade; the surest tool."""
        order = sorted(critique.grades, key=lambda name: critique.grades[name])
        ranks = {"physics": -1, **{name: rank for rank, name in enumerate(order)}}
        for problem in sorted(critique.problems, key=lambda one: ranks[one.criterion]):
            tools = {tool: self._confidence(problem, tool) for tool in CONFIDENCE[problem.fault]}
            usable = {
                tool: value + NOISE * self.generator.random() for tool, value in tools.items() if value >= HOPELESS
            }
            if usable:
                return WeaverAction(problem, max(usable, key=lambda tool: usable[tool]))
        return None

    def failed(self, action: WeaverAction) -> None:
        """Degrade the tool for this problem."""
        key = action.problem, action.tool
        self.degraded[key] = self.degraded.get(key, 1.0) * DEGRADED

    def _confidence(self, problem: SceneProblem, tool: Tool) -> float:
        return CONFIDENCE[problem.fault][tool] * self.degraded.get((problem, tool), 1.0)
