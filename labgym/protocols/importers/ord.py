"""The Open Reaction Database: datasets as protocol buffers (binary, text, JSON, gzipped or not) or Parquet."""

from __future__ import annotations

import itertools
import math
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError

from labgym.documents import document_error
from labgym.errors import DocumentError, MissingDependencyError
from labgym.protocols.experiments import Action, Experiment, Material, Portion, Rejection
from labgym.protocols.experiments.model import Atmosphere, Keep, Role, Verb
from labgym.protocols.importers.ord_messages import messages
from labgym.quantities import BASE, ROOM_RANGE, SYMBOLS, Dimension, convert

LICENSE = "CC-BY-SA-4.0"
MAX_BYTES = 1024**3
MAX_UNPACKED = 1024**3
MAX_REACTION = 4 * 1024**2
MAX_TEXT = 64 * 1024**2
"""Bytes of a file, of what a gzipped one unpacks to, of one reaction in Parquet, and of JSON or text, which unfold to
many times their size."""
BINARY, TEXT, JSON, PARQUET = (".pb", ".binpb"), (".pbtxt", ".txtpb"), (".json",), (".parquet",)
_DEGREES = {"celsius": "degree_Celsius", "fahrenheit": "degree_Fahrenheit"}
_ROLES: dict[str, Role] = {
    "REACTANT": "reactant",
    "SOLVENT": "solvent",
    "CATALYST": "catalyst",
    "WORKUP": "workup",
}
_MANNERS = {"DROPWISE": "dropwise", "PORTIONWISE": "portionwise", "SLOW": "slowly", "FAST": "quickly"}
_NAMED = ("NAME", "IUPAC_NAME", "CAS_NUMBER", "SMILES", "CXSMILES", "INCHI_KEY")
"""Kinds of identifiers that a substance is called by, the best first."""
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
_TOLD: tuple[tuple[str, Verb], ...] = (
    ("recrystal", "Recrystallize"),
    ("crystal", "Crystallize"),
    ("precipit", "Crystallize"),
    ("triturat", "Triturate"),
    ("quench", "Quench"),
    ("separat", "PhaseSeparation"),
    ("partition", "Partition"),
    ("sublim", "Sublime"),
)
"""Work-ups of the database's kind CUSTOM by a word of their description."""


class _OutOfScopeError(Exception):
    """A reaction that the actions of an experiment cannot tell."""


def read(path: Path) -> Iterator[Experiment | Rejection]:
    """Return the reactions of a dataset, or of all datasets below a folder in the order of their names.

    Raises:
        DocumentError: nothing to read, or a single file that is no dataset.
        MissingDependencyError: protobuf, or for Parquet pyarrow, is not installed.
    """
    if not path.is_dir():
        yield from _file(path)
        return
    files = sorted(file for file in path.rglob("*") if file.is_file() and _suffix(file))
    if not files:
        kinds = ", ".join((*BINARY, *TEXT, *JSON, *PARQUET))
        raise DocumentError(path, "", f"holds no ORD datasets ({kinds}, or gzipped)")
    for file in files:
        try:
            yield from _file(file)
        except DocumentError as error:
            yield Rejection(str(file.relative_to(path)), str(error))


def _suffix(path: Path) -> str:
    name = path.name.lower().removesuffix(".gz")
    return next((s for s in (*BINARY, *TEXT, *JSON, *PARQUET) if name.endswith(s)), "")


def _file(path: Path) -> Iterator[Experiment | Rejection]:
    for number, reaction in enumerate(_reactions(path)):
        place = f"{path.name}:{number}"
        if isinstance(reaction, Rejection):
            yield reaction
            continue
        try:
            yield _experiment(reaction, path, number)
        except _OutOfScopeError as error:
            yield Rejection(place, str(error))
        except TypeError:
            yield Rejection(place, "it has text that is not UTF-8")
        except ValidationError as error:
            yield Rejection(place, str(document_error(place, error)))


