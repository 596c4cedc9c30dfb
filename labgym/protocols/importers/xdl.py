"""XDL, the chemical description language: XML files of one synthesis each.

Both versions of the language are read: reagents by `id` or by `name`, and a procedure with or without phases. Steps
that only operate the machine (cleaning, stopping a stirrer, confirming) are left out. An unknown step becomes a note.
Blueprints are carried out where they are called; of a file of blueprints alone, the first is read with its reagents.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from labgym.documents import read_bytes
from labgym.errors import DocumentError
from labgym.protocols.experiments import Action, Experiment, Material, Portion, Rejection
from labgym.protocols.experiments.model import Role, Verb, holding
from labgym.protocols.experiments.remarks import read_remark
from labgym.protocols.importers.records import Records, UnreadableError, printable, record, slug
from labgym.protocols.importers.xdl_scopes import MAX_BLUEPRINTS, Scope
from labgym.quantities import ROOM_TEMPERATURE, value_of
from labgym.quantities import amounts as quantities

MAX_BYTES = 8 * 1024**2
MAX_DEPTH = 40
MAX_ELEMENTS = 20_000
SUFFIXES = (".xdl", ".xml")
STRUCTURE = "SMILES "
COMMENT = "!--"
"""Tag of the elements that comments become."""
MAX_ACTIONS = 300
MAX_VISITS = 20_000
"""Largest numbers of actions of an experiment and of steps including repeats."""
_NUMBER, _PLAIN = re.compile(r"[0-9]{1,4}"), re.compile(r"[0-9]{1,6}(?:\.[0-9]{1,6})?")
_NUMBER_LIKE = re.compile(r"[-+]?(?:[.\d]|nan\b|inf)", re.IGNORECASE)
_TITLE = re.compile(r"^\s*(?:the\s+)?(?:synthesis|preparation) of\s++([^.;]{3,120}?)\s*+\.?\s*$", re.IGNORECASE)
MACHINE = frozenset(
    (
        *("StopStir", "StopHeatChill", "CleanVessel", "CleanBackbone", "CleanTubing", "ResetHandling", "Confirm"),
        *("Await", "PrimePumpForAdd", "StartVacuum", "StopVacuum", "StopPurge", "SwitchArgon", "SwitchVacuum"),
        "Shutdown",
    )
)
"""Steps that operate the machine and do not change the mixture."""
NESTING = frozenset(("Prep", "Reaction", "Workup", "Purification", "Async", "Procedure", "Step"))
"""Elements that only group steps."""
REPEATING = frozenset(("Repeat", "Loop"))
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


def read_xml(path: Path) -> Element:
    """Return the root element of a file.

    Raises:
        DocumentError: the file is missing, too large, not XML, nested too deeply, in an unsupported encoding, or has a
            document type definition.
    """
    return _Reader(path).read(read_bytes(path, MAX_BYTES))


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path, self.depth, self.elements = path, 0, 0
        self.tree = TreeBuilder()

    def read(self, content: bytes) -> Element:
        parser = expat.ParserCreate()
        parser.StartDoctypeDeclHandler = self._refuse
        parser.EntityDeclHandler = self._refuse
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self.tree.data
        parser.CommentHandler = self._comment
        try:
            parser.Parse(content, True)
        except expat.ExpatError as error:
            problem = f"not XML, line {error.lineno}: {expat.ErrorString(error.code)}"
            raise DocumentError(self.path, "", problem) from None
        except DocumentError:
            raise
        except (LookupError, ValueError):
            # expat raises ValueError for multi-byte encodings such as gb18030 and shift_jis.
            raise DocumentError(self.path, "", "in an encoding that is not supported; save it as UTF-8") from None
        return self.tree.close()

    def _refuse(self, *_: object) -> None:
        raise DocumentError(self.path, "", "has a document type definition, which is not allowed; remove it")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        self.elements += 1
        if self.depth > MAX_DEPTH or self.elements > MAX_ELEMENTS:
            problem = f"more than {MAX_DEPTH} levels deep or {MAX_ELEMENTS} elements long"
            raise DocumentError(self.path, "", problem)
        self.tree.start(tag, attributes)

    def _comment(self, text: str) -> None:
        if self.depth:
            self._start(COMMENT, {})
            self.tree.data(text)
            self._end(COMMENT)

    def _end(self, tag: str) -> None:
        self.depth -= 1
        self.tree.end(tag)


@dataclass
class _ActionList:
    """The actions so far, the verbs that used each material, and the blueprints by name."""

    blueprints: Mapping[str, Element]
    actions: list[Action] = field(default_factory=list)
    uses: dict[str, set[Verb]] = field(default_factory=dict)
    visited: int = 0
    comment: str = ""
    joined: tuple[Portion, ...] = ()

    def visit(self, steps: int) -> None:
        """Count steps, and whatever else takes as long."""
        self.visited += steps
        if self.visited > MAX_VISITS:
            raise UnreadableError(f"it has more than {MAX_VISITS} steps, repeats included")

    def do(self, verb: Verb, *takes: Portion, **conditions: Any) -> None:
        """Append an action, changed by a remark in the comment of its step, or keep its materials for the next one."""
        stated = {name: value for name, value in conditions.items() if value not in (None, "")}
        head, fields, note = read_remark(self.comment)
        self.comment = ""
        if note:
            stated["note"] = note[:400] if head or "note" not in stated else f"{stated['note']}; {note}"[:400]
        joined = fields.pop("joined", False)
        changed: dict[str, Any] = {key: fields.pop(key) for key in ("amount", "solvent") if key in fields}
        portions = [portion.model_dump() for portion in takes]
        portions[-1:] = [{**portion, **changed} for portion in portions[-1:]]
        action = Action.model_validate({"takes": portions, **stated, **fields, "verb": head or verb})
        action = action.model_copy(update={"takes": (*self.joined, *action.takes)})
        self.joined = action.takes if joined else ()
        for portion in action.takes:
            self.uses.setdefault(portion.name, set()).add(action.verb)
        if len(self.actions) == MAX_ACTIONS or len(self.joined) > MAX_ACTIONS:
            raise UnreadableError(f"it has more than {MAX_ACTIONS} actions")
        if not joined:
            self.actions.append(action)


def files(folder: Path) -> list[Path]:
    """Return the XDL files below a folder in the order of their names.

    Raises:
        DocumentError: the folder holds no XDL files.
    """
    listed = sorted(file for file in folder.rglob("*") if file.suffix.lower() in SUFFIXES and file.is_file())
    if not listed:
        raise DocumentError(folder, "", f"holds no XDL files ({', '.join(SUFFIXES)})")
    return listed


def read(file: Path, folder: Path, product: str = "") -> Records:
    """Return the experiment of an XDL file.

    Args:
        file: the file.
        folder: folder that its place is relative to.
        product: name of the product of a file that does not state one; "{stem}" stands for the file's name without
            suffix.

    Raises:
        DocumentError: the file is not XDL.
    """
    yield _file(file, str(file.relative_to(folder)), product)


def _file(path: Path, place: str, product: str) -> Experiment | Rejection:
    root = read_xml(path)
    blueprints = {item.get("id", ""): item for item in root.iterfind("Blueprint")}
    synthesis = root if root.tag == "Synthesis" else root.find("Synthesis")
    if synthesis is None:
        synthesis = next(iter(blueprints.values()), None)
    if synthesis is None or synthesis.find("Procedure") is None:
        raise DocumentError(path, "", "not XDL: it has no Synthesis with a Procedure")
    fallback = product.replace("{stem}", path.stem)
    return record(place, partial(_experiment, place, path.stem, synthesis, blueprints, fallback))


def _experiment(
    place: str, stem: str, synthesis: Element, blueprints: Mapping[str, Element], fallback: str
) -> Experiment:
    procedure = synthesis.find("Procedure")
    if procedure is None:
        raise UnreadableError("its Synthesis has no Procedure")
    actions = _ActionList(blueprints)
    scope = Scope.of(synthesis, {})
    for step in procedure:
        _carry_out(step, actions, scope)
    if actions.joined:
        actions.do("Add")
    if not actions.uses:
        raise UnreadableError("it takes no materials")
    actions.do("Yield")
    metadata = synthesis.find("Metadata")
    fields = {} if metadata is None else metadata.attrib
    product = _product(synthesis, fields) or fallback
    structures = {_name(reagent): _structure(reagent.get("comment", "")) for reagent in synthesis.iter("Reagent")}
    roles = {_name(reagent): reagent.get("role", "") for reagent in synthesis.iter("Reagent")}
    materials = [
        Material(name=name, role=_role(roles.get(name, ""), verbs), smiles=structures.get(name, ""))
        for name, verbs in actions.uses.items()
    ]
    equation = fields.get("smarts", "")
    return Experiment(
        id=f"xdl_{slug(place.rpartition('.')[0]).strip('_-')[-100:] or 'file'}",
        name=(product or fields.get("description", "") or stem)[:300],
        product=product[:500],
        reaction=equation if equation.count(">") == 2 and not equation.count(" ") else "",
        description=fields.get("description", "")[:4000],
        materials=tuple(materials),
        actions=tuple(actions.actions),
        origin="xdl",
    )


def _product(synthesis: Element, fields: Mapping[str, str]) -> str:
    """Return the product that the metadata state, also as a description "Synthesis of ...", or ""."""
    title = _TITLE.match(fields.get("description", ""))
    return fields.get("product", "") or synthesis.get("product", "") or (title[1] if title else "")


def _name(reagent: Element) -> str:
    return (reagent.get("name") or reagent.get("id") or "").strip()


def _structure(comment: str) -> str:
    """Return the SMILES that an exported reagent has in its comment, or ""."""
    return comment.removeprefix(STRUCTURE) if comment.startswith(STRUCTURE) else ""


def _role(stated: str, verbs: set[Verb]) -> Role:
    if stated.lower() in _ROLES:
        return _ROLES[stated.lower()]
    if verbs <= {"Wash", "Extract", "Quench", "DrySolution", "AdjustPH", "Recrystallize", "Filter", "Chromatograph"}:
        return "workup"
    return "solvent" if verbs <= {"Dissolve"} else "reagent"


def _carry_out(step: Element, actions: _ActionList, scope: Scope) -> None:
    """Append the actions of a step and of the steps in it."""
    actions.visit(1)
    if step.tag == COMMENT:
        actions.comment = (step.text or "").strip()
    elif step.tag in actions.blueprints:
        if scope.depth == MAX_BLUEPRINTS:
            raise UnreadableError(f"blueprint {step.tag[:60]!r} is nested more than {MAX_BLUEPRINTS} deep")
        blueprint = actions.blueprints[step.tag]
        inside = Scope.of(blueprint, scope.resolved(step).attrib, scope.depth + 1)
        actions.visit(len(inside.values))
        for inner in blueprint.iterfind("Procedure/*"):
            _carry_out(inner, actions, inside)
    elif step.tag in NESTING:
        for inner in step:
            _carry_out(inner, actions, scope)
    elif step.tag in REPEATING:
        _repeat(step, actions, scope)
    elif step.tag not in MACHINE:
        step = scope.resolved(step)
        if not read_remark(actions.comment)[0]:
            actions.comment = step.get("comment", "")
        _STEPS.get(step.tag, _unknown)(step, actions)
        actions.comment = ""


def _repeat(step: Element, actions: _ActionList, scope: Scope) -> None:
    """Append the actions of a repeat: over reagents or vessels, a number of times, or once if it runs until done."""
    times = scope.resolved(step).get("repeats", "1")
    if not _NUMBER.fullmatch(times) or int(times) > MAX_ACTIONS:
        raise UnreadableError(f"a Repeat needs a number of repeats up to {MAX_ACTIONS}, got {times[:40]!r}")
    looping = any("." in key and not key.startswith("param.") for key in step.attrib)
    actions.visit(len(scope.members) if looping else 0)
    for inside in scope.iterations(step) if looping else [scope] * int(times):
        actions.visit(1)
        for inner in step:
            _carry_out(inner, actions, inside)
    if not looping and "repeats" not in scope.resolved(step).attrib:
        actions.do("Note", note="the steps before this are repeated until a condition holds")


def _unknown(step: Element, actions: _ActionList) -> None:
    """Append a note of a step that is not known."""
    stated = ", ".join(f"{key} {value}" for key, value in step.items())
    actions.do("Note", note=printable(f"{step.tag}: {stated}" if stated else step.tag)[:400])


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
    """Return the material that one attribute names, with the amount from the first of the others that is set."""
    name = printable(step.get(of, ""))
    if not name:
        return ()
    amount = next((step.get(key, "").strip() for key in amounts if step.get(key)), "")
    if _NUMBER_LIKE.match(amount) and not quantities(amount) and not _PLAIN.fullmatch(amount):
        raise UnreadableError(f"the amount {amount[:40]!r} of {name[:60]!r} cannot be read: give it as 5 mL or 2 g")
    times = step.get("repeats") or step.get("repeat") or step.get("n_separations") or step.get("eluting_repeats") or ""
    if _NUMBER.fullmatch(times) and int(times) > 1 and amount:
        amount = f"{int(times)} x {amount}"
    return (Portion(name=name, amount=amount),)


def _add(step: Element, actions: _ActionList) -> None:
    slowly = "dropwise" if step.get("dropwise", "").lower() == "true" else None
    portionwise = "portionwise" if step.get("portions") else None
    takes = _portion(step, "reagent", "volume", "mass", "amount", "mol")
    actions.do("Add", *takes, manner=slowly or portionwise, **_conditions(step))


def _heat_chill(step: Element, actions: _ActionList) -> None:
    conditions = _conditions(step)
    at = conditions["temperature"]
    if at is None and step.get("temp"):
        actions.do("Heat", **conditions)
        return
    actions.do(holding(at), **conditions)


def _separate(step: Element, actions: _ActionList) -> None:
    takes = _portion(step, "solvent", "solvent_volume", "volume")
    layer = step.get("product_phase", "").lower() or {"true": "bottom", "false": "top"}.get(
        step.get("product_bottom", "").lower(), ""
    )
    verb: Verb = "Wash" if step.get("purpose", "").lower() == "wash" else "Extract" if takes else "PhaseSeparation"
    actions.do(verb, *takes, note=f"product in the {layer} layer" if layer in ("top", "bottom") else "")
    if step.get("through"):
        actions.do("DrySolution", *_portion(step, "through"))


def _filter(step: Element, actions: _ActionList) -> None:
    actions.do("Filter", keep=None if step.get("filtrate_vessel") else "precipitate", **_conditions(step))


def _filter_through(step: Element, actions: _ActionList) -> None:
    takes = (*_portion(step, "through"), *_portion(step, "eluting_solvent", "eluting_volume"))
    actions.do("Filter", *takes, keep="filtrate")


def _plain(verb: Verb, of: str = "", *amounts: str, **fixed: Any) -> Callable[[Element, _ActionList], None]:
    """Return the handler of a step that is one action: its verb, its material and its conditions."""

    def carry_out(step: Element, actions: _ActionList) -> None:
        takes = _portion(step, of, *amounts) if of else ()
        actions.do(verb, *takes, **{**_conditions(step), **fixed})

    return carry_out


_STEPS: dict[str, Callable[[Element, _ActionList], None]] = {
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
