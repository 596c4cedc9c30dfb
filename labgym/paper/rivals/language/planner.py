"""A language model as SceneWeaver's planner."""

from __future__ import annotations

from dataclasses import dataclass, field

from labgym.llm.client import LanguageModel
from labgym.llm.prompting import load_prompt
from labgym.llm.rounds import ask_with_repairs
from labgym.paper.rivals.language.answers import ChosenStep
from labgym.paper.rivals.language.designer import PROMPTS
from labgym.paper.rivals.sceneweaver.critic import Critique
from labgym.paper.rivals.sceneweaver.policy import CONFIDENCE, WeaverAction

MOST = 100
"""Greatest number of problems that the model is shown."""


@dataclass
class ModelPlanner:
    """Asks a language model for each step.

    Attributes:
        purpose: description of the room. seed: random seed of the questions.
        failures: steps that were rolled back or did not solve their problem.
    """

    model: LanguageModel
    purpose: str
    seed: int = 0
    failures: list[WeaverAction] = field(default_factory=list)

    def choose(self, critique: Critique) -> WeaverAction | None:
        """Return the step that the model chooses; None if it stops or names no problem of the list.

        A tool that does not fit the fault is replaced by the first one that does.

        Raises:
            LanguageModelError: no reply, or still none of the form after the repairs.
        """
        problems = critique.problems[:MOST]
        if not problems:
            return None
        prompt = load_prompt(PROMPTS / "improve_scene.md")
        messages = prompt.fill(
            purpose=self.purpose,
            grades={name: round(grade, 2) for name, grade in critique.grades.items()},
            problems=[[number, one.criterion, one.fault, one.subject] for number, one in enumerate(problems)],
            tools={fault: list(tools) for fault, tools in CONFIDENCE.items()},
            failures=[[one.problem.fault, one.problem.subject, one.tool] for one in self.failures],
        )
        answer = ask_with_repairs(self.model, prompt.label, messages, ChosenStep, seed=self.seed).answer
        if answer.stop or answer.problem >= len(problems):
            return None
        problem = problems[answer.problem]
        fitting = CONFIDENCE[problem.fault]
        return WeaverAction(problem, answer.tool if answer.tool in fitting else next(iter(fitting)))

    def failed(self, action: WeaverAction) -> None:
        """Remember a step for the next question."""
        self.failures.append(action)
