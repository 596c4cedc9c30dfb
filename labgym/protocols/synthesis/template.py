"""Protocols from templates: the kind of reaction gives the frame, the text everything that it states."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import replace

from labgym.assets import Asset, Catalog
from labgym.protocols.constraints import derive
from labgym.protocols.model import Protocol
from labgym.protocols.retrieval import Results
from labgym.protocols.synthesis.apparatus import ROOM, bath_for, millilitres, vessel_for
from labgym.protocols.synthesis.bench import HOOD, Bench
from labgym.protocols.synthesis.conditions import Hold, addition_temperature, holds
from labgym.protocols.synthesis.errors import RefusalError
from labgym.protocols.synthesis.frame import clean_up, is_pyrophoric, weigh_first, words
from labgym.protocols.synthesis.operations import Operation
from labgym.protocols.synthesis.precedents import precedent
from labgym.protocols.synthesis.reading import Clause, Reading
from labgym.protocols.synthesis.refusals import refusals, refuse_mixture, refuse_solvent
from labgym.protocols.synthesis.roles import ASSUMED, PROTECTIVE_GASES, Part, cast
from labgym.protocols.synthesis.transformations import Transformation, recognise, transformations
from labgym.protocols.synthesis.workup import WorkUp, tasks
from labgym.protocols.synthesis.writer import Commission, Draft

KNOWN = 2
"""How many reagents of the nearest protocol a text without words for a reaction must name to be taken for it."""
AIRLESS = frozenset({"Magnesium", "PalladiumOnCarbon", "RaneyNickel", "TetrakisTriphenylphosphinePalladium"})
"""Metals and catalysts that work, or are safe beside a solvent, without air alone."""
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
"""What is added to end a reaction once it has been left to react."""
DECISIVE = (
    *("oxidizer", "reducing_agent", "chlorinating_agent", "brominating_agent", "halogenating_agent", "acylating_agent"),
    *("alkylating_agent", "organometallic", "active_metal", "halogen", "azide", "cyanide", "sulfonylating_agent"),
    *("silylating_agent", "coupling_agent", "organic_reagent", "lewis_acid"),
)
"""Categories of reagents that make a reaction what it is."""


class TemplateWriter:
    """Writes protocols without a language model; the same text gives the same protocol."""

    def write(self, commission: Commission) -> Draft:
        """Return a protocol whose names, amounts and conditions come from the text, then from the table.

        Raises:
            RefusalError: no kind of reaction is recognised, a vessel or bath is lacking, or reagents must not meet.
        """
        reading = commission.reading
        kind = _kind(reading, commission.context)
        before, after = _parted(kind, reading.clauses)
        chosen = cast(kind, before)
        parts = chosen.parts
        if not any(part.named and part.when != "medium" for part in parts):
            message = f"nothing in the text takes part in {kind.name!r}: name the substance that reacts"
            raise RefusalError("no-reaction", message)
        _refuse_mismatch(kind, parts)
        refuse_solvent([p.asset.name for p in parts], [p.asset.name for p in parts if "solvent" in p.role])
        bench = Bench()
        reaction = _Reaction(bench, kind, commission, before, parts)
        reaction.carry_out()
        work_up = WorkUp(bench, kind, reaction.volume, chosen.factor, reaction.vessel)
        for task in tasks(kind, after, [part.asset for part in parts]):
            work_up.carry_out(task)
        _analyse(bench, kind, after)
        clean_up(bench)
        weigh_first(bench, reaction.vessel)
        refuse_mixture(use.name for use in bench.reagents)
        bench.notes[:0] = _assumptions(kind, parts)
        return Draft(_protocol(reading, kind, bench, parts), tuple(bench.notes))


class _Reaction:
    """The steps from the empty flask to the finished reaction."""

    def __init__(
        self,
        bench: Bench,
        kind: Transformation,
        commission: Commission,
        clauses: Sequence[Clause],
        parts: Sequence[Part],
    ) -> None:
        self.bench, self.kind, self.clauses, self.parts = bench, kind, clauses, parts
        self.volume = millilitres((part.asset, part.amount) for part in parts)
        self.holds = holds(kind, clauses, parts, precedent(commission.context, parts), bench.notes)
        self.adding = addition_temperature(kind, clauses)
        self.inert = _wants_inert(commission.reading, parts)
        heated = any(hold.temperature > ROOM[1] for hold in self.holds)
        smallest = vessel_for(self.volume)
        self.vessel = (
            "ThreeNeckFlask" if (heated or self.inert) and smallest == "RoundBottomFlask" and self.dropped else smallest
        )

    @property
    def dropped(self) -> tuple[Part, ...]:
        """The parts that are added after the others."""
        return tuple(part for part in self.parts if part.when == "add")

    @property
    def charged(self) -> tuple[Part, ...]:
        """The parts that are in the flask before."""
        return tuple(part for part in self.parts if part.when != "add")

    def carry_out(self) -> None:
        """Append the steps."""
        for part in self.parts:
            self.bench.take(part.asset, _role(part), part.amount)
        self._protect()
        self._charge()
        self._add()
        for hold in self.holds:
            self._hold(hold)
        if self.inert and any(part.asset.name == "Hydrogen" for part in self.parts):
            uses = (self.vessel, "SchlenkLine", self.inert)
            self.bench.do("Purge", f"Replace the hydrogen by {words(self.inert)} three times.", uses, HOOD, 22.0, 10.0)
        if any(clause.operation and clause.operation.action == "Monitor" for clause in self.clauses):
            self.bench.do(
                "Monitor",
                "Follow the reaction by TLC until the starting material is gone.",
                ("TLCPlate", "TLCChamber"),
                HOOD,
                None,
                10.0,
            )

    def _charge(self) -> None:
        charged = self.charged
        if not charged:
            return
        names = tuple(part.asset.name for part in charged)
        measured = ("GraduatedCylinder",) if any(_liquid(part.asset) for part in charged) else ()
        cold = self.adding < ROOM[0] and bool(self.dropped)
        shield, line = (" under inert gas", ("SchlenkLine",)) if self.inert else ("", ())
        text = f"Charge the {words(self.vessel)} with {', '.join(_given(part) for part in charged)}{shield} and stir"
        text += f"; cool to {self.adding:g} C." if cold else "."
        at = self.adding if cold else 22.0
        self.bench.do(
            "MakeSolution",
            text,
            (self.vessel, *bath_for(at), *measured, *line, *self.kind.extras, *names),
            HOOD,
            at,
            10.0,
        )

    def _protect(self) -> None:
        if self.inert:
            gas = next((part.asset.name for part in self.parts if part.asset.name in PROTECTIVE_GASES), None)
            name = gas or self.bench.take(Catalog.load().get(self.inert), "protective gas", "from the cylinder")
            text = f"Evacuate and fill the flask with {words(name)} three times on the Schlenk line."
            self.bench.do("Purge", text, (self.vessel, "SchlenkLine", name), HOOD, 22.0, 10.0)

    def _add(self) -> None:
        for gaseous in (False, True):
            parts = [part for part in self.dropped if _gas(part.asset) is gaseous]
            if not parts:
                continue
            names = tuple(part.asset.name for part in parts)
            funnel = ("DroppingFunnel",) if any(_liquid(part.asset) for part in parts) else ()
            how = (
                "Fill the flask from the balloon with"
                if gaseous
                else "Add slowly"
                if funnel
                else "Add in small portions"
            )
            what = ", then ".join(_given(part) for part in parts)
            at = 22.0 if gaseous else min(self.adding, max(hold.temperature for hold in self.holds))
            line = ("SchlenkLine",) if self.inert else ()
            shield = " under inert gas" if self.inert else ""
            uses = (*funnel, self.vessel, *bath_for(at), *line, *self.kind.extras, *names)
            self.bench.do(
                "Purge" if gaseous else "Add",
                f"{how} {what}{shield} at {at:g} C.",
                uses,
                HOOD,
                at,
                _addition_time(self.clauses),
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
        uses = (self.vessel, *bath_for(hold.temperature), *cooling, *still, *self.kind.extras)
        self.bench.do(hold.action, texts[hold.action], uses, HOOD, hold.temperature, hold.duration)


def _kind(reading: Reading, context: Results) -> Transformation:
    """Return the kind of reaction by what the text speaks of, else that of the nearest protocol of the library."""
    named = {
        mention.name
        for clause in reading.clauses
        for mention in clause.mentions
        if mention.kind in ("reagent", "class")
    }
    if not named:
        raise RefusalError("no-chemistry", "the text names no substance of the catalogue: say what reacts with what")
    unwritten = transformations().unwritten.found(reading.text)
    if unwritten:
        raise RefusalError("no-reaction", f"there is no template for a reaction called {unwritten!r}")
    kind = recognise(reading.spoken_of)
    if kind is not None:
        return kind
    for hit in context.hits:
        for other in transformations().transformations:
            wanted = {name for slot in other.slots for name in (slot.asset, *slot.accepts)}
            if other.like == hit.fragment.source and len(wanted & named) >= KNOWN:
                return other
    known = ", ".join(sorted(other.name for other in transformations().transformations)[:6])
    raise RefusalError("no-reaction", f"no reaction is recognised in the text; known are for example: {known}")


def _refuse_mismatch(kind: Transformation, parts: Sequence[Part]) -> None:
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


def _wants_inert(reading: Reading, parts: Sequence[Part]) -> str:
    """Return the protective gas that is needed, or ""."""
    if "ArgonGas" in reading.spoken_of or "argon" in reading.text.lower():
        return "ArgonGas"
    asked = "NitrogenGas" in reading.spoken_of or "inert" in reading.text.lower() or "氮气" in reading.text
    spoilt = refusals().destroyed_by_protic | AIRLESS
    needed = any(is_pyrophoric(part.asset) or part.asset.name in spoilt for part in parts)
    return "NitrogenGas" if asked or needed else ""


def _addition_time(clauses: Sequence[Clause]) -> float:
    stated = [c.duration for c in clauses if c.operation and c.operation.action == "Add" and c.duration]
    return stated[0] if stated else 15.0


def _analyse(bench: Bench, kind: Transformation, clauses: Sequence[Clause]) -> None:
    named = [name for clause in clauses for name in clause.names("instrument")]
    devices = [name for name in dict.fromkeys(named) if Catalog.load().get(name).category == "analytical"] or [
        kind.analysis
    ]
    tube = ("NMRTube",) if any("NMR" in name for name in devices) else ()
    named_so = " and ".join(words(name) for name in devices)
    bench.do(
        "Analyze",
        f"Check identity and purity of the product with the {named_so}.",
        (*devices, *tube),
        "ValidationPlatform",
        None,
        20.0,
    )


def _assumptions(kind: Transformation, parts: Sequence[Part]) -> list[str]:
    notes = [f"written as: {kind.name} (template {kind.id}, like {kind.like})"]
    notes += [f"{p.asset.name} stands in for the {p.stands_for} of the text" for p in parts if p.stands_for]
    unnamed = [part.asset.name for part in parts if not part.named]
    if unnamed:
        notes.append(f"not named in the text and assumed: {', '.join(unnamed)}")
    return notes


def _protocol(reading: Reading, kind: Transformation, bench: Bench, parts: Sequence[Part]) -> Protocol:
    digest = hashlib.sha256(reading.text.encode()).hexdigest()[:10]
    product = reading.product or kind.product
    stand_ins = "".join(f" {p.asset.name} stands in for the {p.stands_for}." for p in parts if p.stands_for)
    return derive(
        Protocol(
            id=f"{kind.id}-{digest}",
            name=kind.name,
            reaction_type=kind.type,
            product=product,
            description=f"{kind.name}, giving {product}.{stand_ins} Written from the text: {reading.text[:1000]}",
            reagents=bench.reagents,
            instruments=bench.instruments,
            steps=tuple(bench.steps),
        )
    )


def _role(part: Part) -> str:
    return f"{part.role} (stands in for the {part.stands_for})" if part.stands_for else part.role


def _given(part: Part) -> str:
    return f"{words(part.asset.name)} ({part.amount.removesuffix(ASSUMED)})"


def _liquid(asset: Asset) -> bool:
    return asset.chemistry is not None and asset.chemistry.state == "liquid"


def _gas(asset: Asset) -> bool:
    return asset.chemistry is not None and asset.chemistry.state == "gas"
