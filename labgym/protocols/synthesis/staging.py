"""Staging: an experiment becomes a protocol; its actions get places, apparatus and sentences."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import count

from pydantic import ValidationError

from labgym.assets import Catalog
from labgym.documents import document_error
from labgym.protocols.amounts import read_amount
from labgym.protocols.apparatus import (
    NECKED_VESSELS,
    REACTION_VESSELS,
    bath_for,
    millilitres,
    usual_temperature,
    vessel_for,
)
from labgym.protocols.capability import capacity, evacuates_to, withstands
from labgym.protocols.constraints import derive
from labgym.protocols.contents import ASIDE_ADDED, MADE_ASIDE
from labgym.protocols.errors import RefusalError
from labgym.protocols.experiments import Action, Experiment
from labgym.protocols.experiments.feasibility import GASES, WORK_UP, FeasibilityFilter, made_aside
from labgym.protocols.experiments.grounding import SOLVENTS
from labgym.protocols.experiments.model import Verb
from labgym.protocols.experiments.narration import sentence
from labgym.protocols.model import Protocol
from labgym.protocols.rules.conditions import AIR_SENSITIVE
from labgym.protocols.rules.hazards import INERT, forms_peroxides_in_storage
from labgym.protocols.rules.temperatures import SUPERHEAT_K
from labgym.protocols.rules.vessels import vapor_pressure
from labgym.protocols.sizing import fitted
from labgym.protocols.substances import OpenedExperiment, Resolver, opened
from labgym.protocols.synthesis.builder import ProtocolBuilder, clean_up, is_pyrophoric, short_name, weigh_first
from labgym.protocols.synthesis.endings import ended
from labgym.protocols.validate import ProtocolError, examine, faults
from labgym.quantities import ROOM_RANGE

OIL_BATH_LIMIT_C = 170.0
"""Bath temperature above which a flask is heated in a mantle, degrees Celsius."""
ICE_BATH_LIMIT_C = -15.0
"""Lowest temperature of a bath of ice and salt, degrees Celsius."""
CONDENSER_FROM_C = 30.0
"""Temperature above which a stirred flask carries a condenser, degrees Celsius."""
QUENCH_FILL = 0.9
"""Largest share of a vessel that a quench may fill."""
REDUCED_PRESSURE_BAR = 0.9
"""Pressure below which a distillation needs a pump, bar."""
PRESSURE_VESSELS = ("PressureTube", "PressureReactor")
"""Kinds of vessels for reactions above the boiling point."""
HYDROGENATORS = ("HydrogenationApparatus", "PressureReactor")
"""Kinds of vessels for reactions with hydrogen under pressure."""
PRESSURE_FILL = 0.5
"""Largest share of a closed vessel that is filled before it is heated."""
BATH_EXCESS_K = 60.0
"""Temperature above the boiling point that is read as that of the bath, kelvin."""
CLOSED = re.compile(r"\b(?:seal|microwav|pressur|autoclav|bomb\b|Parr\b|Teflon|capped|screw)", re.IGNORECASE)
"""Words for a vessel in which a liquid may be above its boiling point."""
HEATED_C = 60.0
"""Temperature of a mixture that is heated to no stated temperature, if it does not boil below it, degrees Celsius."""
BALLOON_LIMIT_BAR = 1.1
"""Pressure above which a hydrogenation needs a closed apparatus, bar."""
ANALYSES = (
    ("melting", ("MeltingPointApparatus",)),
    ("gc", ("GasChromatograph",)),
    ("nmr", ("NMRSpectrometer", "NMRTube")),
    ("tlc", ("TLCPlate", "TLCChamber")),
    ("infrared", ("FTIRSpectrometer",)),
    ("", ("LiquidChromatograph",)),
)
"""Instruments by a word of the analysis's note; the last entry applies if the note names none."""
ROLES: dict[Verb, str] = {
    "AdjustPH": "pH adjustment",
    "Chromatograph": "chromatography",
    "Crystallize": "crystallization",
    "DrySolution": "drying agent",
    "Extract": "extraction solvent",
    "Filter": "rinse or filter aid",
    "Partition": "extraction solvent",
    "Pour": "quench",
    "Quench": "quench",
    "Recrystallize": "recrystallization",
    "Triturate": "trituration",
    "Wash": "wash",
}


