"""The operations of a work-up: those of the text, completed by what they and the reaction need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from labgym.assets import Asset, Catalog
from labgym.protocols.amounts import figure
from labgym.protocols.synthesis.phases import ReactionMixture, WorkUpStep, completed
from labgym.protocols.synthesis.reading import Clause
from labgym.protocols.synthesis.roles import ASSUMED, SOLVENTS
from labgym.protocols.synthesis.transformations import Transformation

PURIFYING = ("Recrystallize", "Crystallize", "Chromatograph", "Distill", "DrySolid", "DryVacuum")
SOLID = ("Filter", "Recrystallize", "Crystallize")
ACTIONS = frozenset(
    {
        *("Quench", "Acidify", "Basify", "Dissolve", "Extract", "PhaseSeparation", "Wash", "DrySolution", "Filter"),
        *("Concentrate", "Recrystallize", "Crystallize", "Distill", "Chromatograph", "DrySolid", "DryVacuum"),
    }
)
"""Actions of a work-up."""
WORKING_UP = ("Extract", "Wash", "Filter", "Concentrate", "DrySolution")
MIXED = {"Chromatograph": 200.0, "Extract": 60.0}
"""Assumed volumes of mixtures whose ratio the text gives, by action, mL; 40 mL for the others."""


def work_up_steps(
    kind: Transformation, clauses: Sequence[Clause], mixture: ReactionMixture, catalog: Catalog
) -> tuple[WorkUpStep, ...]:
    """Return the operations after the reaction: those of the text, completed by what they and the reaction need."""
    steps = _settled([step for clause in clauses for step in _steps_of(clause, catalog)])
    usual = usual_steps(kind, catalog)
    if kind.action == "Distill" and steps and steps[0].action == "Distill":
        steps = steps[1:]
    actions = [step.action for step in steps]
    reactive = any(_is_reactive(reagent) for reagent in mixture.reagents)
    isolated = actions[:1] in (["Filter"], ["Concentrate"], ["Crystallize"], ["Distill"]) and not reactive
    if not isolated and not any(action in ("Quench", "Acidify", "Basify") for action in actions):
        steps = [*usual["quench"], *steps]
    if _reducing(kind) and "Quench" not in actions and "Acidify" in actions:
        # Acid releases chlorine from residual oxidizer or manganese dioxide.
        steps = [*usual["quench"], *usual["workup"][:1], *steps]
    if not any(action in WORKING_UP for action in actions):
        at = next((i for i, step in enumerate(steps) if step.action in PURIFYING), len(steps))
        steps = [*steps[:at], *usual["workup"], *steps[at:]]
    if not any(action in PURIFYING for action in actions):
        steps = [*steps, *(usual["purify"] if mixture.distilled else _finish(actions, usual["purify"]))]
    names = [step.action for step in steps]
    if "Extract" in names and not {"Concentrate", "Distill"} & set(names):
        at = max(i for i, name in enumerate(names) if name in ("Extract", "Wash", "DrySolution")) + 1
        steps.insert(at, WorkUpStep("Concentrate"))
    extract = _first(usual["workup"], "Extract") or parsed_step("extract:EthylAcetate", catalog)
    dry = _first(usual["workup"], "DrySolution") or parsed_step("dry:MagnesiumSulfate", catalog)
    return tuple(completed(steps, mixture, extract, dry))


def _first(steps: Sequence[WorkUpStep], action: str) -> WorkUpStep | None:
    return next((step for step in steps if step.action == action), None)


def _finish(actions: Sequence[str], usual: Sequence[WorkUpStep]) -> Sequence[WorkUpStep]:
    """Return the default last steps; if the text describes a work-up, the product is only dried."""
    worked_up = [action for action in actions if action in WORKING_UP]
    if not worked_up:
        return usual
    return [WorkUpStep("DrySolid" if worked_up[-1] == "Filter" else "DryVacuum")]


def _reducing(kind: Transformation) -> bool:
    """Return whether the reaction is ended by destroying an oxidizer."""
    return kind.quench is not None and kind.quench.asset in ("SodiumSulfite", "SodiumBisulfite", "SodiumThiosulfate")


def _settled(steps: Sequence[WorkUpStep]) -> list[WorkUpStep]:
    """Return steps with those after a solid adapted to it: it is rinsed on the filter and dried in the oven."""
    settled: list[WorkUpStep] = []
    for step in steps:
        solid = bool(settled) and settled[-1].action in SOLID
        if solid and step.action == "DrySolution" and not step.reagents:
            step = replace(step, action="DrySolid")
        elif solid and step.action == "Wash":
            step = replace(step, action="Filter")
        settled.append(step)
    return settled


def _is_reactive(reagent: Asset) -> bool:
    """Return whether excess reagent has to be destroyed before the mixture is worked up."""
    chemistry = reagent.chemistry
    return reagent.hazards.oxidizer or (chemistry is not None and chemistry.water_reactive)


def _step(clause: Clause, catalog: Catalog) -> WorkUpStep | None:
    operation = clause.operation
    if operation is None or operation.action not in ACTIONS:
        return None
    names = [name for name in clause.names("reagent") if name not in clause.removed]
    reagents = tuple((catalog.get(name), _amount(clause, name)) for name in names)
    if not reagents and "水洗" in clause.text:
        reagents = ((catalog.get("DeionizedWater"), ""),)
    devices = clause.names("instrument")
    return WorkUpStep(operation.action, reagents, clause.temperature, clause.duration, devices, clause.text)


def _steps_of(clause: Clause, catalog: Catalog) -> tuple[WorkUpStep, ...]:
    """Return the steps of a clause: an extraction that also names what the layer is washed with is two."""
    step = _step(clause, catalog)
    if step is None:
        return ()
    if step.action == "Extract" and step.of(*SOLVENTS):
        washes = tuple(item for item in step.reagents if item not in step.of(*SOLVENTS))
        wash = (replace(step, action="Wash", reagents=washes, duration=None),) if washes else ()
        return (replace(step, reagents=step.of(*SOLVENTS)), *wash)
    return (step,)


def _amount(clause: Clause, name: str) -> str:
    """Return the amount of a reagent in a clause; a concentration alone is combined with the usual volume."""
    strength = clause.strengths.get(name, "")
    share = next((share for ratio in clause.mixtures for liquid, share in ratio if liquid == name), None)
    if share is not None and name not in clause.amounts:
        action = clause.operation.action if clause.operation else ""
        return f"{figure(share * MIXED.get(action, 40.0))} mL{ASSUMED}"
    return clause.amounts.get(name, "") or (f"40 mL of {strength}{ASSUMED}" if strength else "")


def usual_steps(kind: Transformation, catalog: Catalog) -> dict[str, list[WorkUpStep]]:
    """Return the quench, the work-up and the purification that are usual for a kind of reaction."""
    quench = []
    if kind.quench is not None:
        quench = [WorkUpStep(kind.quench.action, ((catalog.get(kind.quench.asset), ""),))]
    return {
        "quench": quench,
        "workup": [parsed_step(text, catalog) for text in kind.workup],
        "purify": [parsed_step(kind.purify, catalog)],
    }


def parsed_step(text: str, catalog: Catalog) -> WorkUpStep:
    """Return the step that an entry of the table describes, as "wash:SodiumChloride"."""
    word, _, names = text.partition(":")
    return WorkUpStep(_TABLE_WORDS[word], tuple((catalog.get(name), "") for name in names.split("+") if name))


_TABLE_WORDS = {
    "extract": "Extract",
    "wash": "Wash",
    "dry": "DrySolution",
    "filter": "Filter",
    "acidify": "Acidify",
    "concentrate": "Concentrate",
    "recrystallise": "Recrystallize",
    "crystallise": "Crystallize",
    "chromatograph": "Chromatograph",
    "distil": "Distill",
    "vacuum": "DryVacuum",
}
"""Actions by the words of the table of transformations."""
