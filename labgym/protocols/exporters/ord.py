"""The Open Reaction Database: an experiment as a dataset of one reaction, in protocol buffers' JSON.

The additions at the beginning become inputs, the first holding after them the conditions, and every other action a
work-up. Remarks hold what the schema has no field for. The dataset has no provenance, which the database asks for.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import takewhile
from typing import Any

from labgym.protocols.experiments import Action, Experiment, Portion
from labgym.protocols.experiments.model import HOLDING, Keep, Manner, Role, Verb, holding
from labgym.protocols.experiments.remarks import BEFORE, write_portion, write_remark
from labgym.quantities import amounts
from labgym.units import SYMBOLS, Dimension

_WORKUPS: dict[Verb, str] = {
    "Add": "ADDITION",
    "AdjustPH": "PH_ADJUST",
    "Chromatograph": "FLASH_CHROMATOGRAPHY",
    "Concentrate": "CONCENTRATION",
    "Dissolve": "DISSOLUTION",
    "Distill": "DISTILLATION",
    "DrySolution": "DRY_WITH_MATERIAL",
    "Extract": "EXTRACTION",
    "Filter": "FILTRATION",
    "SetTemperature": "TEMPERATURE",
    "Stir": "STIRRING",
    "Wait": "WAIT",
    "Wash": "WASH",
}
_ROLES: dict[Role, str] = {
    "reactant": "REACTANT",
    "reagent": "REAGENT",
    "catalyst": "CATALYST",
    "solvent": "SOLVENT",
    "workup": "WORKUP",
}
_SPEEDS: dict[Manner, str] = {
    "dropwise": "DROPWISE",
    "portionwise": "PORTIONWISE",
    "slowly": "SLOW",
    "quickly": "FAST",
}
_PHASES: tuple[Keep, ...] = ("organic", "aqueous")
_MEASURES: dict[Dimension, tuple[str, str]] = {
    "mass": ("mass", "KILOGRAM GRAM MILLIGRAM MICROGRAM"),
    "volume": ("volume", "LITER MILLILITER MICROLITER NANOLITER"),
    "substance": ("moles", "MOLE MILLIMOLE MICROMOLE NANOMOLE"),
}
"""Dimensions of amounts, the best first: the field of the message, and its units."""
_ATMOSPHERES = ("nitrogen", "argon", "hydrogen", "air")
Message = dict[str, Any]


def written(experiment: Experiment) -> str:
    """Return the dataset; reading it back gives the experiment's actions."""
    return json.dumps(
        {
            "name": experiment.name,
            "description": experiment.description or experiment.name,
            "reactions": [_reaction(experiment)],
        },
        ensure_ascii=False,
        indent=1,
    )


def _reaction(experiment: Experiment) -> Message:
    actions = list(experiment.actions)
    if actions[-1].verb == "Yield" and not actions[-1].takes:
        actions.pop()
    before = list(takewhile(lambda action: not action.takes, actions))
    inputs = list(takewhile(lambda action: action.takes, actions[len(before) :]))
    rest = actions[len(before) + len(inputs) :]
    held = rest[0] if inputs and rest and rest[0].verb in HOLDING and not rest[0].takes else None
    materials = {material.name: material for material in experiment.materials}

    def component(portion: Portion) -> Message:
        material = materials[portion.name]
        amount, implied = _amount(portion.amount)
        remark = write_portion(portion, implied)
        return {
            "identifiers": _identifiers(material.name, material.smiles),
            "amount": amount,
            "reactionRole": _ROLES[material.role],
            **({"preparations": [{"type": "CUSTOM", "details": remark}]} if remark else {}),
        }

    def added(action: Action) -> Message:
        return {
            "components": [component(portion) for portion in action.takes],
            **({"additionSpeed": {"type": _SPEEDS[action.manner]}} if action.manner else {}),
        }

    outcome: Message = {"products": list(_products(experiment))}
    if held is not None and held.duration is not None:
        outcome["reactionTime"] = _time(held.duration)
    return {
        "reactionId": experiment.id,
        "identifiers": [{"type": "REACTION_SMILES", "value": experiment.reaction}] if experiment.reaction else [],
        "inputs": dict(
            _input(number, action, added(action), before if number == 1 else [])
            for number, action in enumerate(inputs, 1)
        ),
        **({"conditions": _conditions(held)} if held is not None else {}),
        "notes": {"procedureDetails": experiment.description},
        "workups": [_workup(action, added(action)) for action in rest if action is not held],
        "outcomes": [outcome],
    }


