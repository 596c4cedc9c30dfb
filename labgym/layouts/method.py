"""How a layout is made from a request: proposers and adjusters by name, and the phases."""

from __future__ import annotations

import typing
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Any, Literal, get_args

from labgym.errors import OptionError, UnknownNameError, check_name, refuse_idle
from labgym.layouts.adjust import Adjuster
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
RULES = "rules"
"""Name of the default: rules and search."""
ADJUSTERS: dict[str, str] = {
    RULES: "labgym.layouts.adjust:RuleAdjuster",
    "llm": "labgym.layouts.language:LanguageAdjuster",
}
"""Module and class of each adjuster; the class is made without arguments, and its module imported only then."""


class Proposer(typing.Protocol):
    """Makes a first layout (phase 1 of LabGen), which the later phases repair and verify."""

    def propose(self, request: Request) -> Layout:
        """Return a layout that holds everything the protocol requires; it may violate rules."""


def proposer_names() -> tuple[str, ...]:
    """Return the names of all proposers."""
    return SOLVER, *sorted(PROPOSERS)


def make_proposer(name: str) -> Proposer:
    """Return the proposer of a name.

    Raises:
        UnknownNameError: no proposer has that name; lists all.
    """
    _check_proposer(name)
    if name == SOLVER:
        return FloorProposer()
    return typing.cast(Proposer, resolve_name(PROPOSERS[ALIASES.get(name, name)])())


def make_adjuster(name: str) -> Adjuster:
    """Return the adjuster of a name.

    Raises:
        UnknownNameError: no adjuster has that name; lists all.
    """
    _check_adjuster(name)
    return typing.cast(Adjuster, resolve_name(ADJUSTERS[name])())


def _check_proposer(name: str) -> None:
    """Check that a proposer exists, without importing it."""
    if name not in proposer_names() and name not in ALIASES:
        raise UnknownNameError("proposer", name, proposer_names())


def _check_adjuster(name: str) -> None:
    check_name("adjuster", name, ADJUSTERS)


Dressing = Literal["solver", "always", "never"]
OnFailure = Literal["raise", "keep"]
MODEL = "llm"
"""End of the names of proposers and adjusters that ask a language model."""


@dataclass(frozen=True)
class Method:
    """The proposer of a layout, and the phases that follow. The default is that of published layouts.

    Attributes:
        proposer: name of a proposer, or the object.
        optimise: whether to repair and adjust the proposal. If not, the refinement does not repair its updates either.
        refine: whether to refine the layout for navigation; without it the optimization clears no ways either.
        adjuster: name of an adjuster, or the object.
        dress: whether to add accessories and safety equipment that no protocol requires: only to what the solver
            proposes, so that other proposers are judged by what they propose themselves; always; or never.
        zones: whether the proposal gets functional zones and an assignment of the steps to them, if it has none.
        on_failure: whether a layout that still violates rules or lacks required assets is an error, or is kept.
        facility: whether the optimization follows the facility rules (fronts, door areas, backs to walls, ways out)
            and a failing layout is repaired. If not, the cost is v(L), and only the refinement considers navigation;
            required assets that the proposal lacks are still added, unlike in the paper's phases (`labgym.paper.pure`).

    Raises:
        UnknownNameError: no proposer or adjuster has that name.
        OptionError: `dress` or `on_failure` has another value, or an adjuster is named without `optimise`.
    """

    proposer: str | Proposer = SOLVER
    optimise: bool = True
    refine: bool = True
    adjuster: str | Adjuster = RULES
    dress: Dressing = "solver"
    on_failure: OnFailure = "raise"
    zones: bool = False
    facility: bool = True

    def __post_init__(self) -> None:
        if isinstance(self.proposer, str):
            _check_proposer(self.proposer)
        if isinstance(self.adjuster, str):
            _check_adjuster(self.adjuster)
        idle = self.adjuster != RULES and not self.optimise
        refuse_idle((("adjuster", idle, "with optimise=False, which adjusts nothing"),))
        _check("dress", self.dress, get_args(Dressing))
        _check("on_failure", self.on_failure, get_args(OnFailure))

    def proposes_with(self) -> Proposer:
        """Return the object that proposes layouts."""
        return make_proposer(self.proposer) if isinstance(self.proposer, str) else self.proposer

    def adjusts_with(self) -> Adjuster:
        """Return the object that adjusts layouts."""
        return make_adjuster(self.adjuster) if isinstance(self.adjuster, str) else self.adjuster

    def dresses(self, proposer: Proposer) -> bool:
        """Return whether accessories are added to what a proposer proposes."""
        if self.dress == "solver":
            return isinstance(proposer, FloorProposer)
        return self.dress == "always"

    @property
    def repairs(self) -> bool:
        """Whether a layout that still fails after all phases is repaired."""
        return self.optimise and self.refine and self.facility

    @property
    def asks_model(self) -> bool:
        """Whether the named proposer or adjuster asks the configured language model."""
        return any(isinstance(name, str) and name.endswith(MODEL) for name in (self.proposer, self.adjuster))

    @property
    def options(self) -> dict[str, Any]:
        """The differences from the default, as plain data for provenance and for the identity of a run."""
        names = {
            name: value if isinstance(value, str | bool) else type(value).__name__ for name, value in vars(self).items()
        }
        default = {name: field.default for name, field in type(self).__dataclass_fields__.items()}
        return {name: value for name, value in names.items() if value != default[name]}


def _check(name: str, value: str, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise OptionError(f"{name} is {value!r}, expected one of {', '.join(allowed)}")


DEFAULT = Method()
