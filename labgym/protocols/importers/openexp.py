"""OpenExp, the action data of ReactXT: JSON lists of records, actions as one line of text each.

A line is upper-case verbs with their slots, joined by " ; ", ended by a full stop: "ADD $1$ (2 g) dropwise at #1# ;
STIR for @2@ ; YIELD $-1$.". Placeholders stand for molecules, temperatures and durations of the record. A file may hold
hundreds of thousands of records and is read record by record.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError

from labgym.documents import document_error
from labgym.errors import DocumentError
from labgym.protocols.experiments import Action, Experiment, Material, Portion, Rejection
from labgym.protocols.experiments.model import Atmosphere, Role, Verb
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
    "OTHERLANGUAGE": "it is in another language than English",
}
_ROLES: dict[str, Role] = {"REACTANT": "reactant", "CATALYST": "catalyst", "SOLVENT": "solvent"}
_SLOTS = (" at ", " for ", " over ", " under ", " to pH ")
_PREPOSITIONS = ("with", "over", "from", "of")
"""What may stand between a verb and its first material."""
_SEVERAL: frozenset[Verb] = frozenset({"MakeSolution", "Partition"})
_WORKING_UP: frozenset[Verb] = frozenset(
    ("AdjustPH", "DrySolution", "Extract", "Partition", "Quench", "Recrystallize", "Triturate", "Wash", "Filter")
)
_QUANTITIES = re.compile(r"^(?P<name>.*\S) \((?P<amount>[^()]{1,200})\)$")
_PORTIONS = re.compile(r"^(?P<rest>.*\S) (?P<count>\d{1,3}) x$")
_MOLECULE, _TEMPERATURE, _DURATION = re.compile(r"\$-?\d+\$"), re.compile(r"#\d+#"), re.compile(r"@\d+@")
_PH = re.compile(r"-?\d{1,2}(?:\.\d+)?")
_PRODUCT = "$-1$"
_SOLUTION = "SLN"


class _UnreadableError(Exception):
    """A record whose actions cannot be told."""


def read(path: Path) -> Iterator[Experiment | Rejection]:
    """Return the records of a file, or of the splits in a folder: train, valid, test.

    Raises:
        DocumentError: nothing to read, or a file that is no list of records.
    """
    files = [path / name for name in FILES if (path / name).is_file()] if path.is_dir() else [path]
    if not files:
        raise DocumentError(path, "", f"holds none of {', '.join(FILES)}")
    for file in files:
        try:
            yield from _file(file)
        except DocumentError as error:
            if not path.is_dir():
                raise
            yield Rejection(file.name, str(error))


def _file(file: Path) -> Iterator[Experiment | Rejection]:
    for number, record in enumerate(_records(file)):
        place = f"{file.name}:{number}"
        try:
            yield _experiment(record)
        except _UnreadableError as error:
            yield Rejection(place, str(error))
        except ValidationError as error:
            yield Rejection(place, str(document_error(place, error)))


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
    """A record's texts behind the placeholders, and what is known of its molecules."""

    molecules: Mapping[str, str]
    temperatures: Mapping[str, str]
    durations: Mapping[str, str]
    names: Mapping[str, str]
    structures: Mapping[str, str]
    roles: Mapping[str, Role]

    def material(self, text: str) -> tuple[str, str]:
        """Return the name of a material as written or behind its placeholder, and its structure or ""."""
        if _MOLECULE.fullmatch(text):
            if text not in self.molecules:
                raise _UnreadableError(f"the molecule {text} is not among those extracted")
            smiles = self.molecules[text]
            return self.names.get(smiles, smiles), smiles
        name = text.replace(" \u200c(", " (")
        return name, self.structures.get(name, "")


def _experiment(record: Any) -> Experiment:
    known = _known(record)
    told = record.get("actions")
    if not isinstance(told, str) or not told.strip():
        raise _UnreadableError("it has no actions")
    pieces = [piece.strip() for piece in told.strip().removesuffix(".").replace("\u00a0", " ").split(" ; ")]
    if len(pieces) > MAX_ACTIONS:
        raise _UnreadableError(f"it has more than {MAX_ACTIONS} actions")
    materials: dict[str, Material] = {}
    actions = tuple(_action(piece, known, materials) for piece in pieces if piece)
    sides = [_listed(record, key) for key in ("REACTANT", "CATALYST", "SOLVENT", "PRODUCT")]
    product = known.names.get(sides[3][0], "") if sides[3] else ""
    index = record.get("index")
    if not isinstance(index, int | str) or isinstance(index, bool):
        raise _UnreadableError("it has no index")
    return Experiment(
        id=f"openexp_{re.sub(r'[^a-z0-9_-]+', '_', str(index).lower())[:100]}",
        name=(product or f"Reaction {index}")[:300],
        reaction=f"{'.'.join(sides[0])}>{'.'.join(sides[1] + sides[2])}>{'.'.join(sides[3])}",
        product=product[:500],
        description=_text(record, "source")[:4000],
        materials=tuple(materials.values()),
        actions=actions,
        origin="openexp",
        license=LICENSE,
    )