def stage(
    experiment: Experiment,
    catalog: Catalog | None = None,
    names: Resolver | None = None,
    partial: Sequence[str] = (),
) -> Protocol:
    """Return an experiment as a protocol that passes every check.

    Args:
        experiment: from the library, imported or read from a text.
        catalog: the assets that the protocol may use; by default that of `names`, or the default catalog.
        names: says what materials are that the catalog lacks; the protocol embeds them. Without it they are refused.
        partial: what the experiment lacks of the text that it was read from, one sentence each.

    Raises:
        RefusalError: the experiment is infeasible with the catalog.
        ProtocolError: the protocol violates rules; the error carries the findings.
    """
    if catalog is None:
        catalog = Catalog.load() if names is None else names.catalog
    open_ = OpenedExperiment(experiment) if names is None else opened(experiment, names)
    assets = catalog.including(open_.substances)
    verdict = FeasibilityFilter(assets).judge(ended(open_.experiment.unrolled(), assets))
    if verdict.obstacles:
        raise RefusalError("infeasible", f"{experiment.id}: {'; '.join(item.message for item in verdict.obstacles)}")
    feasible = verdict.experiment
    builder = ProtocolBuilder(assets)
    vessel = _Stager(builder, feasible).carry_out()
    clean_up(builder)
    weigh_first(builder, vessel)
    try:
        draft = Protocol(
            id=feasible.id.replace("__", "_")[:64],
            name=feasible.name,
            reaction_type=experiment.reaction_type,
            reaction=feasible.reaction,
            product=feasible.product or feasible.name,
            description=feasible.description or feasible.name,
            synonyms=feasible.synonyms,
            reagents=builder.reagents,
            instruments=builder.instruments,
            steps=tuple(builder.steps),
            substances=open_.substances,
            partial=(*partial, *open_.partial),
        )
    except ValidationError as error:
        raise RefusalError("infeasible", str(document_error(feasible.id, error))) from None
    protocol = derive(fitted(draft, assets), assets)
    found = faults(examine(protocol, assets))
    if found:
        raise ProtocolError(protocol.id, found)
    return protocol


