"""An experiment put into a laboratory: its actions get places, apparatus and sentences, and become a protocol."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import count

from pydantic import ValidationError

from labgym.assets import Asset, Catalog
from labgym.documents import document_error
from labgym.protocols.capability import capacity
from labgym.protocols.constraints import derive
from labgym.protocols.experiments import Action, Experiment
from labgym.protocols.experiments.feasibility import GASES, WORK_UP, FeasibilityFilter
from labgym.protocols.experiments.model import Verb
from labgym.protocols.experiments.narration import sentence
from labgym.protocols.model import Protocol
from labgym.protocols.synthesis.apparatus import BEAKERS, ROOM, bath_for, millilitres, vessel_for
from labgym.protocols.synthesis.bench import HOOD, Bench
from labgym.protocols.synthesis.errors import RefusalError
from labgym.protocols.synthesis.frame import clean_up, groups_of, weigh_first
from labgym.protocols.validate import ProtocolError, examine

REACHED_BY_OIL = 170.0
"""Bath temperature above which a flask stands in a heating mantle, degrees Celsius."""
REFLUXING = 30.0
"""Temperature above which a stirred flask carries a condenser, degrees Celsius."""
NEARLY_FULL = 0.9
"""Share of a vessel that a quench may fill."""
ATMOSPHERE = 0.9
"""Pressure, bar, below which a still needs a pump."""
FUNNEL = "SeparatoryFunnel"
SUCTION = ("BuchnerFunnel", "FilterFlask", "FilterPaper")
ANALYSES = (
    ("melting", ("MeltingPointApparatus",)),
    ("gc", ("GasChromatograph",)),
    ("nmr", ("NMRSpectrometer", "NMRTube")),
    ("tlc", ("TLCPlate", "TLCChamber")),
    ("infrared", ("FTIRSpectrometer",)),
    ("", ("LiquidChromatograph",)),
)
"""Instruments by a word of the analysis's note, the last where nothing is said."""
ROLES: dict[Verb, str] = {
    "AdjustPH": "pH adjustment",
    "Chromatograph": "chromatography",
    "Crystallize": "crystallisation",
    "DrySolution": "drying agent",
    "Extract": "extraction solvent",
    "Filter": "rinse or filter aid",
    "Partition": "extraction solvent",
    "Quench": "quench",
    "Recrystallize": "recrystallisation",
    "Triturate": "trituration",
    "Wash": "wash",
}
DURATIONS: dict[Verb, float] = {
    "Stir": 30.0,
    "Extract": 20.0,
    "Concentrate": 20.0,
    "Distill": 45.0,
    "Recrystallize": 45.0,
}
USUAL = 15.0
"""Minutes that an action takes where the experiment does not say."""


def stage(experiment: Experiment) -> Protocol:
    """Return an experiment as a protocol that passes every check.

    Raises:
        RefusalError: the experiment is infeasible with the catalogue, or its type of reaction is not known.
        ProtocolError: as it stands it would break a rule; names the findings.
    """
    verdict = FeasibilityFilter().judge(experiment)
    if verdict.obstacles:
        raise RefusalError("infeasible", f"{experiment.id}: {'; '.join(item.message for item in verdict.obstacles)}")
    if experiment.reaction_type is None:
        raise RefusalError(
            "no-reaction",
            f"{experiment.id} does not say what type of reaction it is: name it, --type redox for example",
        )
    known = verdict.experiment
    bench = Bench()
    vessel = _Stage(bench, known).carry_out()
    clean_up(bench)
    weigh_first(bench, vessel)
    try:
        written = Protocol(
            id=known.id.replace("__", "_")[:64],
            name=known.name,
            reaction_type=experiment.reaction_type,
            reaction=known.reaction,
            product=known.product or known.name,
            description=known.description or known.name,
            synonyms=known.synonyms,
            reagents=bench.reagents,
            instruments=bench.instruments,
            steps=tuple(bench.steps),
        )
    except ValidationError as error:
        raise RefusalError("infeasible", str(document_error(known.id, error))) from None
    protocol = derive(written)
    faults = [finding for finding in examine(protocol) if finding.severity == "fault"]
    if faults:
        raise ProtocolError(protocol.id, faults)
    return protocol


