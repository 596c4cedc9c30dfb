"""The interface of proposers, and proposers by name."""

from __future__ import annotations

import typing
from pkgutil import resolve_name

from labgym.errors import UnknownNameError
from labgym.layouts.interiors import FloorProposer
from labgym.layouts.model import Layout
from labgym.layouts.request import Request

SOLVER = "solver"
"""Name of the default: planning habits and a constraint solver."""
PROPOSERS: dict[str, str] = {
    "holodeck": "labgym.paper.rivals:HolodeckProposer",
    "holodeck+": "labgym.paper.rivals:HolodeckPlusProposer",
    "holodeck+-llm": "labgym.paper.rivals.language:HolodeckPlusLanguageProposer",
    "holodeck-llm": "labgym.paper.rivals.language:HolodeckLanguageProposer",
    "llm": "labgym.layouts.language:LanguageProposer",
    "sampler": "labgym.paper.sampler:SamplerProposer",
    "sceneweaver": "labgym.paper.rivals:SceneWeaverProposer",
    "sceneweaver-llm": "labgym.paper.rivals.language:SceneWeaverLanguageProposer",
}
"""Module and class of each other proposer; the class is made without arguments, and its module imported only then."""
ALIASES = {"holodeck-plus-llm": "holodeck+-llm"}
"""Other spellings that are accepted."""


class Proposer(typing.Protocol):
    """Makes a first layout (phase 1 of LabGen), which the later phases repair and verify."""

    def propose(self, request: Request) -> Layout:
        """Return a layout that holds everything the protocol requires; it may violate rules."""


def proposer_names() -> tuple[str, ...]:
    """Return the names of all proposers."""
    return SOLVER, *sorted(PROPOSERS)


def check_proposer(name: str) -> None:
    """Check that a proposer exists, without importing it.

    Raises:
        UnknownNameError: no proposer has that name; lists all.
    """
    if name not in proposer_names() and name not in ALIASES:
        raise UnknownNameError("proposer", name, proposer_names())


def make_proposer(name: str) -> Proposer:
    """Return the proposer of a name.

    Raises:
        UnknownNameError: no proposer has that name; lists all.
    """
    check_proposer(name)
    if name == SOLVER:
        return FloorProposer()
    return typing.cast(Proposer, resolve_name(PROPOSERS[ALIASES.get(name, name)])())