def _reactions(path: Path) -> Iterator[Any]:
    if _suffix(path) in PARQUET:
        yield from _parquet(path)
        return
    dataset = messages()[0]()
    from google.protobuf import json_format, text_format
    from google.protobuf.message import DecodeError

    content = _content(path)
    if _suffix(path) in (*TEXT, *JSON) and len(content) > MAX_TEXT:
        raise DocumentError(path, "", f"text of more than {MAX_TEXT} bytes; save it as .pb, which is read faster")
    try:
        if _suffix(path) in JSON:
            json_format.Parse(_with_listed_inputs(content), dataset, ignore_unknown_fields=True, max_recursion_depth=50)
        elif _suffix(path) in TEXT:
            text_format.Parse(content.decode("utf-8"), dataset, allow_unknown_field=True)
        else:
            dataset.ParseFromString(content)
    except (json_format.ParseError, text_format.ParseError, DecodeError, ValueError, RecursionError) as error:
        raise DocumentError(path, "", f"not an ORD dataset ({' '.join(str(error).split())[:200]})") from None
    yield from dataset.reactions


def _content(path: Path) -> bytes:
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise DocumentError(path, "", f"cannot be read ({error.strerror or type(error).__name__})") from None
    if len(content) > MAX_BYTES:
        raise DocumentError(path, "", f"larger than {MAX_BYTES} bytes")
    if not path.name.lower().endswith(".gz"):
        return content
    unpacker = zlib.decompressobj(zlib.MAX_WBITS | 16)
    try:
        unpacked = unpacker.decompress(content, MAX_UNPACKED)
    except zlib.error:
        raise DocumentError(path, "", "not gzipped, although its name says so") from None
    if unpacker.unconsumed_tail:
        raise DocumentError(path, "", f"unpacks to more than {MAX_UNPACKED} bytes")
    if unpacker.unused_data.strip(b"\0"):
        raise DocumentError(path, "", "several gzip streams in one file; unpack it first")
    if not unpacker.eof:
        raise DocumentError(path, "", "cut off: its gzip stream does not end")
    return unpacked


def _with_listed_inputs(content: bytes) -> str:
    """Return a dataset's JSON with the map of inputs as the list of entries that it is on the wire."""
    import json

    data = json.loads(content)
    reactions = data.get("reactions", []) if isinstance(data, dict) else []
    for reaction in reactions if isinstance(reactions, list) else []:
        if isinstance(reaction, dict) and isinstance(reaction.get("inputs"), dict):
            reaction["inputs"] = [{"key": key, "value": value} for key, value in reaction["inputs"].items()]
    return json.dumps(data)


