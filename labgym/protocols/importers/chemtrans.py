"""ChemTrans: two text files of descriptions and instructions, line by line; the instructions alone suffice.

A line consists of operations in square brackets with fields, joined by "&":

    [ add ] reagent: ( name: water & volume: 5 mL & ) & [ settemp ] temperature: 80 C & time: 2 h

The brackets of the published files do not always balance: a name without an opening bracket is read as if it had one,
and a line that is still ambiguous is rejected. ChemActor's tables are read too: comma-separated values with such a line
in the column `action_labels`.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

from labgym.documents import read_bytes
from labgym.errors import DocumentError
from labgym.protocols.experiments import Action, Experiment, Material, Portion
from labgym.protocols.experiments.model import Role, Verb
from labgym.protocols.importers.records import Records, UnreadableError, record, slug
from labgym.quantities import duration, temperature, value_of

MAX_LINE = 50_000
MAX_BYTES = 256 * 1024**2
INSTRUCTIONS, DESCRIPTIONS = "_out.txt", "_inp.txt"
LABELS, TITLE = "action_labels", "reaction_name"
VERBS: dict[str, Verb] = {
    "add": "Add",
    "column": "Chromatograph",
    "distill": "Distill",
    "dry": "DrySolution",
    "evaporate": "Concentrate",
    "extract": "Extract",
    "filter": "Filter",
    "partition": "Partition",
    "quench": "Quench",
    "recrystallize": "Recrystallize",
    "reflux": "Reflux",
    "settemp": "SetTemperature",
    "transfer": "Transfer",
    "triturate": "Triturate",
    "wash": "Wash",
    "yield": "Yield",
}
_OPERATION = re.compile(r"\[\s*([a-z]+)\s*\]")
_FIELD = re.compile(
    r"(?:^|&)\s*(reagent\((?:adsorbent|eluent)\)|mass\(yield\)|reagent|temperature|time|pressure|phase|appearance|yield"
    r"|N/A)\s*:"
)
_REAGENT_FIELD = re.compile(
    r"(?:^|&)\s*(name|type|mass|mole|volume|concentration|equivalent|batch:each|batch:total|batch|speed|temperature|note)\s*:"
)
_WORKING_UP: frozenset[Verb] = frozenset(
    ("DrySolution", "Extract", "Partition", "Quench", "Recrystallize", "Triturate", "Wash", "Filter", "Chromatograph")
)
_CLOSED = re.compile(r"&\s*\)|&\s*(?=reagent:)")
"""The end of a reagent's fields; its closing bracket may be missing."""
_AMOUNTS = ("mass", "volume", "mole", "concentration")
_COUNT = re.compile(r"(?:^|\D)(\d{1,2})\s*+(?:(?:x|×|times)\s*+)?$")


def files(folder: Path) -> list[Path]:
    """Return the files of instructions and the CSV files of a folder.

    Raises:
        DocumentError: the folder holds no such file.
    """
    listed = sorted(folder.glob(f"*{INSTRUCTIONS}")) + sorted(folder.glob("*.csv"))
    if not listed:
        raise DocumentError(folder, "", f"holds no *{INSTRUCTIONS} and no *.csv")
    return listed


def companions(file: Path) -> list[Path]:
    """Return the file of descriptions that belongs to a file of instructions, if it exists."""
    other = file.with_name(file.name.replace(INSTRUCTIONS, DESCRIPTIONS))
    return [other] if other != file and other.is_file() else []


def read(file: Path, folder: Path) -> Records:  # noqa: ARG001 -- a record's place is the file's name and the line
    """Return the experiments of a file of instructions, or of a CSV file.

    The descriptions are read from the file next to the instructions, if it exists.

    Raises:
        DocumentError: the file is neither.
    """
    lines = _labelled(file) if file.suffix.lower() == ".csv" else _paired(file)
    for number, (title, description, instructions) in enumerate(lines, 1):
        build = partial(_experiment, _stem(file), number, title, description, instructions)
        yield record(f"{file.name}:{number}", build)


def _stem(path: Path) -> str:
    name = path.name.removesuffix(INSTRUCTIONS).removesuffix(".csv").removesuffix(".txt")
    return slug(name)[:60] or "file"


def _paired(path: Path) -> Iterator[tuple[str, str, str]]:
    instructions = _lines(path)
    others = companions(path)
    descriptions = _lines(others[0]) if others else [""] * len(instructions)
    if len(descriptions) != len(instructions):
        problem = (
            f"has {len(descriptions)} lines, but {path.name} has {len(instructions)}; the files must match line by line"
        )
        raise DocumentError(others[0], "", problem)
    for description, line in zip(descriptions, instructions, strict=True):
        yield "", description, line


def _labelled(path: Path) -> Iterator[tuple[str, str, str]]:
    lines = _lines(path)
    reader = csv.DictReader((f"{line}\n" for line in lines), strict=True)
    try:
        if LABELS not in (reader.fieldnames or ()):
            raise DocumentError(path, "", f"has no column {LABELS!r}")
        for row in reader:
            yield row.get(TITLE) or "", "", row[LABELS] or ""
    except csv.Error as error:
        raise DocumentError(path, "", f"not comma-separated values, line {reader.line_num}: {error}") from None