@dataclass
class _Stager:
    """Appends the steps of an experiment's actions and tracks where the batch is.

    Attributes:
        reacting: whether the reaction has not been worked up yet.
        solid: whether the batch is a solid on a filter.
        vessel: name of the reaction flask.
        volume: mL in the reaction flask at the end of the reaction.
        in_flask: whether the batch is still in the reaction flask.
        roles: the role of each material by name.
        liquids: mL of the liquids that were added, by name.
        aside: places of the actions that make a solution in a separate vessel.
    """

    builder: ProtocolBuilder
    experiment: Experiment
    reacting: bool = True
    solid: bool = False
    vessel: str = ""
    volume: float = 0.0
    in_flask: bool = True
    roles: dict[str, str] = field(default_factory=dict)
    liquids: dict[str, float] = field(default_factory=dict)
    aside: frozenset[int] = frozenset()

    @property
    def catalog(self) -> Catalog:
        return self.builder.catalog

    def carry_out(self) -> str:
        """Append the steps of all actions and return the reaction vessel."""
        actions = _joined(self.experiment.actions)
        self.roles = {material.name: material.role for material in self.experiment.materials}
        reaction = actions[: _end(actions)]
        self.volume = sum(self._millilitres(action) for action in reaction)
        needs_necks = any(action.manner == "dropwise" or action.atmosphere in GASES for action in reaction)
        self.vessel = vessel_for(self.volume, self.catalog, NECKED_VESSELS if needs_necks else REACTION_VESSELS)
        self.aside = frozenset(made_aside(actions))
        for number, action in enumerate(actions):
            if self.reacting and action.verb in WORK_UP:
                self.reacting = False
            if number in self.aside:
                self._make_aside(action)
                continue
            self._act(action, actions[number + 1] if number + 1 < len(actions) else None)
        if not any(action.verb == "Analyze" for action in actions):
            self._analyze(Action(verb="Analyze", note="assumed, the experiment names no analysis"), ())
        return self.vessel

    def _make_aside(self, action: Action) -> None:
        """Make a solution that a later action adds: in a separate flask, from which it is transferred."""
        names = self._take_all(action)
        note = _with_note(self._under_gas(action, names), MADE_ASIDE)
        self._do(note, names, vessel=("ErlenmeyerFlask",), bath=_bath(action.temperature))

    def _act(self, action: Action, following: Action | None) -> None:
        if action.verb in ("Yield", "Transfer", "CollectLayer"):
            return
        names = self._take_all(action)
        action = self._under_gas(action, names)
        if action.part == "solution" and not action.takes:
            action = _with_note(action, ASIDE_ADDED)
        if not self.reacting and action.verb in ("Add", "Dissolve"):
            self.volume += self._millilitres(action)
        _STEPS.get(action.verb, _Stager._in_the_flask)(self, action, names)
        if action.verb in ("Filter", "Crystallize", "Recrystallize", "Triturate"):
            rinsed = action.verb == "Filter" and following is not None and self._rinses(following)
            kept = action.keep != "filtrate" or rinsed
            self.solid = kept and (following is None or following.verb != "Dissolve")
        elif action.verb in ("Dissolve", "Extract", "Concentrate", "Add"):
            self.solid = False

    def _under_gas(self, action: Action, names: tuple[str, ...]) -> Action:
        """Return an action under nitrogen, which is assumed, if it takes what air destroys and names no gas."""
        sensitive = any(is_pyrophoric(self.catalog.get(name)) or name in AIR_SENSITIVE for name in names)
        if not sensitive or action.atmosphere is not None or INERT.search(action.note):
            return action
        return _with_note(action.model_copy(update={"atmosphere": "nitrogen"}), "nitrogen is assumed")

    def _take_all(self, action: Action) -> tuple[str, ...]:
        """List what an action takes, count its liquids, and return the names."""
        names = tuple(self._take(action, portion.name, portion.amount) for portion in action.takes)
        for portion, name in zip(action.takes, names, strict=True):
            volume = millilitres([(self.catalog.get(name), portion.amount)])
            if volume:
                self.liquids[name] = self.liquids.get(name, 0.0) + volume
        return names

    def _rinses(self, action: Action) -> bool:
        """Return whether a washing rinses what is on a filter: of no layer, and with a solvent."""
        categories = [self.catalog.get(portion.name).category for portion in action.takes]
        apart = action.part in ("organic", "aqueous", "filtrate")
        return action.verb == "Wash" and not apart and any(category in SOLVENTS for category in categories)

    def _take(self, action: Action, name: str, amount: str) -> str:
        role = self.roles[name] if self.reacting else ROLES.get(action.verb, "solvent")
        listed = {role for use in self.builder.reagents if use.name == name for role in use.role.split(" and ")}
        if role in listed:
            role = next(f"{role} {number}" for number in count(2) if f"{role} {number}" not in listed)
        asset = self.catalog.get(name)
        return self.builder.take(asset, role, amount or ("from the cylinder" if asset.phase == "gas" else "as needed"))

    def _gas(self, action: Action) -> tuple[str, ...]:
        """List the gas above the mixture and return it after the device that supplies it."""
        if action.atmosphere not in GASES:
            return ()
        name = GASES[action.atmosphere]
        if not self.builder.takes(name):
            self.builder.take(self.catalog.get(name), "gas above the mixture", "from the cylinder")
        return ("SchlenkLine", name)

    def _do(
        self,
        action: Action,
        names: tuple[str, ...],
        temperature: float | None = None,
        verb: str = "",
        setup: str = "",
        **slots: Sequence[str],
    ) -> None:
        at = temperature if temperature is not None else action.temperature
        text = sentence(
            action if action.temperature is None else action.model_copy(update={"temperature": at}), self.catalog
        )
        self.builder.do(verb or action.verb, text, names, at, action.duration, setup, **slots)

    def _plain(self, action: Action, names: tuple[str, ...]) -> None:
        cold = action.temperature is not None and action.temperature < ROOM_RANGE[0]
        self._do(action, names, bath=_cold_bath(action.temperature or 0.0) if cold else ())

    def _with_device(self, action: Action, names: tuple[str, ...]) -> None:
        self._do(action, names, vessel=(self.vessel,), gas=self._gas(action))

    def _in_the_flask(self, action: Action, names: tuple[str, ...]) -> None:
        at = action.temperature
        if at is None and action.verb in ("Reflux", "Heat"):
            at = self._boiling() if action.verb == "Reflux" else min(HEATED_C, self._boiling())
            action = _with_note(action, f"the text gives no temperature, {at:g} C is assumed")
        elif at is not None and action.verb in ("Heat", "Reflux", "Stir", "Wait", "SetTemperature"):
            points = self._main_boiling_points()
            hottest = max(points, default=at)
            closed = CLOSED.search(self.experiment.description) is not None or at > hottest + BATH_EXCESS_K
            if closed and self.in_flask and at > min(points, default=at) + SUPERHEAT_K:
                self.vessel = self._closed_vessel(PRESSURE_VESSELS, self._vapor_bar(at))
                action = self._transferred(action)
            elif at > hottest + SUPERHEAT_K:
                action = _with_note(action, f"{at:g} C is taken as the temperature of the bath, the mixture boils")
                at = hottest
        vessel = self.vessel
        if not self.in_flask:
            vessel = "RoundBottomFlask"
        funnel: tuple[str, ...] = ()
        poured = any(
            self.catalog.get(name).phase == "liquid" or (amount.volume is not None and amount.mass is None)
            for name, amount in zip(names, (read_amount(portion.amount) for portion in action.takes), strict=True)
        )
        if poured or (action.part == "solution" and not names):
            dropwise = action.manner in ("dropwise", "slowly") and self.reacting
            funnel = ("GraduatedCylinder", "DroppingFunnel") if dropwise else ("GraduatedCylinder",)
        heated = (at is not None and at > CONDENSER_FROM_C) or action.verb == "Reflux"
        heated = heated and withstands(self.catalog.get(vessel)) is None
        condenser = ("RefluxCondenser",) if heated else ()
        trap = ("DeanStarkTrap",) if "Dean-Stark" in action.note else ()
        verb: str = action.verb
        if verb == "Wait":
            verb = "Stir"
        elif verb in ("SetTemperature", "Heat") and (verb == "SetTemperature" or at is None or at <= ROOM_RANGE[1]):
            verb = "Stir" if at is None or ROOM_RANGE[0] <= at <= ROOM_RANGE[1] else _change(at)
        self._do(
            action,
            names,
            at,
            verb,
            action.verb,
            vessel=(vessel,),
            bath=(*_bath(at), *(("OverheadStirrer",) if at is not None and at > OIL_BATH_LIMIT_C else ())),
            gas=self._gas(action),
            funnel=funnel,
            condenser=(*condenser, *trap),
        )

    def _hydrogenate(self, action: Action, names: tuple[str, ...]) -> None:
        gas = names
        if "Hydrogen" not in names:
            if not self.builder.takes("Hydrogen"):
                self.builder.take(self.catalog.get("Hydrogen"), "reactant", "from the cylinder")
            gas = (*names, "Hydrogen")
        funnel = ("GraduatedCylinder",) if self._millilitres(action) else ()
        at = action.temperature
        boils = at is not None and at > min(self._main_boiling_points(), default=at)
        bar = max(action.pressure or 0.0, 1.0 + self._vapor_bar(at) if boils and at is not None else 0.0)
        if bar > BALLOON_LIMIT_BAR:
            self.vessel = self._closed_vessel(HYDROGENATORS, bar)
            self._do(self._transferred(action), gas, device=(self.vessel,), funnel=funnel)
        else:
            bath = _bath(action.temperature)
            self._do(action, gas, device=("HydrogenBalloon",), vessel=(self.vessel,), bath=bath, funnel=funnel)

    def _purge(self, action: Action, names: tuple[str, ...]) -> None:
        self._do(action, names, vessel=(self.vessel,), gas=self._gas(action) or ("SchlenkLine",))

    def _quench(self, action: Action, names: tuple[str, ...]) -> None:
        """End the reaction in its flask if the flask is large enough, else in a beaker.

        A mixture that contains a strong oxidizing acid is always poured onto water.
        """
        total = self.volume + self._millilitres(action)
        acid = any(
            "oxidizing_acid" in self.catalog.get(name).groups and role != "workup" for name, role in self.roles.items()
        )
        vessel = self.catalog.get(self.vessel)
        fits = total <= QUENCH_FILL * (capacity(vessel) or 0.0) and withstands(vessel) is None
        at = _temperature(action)
        cold = at < ROOM_RANGE[0]
        paper = ("PHPaper",) if action.verb == "AdjustPH" else ()
        cylinder = ("GraduatedCylinder",) if self._millilitres(action) else ()
        verb = _ph_change(action) or action.verb
        if fits and self.in_flask and not acid:
            gas, bath = self._gas(action), _bath(at) if cold else ("MagneticStirrer",)
            self._do(action, names, at, verb, vessel=(self.vessel,), bath=bath, paper=paper, gas=gas, funnel=cylinder)
            return
        self.in_flask = False
        if action.verb in ("Pour", "Quench"):
            action = _with_note(action, "pour the mixture slowly onto the water")
        bath = ("IceBath", "MagneticStirrer") if cold else ("MagneticStirrer",)
        self._do(action, names, at, verb, beaker=("Beaker",), bath=bath, paper=paper, funnel=cylinder)

    def _wash(self, action: Action, names: tuple[str, ...]) -> None:
        cold = action.temperature is not None and action.temperature < ROOM_RANGE[0]
        self._do(action, names, verb="Filter" if self.solid else "Wash", bath=("IceBath",) if cold else ())

    def _concentrate(self, action: Action, names: tuple[str, ...]) -> None:
        if any(forms_peroxides_in_storage(self.catalog.get(use.name)) for use in self.builder.reagents):
            action = _with_note(action, "test for peroxides first")
        self._do(action, names, _temperature(action))
        self.in_flask = False

    def _distill(self, action: Action, names: tuple[str, ...]) -> None:
        at = _temperature(action)
        flask = self.vessel if self.reacting else "RoundBottomFlask"
        reduced = action.atmosphere == "vacuum" or (
            action.pressure is not None and action.pressure < REDUCED_PRESSURE_BAR
        )
        chemistry = [self.catalog.get(use.name).chemistry for use in self.builder.reagents]
        if any(item is not None and item.peroxide_former for item in chemistry):
            action = _with_note(action, "test for peroxides first")
        self._do(
            action, names, at, vessel=(flask,), pump=(self._pump(action.pressure),) if reduced else (), bath=_bath(at)
        )

    def _pump(self, bar: float | None) -> str:
        """Return the lightest pump that reaches a pressure, the finest if none does."""
        pumps = [asset for asset in self.catalog.of_kind("instrument") if asset.category == "vacuum"]
        reach = {asset.name: evacuates_to(asset) or math.inf for asset in pumps}
        fit = [asset for asset in pumps if bar is None or reach[asset.name] <= 1000.0 * bar]
        return min(fit, key=lambda asset: asset.mass).name if fit else min(reach, key=lambda name: reach[name])

    def _crystallize(self, action: Action, names: tuple[str, ...]) -> None:
        at = _temperature(action)
        self._do(action, names, at, bath=_cold_bath(at))

    def _recrystallize(self, action: Action, names: tuple[str, ...]) -> None:
        at = _temperature(action)
        if action.temperature is None:
            at = min((at, *(point for name in names if (point := self.catalog.get(name).boiling_point) is not None)))
        bath = _cold_bath(at) if at < ROOM_RANGE[0] else ()
        self._do(action, names, at, vessel=("ErlenmeyerFlask",), bath=bath)

    def _dry_solid(self, action: Action, names: tuple[str, ...]) -> None:
        at = _temperature(action)
        if at <= ROOM_RANGE[1]:
            self._do(action, (), at, "DryVacuum")
        else:
            oven = "VacuumOven" if action.atmosphere == "vacuum" else "DryingOven"
            self._do(action, names, at, oven=(oven,))

    def _analyze(self, action: Action, names: tuple[str, ...]) -> None:
        note = action.note.lower()
        self._do(action, names, device=next(devices for word, devices in ANALYSES if word in note))

    def _boiling(self) -> float:
        """Return where the mixture boils, that is, most of its liquid; the usual temperature if that is not known."""
        points = {name: point for name in self.liquids if (point := self.catalog.get(name).boiling_point) is not None}
        main = max(points, key=lambda name: self.liquids[name], default=None)
        return usual_temperature("Reflux") if main is None else points[main]

    def _main_boiling_points(self) -> list[float]:
        """Return the boiling points of the main liquids; empty if one is not known."""
        total = sum(self.liquids.values())
        points = [
            self.catalog.get(name).boiling_point
            for name, volume in self.liquids.items()
            if volume and volume >= 0.1 * total
        ]
        known = [point for point in points if point is not None]
        return known if len(known) == len(points) else []

    def _vapor_bar(self, at: float) -> float:
        """Return the highest vapor pressure of the liquids at a temperature, bar."""
        liquids = [self.catalog.get(name) for name, volume in self.liquids.items() if volume]
        return max((vapor_pressure(liquid, at) for liquid in liquids), default=0.0)

    def _closed_vessel(self, kinds: Sequence[str], bar: float) -> str:
        """Return the smallest closed vessel of some kinds that takes the mixture and withstands a pressure.

        Raises:
            RefusalError: none does.
        """
        known = [self.catalog.get(kind) for kind in kinds if kind in self.catalog]
        strong = [kind.name for kind in known if bar - 1.0 <= (withstands(kind) or 0.0)]
        return vessel_for(self.volume, self.catalog, strong, PRESSURE_FILL)

    def _transferred(self, action: Action) -> Action:
        vessel = self.catalog.get(self.vessel)
        kind = short_name(vessel.family, self.catalog)
        return _with_note(action, f"transfer the mixture to the {kind} of {capacity(vessel):g} mL first")

    def _millilitres(self, action: Action) -> float:
        return millilitres((self.catalog.get(portion.name), portion.amount) for portion in action.takes)


