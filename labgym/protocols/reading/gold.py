"""Gold: action lists that people wrote, and the tuples of a read one to compare with them.

A gold file has one JSON object a line: `id`, `text` (or only `hash`, the first 16 hexadecimal digits of the text's
SHA-256, with the texts in another file), `outcome` and `tuples`. A tuple is one operation with one of its
substances: `order`, `op`, `substance` (null without one), `substance_span`, `amount` (values in g, mL, mol, eq, M,
N, %, or words), `conditions` (kind, value in C, min or bar, or a word), `phase`, `repeat`, `basis`.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from labgym.documents import MAX_BYTES, parse_json, read_bytes
from labgym.errors import DocumentError
from labgym.protocols.experiments.model import Action
from labgym.protocols.reading.actions import ActionList
from labgym.quantities import OVERNIGHT_MIN, ROOM_TEMPERATURE
from labgym.units import DROP_ML

_WRITTEN = re.compile(r"(?<![\d.])(?:\d{1,3} x )?(-?\d{1,9}(?:\.\d{1,9})?) (g|mL|mmol|mol|equiv|M|%|parts)(?![A-Za-z])")
_WORD = re.compile(
    r"(?<![-\w])(half-concentrated|saturated|concentrated|dilute|aqueous|excess|catalytic|glacial|half-saturated|little|equal|or)\b"
)
_UNITS = {"N": "M", "vol": "parts", "ppm": "parts", "equiv": "eq", "drops": "mL"}
_SCORED = frozenset(("T", "t", "rate", "p", "pH", "atm"))
_NAMED = {"rt": ROOM_TEMPERATURE, "ice": 0.0, "overnight": OVERNIGHT_MIN}
_RATES = {"rapidly": "quickly", "high vacuum": "vacuum", "gradually": "slowly", "carefully": "slowly"}
Value = tuple[str, float | str]
"""A unit or kind with a number or a word."""


@dataclass(frozen=True)
class Tuple:
    """An operation with one substance.

    Attributes:
        substance: as written, or None.
        amounts: by unit (g, mL, mol, eq, M, %, parts, "word").
        conditions: of the action, on its first tuple only.
    """

    order: int
    op: str
    substance: str | None
    span: tuple[int, int] | None
    amounts: tuple[Value, ...] = ()
    conditions: tuple[Value, ...] = ()
    phase: str | None = None
    repeat: int = 1


@dataclass(frozen=True)
class GoldText:
    """A text with its tuples and outcome."""

    id: str
    text: str
    outcome: str
    tuples: tuple[Tuple, ...]


def read_gold(path: str | Path, texts: str | Path | None = None) -> list[GoldText]:
    """Return the texts of a gold file.

    Args:
        path: the gold, one JSON object a line.
        texts: a file of texts, one JSON object with `id` and `text` a line, if the gold has none.

    Raises:
        DocumentError: a line is not a gold text, has no text, or its text has another hash.
    """
    known = {_text(texts, number, line, "id"): _text(texts, number, line, "text") for number, line in _lines(texts)}
    found = []
    for number, line in _lines(path):
        name = _text(path, number, line, "id")
        text = _text(path, number, line, "text") if line.get("text") else known.get(name)
        if text is None:
            raise DocumentError(path, f"line {number}", "has no text: name the file of the texts")
        digest = hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()
        if "hash" in line and not (line["hash"] and digest.startswith(str(line["hash"]))):
            raise DocumentError(
                path,
                f"line {number}",
                f"the text of {name[:80]!r} has another hash: take the texts that were annotated",
            )
        try:
            tuples = tuple(_gold_tuple(item) for item in line["tuples"])
            hash(tuples)
        except (AttributeError, KeyError, IndexError, TypeError, ValueError) as error:
            reason = f"{type(error).__name__}: {' '.join(str(error).split())[:120]}"
            raise DocumentError(path, f"line {number}", f"not a gold text ({reason})") from None
        found.append(GoldText(name, text, _text(path, number, line, "outcome"), tuples))
    return found


def _text(source: str | Path | None, number: int, line: dict[str, Any], name: str) -> str:
    text = line.get(name)
    if not isinstance(text, str):
        raise DocumentError(source, f"line {number}.{name}", "expected a text")
    return text


def _lines(path: str | Path | None) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the number and the object of each line that is not empty; nothing without a file."""
    for number, line in enumerate(read_bytes(path, MAX_BYTES).splitlines(), 1) if path is not None else ():
        if line.strip():
            data = parse_json(line, f"{path} line {number}")
            if not isinstance(data, dict):
                raise DocumentError(path, f"line {number}", "expected a JSON object")
            yield number, data


