"""OpenExp, the action data of ReactXT: JSON lists of records, whose actions are one line of text.

A line consists of upper-case verbs with their slots, joined by " ; ", and ends with a full stop:

    ADD $1$ (2 g) dropwise at #1# ; STIR for @2@ ; YIELD $-1$.

Placeholders stand for molecules, temperatures and durations of the record. A file may hold hundreds of thousands of
records, so it is read record by record.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, get_args

from labgym.counts import is_whole
from labgym.errors import DocumentError
from labgym.protocols.experiments import Action, Experiment, Material, Portion
from labgym.protocols.experiments.model import Atmosphere, Role, Verb
from labgym.protocols.importers.records import Records, UnreadableError, record, slug
from labgym.quantities import duration, temperature

LICENSE = "CC-BY-SA-4.0"
FILES = ("train.json", "valid.json", "test.json")
MAX_RECORD = 1024**2
"""Characters of one record."""
CHUNK = 1024**2
MAX_ACTIONS = 200
MAX_ACTION = 5000

VERBS: dict[str, Verb] = {
    "ADD": "Add",
    "COLLECTLAYER": "CollectLayer",
    "CONCENTRATE": "Concentrate",
    "DEGAS": "Purge",
    "DRYSOLID": "DrySolid",
    "DRYSOLUTION": "DrySolution",
    "EXTRACT": "Extract",
    "FILTER": "Filter",
    "MAKESOLUTION": "MakeSolution",
    "MICROWAVE": "Microwave",
    "PARTITION": "Partition",
    "PH": "AdjustPH",
    "PHASESEPARATION": "PhaseSeparation",
    "PURIFY": "Purify",
    "QUENCH": "Quench",
    "RECRYSTALLIZE": "Recrystallize",
    "REFLUX": "Reflux",
    "SETTEMPERATURE": "SetTemperature",
    "SONICATE": "Sonicate",
    "STIR": "Stir",
    "TRITURATE": "Triturate",
    "WAIT": "Wait",
    "WASH": "Wash",
    "YIELD": "Yield",
}
UNUSABLE = {
    "FOLLOWOTHERPROCEDURE": "it refers to another procedure",
    "INVALIDACTION": "it has an action that could not be read when the data were made",
    "NOACTION": "it has a step without an action",
    "OTHERLANGUAGE": "it is not in English",
}
_ROLES: dict[str, Role] = {"REACTANT": "reactant", "CATALYST": "catalyst", "SOLVENT": "solvent"}
_SLOTS = (" at ", " for ", " over ", " under ", " to pH ")
_PREPOSITIONS = ("with", "over", "from", "of")
"""Words between a verb and its first material."""
_SEVERAL: frozenset[Verb] = frozenset({"MakeSolution", "Partition"})
_WORKING_UP: frozenset[Verb] = frozenset(
    ("AdjustPH", "DrySolution", "Extract", "Partition", "Quench", "Recrystallize", "Triturate", "Wash", "Filter")
)
_QUANTITIES = re.compile(r"^(?P<name>.*\S) \((?P<amount>[^()]{1,200})\)$")
_PORTIONS = re.compile(r"^(?P<rest>.*\S) (?P<count>\d{1,3}) x$")
_MOLECULE, _TEMPERATURE, _DURATION = re.compile(r"\$-?\d+\$"), re.compile(r"#\d+#"), re.compile(r"@\d+@")
_PH = re.compile(r"-?\d{1,2}(?:\.\d+)?")
_SOLUTION = "SLN"


def files(folder: Path) -> list[Path]:
    """Return the splits in a folder: train, valid, test.

    Raises:
        DocumentError: the folder holds no split.
    """
    splits = [folder / name for name in FILES if (folder / name).is_file()]
    if not splits:
        raise DocumentError(folder, "", f"holds none of {', '.join(FILES)}")
    return splits


def read(file: Path, folder: Path) -> Records:  # noqa: ARG001 -- a record's place is the file's name and its number
    """Return the records of a file.

    Raises:
        DocumentError: the file is not a list of records.
    """
    for number, data in enumerate(_records(file)):
        yield record(f"{file.name}:{number}", partial(_experiment, data))


def _records(path: Path) -> Iterator[Any]:
    """Return the elements of a JSON list one by one."""
    decoder = json.JSONDecoder()
    text, at, begun = "", 0, False
    try:
        with path.open(encoding="utf-8-sig") as stream:
            while True:
                chunk = stream.read(CHUNK)
                text, at = text[at:] + chunk, 0
                while True:
                    at = _skipped(text, at, "," if begun else "")
                    if at == len(text):
                        break
                    if not begun:
                        if text[at] != "[":
                            raise DocumentError(path, "", "not a JSON list of records")
                        begun, at = True, at + 1
                        continue
                    if text[at] == "]":
                        return
                    try:
                        value, end = decoder.raw_decode(text, at)
                    except ValueError:
                        break
                    yield value
                    at = end
                if not chunk:
                    raise DocumentError(path, "", "cut off, or not a JSON list of records")
                if len(text) - at > MAX_RECORD + CHUNK:
                    raise DocumentError(path, "", f"a record is longer than {MAX_RECORD} characters, or not JSON")
    except (OSError, UnicodeDecodeError) as error:
        raise DocumentError(path, "", f"cannot be read as UTF-8 text ({type(error).__name__})") from None
    except RecursionError:
        raise DocumentError(path, "", "nested too deeply") from None


def _skipped(text: str, at: int, separators: str) -> int:
    while at < len(text) and (text[at].isspace() or text[at] in separators):
        at += 1
    return at


@dataclass(frozen=True)
class _Record:
    """The texts behind a record's placeholders, and the names, structures and roles of its molecules."""

    molecules: Mapping[str, str]
    temperatures: Mapping[str, str]
    durations: Mapping[str, str]
    names: Mapping[str, str]
    structures: Mapping[str, str]
    roles: Mapping[str, Role]

    def material(self, text: str) -> tuple[str, str]:
        """Return the name of a material, as written or from its placeholder, and its structure or ""."""
        if _MOLECULE.fullmatch(text):
            if text not in self.molecules:
                raise UnreadableError(f"the molecule {text} is not among those extracted")
            smiles = self.molecules[text]
            return self.names.get(smiles, smiles), smiles
        name = text.replace(" \u200c(", " (")
        return name, self.structures.get(name, "")


