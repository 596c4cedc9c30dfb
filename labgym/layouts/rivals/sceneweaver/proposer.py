"""SceneWeaver as a proposer: initial scene, reflect and act up to 15 steps, physics, roll back.

SceneWeaver (Yang and others, NeurIPS 2025, arXiv 2509.20414; code: Scene-Weaver/SceneWeaver) lets a language model
choose one tool a step, driven by a critic that grades pictures. Here a seeded policy chooses, rules grade, and the
request gives the room. Published: a step is rolled back if the sum of four grades falls by 5 or more (`check_valid`);
here if it falls at all, which is the paper's intention without the noise of a language model's grades.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from labgym.assets import Asset
from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.layouts.rivals import household
from labgym.layouts.rivals.chamber import Chamber, chambers
from labgym.layouts.rivals.household import Choice
from labgym.layouts.rivals.piece import layout_of
from labgym.layouts.rivals.randomness import generator_of, numbers_in_use
from labgym.layouts.rivals.reading import assets_in, description
from labgym.layouts.rivals.sceneweaver.critic import Critique, critique
from labgym.layouts.rivals.sceneweaver.physics import cleared, settle
from labgym.layouts.rivals.sceneweaver.policy import Action, Planner, TablePlanner
from labgym.layouts.rivals.sceneweaver.scene import Scene
from labgym.layouts.rivals.sceneweaver.tools import Toolbox

STEPS = 15
"""Greatest number of steps, the initial scene and the end included (`max_steps`)."""
STREAM = 0x5CE
"""Sub-stream of the seed."""


@dataclass(frozen=True)
class Step:
    """One step of a run: what was tried, whether it was kept, and the critique of the scene that remains."""

    action: Action | None
    kept: bool
    critique: Critique


@dataclass(frozen=True)
class SceneWeaverProposer:
    """SceneWeaver with a description of the experiment; deterministic."""

    name: str = "sceneweaver"
    steps: int = STEPS

    def propose(self, request: Request) -> Layout:
        """Return SceneWeaver's scene in the largest laboratory space."""
        chamber = chambers(request)[0]
        scene, history = self.run(request, chamber)
        last = history[-1].critique
        options = {
            "designer": "table",
            "steps": len(history),
            "rolled_back": sum(not step.kept for step in history),
            "grades": {name: round(grade, 2) for name, grade in last.grades.items()},
        }
        return layout_of(request, [(chamber, list(scene.pieces()))], self.name, options)

    def run(self, request: Request, chamber: Chamber) -> tuple[Scene, list[Step]]:
        """Return the final scene of a space, and the steps that led to it."""
        generator = generator_of(request, STREAM)
        named = assets_in(description(request.protocol), request.catalog)
        toolbox = Toolbox(request, chamber, generator, Counter(numbers_in_use(request)))
        scene = settle(toolbox.initial(_listed(request, chamber, named, generator)), chamber)
        history = [Step(None, True, critique(scene, chamber, named))]
        planner: Planner = TablePlanner(generator)
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
            history.append(Step(action, kept, after if kept else before))
        return cleared(scene, chamber), history


def _listed(
    request: Request, chamber: Chamber, named: tuple[Asset, ...], generator: np.random.Generator
) -> list[tuple[Asset, Choice | None]]:
    """Large objects of the initial scene: drawn from the table, and those that the description names."""
    objects: list[tuple[Asset, Choice | None]] = []
    for choice in household.FLOOR:
        count = int(generator.integers(choice.least, choice.most + 1)) if generator.random() < choice.chance else 0
        objects += [(request.catalog.get(choice.asset), choice)] * count
    present = {asset.role for asset, _ in objects}
    objects += [(asset, None) for asset in named if asset.placing == "floor" and asset.role not in present]
    return [entry for entry in objects if entry[0].size.height <= chamber.ground.ceiling]
