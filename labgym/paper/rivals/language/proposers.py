"""The rivals with a language model, as proposers that are made without arguments."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass

from labgym.layouts.model import Layout
from labgym.layouts.request import Request
from labgym.llm.client import LanguageModel
from labgym.paper.rivals.holodeck import HolodeckProposer
from labgym.paper.rivals.language.designer import SEEDS, ModelDesigner
from labgym.paper.rivals.language.planner import ModelPlanner
from labgym.paper.rivals.reading import description
from labgym.paper.rivals.sceneweaver import SceneWeaverProposer


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
