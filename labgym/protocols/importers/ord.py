"""The Open Reaction Database: from reactions to experiments."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, get_args

from pydantic import TypeAdapter

from labgym.errors import DocumentError
from labgym.protocols.experiments import Action, Experiment, Material
from labgym.protocols.experiments.model import Atmosphere, Keep, Role, Verb, holding
from labgym.protocols.experiments.remarks import BEFORE, PORTION, read_remark
from labgym.protocols.importers.ord_files import BINARY, JSON, PARQUET, TEXT, reactions
from labgym.protocols.importers.records import Records, UnreadableError, printable, record, slug
from labgym.units import BASE, SYMBOLS, Dimension, convert

LICENSE = "CC-BY-SA-4.0"
MAX_ACTIONS, MAX_COMPONENTS = 250, 30
"""Largest numbers of inputs and work-ups of a reaction, and of components of an input."""
_DEGREES = {"celsius": "degree_Celsius", "fahrenheit": "degree_Fahrenheit"}
_ROLES: dict[str, Role] = {
    "REACTANT": "reactant",
    "SOLVENT": "solvent",
    "CATALYST": "catalyst",
    "WORKUP": "workup",
}
_MANNERS = {"DROPWISE": "dropwise", "PORTIONWISE": "portionwise", "SLOW": "slowly", "FAST": "quickly"}
_NAMED = ("NAME", "IUPAC_NAME", "CAS_NUMBER", "SMILES", "CXSMILES", "INCHI_KEY")
"""Kinds of identifiers that name a substance, the best first."""
_WORKUPS: dict[str, Verb] = {
    "ADDITION": "Add",
    "ALIQUOT": "Analyze",
    "TEMPERATURE": "SetTemperature",
    "CONCENTRATION": "Concentrate",
    "EXTRACTION": "Extract",
    "FILTRATION": "Filter",
    "WASH": "Wash",
    "DRY_IN_VACUUM": "DrySolid",
    "DRY_WITH_MATERIAL": "DrySolution",
    "FLASH_CHROMATOGRAPHY": "Chromatograph",
    "OTHER_CHROMATOGRAPHY": "Chromatograph",
    "SCAVENGING": "Filter",
    "WAIT": "Wait",
    "STIRRING": "Stir",
    "PH_ADJUST": "AdjustPH",
    "DISSOLUTION": "Dissolve",
    "DISTILLATION": "Distill",
}
_BY_DESCRIPTION: dict[str, Verb] = {
    "recrystal": "Recrystallize",
    "crystal": "Crystallize",
    "precipit": "Crystallize",
    "triturat": "Triturate",
    "quench": "Quench",
    "separat": "PhaseSeparation",
    "partition": "Partition",
    "sublim": "Sublime",
    "evaporat": "Concentrate",
    "concentrat": "Concentrate",
    "in vacuo": "Concentrate",
    "solvent was removed": "Concentrate",
    "solvents were removed": "Concentrate",
    "chromatogra": "Chromatograph",
    "distill": "Distill",
    "dissolv": "Dissolve",
    "filter": "Filter",
    "reflux": "Reflux",
    "acidif": "AdjustPH",
    "neutrali": "AdjustPH",
    "sonicat": "Sonicate",
    "stirred": "Stir",
    "dried over": "DrySolution",
    "dried": "DrySolid",
}
"""Verbs of work-ups of the kind CUSTOM, by the first of these words in their description; others become notes."""


_ACTIONS = TypeAdapter(list[Action])


def files(folder: Path) -> list[Path]:
    """Return all datasets below a folder in the order of their names.

    Raises:
        DocumentError: the folder holds no datasets.
    """
    datasets = sorted(file for file in folder.rglob("*") if file.is_file() and _suffix(file))
    if not datasets:
        kinds = ", ".join((*BINARY, *TEXT, *JSON, *PARQUET))
        raise DocumentError(folder, "", f"holds no ORD datasets ({kinds}, or gzipped)")
    return datasets


def read(file: Path, folder: Path) -> Records:  # noqa: ARG001 -- a record's place is the file's name and its number
    """Return the reactions of a dataset. A reaction with a value that the schema does not know becomes a rejection.

    Raises:
        DocumentError: the file is not a dataset.
        MissingDependencyError: protobuf, or pyarrow for Parquet, is not installed.
    """
    number = -1
    for number, parse in enumerate(reactions(file)):
        yield record(f"{file.name}:{number}", partial(_parsed, parse, file, number))
    if number < 0:
        raise DocumentError(file, "", "holds no reactions")


def _suffix(path: Path) -> str:
    name = path.name.lower().removesuffix(".gz")
    return next((s for s in (*BINARY, *TEXT, *JSON, *PARQUET) if name.endswith(s)), "")


def _parsed(parse: Callable[[], Any], path: Path, number: int) -> Experiment:
    return _experiment(parse(), path, number)


def _experiment(reaction: Any, path: Path, number: int) -> Experiment:
    conditions = reaction.conditions
    if len(reaction.inputs) + len(reaction.workups) > MAX_ACTIONS:
        raise UnreadableError(f"it has more than {MAX_ACTIONS} inputs and work-ups")
    materials: dict[str, Material] = {}
    entries = sorted(reaction.inputs, key=lambda entry: (entry.value.addition_order, _text(entry.key)))
    actions = [action for entry in entries for action in _input(entry, materials)]
    for technique, words in (("flow", "flow chemistry"), ("electrochemistry", "electrochemistry")):
        if conditions.HasField(technique):
            actions.append(Action(verb="Note", note=f"the reaction is {words}"))
    actions += _reacting(conditions, reaction.outcomes)
    actions += [_worked_up(workup, materials) for workup in reaction.workups]
    product = _product(reaction.outcomes)
    name, smiles = ("", "") if product is None else (_name(product), _smiles(product))
    actions.append(Action(verb="Yield", note=_yield(product)))
    reaction_id = _text(reaction.reaction_id) or f"{path.name.split('.')[0]}_{number}"
    return Experiment(
        id="ord_" + slug(reaction_id).removeprefix("ord-")[:100],
        name=(name or reaction_id)[:300],
        reaction=_equation(reaction, materials, smiles),
        product=name[:500],
        description=_text(reaction.notes.procedure_details)[:4000],
        materials=tuple(materials.values()),
        actions=tuple(actions),
        origin="ord",
        license=LICENSE,
    )


def _input(entry: Any, materials: dict[str, Material]) -> list[Action]:
    head, fields, note = read_remark(_text(entry.key).partition(" ")[2])
    before = _ACTIONS.validate_python(fields.pop(BEFORE, []))
    return [*before, _added(entry.value, materials, head or "Add", {"note": note, **fields} if head else {})]


def _added(
    inputs: Any, materials: dict[str, Material], verb: str, conditions: Mapping[str, Any], workup: bool = False
) -> Action:
    takes = []
    if len(inputs.components) > MAX_COMPONENTS:
        raise UnreadableError(f"an input has more than {MAX_COMPONENTS} components")
    for compound in inputs.components:
        name = _name(compound)[:200]
        if not name:
            raise UnreadableError("a component has neither name nor structure")
        stated_role = _ROLES.get(_enum(compound, "reaction_role"), "reagent")
        role: Role = "workup" if workup and verb != "Add" else stated_role
        materials.setdefault(name, Material(name=name, role=role, smiles=_smiles(compound)))
        takes.append({"name": name, "amount": _amount(compound.amount), **_remarked(compound)})
    manner = _MANNERS.get(_enum(inputs.addition_speed, "type"))
    stated = {
        "temperature": _temperature(inputs.addition_temperature),
        "duration": _minutes(inputs.addition_duration),
        "manner": manner,
        **conditions,
    }
    return Action.model_validate(
        {"takes": takes, **{key: value for key, value in stated.items() if value not in (None, "")}, "verb": verb}
    )


def _remarked(compound: Any) -> dict[str, Any]:
    """Return what a remark adds to a material."""
    remarks = (read_remark(_text(preparation.details)) for preparation in compound.preparations)
    return next((fields for head, fields, _ in remarks if head == PORTION), {})


def _reacting(conditions: Any, outcomes: Any) -> Iterator[Action]:
    """Return the action that lets the mixture react, if the record states any of its conditions."""
    temperature = _temperature(conditions.temperature.setpoint)
    duration = next((time for outcome in outcomes if (time := _minutes(outcome.reaction_time)) is not None), None)
    gas = _enum(conditions.pressure.atmosphere, "type").lower()
    stirred = _enum(conditions.stirring, "type")
    lit = _enum(conditions.illumination, "type") in (
        *("LED", "HALOGEN_LAMP", "DEUTERIUM_LAMP", "SOLAR_SIMULATOR", "BROAD_SPECTRUM"),
    )
    verb: Verb = "Stir"
    if _enum(conditions.temperature.control, "type") == "MICROWAVE":
        verb = "Microwave"
    elif conditions.reflux:
        verb = "Reflux"
    elif lit:
        verb = "Irradiate"
    elif stirred == "SONICATION":
        verb = "Sonicate"
    else:
        verb = holding(temperature)
    values = {
        "temperature": temperature,
        "duration": duration,
        "atmosphere": gas if gas in get_args(Atmosphere) else None,
        "pressure": _measured(conditions.pressure.setpoint, "pressure", 6) or None,
        "ph": conditions.ph if conditions.HasField("ph") else None,
    }
    present = {key: value for key, value in values.items() if value is not None}
    head, fields, note = read_remark(_text(conditions.details))
    if head:
        yield Action.model_validate({**present, "note": note, **fields, "verb": head})
    elif present or verb != "Stir" or stirred not in ("", "UNSPECIFIED", "NONE"):
        yield Action.model_validate({"verb": verb, **present, "note": note[:400]})


def _worked_up(workup: Any, materials: dict[str, Material]) -> Action:
    kind, details = _enum(workup, "type"), _text(workup.details)
    head, fields, details = read_remark(details)
    verb = head or _WORKUPS.get(kind) or _described(details)
    phase = _text(workup.keep_phase).lower()
    keep: Keep | None = None
    if "organic" in phase or "aqueous" in phase:
        keep = "organic" if "organic" in phase else "aqueous"
    elif verb == "Filter" and phase:
        keep = "filtrate" if "filtrate" in phase or "liquid" in phase else "precipitate"
    conditions = {
        "temperature": _temperature(workup.temperature.setpoint),
        "duration": _minutes(workup.duration),
        "keep": keep,
        "ph": workup.target_ph if workup.HasField("target_ph") else None,
        "atmosphere": "vacuum" if kind == "DRY_IN_VACUUM" else None,
        "note": details[:400] or (f"a work-up of the kind {kind}" if verb == "Note" else ""),
    }
    stated = {key: value for key, value in conditions.items() if value is not None}
    return _added(workup.input, materials, verb, {**stated, **fields}, workup=True)


def _described(details: str) -> Verb:
    """Return the verb of the word of a description that stands first, "Note" if it has none of those that are known."""
    text = details.lower()
    found = [(place, -len(word), verb) for word, verb in _BY_DESCRIPTION.items() if (place := text.find(word)) >= 0]
    return min(found)[2] if found else "Note"


def _equation(reaction: Any, materials: dict[str, Material], product: str) -> str:
    """Return the reaction SMILES of the record, else one made of its inputs and its product."""
    for identifier in reaction.identifiers:
        if _enum(identifier, "type") in ("REACTION_SMILES", "REACTION_CXSMILES"):
            return _text(identifier.value).split(" ")[0]
    sides: dict[bool, list[str]] = {True: [], False: []}
    for material in materials.values():
        if material.smiles and material.role != "workup":
            sides[material.role == "reactant"].append(material.smiles)
    return f"{'.'.join(sides[True])}>{'.'.join(sides[False])}>{product}" if product else ""


def _product(outcomes: Any) -> Any | None:
    products = [product for outcome in outcomes for product in outcome.products]
    return next((product for product in products if product.is_desired_product), products[0] if products else None)


def _yield(product: Any | None) -> str:
    for measurement in product.measurements if product is not None else ():
        if _enum(measurement, "type") == "YIELD" and measurement.percentage.HasField("value"):
            return f"yield {measurement.percentage.value:.3g} %"
    return ""


def _name(compound: Any) -> str:
    identifiers = {_enum(item, "type"): printable(_text(item.value)) for item in reversed(compound.identifiers)}
    return next((identifiers[kind] for kind in _NAMED if identifiers.get(kind)), "")


def _smiles(compound: Any) -> str:
    for identifier in compound.identifiers:
        if _enum(identifier, "type") in ("SMILES", "CXSMILES"):
            return _text(identifier.value).split(" ")[0]
    return ""


def _amount(amount: Any) -> str:
    for kind in ("mass", "volume", "moles"):
        if amount.HasField(kind):
            measure = getattr(amount, kind)
            unit = SYMBOLS.get(_enum(measure, "units").lower())
            if unit is not None and measure.HasField("value"):
                value = float(f"{measure.value:.4g}")
                return f"{_plain(value)} {unit}" if 0.0 < value < math.inf else ""
    return ""


def _plain(value: float) -> str:
    """Return a number without an exponent, as amounts are written."""
    text = f"{value:.10f}"
    return text.rstrip("0").rstrip(".")


def _temperature(measure: Any) -> float | None:
    return _measured(measure, "temperature", 2)


def _minutes(measure: Any) -> float | None:
    return _measured(measure, "time", 4)


def _measured(measure: Any, dimension: Dimension, digits: int) -> float | None:
    """Return a message's value in the base unit of a dimension, or None if its value or unit is missing."""
    unit = {"unspecified": "", "mm_hg": "mmHg", **_DEGREES}.get(
        _enum(measure, "units").lower(), _enum(measure, "units").lower()
    )
    if not unit or not measure.HasField("value"):
        return None
    # Messages hold 32-bit floats: 6 digits are what the database's number had.
    return round(convert(float(f"{measure.value:.6g}"), unit, BASE[dimension]), digits)


def _text(value: Any) -> str:
    """Return the text of a string field.

    Raises:
        UnreadableError: the field holds bytes that are not UTF-8 text; protobuf passes those on as they are.
    """
    if not isinstance(value, str):
        raise UnreadableError("it has text that is not UTF-8")
    return value


def _enum(message: Any, field: str) -> str:
    """Return the name of an enumeration's value."""
    descriptor = message.DESCRIPTOR.fields_by_name[field].enum_type
    return str(descriptor.values_by_number[getattr(message, field)].name)
