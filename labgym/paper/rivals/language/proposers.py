"""The rivals with a language model, also as SceneWeaver's planner, as proposers that are made without arguments."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field

from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.llm.client import LanguageModel
from labgym.llm.prompting import load_prompt
from labgym.llm.rounds import ask_with_repairs
from labgym.paper.rivals.holodeck import HolodeckProposer
from labgym.paper.rivals.language.designer import PROMPTS, SEEDS, ChosenStep, ModelDesigner
from labgym.paper.rivals.reading import description
from labgym.paper.rivals.sceneweaver import SceneWeaverProposer
from labgym.paper.rivals.sceneweaver.critic import Critique
from labgym.paper.rivals.sceneweaver.policy import CONFIDENCE, WeaverAction


@dataclass(frozen=True)
class HolodeckLanguageProposer:
    """Holodeck with a language model as the designer.

    Attributes:
        model: the client; by default the one that the environment configures.
    """

    model: LanguageModel | None = None
    name: str = "holodeck-llm"
    structured: bool = False

    def propose(self, request: Request) -> Layout:
        """Return Holodeck's scene for the plan that the model lists.

        Raises:
            LanguageModelError: no model is configured or reachable, or its reply is not of the form.
        """
        with _client(self.model) as model:
            designer = ModelDesigner(model, self.structured)
            return HolodeckProposer(designer, name=self.name, source=model.config.model).propose(request)


@dataclass(frozen=True)
class HolodeckPlusLanguageProposer(HolodeckLanguageProposer):
    """Holodeck+ with a language model as the designer."""

    name: str = "holodeck+-llm"
    structured: bool = True


@dataclass(frozen=True)
class SceneWeaverLanguageProposer:
    """SceneWeaver with a language model for the initial list and as the planner.

    Attributes:
        model: the client; by default the one that the environment configures.
    """

    model: LanguageModel | None = None
    name: str = "sceneweaver-llm"

    def propose(self, request: Request) -> Layout:
        """Return SceneWeaver's scene, planned by the model; grades and the contents of a step are as without one.

        Raises:
            LanguageModelError: no model is configured or reachable, or its reply is not of the form.
        """
        with _client(self.model) as model:
            purpose = description(request.protocol)
            rival = SceneWeaverProposer(
                name=self.name,
                designer=ModelDesigner(model),
                planner=lambda _: ModelPlanner(model, purpose, request.seed % SEEDS),
                source=model.config.model,
            )
            return rival.propose(request)


def _client(model: LanguageModel | None) -> AbstractContextManager[LanguageModel]:
    return LanguageModel.from_environment() if model is None else nullcontext(model)


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