@dataclass
class _Stage:
    """Where the batch is while the actions are carried out.

    Attributes:
        reacting: whether it is still in the reaction flask. solid: whether it lies on a filter.
        volume: mL in the reaction flask at the end of the reaction. in_flask: whether it is still there.
    """

    bench: Bench
    experiment: Experiment
    reacting: bool = True
    solid: bool = False
    vessel: str = ""
    volume: float = 0.0
    in_flask: bool = True
    roles: dict[str, str] = field(default_factory=dict)

    def carry_out(self) -> str:
        """Append the steps of all actions and return the reaction vessel."""
        actions = _joined(self.experiment.actions)
        self.roles = {material.name: material.role for material in self.experiment.materials}
        reaction = actions[: _end(actions)]
        catalog = Catalog.load()
        self.volume = millilitres((catalog.get(p.name), p.amount) for action in reaction for p in action.takes)
        self.vessel = vessel_for(self.volume)
        wants_necks = any(action.manner == "dropwise" or action.atmosphere in GASES for action in reaction)
        if self.vessel == "RoundBottomFlask" and wants_necks:
            self.vessel = "ThreeNeckFlask"
        for number, action in enumerate(actions):
            if self.reacting and action.verb in WORK_UP:
                self.reacting = False
            self._act(action, actions[number + 1].verb if number + 1 < len(actions) else None)
        if not any(action.verb == "Analyze" for action in actions):
            self._analyze(Action(verb="Analyze", note="assumed, the experiment names no analysis"), ())
        return self.vessel

    def _act(self, action: Action, following: Verb | None) -> None:
        if action.verb in ("Yield", "Transfer", "CollectLayer"):
            return
        names = tuple(self._take(action, portion.name, portion.amount) for portion in action.takes)
        if not self.reacting and action.verb in ("Add", "Dissolve"):
            self.volume += self._millilitres(action)
        do = _SPECIAL.get(action.verb, _Stage._in_the_flask)
        do(self, action, names)
        if action.verb in ("Filter", "Crystallize", "Recrystallize", "Triturate"):
            self.solid = action.keep != "filtrate" and following != "Dissolve"
        elif action.verb in ("Dissolve", "Extract", "Concentrate", "Add"):
            self.solid = False

    def _take(self, action: Action, name: str, amount: str) -> str:
        role = self.roles[name] if self.reacting else ROLES.get(action.verb, "solvent")
        stated = {r for use in self.bench.reagents if use.name == name for r in use.role.split(" and ")}
        if role in stated:
            role = next(f"{role} {number}" for number in count(2) if f"{role} {number}" not in stated)
        asset = Catalog.load().get(name)
        gas = asset.chemistry is not None and asset.chemistry.state == "gas"
        return self.bench.take(asset, role, amount or ("from the cylinder" if gas else "as needed"))

    def _gas(self, action: Action) -> tuple[str, ...]:
        """Return what holds a gas above the mixture, the gas listed."""
        if action.atmosphere not in GASES:
            return ()
        name = GASES[action.atmosphere]
        if not self.bench.takes(name):
            self.bench.take(Catalog.load().get(name), "gas above the mixture", "from the cylinder")
        return ("SchlenkLine", name)

    def _do(
        self,
        action: Action,
        uses: Sequence[str],
        place: str = HOOD,
        temperature: float | None = None,
        name: str | None = None,
    ) -> None:
        at = temperature if temperature is not None else action.temperature
        told = action if action.temperature is None else action.model_copy(update={"temperature": at})
        duration = action.duration or DURATIONS.get(action.verb, USUAL)
        self.bench.do(name or action.verb, sentence(told), tuple(uses), place, at, duration)

    def _in_the_flask(self, action: Action, names: tuple[str, ...]) -> None:
        at = action.temperature
        vessel = self.vessel if self.in_flask else "RoundBottomFlask" if self.volume < 120.0 else "LargeBeaker"
        uses = [vessel, *_warmth(at), *self._gas(action)]
        liquids = [name for name in names if _state(name) == "liquid"]
        if liquids:
            dropped = action.manner in ("dropwise", "slowly")
            uses.append("DroppingFunnel" if dropped and self.reacting else "GraduatedCylinder")
        if (at is not None and at > REFLUXING) or action.verb == "Reflux":
            uses.append("RefluxCondenser")
        if "Dean-Stark" in action.note:
            uses.append("DeanStarkTrap")
        verb: str = action.verb
        if verb == "Wait":
            verb = "Stir"
        elif verb == "SetTemperature":
            verb = "Stir" if at is None or ROOM[0] <= at <= ROOM[1] else "Heat" if at > ROOM[1] else "Cool"
        if action.verb == "Reflux" and at is None:
            at = 80.0
        self._do(action, [*uses, *names], temperature=at, name=verb)

    def _with_device(self, action: Action, names: tuple[str, ...]) -> None:
        device = {"Irradiate": "PhotoReactor", "Sonicate": "UltrasonicCleaner", "Microwave": "MicrowaveReactor"}[
            action.verb
        ]
        self._do(action, (self.vessel, device, *self._gas(action), *names))

    def _hydrogenate(self, action: Action, names: tuple[str, ...]) -> None:
        closed = action.pressure is not None and action.pressure > 1.1
        device = ("HydrogenationApparatus",) if closed else ("HydrogenBalloon", self.vessel)
        gas = names
        if "Hydrogen" not in names:
            if not self.bench.takes("Hydrogen"):
                self.bench.take(Catalog.load().get("Hydrogen"), "reactant", "from the cylinder")
            gas = (*names, "Hydrogen")
        self._do(action, (*device, *(() if closed else _warmth(action.temperature)), *gas))

    def _purge(self, action: Action, names: tuple[str, ...]) -> None:
        self._do(action, (self.vessel, *(self._gas(action) or ("SchlenkLine",)), *names))

    def _quench(self, action: Action, names: tuple[str, ...]) -> None:
        """End the reaction in its flask where all fits, else in a beaker; strong acid is always poured onto water."""
        total = self.volume + self._millilitres(action)
        acid = any("oxidizing_acid" in groups_of(name) and self.roles.get(name) != "workup" for name in self.roles)
        fits = total <= NEARLY_FULL * (capacity(Catalog.load().get(self.vessel)) or 0.0)
        at = action.temperature if action.temperature is not None else 10.0
        paper = ("PHPaper",) if action.verb == "AdjustPH" else ()
        if fits and self.in_flask and not acid:
            bath = _warmth(at) if at < ROOM[0] else ()
            uses = (self.vessel, *bath, *paper, *self._gas(action))
        else:
            uses = (vessel_for(total, BEAKERS, NEARLY_FULL), *(("IceBath",) if at < ROOM[0] else ()), *paper)
            self.in_flask = False
            if action.verb == "Quench":
                action = action.model_copy(
                    update={
                        "note": "; ".join(filter(None, ("pour the mixture slowly onto the water or ice", action.note)))
                    }
                )
        self._do(action, (*uses, *names), temperature=at, name=_ph(action) or action.verb)

    def _funnel(self, action: Action, names: tuple[str, ...]) -> None:
        if action.verb == "Wash" and self.solid:
            self._do(action, (*SUCTION, *names), name="Filter")
        else:
            self._do(action, (FUNNEL, "ErlenmeyerFlask", *names))

    def _dry_solution(self, action: Action, names: tuple[str, ...]) -> None:
        self._do(action, ("ErlenmeyerFlask", "GlassFunnel", *names))

    def _filter(self, action: Action, names: tuple[str, ...]) -> None:
        self._do(action, (*SUCTION, *names))

    def _concentrate(self, action: Action, names: tuple[str, ...]) -> None:
        uses = ("RotaryEvaporator", "RoundBottomFlask", *names)
        self._do(action, uses, "RotaryEvaporatorStation", 40.0 if action.temperature is None else action.temperature)
        self.in_flask = False

    def _distill(self, action: Action, names: tuple[str, ...]) -> None:
        at = 90.0 if action.temperature is None else action.temperature
        flask = "RoundBottomFlask" if not self.reacting else self.vessel
        still = (flask, "DistillationHead", "LiebigCondenser", "VacuumAdapter", "PearShapedFlask")
        reduced = action.atmosphere == "vacuum" or (action.pressure is not None and action.pressure < ATMOSPHERE)
        pump = ("VacuumPump",) if reduced else ()
        peroxides = any(_forms_peroxides(use.name) for use in self.bench.reagents)
        if peroxides:
            action = action.model_copy(
                update={"note": "; ".join(filter(None, ("test for peroxides first", action.note)))}
            )
        self._do(action, (*still, *pump, *_warmth(at), *names), temperature=at)

    def _crystallize(self, action: Action, names: tuple[str, ...]) -> None:
        at = action.temperature if action.temperature is not None else 3.0
        self._do(
            action, ("CrystallizingDish", "IceBath" if at >= -15.0 else "CoolingBathDewar", *names), temperature=at
        )

    def _recrystallize(self, action: Action, names: tuple[str, ...]) -> None:
        at = action.temperature if action.temperature is not None else 60.0
        flask = vessel_for(self._millilitres(action), ("ErlenmeyerFlask", "LargeBeaker"), NEARLY_FULL)
        self._do(action, (flask, "MagneticHotplateStirrer", *SUCTION[:2], *names), temperature=at)

    def _millilitres(self, action: Action) -> float:
        return millilitres((Catalog.load().get(portion.name), portion.amount) for portion in action.takes)

    def _chromatograph(self, action: Action, names: tuple[str, ...]) -> None:
        self._do(action, ("ChromatographyColumn", "TLCPlate", *names), "PurificationBench")

    def _dry_solid(self, action: Action, names: tuple[str, ...]) -> None:
        vacuum = action.atmosphere == "vacuum"
        at = action.temperature if action.temperature is not None else 40.0
        if at <= ROOM[1]:
            self._do(action, ("RoundBottomFlask", "VacuumPump", "ColdTrap"), temperature=at, name="DryVacuum")
        else:
            oven = "VacuumOven" if vacuum else "DryingOven"
            self._do(action, (oven, "WatchGlass", *names), "DryingStation", at)

    def _analyze(self, action: Action, names: tuple[str, ...]) -> None:
        note = action.note.lower()
        self._do(action, (*next(devices for word, devices in ANALYSES if word in note), *names), "ValidationPlatform")