_STEPS: dict[Verb, Callable[[_Stager, Action, tuple[str, ...]], None]] = {
    **dict.fromkeys(
        ("Chromatograph", "DrySolution", "Extract", "Filter", "Monitor", "Partition", "PhaseSeparation", "Purify"),
        _Stager._plain,
    ),
    **dict.fromkeys(("Irradiate", "Microwave", "Sonicate"), _Stager._with_device),
    "AdjustPH": _Stager._quench,
    "Analyze": _Stager._analyze,
    "Concentrate": _Stager._concentrate,
    "Crystallize": _Stager._crystallize,
    "Distill": _Stager._distill,
    "DrySolid": _Stager._dry_solid,
    "Hydrogenate": _Stager._hydrogenate,
    "Pour": _Stager._quench,
    "Purge": _Stager._purge,
    "Quench": _Stager._quench,
    "Recrystallize": _Stager._recrystallize,
    "Wash": _Stager._wash,
}
"""Actions that are not simply done to the mixture in its flask."""


def _joined(actions: Sequence[Action]) -> list[Action]:
    """Return actions with consecutive washes merged, and filtrations that the previous action includes left out."""
    joined: list[Action] = []
    for action in actions:
        last = joined[-1] if joined else None
        if last is not None and last.verb == action.verb == "Wash":
            joined[-1] = last.model_copy(
                update={"takes": (*last.takes, *action.takes), "duration": (last.duration or 10.0) + 10.0}
            )
        elif (
            last is not None
            and action.verb == "Filter"
            and not action.takes
            and last.verb in ("DrySolution", "Recrystallize")
        ):
            continue
        else:
            joined.append(action)
    return joined