def _parquet(path: Path) -> Iterator[Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MissingDependencyError("pyarrow", "reading Parquet datasets", "ord") from None
    reaction_type = messages()[1]
    from google.protobuf.message import DecodeError

    try:
        table = pyarrow.parquet.ParquetFile(path)
        numbers = itertools.count()
        for batch in table.iter_batches(batch_size=100, columns=["reaction"]):
            for number, value in zip(numbers, batch.column(0), strict=False):
                content = value.as_py()
                if not isinstance(content, bytes) or len(content) > MAX_REACTION:
                    yield Rejection(f"{path.name}:{number}", "the column reaction holds no serialized reaction")
                    continue
                try:
                    yield reaction_type.FromString(content)
                except DecodeError:
                    yield Rejection(f"{path.name}:{number}", "not a serialized reaction")
    except (pyarrow.ArrowException, OSError, KeyError, IndexError) as error:
        raise DocumentError(path, "", f"not an ORD dataset in Parquet ({str(error)[:200]})") from None


def _experiment(reaction: Any, path: Path, number: int) -> Experiment:
    conditions = reaction.conditions
    if conditions.HasField("flow") or conditions.HasField("electrochemistry"):
        raise _OutOfScopeError("flow chemistry and electrochemistry are not among the actions of an experiment")
    materials: dict[str, Material] = {}
    entries = sorted(reaction.inputs, key=lambda entry: (entry.value.addition_order, entry.key))
    actions = [_added(entry.value, materials, "Add") for entry in entries]
    actions += _held(conditions, reaction.outcomes)
    actions += [_worked_up(workup, materials) for workup in reaction.workups]
    product = _product(reaction.outcomes)
    called, smiles = ("", "") if product is None else (_called(product), _smiles(product))
    actions.append(Action(verb="Yield", note=_yield(product)))
    given = re.sub(r"[^a-z0-9_-]+", "_", reaction.reaction_id.lower())[:100] or f"{path.name.split('.')[0]}_{number}"
    return Experiment(
        id="ord_" + re.sub(r"[^a-z0-9_-]+", "_", given.lower()).removeprefix("ord-")[:100],
        name=(called or reaction.reaction_id or given)[:300],
        reaction=_equation(reaction, materials, smiles),
        product=called[:500],
        description=reaction.notes.procedure_details[:4000],
        materials=tuple(materials.values()),
        actions=tuple(actions),
        origin="ord",
        license=LICENSE,
    )


def _added(given: Any, materials: dict[str, Material], verb: Verb, **conditions: Any) -> Action:
    takes = []
    for compound in given.components:
        name = _called(compound)[:200]
        if not name:
            raise _OutOfScopeError("a component has neither name nor structure")
        role: Role = "workup" if verb != "Add" else _ROLES.get(_enum(compound, "reaction_role"), "reagent")
        materials.setdefault(name, Material(name=name, role=role, smiles=_smiles(compound)))
        takes.append(Portion(name=name, amount=_amount(compound.amount)))
    manner = _MANNERS.get(_enum(given.addition_speed, "type"))
    stated = {
        "temperature": _temperature(given.addition_temperature),
        "duration": _minutes(given.addition_duration),
        "manner": manner,
        **conditions,
    }
    return Action.model_validate(
        {"verb": verb, "takes": takes, **{key: value for key, value in stated.items() if value not in (None, "")}}
    )


def _held(conditions: Any, outcomes: Any) -> Iterator[Action]:
    """Return how the mixture is left to react, where anything is said of it."""
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
    elif temperature is not None and not ROOM_RANGE[0] <= temperature <= ROOM_RANGE[1]:
        verb = "Heat" if temperature > ROOM_RANGE[1] else "Cool"
    told = {
        "temperature": temperature,
        "duration": duration,
        "atmosphere": gas if gas in get_args(Atmosphere) else None,
        "pressure": _measured(conditions.pressure.setpoint, "pressure", 6) or None,
        "ph": conditions.ph if conditions.HasField("ph") else None,
    }
    present = {key: value for key, value in told.items() if value is not None}
    if present or verb != "Stir" or stirred not in ("", "UNSPECIFIED", "NONE"):
        yield Action.model_validate({"verb": verb, **present})


def _worked_up(workup: Any, materials: dict[str, Material]) -> Action:
    kind, details = _enum(workup, "type"), workup.details.lower()
    verb = _WORKUPS.get(kind) or next((verb for word, verb in _TOLD if word in details), None)
    if verb is None:
        raise _OutOfScopeError(f"a work-up of kind {kind} ({details[:60]!r}) is not among the actions of an experiment")
    phase = workup.keep_phase.lower()
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
        "note": workup.details[:400],
    }
    stated = {key: value for key, value in conditions.items() if value is not None}
    return _added(workup.input, materials, verb, **stated)


def _equation(reaction: Any, materials: dict[str, Material], product: str) -> str:
    """Return the reaction SMILES that the record states, else one made of its inputs and its product."""
    for identifier in reaction.identifiers:
        if _enum(identifier, "type") in ("REACTION_SMILES", "REACTION_CXSMILES"):
            return str(("" + identifier.value).split(" ")[0])
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


def _called(compound: Any) -> str:
    identifiers = {_enum(item, "type"): "" + item.value for item in reversed(compound.identifiers)}
    return next((str(identifiers[kind]) for kind in _NAMED if identifiers.get(kind)), "")


def _smiles(compound: Any) -> str:
    for identifier in compound.identifiers:
        if _enum(identifier, "type") in ("SMILES", "CXSMILES"):
            return str(("" + identifier.value).split(" ")[0])
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


def _enum(message: Any, field: str) -> str:
    """Return the name of an enumeration's value."""
    descriptor = message.DESCRIPTOR.fields_by_name[field].enum_type
    return str(descriptor.values_by_number[getattr(message, field)].name)
