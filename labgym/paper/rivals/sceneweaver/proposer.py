"""SceneWeaver as a proposer: initial scene, reflect and act up to 15 steps, physics, roll back.

SceneWeaver (Yang and others, NeurIPS 2025, arXiv 2509.20414; code: Scene-Weaver/SceneWeaver) lets a language model
choose one tool a step, driven by a critic that grades pictures. Here a seeded policy chooses, rules grade, and the
request gives the room. Published: a step is rolled back if the sum of four grades falls by 5 or more (`check_valid`);
here if it falls at all, which is the paper's intention without the noise of a language model's grades.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.paper.rivals.chamber import Chamber, chambers
from labgym.paper.rivals.piece import generator_of, layout_of, numbers_in_use
from labgym.paper.rivals.plan import Designer, DesignPlan, Grade, Large, household_plan, named_to
from labgym.paper.rivals.sceneweaver.critic import Critique, critique
from labgym.paper.rivals.sceneweaver.physics import cleared, settle
from labgym.paper.rivals.sceneweaver.policy import Planner, TablePlanner, WeaverAction
from labgym.paper.rivals.sceneweaver.scene import WeaverScene
from labgym.paper.rivals.sceneweaver.tools import Guide, Toolbox

STEPS = 15
"""Greatest number of steps, the initial scene and the end included (`max_steps`)."""
STREAM = 0x5CE
"""Sub-stream of the seed."""


@dataclass(frozen=True)
class WeaverStep:
    """One step of a run: what was tried, whether it was kept, and the critique of the scene that remains."""

    action: WeaverAction | None
    kept: bool
    critique: Critique


@dataclass(frozen=True)
class SceneWeaverProposer:
    """SceneWeaver with a description of the experiment; deterministic.

    Attributes:
        steps: greatest number of steps.
        designer: lists the large objects of the initial scene. planner: makes the planner of a run.
        source: who the designer and the planner are, for the layout's provenance.
        grade: what the critic knows of the protocol.
        guide: makes what looks at pictures for the tool `picture`; None without one.
    """

    name: str = "sceneweaver"
    steps: int = STEPS
    designer: Designer = household_plan
    planner: Callable[[np.random.Generator], Planner] = TablePlanner
    source: str = "table"
    grade: Grade = "description"
    guide: Callable[[Request, Chamber], Guide] | None = None

    def propose(self, request: Request) -> Layout:
        """Return SceneWeaver's scene in the largest laboratory space."""
        chamber = chambers(request)[0]
        scene, history = self.run(request, chamber)
        last = history[-1].critique
        options = {
            "designer": self.source,
            "steps": len(history),
            "rolled_back": sum(not step.kept for step in history),
            "grades": {name: round(grade, 2) for name, grade in last.grades.items()},
        }
        return layout_of(request, [(chamber, list(scene.pieces()))], self.name, options)

    def run(self, request: Request, chamber: Chamber) -> tuple[WeaverScene, list[WeaverStep]]:
        """Return the final scene of a space, and the steps that led to it."""
        generator = generator_of(request, STREAM)
        named = named_to(request, self.grade)
        guide = None if self.guide is None else self.guide(request, chamber)
        toolbox = Toolbox(request, chamber, generator, Counter(numbers_in_use(request)), guide)
        scene = settle(toolbox.initial(_first(self.designer(request, generator), chamber)), chamber)
        history = [WeaverStep(None, True, critique(scene, chamber, named))]
        planner = self.planner(generator)
        while len(history) < self.steps - 1:
            before = history[-1].critique
            action = planner.choose(before)
            if action is None:
                break
            proposal = settle(toolbox.act(scene, action, before), chamber)
            after = critique(proposal, chamber, named)
            kept = not after.worse_than(before)
            if not kept or action.problem in after.problems:
                planner.failed(action)
            if kept:
                scene = proposal
            history.append(WeaverStep(action, kept, after if kept else before))
        return cleared(scene, chamber), history


def _first(plan: DesignPlan, chamber: Chamber) -> list[Large]:
    """The large objects of the initial scene: the first request's, without what stands on them."""
    return [one for one in plan.large if one.wish < 2 and one.asset.size.height <= chamber.ground.ceiling]
