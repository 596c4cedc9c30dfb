"""The mixture during the work-up: which layer exists, whether it is wet, and what a step therefore needs before it.

No layer is washed before there is one; a wet layer is dried before it is evaporated or distilled; the solvent goes
before a residue is distilled, chromatographed or recrystallized; a supported catalyst is filtered off first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from labgym.assets import Asset
from labgym.protocols.rules.conditions import MISCIBLE, STEAM, SUPPORTED
from labgym.protocols.synthesis.roles import SOLVENTS, Participant

ENDING = ("Quench", "Acidify", "Basify")
FINISHING = ("Distill", "Chromatograph", "Recrystallize", "DryVacuum")
EXTRACTABLE_ML, STRIPPED_BELOW_C = 120.0, 90.0
"""Volume of a mixture that still fits the separating funnel, mL; boiling point of what is stripped, degrees Celsius."""
CONDENSED = ("Recrystallize", "Crystallize", "DrySolid")


@dataclass(frozen=True)
class WorkUpStep:
    """An operation after the reaction.

    Attributes:
        action: name of the action.
        reagents: reagents with amounts as written, "" without an amount.
        temperature: degrees Celsius, if the text gives it.
        duration: minutes, if the text gives it.
        devices: instruments that the text names.
        text: the clause that it comes from, "" if it is assumed.
        keep: "filtrate" or "solid", for a filtration; "filtered" for crystals that the next step collects.
    """

    action: str
    reagents: tuple[tuple[Asset, str], ...] = ()
    temperature: float | None = None
    duration: float | None = None
    devices: tuple[str, ...] = ()
    text: str = ""
    keep: str = ""

    def of(self, *categories: str) -> tuple[tuple[Asset, str], ...]:
        """Return the reagents of some categories."""
        return tuple(item for item in self.reagents if item[0].category in categories)


@dataclass(frozen=True)
class ReactionMixture:
    """The reaction mixture at the end of the reaction.

    Attributes:
        reagents: everything in it.
        solvents: its organic liquids that serve as solvents.
        hottest: temperature of the reaction, degrees Celsius.
        vessel: name of its flask.
        volume: mL.
        distilled: whether the product was distilled off as it formed.
    """

    reagents: tuple[Asset, ...]
    solvents: tuple[Asset, ...]
    hottest: float
    vessel: str
    volume: float
    distilled: bool = False

    @classmethod
    def of(
        cls, parts: Sequence[Participant], hottest: float, vessel: str, volume: float, distilled: bool
    ) -> ReactionMixture:
        """Return the mixture of the participants of a reaction."""
        solvents = tuple(part.asset for part in parts if "solvent" in part.role and part.asset.category in SOLVENTS)
        return cls(tuple(part.asset for part in parts), solvents, hottest, vessel, volume, distilled)

    @property
    def has_layer(self) -> bool:
        """Whether an organic liquid in it forms a layer on water; a distilled product does."""
        return self.distilled or any(
            asset.name not in MISCIBLE and asset.category == "organic_solvent" for asset in self.solvents
        )

    @property
    def is_strippable(self) -> bool:
        """Whether it is mostly a volatile solvent that mixes with water, too much of it to extract from."""
        points = [asset.boiling_point for asset in self.solvents if asset.name in MISCIBLE]
        volatile = any(point is not None and point < STRIPPED_BELOW_C for point in points)
        return volatile and self.volume > EXTRACTABLE_ML and not self.has_layer

    @property
    def has_supported_catalyst(self) -> bool:
        """Whether a supported metal has to be filtered off."""
        return any(SUPPORTED in asset.groups for asset in self.reagents)


@dataclass
class _State:
    layer: bool
    catalyst: bool
    strippable: bool
    water: bool = False
    wet: bool = False
    solid: bool = False
    residue: bool = False
    isolated: bool = False
    neat: bool = False


def completed(
    steps: Sequence[WorkUpStep], mixture: ReactionMixture, extract: WorkUpStep, dry: WorkUpStep
) -> list[WorkUpStep]:
    """Return the steps of a work-up with those that they need before them.

    Args:
        extract, dry: the extraction and the drying that are usual for the reaction.
    """
    state = _State(mixture.has_layer, mixture.has_supported_catalyst, mixture.is_strippable, neat=mixture.distilled)
    done: list[WorkUpStep] = []
    for position, step in enumerate(steps):
        rest = steps[position + 1 :]
        if step.action == "Quench" and state.residue:
            step = replace(step, keep="residue")
        for needed in _needed(step, rest, state, extract, dry):
            _apply(needed, state)
            done.append(needed)
        if step.action == "Crystallize" and rest and rest[0].action == "Filter":
            step = replace(step, keep="filtered")
        if step.action == "Filter":
            step = replace(step, keep=_kept(step, rest, state))
        if _is_repeated(step, done):
            continue
        _apply(step, state)
        done.append(step)
    return done


def _needed(
    step: WorkUpStep, rest: Sequence[WorkUpStep], state: _State, extract: WorkUpStep, dry: WorkUpStep
) -> list[WorkUpStep]:
    """Return what has to be done before a step."""
    needed: list[WorkUpStep] = []
    action = step.action
    if state.catalyst and action in (*ENDING, "Extract", "Wash", "Concentrate", *FINISHING, "DrySolution"):
        needed.append(_celite())
    if action == "Extract" and state.strippable and not state.residue:
        needed.append(WorkUpStep("Concentrate"))
    if action == "Wash" and state.residue:
        needed.append(replace(extract, action="Dissolve"))
    elif action in ("Wash", "DrySolution") and not state.layer and not state.solid:
        needed.append(extract)
    oil = action in ("Distill", "Chromatograph", "DryVacuum")
    oil = oil and not (action == "Distill" and STEAM.search(step.text))
    later = any(item.action in ("Extract", "Filter", "Acidify", "Quench", "Crystallize") for item in rest)
    stripped = action == "Concentrate" and not later
    if (oil or stripped) and state.water and not state.wet and not state.solid:
        separable = state.layer
        needed.append(WorkUpStep("PhaseSeparation") if separable else extract)
        needed.append(dry)
    elif action == "DrySolution" and state.water and not state.wet and state.layer:
        needed.append(WorkUpStep("PhaseSeparation"))
    elif (oil or action in ("Concentrate", "Recrystallize")) and state.wet and not state.solid:
        needed.append(dry)
    extracted = any(item.action in ("Extract", "Wash", "DrySolution") for item in needed) or state.isolated
    if action in FINISHING and extracted and not (state.residue or state.solid or state.neat):
        needed.append(WorkUpStep("Concentrate"))
    return needed


def _apply(step: WorkUpStep, state: _State) -> None:
    action = step.action
    if action in ENDING:
        state.water = True
    elif action == "Extract":
        state.layer, state.wet, state.water, state.isolated, state.residue = True, True, False, True, False
        state.neat = False
    elif action == "PhaseSeparation" or action == "Wash":
        state.wet, state.water, state.isolated = True, False, True
    elif action == "Dissolve":
        state.layer, state.residue, state.isolated, state.neat = True, False, True, False
    elif action == "DrySolution":
        state.wet, state.isolated = False, True
    elif action == "Concentrate":
        state.residue, state.layer, state.strippable = True, False, False
    elif action == "Filter":
        state.catalyst = False
        if step.keep == "solid":
            state.solid, state.water, state.wet = True, False, False
    elif action in CONDENSED:
        state.solid, state.water, state.wet = True, False, False
    elif action == "Distill":
        state.residue, state.layer, state.water, state.wet, state.isolated = False, True, False, False, False


def _kept(step: WorkUpStep, rest: Sequence[WorkUpStep], state: _State) -> str:
    """Return the fraction that a filtration keeps: the filtrate if the next step needs a liquid, else the solid."""
    after = rest[0].action if rest else ""
    liquid = after in ("Extract", "Concentrate", "DrySolution", "Acidify", "Distill", "Basify", "Quench")
    return "filtrate" if liquid or step.of("adsorbent") or state.catalyst else "solid"


def _is_repeated(step: WorkUpStep, done: Sequence[WorkUpStep]) -> bool:
    """Return whether the previous step includes a step, as crystallizing includes collecting the crystals."""
    last = done[-1] if done else None
    if last is None:
        return False
    collected = step.action == "Filter" and not step.reagents and last.action == "Recrystallize"
    dried = step.action == "Filter" and not step.reagents and last.action == "DrySolution"
    return collected or dried


def _celite() -> WorkUpStep:
    return WorkUpStep("Filter", keep="filtrate", devices=("Celite",))
