"""XDL: an experiment as a synthesis in the chemical description language, with the steps of its standard.

The batch is in one vessel throughout, because the language leaves the distribution over vessels to the platform. What a
step has no attribute for is a remark in an XML comment before it. An action that takes several materials becomes one
addition for each, joined by their remarks; an action that is no step of the language becomes a Wait with a remark.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any
from xml.etree.ElementTree import Comment, Element, SubElement, indent, tostring

from labgym.protocols.experiments import Action, Experiment, Material, Portion
from labgym.protocols.experiments.model import HOLDING, Role, Verb, holding
from labgym.protocols.experiments.remarks import write_remark
from labgym.quantities import Quantity, amounts, plain_number
from labgym.units import BASE, SYMBOLS

BATCH, SEPARATOR, COLUMN = "reactor", "separator", "column"
REMARK = "!--"
"""Attribute that holds the remark on a step until it is written as a comment."""
_ROLES: dict[Role, str] = {"reactant": "substrate", "catalyst": "catalyst", "solvent": "solvent"}
_UNITS = frozenset(("kilogram", "gram", "milligram", "liter", "milliliter"))
"""Units that the language writes as this project does."""
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff\ufffe\uffff]")
"""Characters that XML does not allow."""
_NOT_ADDED: frozenset[Verb] = frozenset(("Chromatograph", "Filter", "Purge"))
"""Verbs whose materials do not go into the batch."""


def written(experiment: Experiment) -> str:
    """Return the XML of a synthesis; reading it back gives the experiment's actions."""
    synthesis = Element("Synthesis")
    facts = {"description": experiment.description, "product": experiment.product, "smarts": experiment.reaction}
    SubElement(synthesis, "Metadata", {key: _clean(value) for key, value in facts.items() if value})
    hardware = SubElement(synthesis, "Hardware")
    SubElement(hardware, "Component", {"id": BATCH, "type": "reactor"})
    SubElement(hardware, "Component", {"id": SEPARATOR, "type": "separator"})
    reagents = SubElement(synthesis, "Reagents")
    for material in experiment.materials:
        structure = {"comment": f"SMILES {material.smiles}"} if material.smiles else {}
        role = _ROLES.get(material.role, "reagent")
        SubElement(reagents, "Reagent", {"name": _clean(material.name), "role": role, **structure})
    procedure = SubElement(synthesis, "Procedure")
    materials = {material.name: material for material in experiment.materials}
    actions = experiment.actions
    for place, action in enumerate(actions):
        if action.verb != "Yield" or action.takes or place < len(actions) - 1:
            procedure.extend(_steps(action, materials))
    indent(synthesis)
    return f"{tostring(synthesis, encoding='unicode')}\n"


def _steps(action: Action, materials: dict[str, Material]) -> Iterator[Element[Any]]:
    """Yield the steps of an action, the last one with its remark, each after the comment with its remark."""
    for step in _plain_steps(action, materials):
        remark = step.attrib.pop(REMARK, "")
        if remark:
            # "--" is not allowed in comments; a name with it is inside the JSON of the remark.
            end = remark.rfind("}") + 1
            escaped = remark[:end].replace("--", "-\\u002d") + remark[end:].replace("--", "- -")
            yield Comment(f" {escaped} ")
        yield step


def _plain_steps(action: Action, materials: dict[str, Material]) -> Iterator[Element]:
    step = _with_solvent(action, materials) if len(action.takes) == 1 else None
    if step is not None:
        yield step
        return
    plain = _alone(action)
    *joined, last = action.takes or (None,)
    if plain is not None and last is not None:
        joined.append(last)
    for portion in joined:
        assert portion is not None
        yield _addition(Action(verb="Add", takes=(portion,)), portion, action.verb not in _NOT_ADDED, joined=True)
    if plain is not None:
        yield plain
    elif last is not None:
        yield _addition(action, last, action.verb not in _NOT_ADDED)
    else:
        yield _wait(action, "Wait", {})


def _addition(action: Action, portion: Portion, added: bool, **more: Any) -> Element:
    """Return the step that adds a material, with the remark on an action."""
    quantity = _quantity(portion.amount, "volume") or _quantity(portion.amount, "mass")
    if quantity is None or not added:
        more["takes"] = [portion.model_dump(exclude_defaults=True, include={"name", "amount", "solvent"})]
        return _wait(action, None, more)
    amount = _amount(quantity, quantity.portions)
    more |= _unlike(portion, amount)
    attributes = {"vessel": BATCH, "reagent": portion.name}
    if action.duration is not None:
        attributes["time"] = _minutes(action.duration)
    if quantity.dimension == "mass":
        return _step("AddSolid", action, ("duration",), "Add", {**attributes, "mass": amount}, more)
    attributes["volume"] = amount
    if action.manner == "dropwise":
        return _step("Add", action, ("duration", "manner"), "Add", {**attributes, "dropwise": "true"}, more)
    return _step("Add", action, ("duration",), "Add", attributes, more)