def _known(record: Any) -> _Record:
    if not isinstance(record, dict):
        raise _UnreadableError(f"expected a JSON object, got {type(record).__name__}")
    names: dict[str, str] = {}
    structures: dict[str, str] = {}
    for name, smiles in _mapping(record, "molecules").items():
        if smiles:
            names.setdefault(smiles, name)
            structures[name] = smiles
    roles: dict[str, Role] = {}
    for key, role in _ROLES.items():
        for smiles in _listed(record, key):
            roles.setdefault(smiles, role)
    return _Record(
        molecules={mark: smiles for smiles, mark in _mapping(record, "extracted_molecules").items()},
        temperatures={mark: text for text, mark in _mapping(record, "extracted_temperature").items()},
        durations={mark: text for text, mark in _mapping(record, "extracted_duration").items()},
        names=names,
        structures=structures,
        roles=roles,
    )


def _action(piece: str, known: _Record, materials: dict[str, Material]) -> Action:
    if len(piece) > MAX_ACTION:
        raise _UnreadableError(f"an action has more than {MAX_ACTION} characters")
    word, _, rest = piece.partition(" ")
    if word in UNUSABLE:
        raise _UnreadableError(UNUSABLE[word])
    verb = VERBS.get(word)
    if verb is None:
        raise _UnreadableError(f"the action {word[:40]!r} is not known")
    fields: dict[str, Any] = {"verb": verb}
    if verb in ("CollectLayer", "Filter"):
        kept = rest.removeprefix("keep ").strip().lower()
        return Action.model_validate({**fields, **({"keep": kept} if kept else {})})
    if verb == "SetTemperature":
        return Action.model_validate({**fields, **_at(rest, known)})
    if verb == "Yield":
        found = _QUANTITIES.match(rest)
        return Action(verb=verb, note=found["amount"] if found else "")
    rest = _stripped(rest, known, fields)
    texts = rest.split(" and ") if verb in _SEVERAL else [rest] if rest else []
    takes = tuple(_portion(text, verb, known, materials) for text in texts if text and text != _SOLUTION)
    if verb == "Purge":
        fields |= _gas(rest)
        takes = ()
    if rest == _SOLUTION:
        fields["note"] = "the solution"
    return Action.model_validate({**fields, "takes": takes})


def _stripped(rest: str, known: _Record, fields: dict[str, Any]) -> str:
    """Take the slots off the end of an action's text, in whatever order they stand, and return what is left."""
    rest = f" {rest}"
    while True:
        if rest.endswith(" with Dean-Stark apparatus"):
            rest, fields["note"] = rest.removesuffix(" with Dean-Stark apparatus"), "Dean-Stark trap"
            continue
        if rest.endswith(" dropwise"):
            rest, fields["manner"] = rest.removesuffix(" dropwise"), "dropwise"
            continue
        for slot in sorted(_SLOTS, key=rest.rfind, reverse=True):
            head, found, tail = rest.rpartition(slot)
            value = _slot(slot.strip(), tail, known) if found else {}
            if value and not value.keys() & fields.keys():
                fields |= value
                rest = head
                break
        else:
            break
    rest = rest.strip()
    return next((rest.removeprefix(f"{word} ") for word in _PREPOSITIONS if rest.startswith(f"{word} ")), rest)


def _slot(slot: str, tail: str, known: _Record) -> dict[str, Any]:
    """Return what a slot says, nothing where the words are part of a name after all."""
    if slot == "at":
        return _at(tail, known)
    if slot in ("for", "over"):
        value = duration(known.durations.get(tail, tail))
        return (
            {"duration": value} if value is not None else {"note": "for a while"} if _DURATION.fullmatch(tail) else {}
        )
    if slot == "under":
        return _gas(tail)
    found = _PH.search(tail)
    return {"ph": float(found[0])} if found else {"note": f"to pH {tail}"[:400]}


def _at(text: str, known: _Record) -> dict[str, Any]:
    told = known.temperatures.get(text, text)
    value = temperature(told)
    if value is not None:
        return {"temperature": value}
    named = (
        bool(_TEMPERATURE.fullmatch(text)) or text in known.temperatures or "temperature" in text or "reflux" in text
    )
    return {"note": f"at {told}"[:400]} if named else {}


def _gas(text: str) -> dict[str, Any]:
    words = {"n2": "nitrogen", "ar": "argon", "h2": "hydrogen"}
    for word in re.findall(r"[a-z0-9]+", text.lower()):
        gas = words.get(word, word)
        if gas in get_args(Atmosphere):
            return {"atmosphere": gas}
    return {"note": f"under {text}"[:400]} if re.search(r"pressure|atmosphere|vacuo|inert", text) else {}


def _portion(text: str, verb: Verb, known: _Record, materials: dict[str, Material]) -> Portion:
    counted = _PORTIONS.match(text)
    text = counted["rest"] if counted else text
    found = _QUANTITIES.match(text)
    name, smiles = known.material((found["name"] if found else text).strip())
    role = known.roles.get(smiles) or ("workup" if verb in _WORKING_UP else "reagent")
    amount = found["amount"] if found else ""
    if counted and amount:
        amount = f"{counted['count']} x {amount}"
    materials.setdefault(name, Material(name=name, role=role, smiles=smiles))
    return Portion(name=name, amount=amount)


def _mapping(record: Mapping[str, Any], key: str) -> dict[str, str]:
    value = record.get(key) or {}
    if not isinstance(value, dict):
        raise _UnreadableError(f"{key} is no object")
    return {str(name): item for name, item in value.items() if isinstance(item, str)}


def _listed(record: Mapping[str, Any], key: str) -> list[str]:
    value = record.get(key) or []
    items = value if isinstance(value, list) else [value]
    return [item.removeprefix(f"{key}: ") for item in items if isinstance(item, str) and item]


def _text(record: Mapping[str, Any], key: str) -> str:
    value = record.get(key)
    return value if isinstance(value, str) else ""
