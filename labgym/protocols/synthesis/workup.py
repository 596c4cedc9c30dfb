"""From the end of the reaction to the pure product: quench, work-up, purification."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from labgym.assets import Asset, Catalog
from labgym.protocols.apparatus import BEAKERS, SUCTION, usual_temperature, vessel_for
from labgym.protocols.refusals import refusals
from labgym.protocols.synthesis.builder import ProtocolBuilder
from labgym.protocols.synthesis.frame import is_solid, short_name
from labgym.protocols.synthesis.reading import Clause
from labgym.protocols.synthesis.roles import ASSUMED, PROTECTIVE_GASES, SOLVENTS, scaled
from labgym.protocols.synthesis.transformations import Transformation
from labgym.quantities import ROOM_TEMPERATURE

ALUMINIUM_HYDRIDES = ("LithiumAluminumHydride", "DIBALH")
PURIFYING = ("Recrystallize", "Crystallize", "Chromatograph", "Distill", "DrySolid", "DryVacuum")
SOLID = ("Filter", "Recrystallize", "Crystallize")
WORKING_UP = ("Extract", "Wash", "Filter", "Concentrate", "DrySolution")
MAX_SCALE = 2.5
"""Work-up volumes grow with the batch up to this factor."""
QUENCH_FILL = 0.95
"""Largest share of a beaker that a quench may fill."""


@dataclass(frozen=True)
class WorkUpStep:
    """An operation after the reaction.

    Attributes:
        action: name of the action.
        reagents: with amounts as written, "" where the text has none.
        temperature: degrees Celsius, if the text gives it.
        duration: minutes, if the text gives it.
        devices: instruments that the text names.
    """

    action: str
    reagents: tuple[tuple[Asset, str], ...] = ()
    temperature: float | None = None
    duration: float | None = None
    devices: tuple[str, ...] = ()

    def of(self, *categories: str) -> tuple[tuple[Asset, str], ...]:
        """Return the reagents of some categories."""
        return tuple(item for item in self.reagents if item[0].category in categories)


def work_up_steps(
    kind: Transformation, clauses: Sequence[Clause], reagents: Sequence[Asset], catalog: Catalog
) -> tuple[WorkUpStep, ...]:
    """Return the operations after the reaction: those of the text, completed by those usual for the reaction."""
    steps = _settled([step for clause in clauses if (step := _step(clause, catalog)) is not None])
    usual = _usual(kind, catalog)
    if kind.action == "Distill" and steps and steps[0].action == "Distill":
        steps = steps[1:]
    actions = [step.action for step in steps]
    isolated = actions[:1] in (["Filter"], ["Concentrate"]) and not any(_is_reactive(reagent) for reagent in reagents)
    if not isolated and not any(action in ("Quench", "Acidify", "Basify") for action in actions):
        steps = [*usual["quench"], *steps]
    if _reducing(kind) and "Quench" not in actions and "Acidify" in actions:
        # Acid on what is left of an oxidizer, or on manganese dioxide, releases chlorine.
        steps = [*usual["quench"], *usual["workup"][:1], *steps]
    if not any(action in WORKING_UP for action in actions):
        at = next((i for i, step in enumerate(steps) if step.action in PURIFYING), len(steps))
        steps = [*steps[:at], *usual["workup"], *steps[at:]]
    if not any(action in PURIFYING for action in actions):
        steps = [*steps, *usual["purify"]]
    if "Extract" in [step.action for step in steps] and "Concentrate" not in [step.action for step in steps]:
        at = max(i for i, step in enumerate(steps) if step.action in ("Extract", "Wash", "DrySolution")) + 1
        steps.insert(at, WorkUpStep("Concentrate"))
    return tuple(steps)


def _reducing(kind: Transformation) -> bool:
    """Return whether the reaction is ended by destroying an oxidizer."""
    return kind.quench is not None and kind.quench.asset in ("SodiumSulfite", "SodiumBisulfite", "SodiumThiosulfate")


def _settled(steps: Sequence[WorkUpStep]) -> list[WorkUpStep]:
    """Return steps with those after a solid adapted to it: it is rinsed on the filter and dried in the oven."""
    settled: list[WorkUpStep] = []
    for step in steps:
        solid = bool(settled) and settled[-1].action in SOLID
        if solid and step.action == "DrySolution" and not step.reagents:
            step = replace(step, action="DrySolid")
        elif solid and step.action == "Wash":
            step = replace(step, action="Filter")
        settled.append(step)
    return settled


def _is_reactive(reagent: Asset) -> bool:
    """Return whether the rest of a reagent has to be destroyed before the mixture is worked up."""
    chemistry = reagent.chemistry
    return reagent.hazards.oxidizer or (chemistry is not None and chemistry.water_reactive)


def _step(clause: Clause, catalog: Catalog) -> WorkUpStep | None:
    operation = clause.operation
    if operation is None or operation.action not in _STEPS:
        return None
    reagents = tuple((catalog.get(name), clause.amounts.get(name, "")) for name in clause.names("reagent"))
    if not reagents and "水洗" in clause.text:
        reagents = ((catalog.get("DeionizedWater"), ""),)
    return WorkUpStep(operation.action, reagents, clause.temperature, clause.duration, clause.names("instrument"))


def _usual(kind: Transformation, catalog: Catalog) -> dict[str, list[WorkUpStep]]:
    quench = []
    if kind.quench is not None:
        amount = kind.quench.amount + ASSUMED
        quench = [WorkUpStep(kind.quench.action, ((catalog.get(kind.quench.asset), amount),))]
    return {
        "quench": quench,
        "workup": [_parsed(text, catalog) for text in kind.workup],
        "purify": [_parsed(kind.purify, catalog)],
    }


def _parsed(text: str, catalog: Catalog) -> WorkUpStep:
    word, _, names = text.partition(":")
    return WorkUpStep(_ACTIONS[word], tuple((catalog.get(name), "") for name in names.split("+") if name))


_ACTIONS = {
    "extract": "Extract",
    "wash": "Wash",
    "dry": "DrySolution",
    "filter": "Filter",
    "acidify": "Acidify",
    "concentrate": "Concentrate",
    "recrystallise": "Recrystallize",
    "crystallise": "Crystallize",
    "chromatograph": "Chromatograph",
    "distil": "Distill",
    "vacuum": "DryVacuum",
}
"""Actions by the words of the table of transformations."""


class WorkUp:
    """Appends the steps of a work-up to a protocol.

    Args:
        builder: the protocol under construction.
        kind: the kind of reaction.
        volume: of the reaction mixture, mL.
        factor: size of the batch relative to that of the table.
        vessel: name of the reaction vessel.
    """

    def __init__(
        self, builder: ProtocolBuilder, kind: Transformation, volume: float, factor: float, vessel: str
    ) -> None:
        self.builder, self.kind, self.volume, self.vessel = builder, kind, volume, vessel
        self.catalog = builder.catalog
        self.factor = min(factor, MAX_SCALE)

    def carry_out(self, step: WorkUpStep) -> None:
        """Append the protocol's steps for a step of the work-up."""
        _STEPS[step.action](self, step)

    def _do(
        self,
        step: WorkUpStep,
        text: str,
        names: Sequence[str] = (),
        temperature: float | None = ROOM_TEMPERATURE,
        **slots: Sequence[str],
    ) -> None:
        self.builder.do(step.action, text, names, temperature, step.duration, "", **slots)

    def _list(self, step: WorkUpStep, role: str, amount: str, fallback: str = "") -> tuple[str, ...]:
        """List a step's reagents, or the fallback if it has none, and return their names."""
        reagents = step.reagents or (((self.catalog.get(fallback), ""),) if fallback else ())
        return tuple(
            self.builder.take(asset, role, stated or scaled(amount, self.factor) + ASSUMED)
            for asset, stated in reagents
        )

    def _names(self, names: Sequence[str]) -> str:
        return " and ".join(short_name(name, self.catalog) for name in names) or "water"

    def _dissolved(self, names: Sequence[str]) -> str:
        """Return the names of what is poured in; solids are solutions in water."""
        words = [
            short_name(name, self.catalog) + (" solution" if is_solid(self.catalog.get(name)) else "") for name in names
        ]
        return " and ".join(words) or "water"

    def _usual_reagent(self, stage: str, action: str, fallback: str) -> str:
        """Return the reagent that the kind of reaction usually takes for an action, or a fallback."""
        steps = _usual(self.kind, self.catalog)[stage]
        return next((step.reagents[0][0].name for step in steps if step.action == action), fallback)

    def _quench(self, step: WorkUpStep) -> None:
        usual = self.kind.quench
        fallback = usual.asset if usual is not None else "SodiumBicarbonate" if step.action == "Quench" else ""
        fallback = fallback or {"Acidify": "HydrochloricAcid", "Basify": "SodiumHydroxide"}[step.action]
        chosen = [asset.name for asset, _ in step.reagents] or [fallback]
        spare = "40 mL" if step.action == "Quench" else "40 mL of 3 M aq."
        amount = usual.amount if usual is not None and chosen == [usual.asset] else spare
        role = {"Quench": "quench", "Acidify": "acidification", "Basify": "basification"}[step.action]
        names = self._list(step, role, amount, fallback)
        if step.action == "Quench" and any(self.builder.takes(name) for name in refusals().destroyed_by_protic):
            self._quench_hydride(names, step)
            return
        words = self._dissolved(names)
        texts = {
            "Quench": f"Pour the cold mixture slowly onto {words} with ice and let gas escape.",
            "Acidify": f"Pour the mixture onto ice and acidify slowly with {words}; check with pH paper.",
            "Basify": f"Pour the mixture onto ice and basify slowly with {words}; check with pH paper.",
        }
        stated = step.temperature
        self._do(
            step,
            texts[step.action],
            names,
            stated if stated is not None and stated <= 25.0 else usual_temperature(step.action),
            vessel=(self.vessel,),
            beaker=(vessel_for(2.0 * self.volume + 60.0, self.catalog, BEAKERS, QUENCH_FILL),),
            bath=("IceBath",),
            paper=("PHPaper",) if step.action != "Quench" else (),
        )

    def _quench_hydride(self, names: tuple[str, ...], step: WorkUpStep) -> None:
        """Destroy the rest of a hydride or organometallic in its flask, dropwise in the cold."""
        gas = tuple(name for name in PROTECTIVE_GASES if self.builder.takes(name))
        after: tuple[str, ...] = ()
        if any(self.builder.takes(name) for name in ALUMINIUM_HYDRIDES):
            after = tuple(
                self.builder.take(self.catalog.get(name), "hydrolysis", amount)
                for name, amount in (("DeionizedWater", "3.5 mL"), ("SodiumHydroxide", "1.2 mL of 15 % aq."))
                if name not in names
            )
        liquids = ", then ".join(self._dissolved([name]) for name in (*names, *after))
        shield = " under inert gas" if gas else ""
        self._do(
            replace(step, duration=step.duration or 30.0),
            f"Cool the flask in an ice bath and add {liquids} drop by drop{shield}; wait until no more gas comes.",
            (*names, *after),
            usual_temperature("Quench"),
            vessel=(self.vessel,),
            bath=("IceBath",),
            funnel=("DroppingFunnel",),
            gas=("SchlenkLine", *gas) if gas else (),
        )

    def _extract(self, step: WorkUpStep) -> None:
        solvents = replace(step, reagents=step.of(*SOLVENTS))
        usual = self._usual_reagent("workup", "Extract", "EthylAcetate")
        names = self._list(solvents, "extraction solvent", "2 x 30 mL", usual)
        rest = tuple(
            self.builder.take(asset, "wash", stated or f"30 mL{ASSUMED}")
            for asset, stated in step.reagents
            if asset.name not in names
        )
        text = f"Transfer to the separating funnel, extract twice with {self._names(names)} and combine the organic"
        self._do(step, f"{text} layers.", (*names, *rest))

    def _wash(self, step: WorkUpStep) -> None:
        names = self._list(step, "wash", "30 mL aq.", "SodiumChloride")
        self._do(step, f"Wash the organic layer in the separating funnel with {self._dissolved(names)}.", names)

    def _dry_solution(self, step: WorkUpStep) -> None:
        names = self._list(step, "drying agent", "5 g", "MagnesiumSulfate")
        self._do(step, f"Dry the organic layer over {self._names(names)} in a conical flask and filter.", names)

    def _filter(self, step: WorkUpStep) -> None:
        aids = tuple(
            self.builder.take(asset, "filter aid", stated or f"5 g{ASSUMED}") for asset, stated in step.of("adsorbent")
        )
        rinses = tuple(
            self.builder.take(asset, "rinse", stated or f"20 mL{ASSUMED}") for asset, stated in step.of(*SOLVENTS)
        )
        text = "Filter by suction" + (f" through {self._names(aids)}" if aids else "")
        text += f", rinse with {self._names(rinses)}" if rinses else ""
        stated = step.temperature
        at = stated if stated is not None and stated < 25.0 else ROOM_TEMPERATURE
        self._do(step, f"{text} and keep what is wanted.", (*aids, *rinses), at)

    def _concentrate(self, step: WorkUpStep) -> None:
        stated = step.temperature
        at = stated if stated is not None and stated >= 25.0 else usual_temperature("Concentrate")
        self._do(step, f"Evaporate the solvent under reduced pressure at a bath temperature of {at:g} C.", (), at)

    def _recrystallise(self, step: WorkUpStep) -> None:
        usual = self._usual_reagent("purify", "Recrystallize", "Ethanol")
        names = self._list(step, "recrystallization", "40 mL", usual)
        chemistry = [self.catalog.get(name).chemistry for name in names]
        points = [item.boiling_point for item in chemistry if item is not None and item.boiling_point is not None]
        hot = round(max(30.0, min(points, default=75.0) - 4.0), 1)
        text = f"Dissolve the product in hot {self._names(names)}, let it cool, chill, filter by suction and let it dry"
        self._do(step, f"{text} in air.", names, hot, vessel=("ErlenmeyerFlask",))

    def _crystallise(self, step: WorkUpStep) -> None:
        names = self._list(step, "crystallization", "30 mL")
        stated = step.temperature
        cold = stated if stated is not None and 0.0 <= stated < 20.0 else usual_temperature("Crystallize")
        text = "Chill until the product crystallizes, and collect it by suction."
        self._do(step, text, names, cold, bath=("IceBath",), suction=SUCTION[:2])

    def _distil(self, step: WorkUpStep) -> None:
        stated = step.temperature
        at = stated if stated is not None and stated > 30.0 else usual_temperature("Distill")
        self._do(
            step,
            f"Test for peroxides, then distil under reduced pressure from a bath at {at:g} C.",
            (),
            at,
            vessel=("RoundBottomFlask",),
            pump=("VacuumPump",),
            bath=("OilBath", "MagneticHotplateStirrer"),
        )

    def _chromatograph(self, step: WorkUpStep) -> None:
        solvents = replace(step, reagents=step.of(*SOLVENTS))
        if not solvents.reagents:
            usual = [item for item in _usual(self.kind, self.catalog)["purify"] if item.action == "Chromatograph"]
            solvents = next(iter(usual), _parsed("chromatograph:NHexane+EthylAcetate", self.catalog))
        names = self._list(solvents, "eluent", "200 mL")
        silica = self.builder.take(
            self.catalog.get("SilicaGel"), "stationary phase", scaled("40 g", self.factor) + ASSUMED
        )
        text = f"Run a column of silica gel with {self._names(names)}; follow the fractions by TLC."
        self._do(step, text, (silica, *names))

    def _dry_solid(self, step: WorkUpStep) -> None:
        oven = next((name for name in step.devices if name in ("VacuumOven", "DryingOven")), "DryingOven")
        at = step.temperature if step.temperature is not None and step.temperature > 30.0 else 50.0
        self._do(step, f"Dry the product at {at:g} C to constant mass.", (), at, oven=(oven,))

    def _dry_vacuum(self, step: WorkUpStep) -> None:
        self._do(step, "Hold the residue under vacuum, a cold trap before the pump, until its mass is constant.")


_STEPS: dict[str, Callable[[WorkUp, WorkUpStep], None]] = {
    "Quench": WorkUp._quench,
    "Acidify": WorkUp._quench,
    "Basify": WorkUp._quench,
    "Extract": WorkUp._extract,
    "Wash": WorkUp._wash,
    "DrySolution": WorkUp._dry_solution,
    "Filter": WorkUp._filter,
    "Concentrate": WorkUp._concentrate,
    "Recrystallize": WorkUp._recrystallise,
    "Crystallize": WorkUp._crystallise,
    "Distill": WorkUp._distil,
    "Chromatograph": WorkUp._chromatograph,
    "DrySolid": WorkUp._dry_solid,
    "DryVacuum": WorkUp._dry_vacuum,
}
"""What appends the steps of each action of a work-up."""