def _unlike(portion: Portion, amount: str) -> dict[str, str]:
    """Return what a step's amount does not say of a portion, for the remark on the step."""
    solvent = {"solvent": portion.solvent} if portion.solvent else {}
    return solvent | ({"amount": portion.amount} if amount != portion.amount else {})


def _wait(action: Action, implied: Verb | None, more: dict[str, Any]) -> Element:
    """Return a Wait with a remark; the language requires its time, which the remark takes back if none is stated."""
    unstated = {"duration": None} if action.duration is None else {}
    time = _minutes(action.duration or 0.0)
    return _step("Wait", action, ("duration",), implied, {"time": time}, more | unstated)


def _with_solvent(action: Action, materials: dict[str, Material]) -> Element | None:
    """Return the step that dissolves or extracts with one liquid, or None if the language has none."""
    (portion,) = action.takes
    quantity = _quantity(portion.amount, "volume")
    if quantity is None:
        return None
    amount = _amount(quantity)
    if action.verb == "Dissolve" and quantity.portions == 1:
        expressed = ("temperature", "duration")
        attributes = {"vessel": BATCH, "solvent": portion.name, "volume": amount, **_conditions(action, *expressed)}
        return _step("Dissolve", action, expressed, "Dissolve", attributes, _unlike(portion, amount))
    structure = materials[portion.name].smiles
    if action.verb == "Extract" and structure and action.keep in (None, "organic"):
        attributes = {
            "purpose": "extract",
            # Chlorinated solvents are heavier than water.
            "product_phase": "bottom" if "Cl" in structure else "top",
            "from_vessel": BATCH,
            "separation_vessel": SEPARATOR,
            "to_vessel": BATCH,
            "solvent": portion.name,
            "solvent_volume": amount,
            "repeats": str(quantity.portions),
        }
        stated = f"{quantity.portions} x {amount}" if quantity.portions > 1 else amount
        return _step("Separate", action, (), "Extract", attributes, _unlike(portion, stated))
    return None


def _alone(action: Action) -> Element | None:
    """Return the step that carries out an action besides adding its materials, or None if the language has none."""
    both, batch = ("temperature", "duration"), {"vessel": BATCH}
    if action.verb in HOLDING:
        if action.temperature is None and action.verb == "Stir" and action.duration is not None:
            return _step("Stir", action, ("duration",), "Stir", batch | _conditions(action, "duration"))
        if action.temperature is not None and action.duration is not None:
            return _step("HeatChill", action, both, holding(action.temperature), batch | _conditions(action, *both))
        if action.temperature is not None:
            conditions = _conditions(action, "temperature")
            return _step("HeatChillToTemp", action, both, "SetTemperature", batch | conditions)
    if action.verb in ("Concentrate", "DrySolid"):
        tag, expressed = "Evaporate" if action.verb == "Concentrate" else "Dry", (*both, "pressure")
        return _step(tag, action, expressed, action.verb, batch | _conditions(action, *expressed))
    if action.verb == "Filter" and action.keep == "precipitate":
        attributes = batch | _conditions(action, "temperature")
        return _step("Filter", action, ("temperature", "keep"), "Filter", attributes)
    if action.verb == "Purge" and action.atmosphere in ("nitrogen", "argon", "hydrogen"):
        attributes = batch | {"gas": action.atmosphere} | _conditions(action, "duration")
        return _step("Purge", action, ("duration", "atmosphere"), "Purge", attributes)
    if action.verb == "Crystallize":
        return _step("Crystallize", action, (), "Crystallize", batch)
    if action.verb == "Chromatograph":
        attributes = {"from_vessel": BATCH, "to_vessel": BATCH, "column": COLUMN}
        return _step("RunColumn", action, (), "Chromatograph", attributes)
    return None


def _step(
    tag: str,
    action: Action,
    expressed: tuple[str, ...],
    implied: Verb | None,
    attributes: dict[str, str],
    more: dict[str, Any] | None = None,
) -> Element:
    remark = write_remark(action, expressed, implied, **(more or {}))
    stated = {**attributes, REMARK: remark} if remark else attributes
    return Element(tag, {key: _clean(value) for key, value in stated.items()})


def _conditions(action: Action, *fields: str) -> dict[str, str]:
    texts = {
        "temperature": ("temp", f"{plain_number(action.temperature or 0.0)} °C"),
        "duration": ("time", _minutes(action.duration or 0.0)),
        "pressure": ("pressure", f"{plain_number((action.pressure or 0.0) * 1000.0)} mbar"),
    }
    return dict(texts[name] for name in fields if getattr(action, name) is not None)


def _quantity(amount: str, dimension: str) -> Quantity | None:
    return next((item for item in amounts(amount) if item.dimension == dimension), None)


def _amount(quantity: Quantity, portions: int = 1) -> str:
    if quantity.unit in _UNITS:
        return f"{plain_number(quantity.value * portions)} {SYMBOLS[quantity.unit]}"
    return f"{plain_number(quantity.base * portions)} {SYMBOLS[BASE[quantity.dimension]]}"


def _minutes(value: float) -> str:
    return f"{plain_number(value)} min"


def _clean(text: str) -> str:
    return _CONTROL.sub(" ", text)