def _gold_tuple(item: dict[str, Any]) -> Tuple:
    span = item.get("substance_span")
    return Tuple(
        int(item["order"]),
        str(item["op"]),
        item["substance"],
        (int(span[0]), int(span[1])) if span else None,
        tuple(sorted((_gold_amount(part) for part in item["amount"]), key=str)),
        tuple(value for part in item["conditions"] if (value := _gold_condition(part)) is not None),
        item.get("phase"),
        int(item.get("repeat", 1)),
    )


def _gold_amount(part: dict[str, Any]) -> Value:
    if "word" in part:
        return ("mL", 3 * DROP_ML) if part["word"] == "few drops" else ("word", part["word"])
    value = (part["value"] + part["to"]) / 2.0 if "to" in part else part["value"]
    return _UNITS.get(part["unit"], part["unit"]), value * DROP_ML if part["unit"] == "drops" else value


def _gold_condition(part: dict[str, Any]) -> Value | None:
    kind = part["kind"]
    if kind not in _SCORED or part.get("word") == "reflux":
        return None
    if "word" in part:
        word = str(part["word"])
        return kind, _NAMED.get(word, _RATES.get(word, word))
    value = part.get("ramp", part["value"])
    value = _NAMED.get(value, value) if isinstance(value, str) else value
    return kind, (value + part["to"]) / 2.0 if "to" in part and isinstance(value, float | int) else value


def tuples(actions: ActionList) -> list[Tuple]:
    """Return the tuples of a read procedure, as the gold has them."""
    found = []
    for order, action in enumerate(actions.actions, 1):
        conditions = tuple(_conditions(action))
        portions = (*action.takes, *action.gives)
        phase = action.keep or (action.part if action.part != "solution" else None)
        if action.part == "solution":
            found.append(Tuple(order, action.verb, action.note.split(";")[0] or "solution", None, (), conditions))
            conditions = ()
        elif action.verb == "Refers":
            found.append(Tuple(order, "Refers", action.note, None))
        elif not portions:
            found.append(Tuple(order, action.verb, None, None, (), conditions, phase, action.repeats))
        for portion in portions:
            amounts = tuple(sorted(_amounts(portion.amount), key=str))
            found.append(
                Tuple(order, action.verb, portion.name, portion.span, amounts, conditions, phase, action.repeats)
            )
            conditions = ()
    return found


def _amounts(text: str) -> Iterator[Value]:
    for match in _WRITTEN.finditer(text):
        unit = match[2]
        value = float(match[1])
        yield ("mol", value / 1000.0) if unit == "mmol" else (_UNITS.get(unit, unit), value)
    for match in _WORD.finditer(text):
        yield "word", match[1]


def _conditions(action: Action) -> Iterator[Value]:
    for period in action.periods:
        if period.temperature is not None:
            yield "T", period.temperature
        if period.duration is not None:
            yield "t", period.duration
    if action.manner:
        yield "rate", action.manner
    if action.pressure is not None:
        yield "p", action.pressure
    if action.ph is not None:
        yield "pH", action.ph
    if action.atmosphere == "vacuum":
        yield "p", "vacuum"
    elif action.atmosphere is not None:
        yield "atm", action.atmosphere
