"""Protocols from templates: the kind of reaction gives the frame, the text overrides everything that it states."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace

from labgym.protocols.apparatus import bath_for, millilitres, vessel_for
from labgym.protocols.constraints import derive
from labgym.protocols.errors import RefusalError
from labgym.protocols.model import Protocol
from labgym.protocols.refusals import refusals, refuse_mixture, refuse_solvent
from labgym.protocols.retrieval import SearchResults
from labgym.protocols.synthesis.builder import ProtocolBuilder
from labgym.protocols.synthesis.conditions import Hold, addition_temperature, holds
from labgym.protocols.synthesis.frame import clean_up, is_gas, is_liquid, is_pyrophoric, short_name, weigh_first
from labgym.protocols.synthesis.operations import Operation
from labgym.protocols.synthesis.precedents import precedent
from labgym.protocols.synthesis.reading import Clause, ParsedDescription
from labgym.protocols.synthesis.roles import ASSUMED, PROTECTIVE_GASES, Participant, cast
from labgym.protocols.synthesis.transformations import Transformation, recognise, transformations
from labgym.protocols.synthesis.workup import WorkUp, work_up_steps
from labgym.protocols.synthesis.writer import Commission, WriterResult
from labgym.quantities import ROOM_RANGE, ROOM_TEMPERATURE

SHARED_REAGENTS = 2
"""Number of reagents of the nearest protocol that a text without words for a reaction must name to be taken for it."""
AIRLESS = frozenset({"Magnesium", "PalladiumOnCarbon", "RaneyNickel", "TetrakisTriphenylphosphinePalladium"})
"""Metals and catalysts that work, or are safe next to a solvent, only without air."""
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

        Raises:
            RefusalError: no kind of reaction is recognized, no vessel or bath is suitable, or reagents must not meet.
        """
        description = commission.description
        kind = _kind(description, commission.context)
        before, after = _parted(kind, description.clauses)
        catalog = commission.catalog
        assignment = cast(kind, before, catalog)
        parts = assignment.parts
        if not any(part.named and part.when != "medium" for part in parts):
            message = f"nothing in the text takes part in {kind.name!r}: name the substance that reacts"
            raise RefusalError("no-reaction", message)
        _refuse_mismatch(kind, parts)
        refuse_solvent([p.asset.name for p in parts], [p.asset.name for p in parts if "solvent" in p.role])
        builder = ProtocolBuilder(catalog)
        reaction = _Reaction(builder, kind, commission, before, parts)
        reaction.carry_out()
        work_up = WorkUp(builder, kind, reaction.volume, assignment.factor, reaction.vessel)
        for step in work_up_steps(kind, after, [part.asset for part in parts], catalog):
            work_up.carry_out(step)
        _analyse(builder, kind, after)
        clean_up(builder)
        weigh_first(builder, reaction.vessel)
        refuse_mixture(use.name for use in builder.reagents)
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
        self.holds = holds(kind, clauses, parts, precedent(commission.context, parts), builder.notes)
        self.adding = addition_temperature(kind, clauses)
        self.inert = _wants_inert(commission.description, parts)
        heated = any(hold.temperature > ROOM_RANGE[1] for hold in self.holds)
        smallest = vessel_for(self.volume, self.catalog)
        self.vessel = (
            "ThreeNeckFlask" if (heated or self.inert) and smallest == "RoundBottomFlask" and self.dropped else smallest
        )

    @property
    def dropped(self) -> tuple[Participant, ...]:
        """The parts that are added after the others."""
        return tuple(part for part in self.parts if part.when == "add")

    @property
    def charged(self) -> tuple[Participant, ...]:
        """The parts that are in the flask before."""
        return tuple(part for part in self.parts if part.when != "add")

    def carry_out(self) -> None:
        """Append the steps."""
        for part in self.parts:
            self.builder.take(part.asset, _role(part), part.amount)
        self._protect()
        self._charge()
        self._add()
        for hold in self.holds:
            self._hold(hold)
        if self.inert and any(part.asset.name == "Hydrogen" for part in self.parts):
            self._purge(f"Replace the hydrogen with {self._name(self.inert)} three times.", self.inert)
        if any(clause.operation and clause.operation.action == "Monitor" for clause in self.clauses):
            self.builder.do("Monitor", "Follow the reaction by TLC until the starting material is gone.")

    def _name(self, name: str) -> str:
        return short_name(name, self.catalog)

    def _described(self, part: Participant) -> str:
        return f"{self._name(part.asset.name)} ({part.amount.removesuffix(ASSUMED)})"

    def _purge(self, text: str, gas: str) -> None:
        self.builder.do("Purge", text, (gas,), ROOM_TEMPERATURE, vessel=(self.vessel,), gas=("SchlenkLine",))

    def _charge(self) -> None:
        charged = self.charged
        if not charged:
            return
        names = tuple(part.asset.name for part in charged)
        cylinder = ("GraduatedCylinder",) if any(is_liquid(part.asset) for part in charged) else ()
        cold = self.adding < ROOM_RANGE[0] and bool(self.dropped)
        shield, line = (" under inert gas", ("SchlenkLine",)) if self.inert else ("", ())
        text = f"Charge the {self._name(self.vessel)} with {', '.join(map(self._described, charged))}{shield} and stir"
        text += f"; cool to {self.adding:g} C." if cold else "."
        at = self.adding if cold else ROOM_TEMPERATURE
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

    def _add(self) -> None:
        for gaseous in (False, True):
            parts = [part for part in self.dropped if is_gas(part.asset) is gaseous]
            if not parts:
                continue
            names = tuple(part.asset.name for part in parts)
            funnel = ("DroppingFunnel",) if any(is_liquid(part.asset) for part in parts) else ()
            how = (
                "Fill the flask from the balloon with"
                if gaseous
                else "Add slowly"
                if funnel
                else "Add in small portions"
            )
            what = ", then ".join(map(self._described, parts))
            at = ROOM_TEMPERATURE if gaseous else min(self.adding, max(hold.temperature for hold in self.holds))
            line = ("SchlenkLine",) if self.inert else ()
            shield = " under inert gas" if self.inert else ""
            self.builder.do(
                "Purge" if gaseous else "Add",
                f"{how} {what}{shield} at {at:g} C.",
                names,
                at,
                _addition_time(self.clauses),
                "Add",
                vessel=(self.vessel,),
                bath=bath_for(at),
                gas=line,
                funnel=funnel,
                extras=self.kind.extras,
            )

    def _hold(self, hold: Hold) -> None:
        texts = {
            "Stir": f"Stir at {hold.temperature:g} C for {hold.duration:g} min.",
            "Heat": f"Stir at {hold.temperature:g} C for {hold.duration:g} min.",
            "Reflux": f"Fit the condenser and reflux at {hold.temperature:g} C for {hold.duration:g} min.",
            "Distill": f"Heat to {hold.temperature:g} C and distil the product off as it forms, {hold.duration:g} min.",
        }
        cooling = ("RefluxCondenser",) if hold.action in ("Reflux", "Heat") and hold.temperature > 45.0 else ()
        still = ("VacuumAdapter", "PearShapedFlask") if hold.action == "Distill" else ()
        self.builder.do(
            hold.action,
            texts[hold.action],
            (),
            hold.temperature,
            hold.duration,
            "Heat",
            vessel=(self.vessel,),
            bath=bath_for(hold.temperature),
            condenser=(*cooling, *still),
            extras=self.kind.extras,
        )