def _input(number: int, action: Action, added: Message, before: list[Action]) -> tuple[str, Message]:
    """Return an input with its key, which has the remarks on its action and on the actions before the first one."""
    more = {BEFORE: [item.model_dump(mode="json", exclude_defaults=True) for item in before]} if before else {}
    remark = write_remark(action, ("temperature", "duration", "manner"), "Add", **more)
    message = {**added, "additionOrder": number}
    if action.temperature is not None:
        message["additionTemperature"] = _degrees(action.temperature)
    if action.duration is not None:
        message["additionDuration"] = _time(action.duration)
    return f"{number:03d} {remark}".strip(), message


def _conditions(held: Action) -> Message:
    message: Message = {}
    implied, expressed = holding(held.temperature), ["temperature", "duration", "ph"]
    if held.temperature is not None:
        message["temperature"] = {"setpoint": _degrees(held.temperature)}
    if held.verb == "Reflux":
        message["reflux"], implied = True, held.verb
    elif held.verb == "Microwave":
        message.setdefault("temperature", {})["control"] = {"type": "MICROWAVE"}
        implied = held.verb
    pressure: Message = {}
    if held.atmosphere in _ATMOSPHERES:
        pressure["atmosphere"] = {"type": held.atmosphere.upper()}
        expressed.append("atmosphere")
    if held.pressure:
        pressure["setpoint"] = {"value": held.pressure, "units": "BAR"}
        expressed.append("pressure")
    remark = write_remark(held, expressed, implied)
    if not remark and not message and not pressure and held.duration is None and held.ph is None:
        remark = write_remark(held, expressed, None)
    return (
        message
        | ({"pressure": pressure} if pressure else {})
        | ({"ph": held.ph} if held.ph is not None else {})
        | ({"details": remark, "conditionsAreDynamic": True} if remark else {})
    )


def _workup(action: Action, added: Message) -> Message:
    kind, expressed = _WORKUPS.get(action.verb, "CUSTOM"), ["temperature", "duration", "ph"]
    message: Message = {}
    if action.verb == "DrySolid" and action.atmosphere == "vacuum":
        kind = "DRY_IN_VACUUM"
        expressed.append("atmosphere")
    if action.keep in _PHASES or (action.keep in ("filtrate", "precipitate") and action.verb == "Filter"):
        message["keepPhase"] = action.keep
        expressed.append("keep")
    if action.takes:
        message["input"] = added
        expressed.append("manner")
    if action.temperature is not None:
        message["temperature"] = {"setpoint": _degrees(action.temperature)}
    if action.duration is not None:
        message["duration"] = _time(action.duration)
    if action.ph is not None:
        message["targetPh"] = action.ph
    details = write_remark(action, expressed, None if kind == "CUSTOM" else action.verb)
    return {"type": kind, **({"details": details} if details else {}), **message}


def _products(experiment: Experiment) -> Iterator[Message]:
    smiles = experiment.reaction.rpartition(">")[2].split(".")[0]
    if experiment.product or smiles:
        identifiers = _identifiers(experiment.product, smiles)
        yield {"identifiers": identifiers, "isDesiredProduct": True, "reactionRole": "PRODUCT"}


def _identifiers(name: str, smiles: str) -> list[Message]:
    values = (("NAME", name), ("SMILES", smiles))
    return [{"type": kind, "value": value} for kind, value in values if value]


def _amount(text: str) -> tuple[Message, str]:
    """Return an amount as a message, and the text that reading it back gives."""
    quantities = amounts(text)
    for dimension, (kind, units) in _MEASURES.items():
        quantity = next((item for item in quantities if item.dimension == dimension), None)
        if quantity is not None and quantity.unit.upper() in units.split() and quantity.base > 0.0:
            value = float(f"{quantity.value * quantity.portions:.4g}")
            plain = f"{value:.10f}".rstrip("0").rstrip(".")
            return {kind: {"value": value, "units": quantity.unit.upper()}}, f"{plain} {SYMBOLS[quantity.unit]}"
    return {"unmeasured": {"type": "CUSTOM", "details": text or "the amount is not stated"}}, ""


def _time(minutes: float) -> Message:
    return {"value": minutes, "units": "MINUTE"}


def _degrees(celsius: float) -> Message:
    return {"value": celsius, "units": "CELSIUS"}