def _experiment(data: Any) -> Experiment:
    context = _context(data)
    line = data.get("actions")
    if not isinstance(line, str) or not line.strip():
        raise UnreadableError("it has no actions")
    pieces = [piece.strip() for piece in line.strip().removesuffix(".").replace("\u00a0", " ").split(" ; ")]
    if len(pieces) > MAX_ACTIONS:
        raise UnreadableError(f"it has more than {MAX_ACTIONS} actions")
    materials: dict[str, Material] = {}
    actions = tuple(_action(piece, context, materials) for piece in pieces if piece)
    sides = [_listed(data, key) for key in ("REACTANT", "CATALYST", "SOLVENT", "PRODUCT")]
    product = context.names.get(sides[3][0], "") if sides[3] else ""
    index = data.get("index")
    if not isinstance(index, str) and not is_whole(index):
        raise UnreadableError("it has no index")
    return Experiment(
        id=f"openexp_{slug(str(index))[:100]}",
        name=(product or f"Reaction {index}")[:300],
        reaction=f"{'.'.join(sides[0])}>{'.'.join(sides[1] + sides[2])}>{'.'.join(sides[3])}",
        product=product[:500],
        description=_text(data, "source")[:4000],
        materials=tuple(materials.values()),
        actions=actions,
        origin="openexp",
        license=LICENSE,
    )


def _context(data: Any) -> _Record:
    if not isinstance(data, dict):
        raise UnreadableError(f"expected a JSON object, got {type(data).__name__}")
    names: dict[str, str] = {}
    structures: dict[str, str] = {}
    for name, smiles in _mapping(data, "molecules").items():
        if smiles:
            names.setdefault(smiles, name)
            structures[name] = smiles
    roles: dict[str, Role] = {}
    for key, role in _ROLES.items():
        for smiles in _listed(data, key):
            roles.setdefault(smiles, role)
    return _Record(
        molecules={mark: smiles for smiles, mark in _mapping(data, "extracted_molecules").items()},
        temperatures={mark: text for text, mark in _mapping(data, "extracted_temperature").items()},
        durations={mark: text for text, mark in _mapping(data, "extracted_duration").items()},
        names=names,
        structures=structures,
        roles=roles,
    )