def _kind(description: ParsedDescription, context: SearchResults) -> Transformation:
    """Return the kind of reaction by what the text speaks of, else that of the nearest protocol of the library."""
    named = {
        mention.name
        for clause in description.clauses
        for mention in clause.mentions
        if mention.kind in ("reagent", "class")
    }
    if not named:
        raise RefusalError("no-chemistry", "the text names no substance of the catalogue: say what reacts with what")
    unwritten = transformations().unwritten.first_in(description.text)
    if unwritten:
        raise RefusalError("no-reaction", f"there is no template for a reaction called {unwritten!r}")
    kind = recognise(description.spoken_of)
    if kind is not None:
        return kind
    for hit in context.hits:
        for other in transformations().transformations:
            wanted = {name for slot in other.slots for name in (slot.asset, *slot.accepts)}
            if other.like == hit.fragment.source and len(wanted & named) >= SHARED_REAGENTS:
                return other
    known = ", ".join(sorted(other.name for other in transformations().transformations)[:6])
    raise RefusalError("no-reaction", f"no reaction is recognised in the text; known are for example: {known}")


def _refuse_mismatch(kind: Transformation, parts: Sequence[Participant]) -> None:
    """Pass a cast that fits the kind of reaction.

    Raises:
        RefusalError: the text names a decisive reagent that has no part in it, while one that has is missing.
    """
    roles = {slot.role for slot in kind.slots}
    strange = [p.asset.name for p in parts if p.when == "add" and p.role not in roles and p.asset.category in DECISIVE]
    missing = [p.asset.name for p in parts if not p.named and p.role in roles and p.asset.category in DECISIVE]
    if strange and missing:
        message = (
            f"{strange[0]} has no part in {kind.name!r}, which would need {missing[0]}: describe the reaction further"
        )
        raise RefusalError("no-reaction", message)