_SPECIAL: dict[Verb, Callable[[_Stage, Action, tuple[str, ...]], None]] = {
    "AdjustPH": _Stage._quench,
    "Analyze": _Stage._analyze,
    "Chromatograph": _Stage._chromatograph,
    "Concentrate": _Stage._concentrate,
    "Crystallize": _Stage._crystallize,
    "Distill": _Stage._distill,
    "DrySolid": _Stage._dry_solid,
    "DrySolution": _Stage._dry_solution,
    "Extract": _Stage._funnel,
    "Filter": _Stage._filter,
    "Hydrogenate": _Stage._hydrogenate,
    "Irradiate": _Stage._with_device,
    "Microwave": _Stage._with_device,
    "Partition": _Stage._funnel,
    "PhaseSeparation": _Stage._funnel,
    "Purge": _Stage._purge,
    "Purify": _Stage._chromatograph,
    "Quench": _Stage._quench,
    "Recrystallize": _Stage._recrystallize,
    "Sonicate": _Stage._with_device,
    "Wash": _Stage._funnel,
}


def _joined(actions: Sequence[Action]) -> list[Action]:
    """Return actions with those made one that are done at one go: washes in a row, a filtration after drying."""
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


def _warmth(at: float | None) -> tuple[str, ...]:
    """Return what brings a flask to a temperature."""
    return ("HeatingMantle",) if at is not None and at > REACHED_BY_OIL else bath_for(at)


def _ph(action: Action) -> str | None:
    if action.verb != "AdjustPH" or action.ph is None:
        return None
    return "Acidify" if action.ph < 7.0 else "Basify"


def _forms_peroxides(name: str) -> bool:
    chemistry = Catalog.load().get(name).chemistry
    return chemistry is not None and chemistry.peroxide_former


def _state(name: str) -> str:
    asset: Asset = Catalog.load().get(name)
    return asset.chemistry.state if asset.chemistry is not None else ""