def _end(actions: Sequence[Action]) -> int:
    """Return how many actions come before the batch leaves the reaction flask."""
    return next((k for k, action in enumerate(actions) if action.verb in WORK_UP), len(actions))


def _temperature(action: Action) -> float:
    """Return the temperature of an action, or the usual one if it has none."""
    return action.temperature if action.temperature is not None else usual_temperature(action.verb)


def _bath(at: float | None) -> tuple[str, ...]:
    """Return the devices that bring a flask to a temperature."""
    return ("HeatingMantle",) if at is not None and at > OIL_BATH_LIMIT_C else bath_for(at)


def _cold_bath(at: float) -> tuple[str, ...]:
    """Return the bath that cools a vessel of the work-up to a temperature."""
    return ("IceBath",) if at >= ICE_BATH_LIMIT_C else ("CoolingBathDewar",)


def _change(at: float) -> str:
    return "Heat" if at > ROOM_RANGE[1] else "Cool"


def _ph_change(action: Action) -> str:
    """Return whether a pH adjustment acidifies or basifies, or "" if the action does not say."""
    if action.verb != "AdjustPH" or action.ph is None:
        return ""
    return "Acidify" if action.ph < 7.0 else "Basify"


def _with_note(action: Action, note: str) -> Action:
    return action.model_copy(update={"note": "; ".join(filter(None, (note, action.note)))})
