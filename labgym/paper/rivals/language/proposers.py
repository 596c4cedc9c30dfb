"""The rivals with a language model, also as SceneWeaver's planner, as proposers that are made without arguments."""

from __future__ import annotations

import io
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field

from labgym.assets import Asset
from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.llm.client import LanguageModel
from labgym.llm.prompting import load_prompt
from labgym.llm.rounds import ask_with_repairs
from labgym.paper.rivals.chamber import Chamber
from labgym.paper.rivals.holodeck import HolodeckProposer
from labgym.paper.rivals.language.designer import PROMPTS, SEEDS, ChosenStep, ListedSurface, ModelDesigner, small_assets
from labgym.paper.rivals.piece import RivalPiece, layout_of
from labgym.paper.rivals.reading import description
from labgym.paper.rivals.sceneweaver import SceneWeaverProposer
from labgym.paper.rivals.sceneweaver.critic import Critique, Fault
from labgym.paper.rivals.sceneweaver.policy import CONFIDENCE, Tool, WeaverAction
from labgym.paper.rivals.sceneweaver.scene import WeaverScene
from labgym.scenes.tracing import trace_view
from labgym.scenes.views import view


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
        sees: whether it takes pictures, so that there is the tool `picture`.
    """

    model: LanguageModel | None = None
    name: str = "sceneweaver-llm"
    sees: bool = False

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
                planner=lambda _: ModelPlanner(model, purpose, request.seed % SEEDS, self.sees),
                source=model.config.model,
                guide=(lambda _, chamber: PictureGuide(model, request, chamber)) if self.sees else None,
            )
            return rival.propose(request)


def _client(model: LanguageModel | None) -> AbstractContextManager[LanguageModel]:
    return LanguageModel.from_environment() if model is None else nullcontext(model)


PICTURE = (512, 384, 2)
"""Width and height of a picture, pixels, and rays per pixel."""
MOST = 100
"""Greatest number of problems that the model is shown."""


@dataclass
class ModelPlanner:
    """Asks a language model for each step.

    Attributes:
        purpose: description of the room. seed: random seed of the questions. sees: whether there is the tool `picture`.
        failures: steps that were rolled back or did not solve their problem.
    """

    model: LanguageModel
    purpose: str
    seed: int = 0
    sees: bool = False
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
        fitting: dict[Fault, tuple[Tool, ...]] = {fault: tuple(tools) for fault, tools in CONFIDENCE.items()}
        if self.sees:
            fitting["bare"] = ("picture", *fitting["bare"])
        prompt = load_prompt(PROMPTS / "improve_scene.md")
        messages = prompt.fill(
            purpose=self.purpose,
            grades={name: round(grade, 2) for name, grade in critique.grades.items()},
            problems=[[number, one.criterion, one.fault, one.subject] for number, one in enumerate(problems)],
            tools=fitting,
            failures=[[one.problem.fault, one.problem.subject, one.tool] for one in self.failures],
        )
        answer = ask_with_repairs(self.model, prompt.label, messages, ChosenStep, seed=self.seed).answer
        if answer.stop or answer.problem >= len(problems):
            return None
        problem = problems[answer.problem]
        tools = fitting[problem.fault]
        return WeaverAction(problem, answer.tool if answer.tool in tools else tools[0])

    def failed(self, action: WeaverAction) -> None:
        """Remember a step for the next question."""
        self.failures.append(action)


@dataclass(frozen=True)
class PictureGuide:
    """Shows a vision-language model a piece of furniture in the scene, and takes what it would put on it."""

    model: LanguageModel
    request: Request
    chamber: Chamber

    def __call__(self, scene: WeaverScene, parent: RivalPiece) -> list[Asset]:
        """Return the small objects that the model lists.

        Raises:
            LanguageModelError: no reply, or still none of the form after the repairs.
        """
        from PIL import Image

        layout = layout_of(self.request, [(self.chamber, list(scene.pieces()))], "picture", {})
        stream = io.BytesIO()
        Image.fromarray(trace_view(layout, view(layout, parent.id), *PICTURE)).save(stream, "png")
        prompt = load_prompt(PROMPTS / "fill_surface.md")
        purpose = description(self.request.protocol)
        messages = prompt.fill([stream.getvalue()], purpose=purpose, furniture=parent.asset.name)
        seed = self.request.seed % SEEDS
        reply = ask_with_repairs(self.model, prompt.label, messages, ListedSurface, seed=seed)
        return small_assets(reply.answer.objects, self.request.catalog)