def _parted(kind: Transformation, clauses: Sequence[Clause]) -> tuple[list[Clause], list[Clause]]:
    """Return the clauses of the reaction and those of what comes after.

    A clause after the reaction belongs to it where it brings in a reagent that the reaction needs, as copper chloride
    that a diazonium salt is poured into.
    """
    needed = {name for slot in kind.slots for name in (slot.asset, *slot.accepts)}
    ends = {kind.quench.asset} if kind.quench is not None else set()
    before: list[Clause] = []
    after: list[Clause] = []
    for clause in clauses:
        if _ends_reaction(kind, clause, before):
            clause = replace(clause, operation=Operation("Quench", "quench", 0))
        phase = clause.operation.phase if clause.operation else "reaction"
        held = {name for earlier in before for name in earlier.names("reagent")}
        brings = set(clause.names("reagent")) & (needed - ends - held)
        reacting = phase == "reaction" and not after
        (before if reacting or (phase == "quench" and brings and not after) or not before else after).append(clause)
    return before, after


def _ends_reaction(kind: Transformation, clause: Clause, before: Sequence[Clause]) -> bool:
    """Say whether a clause adds what ends a reaction that was left to react: "stir 2 h, add dilute acid"."""
    needed = {name for slot in kind.slots for name in (slot.asset, *slot.accepts)}
    reagents = set(clause.names("reagent"))
    adds = clause.operation is not None and clause.operation.action == "Add"
    return adds and any(c.duration for c in before) and bool(reagents) and reagents <= QUENCHES - needed


def _wants_inert(description: ParsedDescription, parts: Sequence[Participant]) -> str:
    """Return the protective gas that is needed, or ""."""
    if "ArgonGas" in description.spoken_of or "argon" in description.text.lower():
        return "ArgonGas"
    asked = "NitrogenGas" in description.spoken_of or "inert" in description.text.lower() or "氮气" in description.text
    spoilt = refusals().destroyed_by_protic | AIRLESS
    needed = any(is_pyrophoric(part.asset) or part.asset.name in spoilt for part in parts)
    return "NitrogenGas" if asked or needed else ""


def _addition_time(clauses: Sequence[Clause]) -> float:
    stated = [c.duration for c in clauses if c.operation and c.operation.action == "Add" and c.duration]
    return stated[0] if stated else 15.0


def _analyse(builder: ProtocolBuilder, kind: Transformation, clauses: Sequence[Clause]) -> None:
    catalog = builder.catalog
    names = dict.fromkeys(name for clause in clauses for name in clause.names("instrument"))
    devices = [name for name in names if catalog.get(name).category == "analytical"] or [kind.analysis]
    tube = ("NMRTube",) if any("NMR" in name for name in devices) else ()
    words = " and ".join(short_name(name, catalog) for name in devices)
    builder.do("Analyze", f"Check identity and purity of the product with the {words}.", device=(*devices, *tube))


def _assumptions(kind: Transformation, parts: Sequence[Participant]) -> list[str]:
    notes = [f"written as: {kind.name} (template {kind.id}, like {kind.like})"]
    notes += [f"{p.asset.name} stands in for the {p.stands_for} of the text" for p in parts if p.stands_for]
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


def _role(part: Participant) -> str:
    return f"{part.role} (stands in for the {part.stands_for})" if part.stands_for else part.role