def _lines(path: Path) -> list[str]:
    try:
        text = read_bytes(path, MAX_BYTES).decode("utf-8").removesuffix("\n")
    except UnicodeDecodeError:
        raise DocumentError(path, "", "not UTF-8 text") from None
    return [line.removesuffix("\r") for line in text.split("\n")]


def _experiment(stem: str, number: int, title: str, description: str, line: str) -> Experiment:
    if len(line) > MAX_LINE:
        raise UnreadableError(f"longer than {MAX_LINE} characters")
    marks = list(_OPERATION.finditer(line))
    if not marks or line[: marks[0].start()].strip(" &"):
        raise UnreadableError("it does not begin with an operation in square brackets")
    materials: dict[str, Material] = {}
    actions: list[Action] = []
    product = ""
    for mark, following in zip(marks, [*marks[1:], None], strict=True):
        body = line[mark.end() : following.start() if following else len(line)]
        verb = VERBS.get(mark[1])
        if verb is None:
            raise UnreadableError(f"the operation {mark[1][:40]!r} is not known")
        fields = _fields(body, _FIELD)
        reagents = [_reagent(text) for key, text in fields if key == "reagent"]
        if verb == "Yield":
            product = next((item["name"] for item in reagents), product)
            amount = "; ".join(text for key, text in fields if key in ("mass(yield)", "yield", "appearance"))
            actions.append(Action(verb="Yield", note=amount[:400]))
            continue
        reagents += [{"name": text} for key, text in fields if key.startswith("reagent(")]
        actions.append(_action(verb, reagents, dict(fields), materials))
    return Experiment(
        id=f"chemtrans_{stem}_{number}",
        name=(title or product or f"Line {number} of {stem}")[:300],
        product=product[:500],
        description=description[:4000],
        materials=tuple(materials.values()),
        actions=tuple(actions),
        origin="chemtrans",
    )


def _action(
    verb: Verb, reagents: list[dict[str, str]], fields: dict[str, str], materials: dict[str, Material]
) -> Action:
    role: Role = "workup" if verb in _WORKING_UP else "reagent"
    takes = []
    for reagent in reagents:
        materials.setdefault(reagent["name"], Material(name=reagent["name"], role=role))
        takes.append(Portion(name=reagent["name"], amount=_amount(reagent)))
    speed = " ".join(reagent.get("speed", "") for reagent in reagents).lower()
    phase = fields.get("phase", "").lower()
    numbers = {
        "temperature": temperature(fields.get("temperature", "")),
        "time": duration(fields.get("time", "")),
        "pressure": value_of(fields.get("pressure", ""), "pressure", default="torr"),
    }
    unread = [fields[key] for key, value in numbers.items() if value is None and fields.get(key)]
    values = {
        "temperature": numbers["temperature"],
        "duration": numbers["time"] if numbers["time"] is not None else duration(speed),
        "pressure": numbers["pressure"],
        "keep": next((part for part in ("organic", "aqueous", "filtrate") if part in phase), None),
        "manner": next((word for word in ("dropwise", "portionwise", "slowly") if word in speed), None),
        "note": "; ".join(unread)[:400],
    }
    stated = {key: value for key, value in values.items() if value not in (None, "")}
    return Action.model_validate({"verb": verb, "takes": takes, **stated})


def _reagent(text: str) -> dict[str, str]:
    """Return the fields of a reagent; the brackets around them may be missing."""
    inner = text.strip().removeprefix("(").strip()
    inner = _CLOSED.split(inner)[0]
    fields = dict(_fields(inner.rstrip(" &"), _REAGENT_FIELD))
    name = " ".join(fields.get("name", "").split()).rstrip(".,;")
    if not name:
        raise UnreadableError(f"a reagent has no name: {text.strip()[:60]!r}")
    return {**fields, "name": name[:200]}


def _amount(reagent: dict[str, str]) -> str:
    """Return mass, volume, moles and concentration as one amount, with the portions first: "2 x 100 mL"."""
    parts = [" ".join(reagent[key].split()).rstrip(".,;") for key in _AMOUNTS if reagent.get(key)]
    count = _COUNT.search(" ".join(reagent.get("batch:each", "").split())[-40:])
    if parts and count and int(count[1]) > 1:
        parts[0] = f"{count[1]} x {parts[0]}"
    return ", ".join(parts)[:200]


def _fields(text: str, pattern: re.Pattern[str]) -> list[tuple[str, str]]:
    """Return keys with the texts after them; the fields of a reagent stay in the text of its brackets."""
    fields: list[tuple[str, str]] = []
    masked = _masked(text) if pattern is _FIELD else text
    marks: list[Any] = list(pattern.finditer(masked))
    if not marks:
        return []
    for mark, following in zip(marks, [*marks[1:], None], strict=True):
        value = text[mark.end() : following.start() if following else len(text)]
        fields.append((mark[1], value.strip().rstrip("&").strip()))
    return fields


def _masked(text: str) -> str:
    """Return the text, of the same length, with everything between a reagent's brackets blanked."""
    blanked = list(text)
    for mark in re.finditer(r"reagent:\s*(?:\(\s*)?(?=name:)", text):
        closed = _CLOSED.search(text, mark.end())
        stop = closed.start() if closed else len(text)
        blanked[mark.end() : stop] = "_" * (stop - mark.end())
    return "".join(blanked)
