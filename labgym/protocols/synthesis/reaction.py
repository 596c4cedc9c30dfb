"""The steps from the empty flask to the finished reaction, its protective gas and its pressure."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from labgym.protocols.amounts import read_amount
from labgym.protocols.apparatus import NECKED_VESSELS, REACTION_VESSELS, bath_for, millilitres, vessel_for
from labgym.protocols.errors import RefusalError
from labgym.protocols.refusals import refusals
from labgym.protocols.synthesis.builder import ProtocolBuilder, is_pyrophoric, short_name
from labgym.protocols.synthesis.conditions import (
    BOILING_TOLERANCE_K,
    Hold,
    addition_temperature,
    boiling_point,
    holds,
    is_period,
    periods,
    precedent,
)
from labgym.protocols.synthesis.reading import Clause, ParsedDescription
from labgym.protocols.synthesis.roles import ASSUMED, PROTECTIVE_GASES, Participant
from labgym.protocols.synthesis.stages import stages
from labgym.protocols.synthesis.transformations import Transformation
from labgym.protocols.synthesis.writer import Commission
from labgym.quantities import ROOM_RANGE, ROOM_TEMPERATURE, StatedCondition

AIRLESS = frozenset({"Magnesium", "PalladiumOnCarbon", "RaneyNickel", "TetrakisTriphenylphosphinePalladium"})
"""Metals and catalysts that work, or are safe next to a solvent, only without air."""
BALLOON, PRESSURE_VESSEL = "HydrogenBalloon", "HydrogenationApparatus"
BALLOON_BAR, VESSEL_BAR = 1.2, 5.0
"""Highest absolute pressures of a balloon and of the hydrogenation apparatus (4 bar above the air's), bar."""
FORMATION_MIN, COLD_ADDITION_C = 30.0, 5.0
"""Time in which a Grignard reagent forms, minutes; temperature at which its substrate is added, degrees Celsius."""
ADDITION_MIN = 15.0
"""Usual duration of an addition, minutes."""
OPEN_BELOW_C = 45.0
"""Highest temperature at which a mixture is heated without a condenser, degrees Celsius."""


def pressure(clauses: Sequence[Clause]) -> StatedCondition | None:
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


def protective_gas(description: ParsedDescription, parts: Sequence[Participant]) -> str:
    """Return the protective gas that is needed, or ""."""
    if "ArgonGas" in description.spoken_of or "argon" in description.text.lower():
        return "ArgonGas"
    asked = "NitrogenGas" in description.spoken_of or "inert" in description.text.lower() or "氮气" in description.text
    spoilt = refusals().destroyed_by_protic | AIRLESS
    needed = any(is_pyrophoric(part.asset) or part.asset.name in spoilt for part in parts)
    return "NitrogenGas" if asked or needed else ""


class ReactionWriter:
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
        self.gas = pressure(clauses)
        self.inert = protective_gas(commission.description, parts)
        self.stages = stages(clauses, parts, is_period) if not any(part.asset.phase == "gas" for part in parts) else ()
        usual = holds(kind, clauses, parts, precedent(commission.context, parts), builder.notes)
        self.holds = self._staged_holds(usual) if self.stages else usual
        self.hottest = max(period.temperature for period in self.holds)
        late = any(stage.added for stage in self.stages) or any(part.when == "add" for part in parts)
        necks = (self.hottest > ROOM_RANGE[1] or self.inert) and late
        self.vessel = vessel_for(self.volume, self.catalog, NECKED_VESSELS if necks else REACTION_VESSELS)
        for period in self.holds:
            point = boiling_point(parts)
            if period.bath is not None and point is not None and period.bath > point[0] + BOILING_TOLERANCE_K:
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
            pressed = self.gas is not None and part.asset.phase == "gas"
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
        self._add(halides, ROOM_TEMPERATURE, ADDITION_MIN)
        point = boiling_point(self.parts)
        boiling = point[0] if point is not None else ROOM_TEMPERATURE
        self._hold(Hold("Reflux", round(boiling, 1), FORMATION_MIN))
        self._add([part for part in late if part not in halides], min(self.adding, COLD_ADDITION_C), ADDITION_MIN)
        for period in self.holds:
            self._hold(period)

    def _carry_out_stages(self) -> None:
        timed = any(stage.periods for stage in self.stages)
        for stage in self.stages:
            at = stage.temperature
            if at is None and stage.added and not any(clause.temperature is not None for clause in self.clauses):
                at = self.kind.add_temperature
            at = at if at is not None else min(self.adding, ROOM_TEMPERATURE) if stage.added else ROOM_TEMPERATURE
            stretches = tuple(periods(self.kind, stage.periods, self.parts, stage.temperature))
            charged, added = stage.charged, stage.added
            if not added and stage.temperature is None and stretches and stretches[0].temperature < ROOM_RANGE[0]:
                # "A with B and C at 0 C": what the kind of reaction adds goes into the cold mixture.
                at = stretches[0].temperature
                charged = tuple(part for part in stage.charged if part.when != "add")
                added = tuple(part for part in stage.charged if part.when == "add")
            self._charge(charged, at if added else None)
            self._add(added, at, stage.minutes or ADDITION_MIN)
            for period in stretches:
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
        runs = groupby(added, key=lambda part: (part.asset.phase == "gas", _pours(part)))
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
                funnel=("GraduatedCylinder", "DroppingFunnel") if liquid else (),
                extras=tuple(name for name in self.kind.extras if name != BALLOON),
            )

    def _fill(self, parts: Sequence[Participant]) -> None:
        """Append the step that replaces the air by a gas, from a balloon or under pressure."""
        names = tuple(part.asset.name for part in parts)
        gas = ", then ".join(self._name(name) for name in names)
        low = next((f" ({clause.pressure.text})" for clause in self.clauses if clause.pressure is not None), "")
        text = f"Evacuate the flask and fill it with {gas} from the balloon{low} three times."
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
        hot = period.action == "Reflux" or (period.action == "Heat" and period.temperature > OPEN_BELOW_C)
        cooling = ("RefluxCondenser",) if hot else ()
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


def _addition_time(clauses: Sequence[Clause]) -> float:
    stated = [c.duration for c in clauses if c.operation and c.operation.action == "Add" and c.duration]
    return stated[0] if stated else ADDITION_MIN


def _pours(part: Participant) -> bool:
    """Return whether a reagent is poured: a liquid, or a solid as a solution."""
    dissolved = part.asset.phase == "solid" and read_amount(part.amount).volume is not None
    return part.asset.phase == "liquid" or dissolved


def _role(part: Participant) -> str:
    return f"{part.role} (stands in for the {part.stands_for})" if part.stands_for else part.role
