"""Protocols from templates: the kind of reaction gives the frame, the text overrides everything that it states."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

from labgym.assets import Catalog
from labgym.protocols.amounts import read_amount
from labgym.protocols.apparatus import bath_for, millilitres, vessel_for
from labgym.protocols.constraints import derive
from labgym.protocols.errors import RefusalError
from labgym.protocols.model import Protocol
from labgym.protocols.refusals import refusals, refuse_mixture, refuse_solvent
from labgym.protocols.retrieval import SearchResults
from labgym.protocols.synthesis.builder import ProtocolBuilder
from labgym.protocols.synthesis.conditions import (
    NEAR_BOILING,
    Hold,
    addition_temperature,
    boiling_point,
    holds,
    is_period,
    periods,
)
from labgym.protocols.synthesis.frame import (
    clean_up,
    is_gas,
    is_liquid,
    is_pyrophoric,
    is_solid,
    short_name,
    weigh_first,
)
from labgym.protocols.synthesis.library_experiments import from_library
from labgym.protocols.synthesis.operations import Operation
from labgym.protocols.synthesis.phases import Mixture
from labgym.protocols.synthesis.precedents import precedent
from labgym.protocols.synthesis.reading import Clause, ParsedDescription
from labgym.protocols.synthesis.roles import ASSUMED, PROTECTIVE_GASES, Participant, cast
from labgym.protocols.synthesis.stages import stages
from labgym.protocols.synthesis.transformations import Transformation, recognise, transformations
from labgym.protocols.synthesis.workup import WorkUp, work_up_steps
from labgym.protocols.synthesis.writer import Commission, WriterResult
from labgym.quantities import ROOM_RANGE, ROOM_TEMPERATURE, Condition

SHARED_REAGENTS = 2
"""Number of reagents of the nearest protocol that a text without words for a reaction must name to be taken for it."""
AIRLESS = frozenset({"Magnesium", "PalladiumOnCarbon", "RaneyNickel", "TetrakisTriphenylphosphinePalladium"})
"""Metals and catalysts that work, or are safe next to a solvent, only without air."""
_DILUTES = re.compile(r"\bdilut|稀释", re.IGNORECASE)
QUENCHES = frozenset(
    (
        "HydrochloricAcid",
        "DeionizedWater",
        "AmmoniumChloride",
        "SodiumBicarbonate",
        "SodiumThiosulfate",
        "SodiumBisulfite",
    )
)
"""Reagents that end a reaction when they are added after its reaction time."""
CANDIDATES = 4
"""Number of kinds of reaction that are tried on a text, best first."""
FORMATION, COLD_ADDITION = 30.0, 5.0
"""Time in which a Grignard reagent forms, minutes; temperature at which its substrate is added, degrees Celsius."""
ADDITION = 15.0
"""Usual duration of an addition, minutes."""
BALLOON, PRESSURE_VESSEL = "HydrogenBalloon", "HydrogenationApparatus"
BALLOON_BAR, VESSEL_BAR = 1.2, 5.0
"""Highest absolute pressures of a balloon and of the hydrogenation apparatus (4 bar above the air's), bar."""
SOLVENT_ROLES = ("solvent", "co-solvent", "alcohol and solvent", "base and solvent")
PURIFICATIONS = {
    "Recrystallize": "recrystallization",
    "Chromatograph": "column chromatography",
    "Distill": "distillation",
}
DECISIVE = (
    *("oxidizer", "reducing_agent", "chlorinating_agent", "brominating_agent", "halogenating_agent", "acylating_agent"),
    *("alkylating_agent", "organometallic", "active_metal", "halogen", "azide", "cyanide", "sulfonylating_agent"),
    *("silylating_agent", "coupling_agent", "organic_reagent", "lewis_acid"),
)
"""Categories of reagents that determine the reaction."""


class TemplateWriter:
    """Writes protocols without a language model; the same text gives the same protocol."""

    def write(self, commission: Commission) -> WriterResult:
        """Return a protocol whose names, amounts and conditions come from the text, else from the table.

        A reaction without a template is taken from the library of experiments.

        Raises:
            RefusalError: no kind of reaction fits the text, no vessel or bath is suitable, or reagents must not meet.
        """
        description = commission.description
        _refuse_nothing(description)
        unwritten = transformations().unwritten.first_in(description.text)
        if unwritten:
            return from_library(commission, unwritten)
        first: RefusalError | None = None
        for kind in _kinds(description, commission.context)[:CANDIDATES]:
            try:
                return _written(kind, commission)
            except RefusalError as refusal:
                if refusal.reason != "no-reaction":
                    raise first or refusal from None
                first = first or refusal
        if first is not None:
            raise first
        _refuse_purification(description)
        examples = ", ".join(sorted(other.name for other in transformations().transformations)[:6])
        raise RefusalError(
            "no-reaction", f"no reaction is recognized in the text; templates are for example: {examples}"
        )


def _written(kind: Transformation, commission: Commission) -> WriterResult:
    """Return the protocol of one kind of reaction.

    Raises:
        RefusalError: the text does not fit the kind, or cannot be carried out.
    """
    description, catalog = commission.description, commission.catalog
    before, after = _parted(kind, description.clauses, catalog)
    assignment = cast(kind, before, catalog)
    parts = assignment.parts
    _refuse_mismatch(kind, parts)
    refuse_solvent([p.asset.name for p in parts], [p.asset.name for p in parts if p.role in SOLVENT_ROLES])
    builder = ProtocolBuilder(catalog)
    reaction = _Reaction(builder, kind, commission, before, parts)
    reaction.carry_out()
    mixture = Mixture.of(parts, reaction.hottest, reaction.vessel, reaction.volume, kind.action == "Distill")
    work_up = WorkUp(builder, kind, mixture, assignment.factor)
    for step in work_up_steps(kind, after, mixture, catalog):
        work_up.carry_out(step)
    _analyse(builder, kind, after)
    clean_up(builder)
    weigh_first(builder, reaction.vessel)
    refuse_mixture(use.name for use in builder.reagents)
    assumed = [*dict.fromkeys(work_up.assumed)]
    if assumed:
        builder.notes.append(f"work-up completed with: {', '.join(assumed)}")
    builder.notes[:0] = _assumptions(kind, parts)
    return WriterResult(_protocol(description, kind, builder, parts), tuple(builder.notes))


class _Reaction:
    """The steps from the empty flask to the finished reaction."""

    def __init__(
        self,
        builder: ProtocolBuilder,
        kind: Transformation,
        commission: Commission,
        clauses: Sequence[Clause],
        parts: Sequence[Participant],
    ) -> None:
        self.builder, self.kind, self.clauses, self.parts = builder, kind, clauses, parts
        self.catalog = builder.catalog
        self.volume = millilitres((part.asset, part.amount) for part in parts)
        self.adding = addition_temperature(kind, clauses)
        self.gas = _pressure(clauses)
        self.inert = _protective_gas(commission.description, parts)
        self.stages = stages(clauses, parts, is_period) if not any(is_gas(part.asset) for part in parts) else ()
        usual = holds(kind, clauses, parts, precedent(commission.context, parts), builder.notes)
        self.holds = self._staged_holds(usual) if self.stages else usual
        self.hottest = max(period.temperature for period in self.holds)
        smallest = vessel_for(self.volume, self.catalog)
        late = any(stage.added for stage in self.stages) or any(part.when == "add" for part in parts)
        necks = (self.hottest > ROOM_RANGE[1] or self.inert) and late
        self.vessel = "ThreeNeckFlask" if necks and smallest == "RoundBottomFlask" else smallest
        for period in self.holds:
            point = boiling_point(parts)
            if period.bath is not None and point is not None and period.bath > point[0] + NEAR_BOILING:
                above = f"{period.bath:g} C is above the boiling point of {point[1]}"
                builder.notes.append(f"{above}: refluxed at {point[0]:g} C with the bath at {period.bath:g} C")

    def _staged_holds(self, usual: Sequence[Hold]) -> tuple[Hold, ...]:
        """Return the periods of all stages; the usual one if the text gives none."""
        stretches = tuple(
            period
            for stage in self.stages
            for period in periods(self.kind, stage.periods, self.parts, stage.temperature)
        )
        return stretches or tuple(usual)

    def carry_out(self) -> None:
        """Append the steps."""
        for part in self.parts:
            pressed = self.gas is not None and is_gas(part.asset)
            amount = "from the cylinder" if pressed else part.amount
            self.builder.take(part.asset, _role(part), amount)
        self._protect()
        if self._forms_reagent():
            self._carry_out_organometallic()
        elif self.stages:
            self._carry_out_stages()
        else:
            charged = tuple(part for part in self.parts if part.when != "add")
            added = tuple(part for part in self.parts if part.when == "add")
            self._charge(charged, self.adding if added else None)
            coldest = min(self.adding, self.hottest)
            self._add(added, coldest, _addition_time(self.clauses))
            if any(clause.warmed for clause in self.clauses) and not added and self.adding < ROOM_RANGE[0]:
                self._cool(self.adding)
            for period in self.holds:
                self._hold(period)
        if self.inert and any(part.asset.name == "Hydrogen" for part in self.parts):
            self._purge(f"Replace the hydrogen with {self._name(self.inert)} three times.", self.inert)
        if any(clause.operation and clause.operation.action == "Monitor" for clause in self.clauses):
            self.builder.do("Monitor", "Follow the reaction by TLC until the starting material is gone.")

    def _forms_reagent(self) -> bool:
        """Return whether an organometallic reagent forms first, and the text leaves open for how long."""
        metal = any(part.role == "metal" for part in self.parts)
        return metal and not any(stage.periods for stage in self.stages[:-1])

    def _carry_out_organometallic(self) -> None:
        """Append the steps of a Grignard reaction: the reagent forms before the substrate is added."""
        late = [part for part in self.parts if part.when == "add"]
        halides = [part for part in late if part.role == "halide"]
        self._charge([part for part in self.parts if part.when != "add"], ROOM_TEMPERATURE)
        self._add(halides, ROOM_TEMPERATURE, ADDITION)
        point = boiling_point(self.parts)
        boiling = point[0] if point is not None else ROOM_TEMPERATURE
        self._hold(Hold("Reflux", round(boiling, 1), FORMATION))
        self._add([part for part in late if part not in halides], min(self.adding, COLD_ADDITION), ADDITION)
        for period in self.holds:
            self._hold(period)

    def _carry_out_stages(self) -> None:
        timed = any(stage.periods for stage in self.stages)
        for stage in self.stages:
            at = stage.temperature
            if at is None and stage.added and not any(clause.temperature is not None for clause in self.clauses):
                at = self.kind.add_temperature
            at = at if at is not None else min(self.adding, ROOM_TEMPERATURE) if stage.added else ROOM_TEMPERATURE
            self._charge(stage.charged, at if stage.added else None)
            self._add(stage.added, at, stage.minutes or ADDITION)
            for period in periods(self.kind, stage.periods, self.parts, stage.temperature):
                self._hold(period)
        if not timed:
            for period in self.holds:
                self._hold(period)

    def _name(self, name: str) -> str:
        return short_name(name, self.catalog)

    def _described(self, part: Participant) -> str:
        return f"{self._name(part.asset.name)} ({part.amount.removesuffix(ASSUMED)})"

    def _purge(self, text: str, gas: str) -> None:
        self.builder.do("Purge", text, (gas,), ROOM_TEMPERATURE, vessel=(self.vessel,), gas=("SchlenkLine",))

    def _cool(self, temperature: float) -> None:
        text = f"Cool the flask to {temperature:g} C."
        self.builder.do("Cool", text, (), temperature, vessel=(self.vessel,), bath=bath_for(temperature))

    def _charge(self, charged: Sequence[Participant], before_addition: float | None) -> None:
        """Append the step that puts reagents into the flask, cooled or warmed for an addition where one follows."""
        if not charged:
            return
        names = tuple(part.asset.name for part in charged)
        cylinder = ("GraduatedCylinder",) if any(_pours(part) for part in charged) else ()
        cold = before_addition is not None and before_addition < ROOM_RANGE[0]
        shield, line = (" under inert gas", ("SchlenkLine",)) if self.inert else ("", ())
        text = f"Charge the {self._name(self.vessel)} with {', '.join(map(self._described, charged))}{shield} and stir"
        text += f"; cool to {before_addition:g} C." if cold else "."
        at = before_addition if cold and before_addition is not None else ROOM_TEMPERATURE
        self.builder.do(
            "MakeSolution",
            text,
            names,
            at,
            vessel=(self.vessel,),
            bath=bath_for(at),
            gas=line,
            funnel=cylinder,
            extras=self.kind.extras,
        )

    def _protect(self) -> None:
        if self.inert:
            gas = next((part.asset.name for part in self.parts if part.asset.name in PROTECTIVE_GASES), None)
            name = gas or self.builder.take(self.catalog.get(self.inert), "protective gas", "from the cylinder")
            text = f"Evacuate and fill the flask with {self._name(name)} three times on the Schlenk line."
            self._purge(text, name)

    def _add(self, added: Sequence[Participant], temperature: float, minutes: float) -> None:
        """Append the steps that add reagents in order, one step for each run of liquids or of solids."""
        runs = groupby(added, key=lambda part: (is_gas(part.asset), _pours(part)))
        for (gaseous, liquid), run in runs:
            parts = tuple(run)
            if gaseous:
                self._fill(parts)
                continue
            how = "Add slowly" if liquid else "Add in small portions"
            what = ", then ".join(map(self._described, parts))
            shield = " under inert gas" if self.inert else ""
            self.builder.do(
                "Add",
                f"{how} {what}{shield} at {temperature:g} C.",
                tuple(part.asset.name for part in parts),
                temperature,
                minutes,
                vessel=(self.vessel,),
                bath=bath_for(temperature),
                gas=("SchlenkLine",) if self.inert else (),
                funnel=("DroppingFunnel",) if liquid else (),
                extras=tuple(name for name in self.kind.extras if name != BALLOON),
            )

    def _fill(self, parts: Sequence[Participant]) -> None:
        """Append the step that replaces the air by a gas, from a balloon or under pressure."""
        names = tuple(part.asset.name for part in parts)
        gas = ", then ".join(self._name(name) for name in names)
        text = f"Evacuate the flask and fill it with {gas} from the balloon three times."
        extras: tuple[str, ...] = self.kind.extras
        if self.gas is not None:
            text = f"Evacuate the bottle and fill it with {gas} three times; set {self.gas.text}."
            extras = (PRESSURE_VESSEL,)
        self.builder.do(
            "Purge",
            text,
            names,
            ROOM_TEMPERATURE,
            None,
            "Add",
            vessel=(self.vessel,),
            bath=bath_for(ROOM_TEMPERATURE),
            gas=("SchlenkLine",) if self.inert else (),
            extras=extras,
        )

    def _hold(self, period: Hold) -> None:
        at, minutes = f"{period.temperature:g} C", f"{period.duration:g} min"
        bath = f" (bath at {period.bath:g} C)" if period.bath is not None else ""
        shield = " under inert gas" if self.inert else ""
        texts = {
            "Stir": f"Stir at {at} for {minutes}{shield}.",
            "Heat": f"Stir at {at} for {minutes}{shield}.",
            "Reflux": f"Fit the condenser and reflux at {at}{bath} for {minutes}{shield}.",
            "Distill": f"Heat to {at} and distil the product off as it forms, {minutes}.",
        }
        cooling = ("RefluxCondenser",) if period.action in ("Reflux", "Heat") and period.temperature > 45.0 else ()
        still = ("VacuumAdapter", "PearShapedFlask") if period.action == "Distill" else ()
        pressed = (PRESSURE_VESSEL,) if self.gas is not None else None
        self.builder.do(
            period.action,
            texts[period.action] + (f" Keep {self.gas.text} of hydrogen." if self.gas is not None else ""),
            (),
            period.temperature,
            period.duration,
            "Heat",
            vessel=(self.vessel,),
            bath=bath_for(period.temperature),
            gas=("SchlenkLine",) if self.inert else (),
            condenser=(*cooling, *still),
            extras=pressed or self.kind.extras,
        )


def _refuse_nothing(description: ParsedDescription) -> None:
    """Raise an error unless a description names a substance.

    Raises:
        RefusalError: it names no substance.
    """
    if not any(m.kind in ("reagent", "class") for clause in description.clauses for m in clause.mentions):
        raise RefusalError("no-chemistry", "the text names no substance of the catalog: say what reacts with what")


def _refuse_purification(description: ParsedDescription) -> None:
    """Raise an error if a description contains only a purification.

    Raises:
        RefusalError: it describes only a purification.
    """
    purifying = [c.operation.action for c in description.clauses if c.operation and c.operation.phase == "purification"]
    if purifying:
        action = PURIFICATIONS.get(purifying[0], purifying[0].lower())
        message = f"the text describes a {action} alone; a protocol needs a reaction of one of the seven types"
        raise RefusalError("no-reaction", f"{message}: describe how the crude product is made")


def _kinds(description: ParsedDescription, context: SearchResults) -> tuple[Transformation, ...]:
    """Return the kinds of reaction that the text may mean, best first; else that of the nearest protocol."""
    kinds = recognise(description.spoken_of)
    if kinds:
        return kinds
    named = {m.name for clause in description.clauses for m in clause.mentions if m.kind in ("reagent", "class")}
    for hit in context.hits:
        for other in transformations().transformations:
            slots = {name for slot in other.slots for name in (slot.asset, *slot.accepts)}
            if other.like == hit.fragment.source and len(slots & named) >= SHARED_REAGENTS:
                return (other,)
    return ()


def _pressure(clauses: Sequence[Clause]) -> Condition | None:
    """Return the pressure above that of the air that the text gives, or None.

    Raises:
        RefusalError: no vessel of the catalog is built for it.
    """
    stated = next((c.pressure for c in clauses if c.pressure is not None and c.pressure.value > BALLOON_BAR), None)
    if stated is not None and stated.value > VESSEL_BAR:
        message = (
            f"{stated.text} is above the {VESSEL_BAR:g} bar that {PRESSURE_VESSEL} is built for: lower the pressure"
        )
        raise RefusalError("infeasible", message)
    return stated


def _refuse_mismatch(kind: Transformation, parts: Sequence[Participant]) -> None:
    """Raise an error unless the participants fit the kind of reaction.

    Raises:
        RefusalError: the text names a decisive reagent that the reaction does not use, and a required one is missing.
    """
    roles = {slot.role for slot in kind.slots}
    extra = [p.asset for p in parts if p.when == "add" and p.role not in roles]
    strange = [asset.name for asset in extra if asset.category in DECISIVE or asset.name == "Hydrogen"]
    missing = [p.asset.name for p in parts if not p.named and p.role in roles and p.asset.category in DECISIVE]
    if strange and missing:
        message = f"no template uses {strange[0]} as the text does; the nearest, {kind.name!r}, takes {missing[0]}"
        raise RefusalError("no-reaction", message)


def _parted(kind: Transformation, clauses: Sequence[Clause], catalog: Catalog) -> tuple[list[Clause], list[Clause]]:
    """Return the clauses of the reaction and those after it.

    A clause after the reaction belongs to it where it brings in a reagent that the reaction needs, as copper chloride
    that a diazonium salt is poured into.
    """
    needed = {name for slot in kind.slots for name in (slot.asset, *slot.accepts)}
    ends = {kind.quench.asset} if kind.quench is not None else set()
    before: list[Clause] = []
    after: list[Clause] = []
    for clause in clauses:
        ending = _ending(kind, clause, before, catalog)
        clause = replace(clause, operation=ending) if ending is not None else clause
        phase = clause.operation.phase if clause.operation else "reaction"
        present = {name for earlier in before for name in earlier.names("reagent")}
        brings = set(clause.names("reagent")) & (needed - ends - present)
        reacting = phase == "reaction" and not after
        (before if reacting or (phase == "quench" and brings and not after) or not before else after).append(clause)
    return before, after


def _ending(kind: Transformation, clause: Clause, before: Sequence[Clause], catalog: Catalog) -> Operation | None:
    """Return the operation of a clause that ends a reaction which was left to react, or None.

    "stir 2 h, add dilute acid" quenches; "stir 2 h, dilute with ether" begins the extraction.
    """
    needed = {name for slot in kind.slots for name in (slot.asset, *slot.accepts)}
    reagents = set(clause.names("reagent"))
    adds = clause.operation is not None and clause.operation.action == "Add"
    if not adds or not reagents or not any(c.duration for c in before):
        return None
    if reagents <= QUENCHES - needed:
        return Operation("Quench", "quench", 0)
    organic = all(catalog.get(name).category == "organic_solvent" for name in reagents)
    return Operation("Extract", "workup", 0) if _DILUTES.search(clause.text) and organic else None


def _protective_gas(description: ParsedDescription, parts: Sequence[Participant]) -> str:
    """Return the protective gas that is needed, or ""."""
    if "ArgonGas" in description.spoken_of or "argon" in description.text.lower():
        return "ArgonGas"
    asked = "NitrogenGas" in description.spoken_of or "inert" in description.text.lower() or "氮气" in description.text
    spoilt = refusals().destroyed_by_protic | AIRLESS
    needed = any(is_pyrophoric(part.asset) or part.asset.name in spoilt for part in parts)
    return "NitrogenGas" if asked or needed else ""


def _addition_time(clauses: Sequence[Clause]) -> float:
    stated = [c.duration for c in clauses if c.operation and c.operation.action == "Add" and c.duration]
    return stated[0] if stated else ADDITION


def _analyse(builder: ProtocolBuilder, kind: Transformation, clauses: Sequence[Clause]) -> None:
    catalog = builder.catalog
    names = dict.fromkeys(name for clause in clauses for name in clause.names("instrument"))
    devices = [name for name in names if catalog.get(name).category == "analytical"] or [kind.analysis]
    tube = ("NMRTube",) if any("NMR" in name for name in devices) else ()
    words = " and ".join(short_name(name, catalog) for name in devices)
    builder.do("Analyze", f"Check the identity and purity of the product ({words}).", device=(*devices, *tube))


def _assumptions(kind: Transformation, parts: Sequence[Participant]) -> list[str]:
    notes = [f"{p.asset.name} stands in for the {p.stands_for} of the text" for p in parts if p.stands_for]
    notes.append(f"written as: {kind.name} (template {kind.id}, like {kind.like})")
    unnamed = [part.asset.name for part in parts if not part.named]
    if unnamed:
        notes.append(f"not named in the text and assumed: {', '.join(unnamed)}")
    return notes


def _protocol(
    description: ParsedDescription, kind: Transformation, builder: ProtocolBuilder, parts: Sequence[Participant]
) -> Protocol:
    digest = hashlib.sha256(description.text.encode()).hexdigest()[:10]
    product = description.product or kind.product
    stand_ins = "".join(f" {p.asset.name} stands in for the {p.stands_for}." for p in parts if p.stands_for)
    return derive(
        Protocol(
            id=f"{kind.id}-{digest}",
            name=kind.name,
            reaction_type=kind.type,
            product=product,
            description=f"{kind.name}, giving {product}.{stand_ins} Written from the text: {description.text[:1000]}",
            reagents=builder.reagents,
            instruments=builder.instruments,
            steps=tuple(builder.steps),
        ),
        builder.catalog,
    )


def _pours(part: Participant) -> bool:
    """Return whether a reagent is poured: a liquid, or a solid as a solution."""
    dissolved = is_solid(part.asset) and read_amount(part.amount).volume is not None
    return is_liquid(part.asset) or dissolved


def _role(part: Participant) -> str:
    return f"{part.role} (stands in for the {part.stands_for})" if part.stands_for else part.role