def _action(piece: str, context: _Record, materials: dict[str, Material]) -> Action:
    if len(piece) > MAX_ACTION:
        raise UnreadableError(f"an action has more than {MAX_ACTION} characters")
    word, _, rest = piece.partition(" ")
    if word in UNUSABLE:
        raise UnreadableError(UNUSABLE[word])
    verb = VERBS.get(word)
    if verb is None:
        raise UnreadableError(f"the action {word[:40]!r} is not known")
    fields: dict[str, Any] = {"verb": verb}
    if verb in ("CollectLayer", "Filter"):
        part = rest.removeprefix("keep ").strip().lower()
        return Action.model_validate({**fields, **({"keep": part} if part else {})})
    if verb == "SetTemperature":
        return Action.model_validate({**fields, **_at(rest, context)})
    if verb == "Yield":
        quantities = _QUANTITIES.match(rest)
        return Action(verb=verb, note=quantities["amount"] if quantities else "")
    rest = _stripped(rest, context, fields)
    texts = rest.split(" and ") if verb in _SEVERAL else [rest] if rest else []
    takes = tuple(_portion(text, verb, context, materials) for text in texts if text and text != _SOLUTION)
    if verb == "Purge":
        fields |= _gas(rest)
        takes = ()
    if rest == _SOLUTION:
        fields["note"] = "the solution"
    return Action.model_validate({**fields, "takes": takes})


def _stripped(rest: str, context: _Record, fields: dict[str, Any]) -> str:
    """Remove the slots from the end of an action's text, in any order, and return the rest."""
    rest = f" {rest}"
    while True:
        if rest.endswith(" with Dean-Stark apparatus"):
            rest, fields["note"] = rest.removesuffix(" with Dean-Stark apparatus"), "Dean-Stark trap"
            continue
        if rest.endswith(" dropwise"):
            rest, fields["manner"] = rest.removesuffix(" dropwise"), "dropwise"
            continue
        for slot in sorted(_SLOTS, key=rest.rfind, reverse=True):
            head, separator, tail = rest.rpartition(slot)
            value = _slot(slot.strip(), tail, context) if separator else {}
            if value and not value.keys() & fields.keys():
                fields |= value
                rest = head
                break
        else:
            break
    rest = rest.strip()
    return next((rest.removeprefix(f"{word} ") for word in _PREPOSITIONS if rest.startswith(f"{word} ")), rest)


def _slot(slot: str, tail: str, context: _Record) -> dict[str, Any]:
    """Return the fields of a slot, or nothing if the words are part of a name."""
    if slot == "at":
        return _at(tail, context)
    if slot in ("for", "over"):
        value = duration(context.durations.get(tail, tail))
        return (
            {"duration": value} if value is not None else {"note": "for a while"} if _DURATION.fullmatch(tail) else {}
        )
    if slot == "under":
        return _gas(tail)
    number = _PH.search(tail)
    return {"ph": float(number[0])} if number else {"note": f"to pH {tail}"[:400]}


def _at(text: str, context: _Record) -> dict[str, Any]:
    phrase = context.temperatures.get(text, text)
    value = temperature(phrase)
    if value is not None:
        return {"temperature": value}
    named = (
        bool(_TEMPERATURE.fullmatch(text)) or text in context.temperatures or "temperature" in text or "reflux" in text
    )
    return {"note": f"at {phrase}"[:400]} if named else {}


def _gas(text: str) -> dict[str, Any]:
    words = {"n2": "nitrogen", "ar": "argon", "h2": "hydrogen"}
    for word in re.findall(r"[a-z0-9]+", text.lower()):
        gas = words.get(word, word)
        if gas in get_args(Atmosphere):
            return {"atmosphere": gas}
    return {"note": f"under {text}"[:400]} if re.search(r"pressure|atmosphere|vacuo|inert", text) else {}


def _portion(text: str, verb: Verb, context: _Record, materials: dict[str, Material]) -> Portion:
    counted = _PORTIONS.match(text)
    text = counted["rest"] if counted else text
    quantities = _QUANTITIES.match(text)
    name, smiles = context.material((quantities["name"] if quantities else text).strip())
    role = context.roles.get(smiles) or ("workup" if verb in _WORKING_UP else "reagent")
    amount = quantities["amount"] if quantities else ""
    if counted and amount:
        amount = f"{counted['count']} x {amount}"
    materials.setdefault(name, Material(name=name, role=role, smiles=smiles))
    return Portion(name=name, amount=amount)


def _mapping(record: Mapping[str, Any], key: str) -> dict[str, str]:
    value = record.get(key) or {}
    if not isinstance(value, dict):
        raise UnreadableError(f"{key} is not a JSON object")
    return {str(name): item for name, item in value.items() if isinstance(item, str)}


def _listed(record: Mapping[str, Any], key: str) -> list[str]:
    value = record.get(key) or []
    items = value if isinstance(value, list) else [value]
    return [item.removeprefix(f"{key}: ") for item in items if isinstance(item, str) and item]


def _text(record: Mapping[str, Any], key: str) -> str:
    value = record.get(key)
    return value if isinstance(value, str) else ""
