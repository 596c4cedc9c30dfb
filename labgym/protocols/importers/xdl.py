"""XDL, the chemical description language: XML files of one synthesis each.

Both shapes of the language are read: reagents by `id` and by `name`, one procedure or one in phases. What only moves
the machine along (cleaning, stopping a stirrer, confirming) is no action of the experiment and left out; a step that is
not known turns the file down, since what it does cannot be told.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from pydantic import ValidationError

from labgym.documents import document_error
from labgym.errors import DocumentError
from labgym.protocols.experiments import Action, Experiment, Material, Portion, Rejection
from labgym.protocols.experiments.model import Role, Verb
from labgym.protocols.importers.markup import read_xml
from labgym.quantities import ROOM_RANGE, ROOM_TEMPERATURE, value_of

SUFFIXES = (".xdl", ".xml")
MAX_ACTIONS = 300
MAX_VISITS = 20_000
"""Actions of an experiment, and steps that are looked at, repeats counted."""
_NUMBER = re.compile(r"[0-9]{1,4}")

MACHINE = frozenset(
    (
        *("StopStir", "StopHeatChill", "CleanVessel", "CleanBackbone", "CleanTubing", "ResetHandling", "Confirm"),
        *("Await", "PrimePumpForAdd", "StartVacuum", "StopVacuum", "StopPurge", "SwitchArgon", "SwitchVacuum"),
        "Shutdown",
    )
)
"""Steps that tend the machine, not the experiment."""
NESTING = frozenset(("Prep", "Reaction", "Workup", "Purification", "Async", "Procedure", "Step"))
"""Elements that only group steps."""
_ROLES: dict[str, Role] = {
    "substrate": "reactant",
    "reactant": "reactant",
    "catalyst": "catalyst",
    "ligand": "catalyst",
    "solvent": "solvent",
    "quenching-agent": "workup",
    "workup": "workup",
}
_GASES = {"nitrogen": "nitrogen", "n2": "nitrogen", "argon": "argon", "ar": "argon", "hydrogen": "hydrogen"}


class _UnknownStepError(Exception):
    """A step, or a loop, that cannot be told as actions."""


@dataclass
class _Bench:
    """The actions so far, and how each material was used."""

    actions: list[Action] = field(default_factory=list)
    uses: dict[str, set[Verb]] = field(default_factory=dict)
    visited: int = 0

    def do(self, verb: Verb, *takes: Portion, **conditions: Any) -> None:
        given = {name: value for name, value in conditions.items() if value not in (None, "")}
        if len(self.actions) == MAX_ACTIONS:
            raise _UnknownStepError(f"it has more than {MAX_ACTIONS} actions")
        self.actions.append(Action.model_validate({"verb": verb, "takes": takes, **given}))
        for portion in takes:
            self.uses.setdefault(portion.name, set()).add(verb)


def read(path: Path) -> Iterator[Experiment | Rejection]:
    """Return the experiment of an XDL file, or those of a folder's files in the order of their names.

    Raises:
        DocumentError: nothing to read, or, for a single file, it is not XDL.
    """
    if not path.is_dir():
        yield _experiment(path, path.name)
        return
    files = sorted(file for file in path.rglob("*") if file.suffix.lower() in SUFFIXES and file.is_file())
    if not files:
        raise DocumentError(path, "", f"holds no XDL files ({', '.join(SUFFIXES)})")
    for file in files:
        try:
            yield _experiment(file, str(file.relative_to(path)))
        except DocumentError as error:
            yield Rejection(str(file.relative_to(path)), str(error))


def _experiment(path: Path, place: str) -> Experiment | Rejection:
    root = read_xml(path)
    synthesis = root if root.tag == "Synthesis" else root.find("Synthesis")
    procedure = None if synthesis is None else synthesis.find("Procedure")
    if synthesis is None or procedure is None:
        raise DocumentError(path, "", "not XDL: it has no Synthesis with a Procedure")
    bench = _Bench()
    try:
        for step in procedure:
            _carry_out(step, bench)
        bench.do("Yield")
        return _written(place, path.stem, synthesis, bench)
    except _UnknownStepError as error:
        return Rejection(place, str(error))
    except ValidationError as error:
        return Rejection(place, str(document_error(place, error)))


def _written(place: str, stem: str, synthesis: Element, bench: _Bench) -> Experiment:
    metadata = synthesis.find("Metadata")
    told = {} if metadata is None else metadata.attrib
    given = re.sub(r"[^a-z0-9_-]+", "_", place.lower().rpartition(".")[0]).strip("_-")[-100:]
    product = told.get("product", "") or synthesis.get("product", "")
    stated = {_name(reagent): reagent.get("role", "") for reagent in synthesis.iter("Reagent")}
    materials = [Material(name=name, role=_role(stated.get(name, ""), verbs)) for name, verbs in bench.uses.items()]
    return Experiment(
        id=f"xdl_{given or 'file'}",
        name=(product or told.get("description", "") or stem)[:300],
        product=product[:500],
        description=told.get("description", "")[:4000],
        materials=tuple(materials),
        actions=tuple(bench.actions),
        origin="xdl",
    )


def _name(reagent: Element) -> str:
    return (reagent.get("name") or reagent.get("id") or "").strip()


def _role(stated: str, verbs: set[Verb]) -> Role:
    if stated.lower() in _ROLES:
        return _ROLES[stated.lower()]
    if verbs <= {"Wash", "Extract", "Quench", "DrySolution", "AdjustPH", "Recrystallize", "Filter", "Chromatograph"}:
        return "workup"
    return "solvent" if verbs <= {"Dissolve"} else "reagent"


def _carry_out(step: Element, bench: _Bench) -> None:
    """Append what a step and the steps in it do."""
    bench.visited += 1
    if bench.visited > MAX_VISITS:
        raise _UnknownStepError(f"its repeats come to more than {MAX_VISITS} steps")
    if step.tag in NESTING:
        for inner in step:
            _carry_out(inner, bench)
    elif step.tag == "Repeat":
        times = step.get("repeats", "")
        if not _NUMBER.fullmatch(times) or not 1 <= int(times) <= MAX_ACTIONS:
            raise _UnknownStepError(f"a Repeat has no number of repeats, got {times[:40]!r}")
        for _ in range(int(times)):
            for inner in step:
                _carry_out(inner, bench)
    elif step.tag in _STEPS:
        _STEPS[step.tag](step, bench)
    elif step.tag not in MACHINE:
        raise _UnknownStepError(f"step {step.tag[:60]!r} is not known")


def _conditions(step: Element) -> dict[str, Any]:
    """Return temperature, duration, pressure and atmosphere of a step."""
    texts = {
        "temp": step.get("temp", ""),
        "time": step.get("time", ""),
        "pressure": step.get("pressure") or step.get("vacuum_pressure") or step.get("vacuum") or "",
    }
    values = {
        "temp": value_of(texts["temp"], "temperature", default="degree_Celsius"),
        "time": value_of(texts["time"], "time", default="second"),
        "pressure": value_of(texts["pressure"], "pressure", default="millibar"),
    }
    unread = [f"{key} {text}" for key, text in texts.items() if text and values[key] is None]
    return {
        "note": "; ".join(unread)[:400],
        "temperature": values["temp"],
        "duration": values["time"],
        "pressure": values["pressure"],
        "atmosphere": _GASES.get((step.get("gas") or step.get("inert_gas") or "").lower()),
    }


def _portion(step: Element, of: str, *amounts: str) -> tuple[Portion, ...]:
    """Return what a step takes: the material named by one attribute, its amount by the first of others."""
    name = step.get(of, "").strip()
    if not name:
        return ()
    amount = next((step.get(key, "").strip() for key in amounts if step.get(key)), "")
    times = step.get("repeats") or step.get("repeat") or step.get("n_separations") or step.get("eluting_repeats") or ""
    if _NUMBER.fullmatch(times) and int(times) > 1 and amount:
        amount = f"{int(times)} x {amount}"
    return (Portion(name=name, amount=amount),)


def _add(step: Element, bench: _Bench) -> None:
    slowly = "dropwise" if step.get("dropwise", "").lower() == "true" else None
    portionwise = "portionwise" if step.get("portions") else None
    takes = _portion(step, "reagent", "volume", "mass", "amount", "mol")
    bench.do("Add", *takes, manner=slowly or portionwise, **_conditions(step))


def _heat_chill(step: Element, bench: _Bench) -> None:
    conditions = _conditions(step)
    at = conditions["temperature"]
    if at is None and step.get("temp"):
        bench.do("Heat", **conditions)
        return
    verb: Verb = (
        "Stir" if at is None or ROOM_RANGE[0] <= at <= ROOM_RANGE[1] else "Heat" if at > ROOM_RANGE[1] else "Cool"
    )
    bench.do(verb, **conditions)


def _separate(step: Element, bench: _Bench) -> None:
    takes = _portion(step, "solvent", "solvent_volume", "volume")
    lower = step.get("product_phase", "").lower() or {"true": "bottom", "false": "top"}.get(
        step.get("product_bottom", "").lower(), ""
    )
    verb: Verb = "Wash" if step.get("purpose", "").lower() == "wash" else "Extract" if takes else "PhaseSeparation"
    bench.do(verb, *takes, note=f"product in the {lower} layer" if lower in ("top", "bottom") else "")
    if step.get("through"):
        bench.do("DrySolution", *_portion(step, "through"))


def _filter(step: Element, bench: _Bench) -> None:
    bench.do("Filter", keep=None if step.get("filtrate_vessel") else "precipitate", **_conditions(step))


def _filter_through(step: Element, bench: _Bench) -> None:
    takes = (*_portion(step, "through"), *_portion(step, "eluting_solvent", "eluting_volume"))
    bench.do("Filter", *takes, keep="filtrate")


def _plain(verb: Verb, of: str = "", *amounts: str, **fixed: Any) -> Callable[[Element, _Bench], None]:
    """Return the reading of a step that is one action: its verb, what it takes, and its conditions."""

    def carry_out(step: Element, bench: _Bench) -> None:
        takes = _portion(step, of, *amounts) if of else ()
        bench.do(verb, *takes, **{**_conditions(step), **fixed})

    return carry_out


_STEPS: dict[str, Callable[[Element, _Bench], None]] = {
    "Add": _add,
    "AddSolid": _add,
    "Transfer": _plain("Transfer"),
    "TransferAllSolid": _plain("Transfer"),
    "Stir": _plain("Stir"),
    "StartStir": _plain("Stir"),
    "Wait": _plain("Wait"),
    "HeatChill": _heat_chill,
    "HeatChillToTemp": _plain("SetTemperature"),
    "StartHeatChill": _plain("SetTemperature"),
    "HeatChillReturnToRT": _plain("SetTemperature", temperature=ROOM_TEMPERATURE),
    "HeatChillSetTemp": _plain("SetTemperature"),
    "Reflux": _plain("Reflux"),
    "Microwave": _plain("Microwave"),
    "StartMicrowave": _plain("Microwave"),
    "Irradiate": _plain("Irradiate"),
    "Sonicate": _plain("Sonicate"),
    "Purge": _plain("Purge"),
    "StartPurge": _plain("Purge"),
    "EvacuateAndRefill": _plain("Purge"),
    "Evacuate": _plain("Purge", atmosphere="vacuum"),
    "Hydrogenate": _plain("Hydrogenate", atmosphere="hydrogen"),
    "Filter": _filter,
    "FilterThrough": _filter_through,
    "WashSolid": _plain("Wash", "solvent", "volume"),
    "Dry": _plain("DrySolid"),
    "Lyophilize": _plain("DrySolid", atmosphere="vacuum"),
    "Dissolve": _plain("Dissolve", "solvent", "volume"),
    "Crystallize": _plain("Crystallize"),
    "Precipitate": _plain("Crystallize", "reagent", "volume"),
    "Recrystallize": _plain("Recrystallize", "solvent", "volume"),
    "Evaporate": _plain("Concentrate"),
    "Rotavap": _plain("Concentrate"),
    "Distill": _plain("Distill"),
    "Sublimate": _plain("Sublime"),
    "Separate": _separate,
    "RunColumn": _plain("Chromatograph", "eluting_solvent", "volume"),
    "Neutralize": _plain("AdjustPH", "reagent", "volume", ph=7.0),
    "AdjustPH": _plain("AdjustPH", "reagent", "volume"),
}
