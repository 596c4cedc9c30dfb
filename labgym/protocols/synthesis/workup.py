"""From the end of the reaction to the pure product: quench, work-up, purification."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from labgym.assets import Asset, Catalog
from labgym.protocols.amounts import read_amount
from labgym.protocols.apparatus import BEAKERS, SUCTION, usual_temperature, vessel_for
from labgym.protocols.refusals import refusals
from labgym.protocols.synthesis.builder import ProtocolBuilder
from labgym.protocols.synthesis.frame import groups_of, is_solid, short_name
from labgym.protocols.synthesis.phases import Mixture, WorkUpStep, completed
from labgym.protocols.synthesis.reading import Clause
from labgym.protocols.synthesis.roles import ASSUMED, PROTECTIVE_GASES, SOLVENTS, scaled
from labgym.protocols.synthesis.transformations import Transformation
from labgym.quantities import ROOM_TEMPERATURE, pressures, temperatures

ALUMINIUM_HYDRIDES = ("LithiumAluminumHydride", "DIBALH")
PURIFYING = ("Recrystallize", "Crystallize", "Chromatograph", "Distill", "DrySolid", "DryVacuum")
SOLID = ("Filter", "Recrystallize", "Crystallize")
WORKING_UP = ("Extract", "Wash", "Filter", "Concentrate", "DrySolution")
FUNNEL_ROOM, LEAST_WASH = 225.0, 15.0
"""Capacity of the separating funnel, and least volume of an assumed wash or quench, mL."""
COOLED = 40.0
"""Temperature above which a mixture is left to cool before it is worked up, degrees Celsius."""
BATH_ABOVE, HOTTEST_BATH = 30.0, 170.0
"""How much hotter than the vapor the bath of a still is, and the hottest oil bath, degrees Celsius."""
MIN_SCALE, MAX_SCALE = 0.5, 2.5
"""Work-up volumes follow the batch between these factors."""
MIXED = {"Chromatograph": 200.0, "Extract": 60.0}
"""Assumed volumes of mixtures whose ratio the text gives, by action, mL; 40 mL for the others."""
QUENCH_FILL = 0.95
"""Largest share of a beaker that a quench may fill."""


def work_up_steps(
    kind: Transformation, clauses: Sequence[Clause], mixture: Mixture, catalog: Catalog
) -> tuple[WorkUpStep, ...]:
    """Return the operations after the reaction: those of the text, completed by what they and the reaction need."""
    steps = _settled([step for clause in clauses for step in _steps_of(clause, catalog)])
    usual = _usual(kind, catalog)
    if kind.action == "Distill" and steps and steps[0].action == "Distill":
        steps = steps[1:]
    actions = [step.action for step in steps]
    reactive = any(_is_reactive(reagent) for reagent in mixture.reagents)
    isolated = actions[:1] in (["Filter"], ["Concentrate"], ["Crystallize"], ["Distill"]) and not reactive
    if not isolated and not any(action in ("Quench", "Acidify", "Basify") for action in actions):
        steps = [*usual["quench"], *steps]
    if _reducing(kind) and "Quench" not in actions and "Acidify" in actions:
        # Acid releases chlorine from residual oxidizer or manganese dioxide.
        steps = [*usual["quench"], *usual["workup"][:1], *steps]
    if not any(action in WORKING_UP for action in actions):
        at = next((i for i, step in enumerate(steps) if step.action in PURIFYING), len(steps))
        steps = [*steps[:at], *usual["workup"], *steps[at:]]
    if not any(action in PURIFYING for action in actions):
        steps = [*steps, *_finish(actions, usual["purify"])]
    names = [step.action for step in steps]
    if "Extract" in names and not {"Concentrate", "Distill"} & set(names):
        at = max(i for i, name in enumerate(names) if name in ("Extract", "Wash", "DrySolution")) + 1
        steps.insert(at, WorkUpStep("Concentrate"))
    extract = _first(usual["workup"], "Extract") or _parsed("extract:EthylAcetate", catalog)
    dry = _first(usual["workup"], "DrySolution") or _parsed("dry:MagnesiumSulfate", catalog)
    return tuple(completed(steps, mixture, extract, dry))


def _first(steps: Sequence[WorkUpStep], action: str) -> WorkUpStep | None:
    return next((step for step in steps if step.action == action), None)


def _finish(actions: Sequence[str], usual: Sequence[WorkUpStep]) -> Sequence[WorkUpStep]:
    """Return the default last steps; if the text describes a work-up, the product is only dried."""
    worked_up = [action for action in actions if action in WORKING_UP]
    if not worked_up:
        return usual
    return [WorkUpStep("DrySolid" if worked_up[-1] == "Filter" else "DryVacuum")]


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
    """Return whether excess reagent has to be destroyed before the mixture is worked up."""
    chemistry = reagent.chemistry
    return reagent.hazards.oxidizer or (chemistry is not None and chemistry.water_reactive)


def _step(clause: Clause, catalog: Catalog) -> WorkUpStep | None:
    operation = clause.operation
    if operation is None or operation.action not in _STEPS:
        return None
    names = [name for name in clause.names("reagent") if name not in clause.removed]
    reagents = tuple((catalog.get(name), _amount(clause, name)) for name in names)
    if not reagents and "水洗" in clause.text:
        reagents = ((catalog.get("DeionizedWater"), ""),)
    devices = clause.names("instrument")
    return WorkUpStep(operation.action, reagents, clause.temperature, clause.duration, devices, clause.text)


def _steps_of(clause: Clause, catalog: Catalog) -> tuple[WorkUpStep, ...]:
    """Return the steps of a clause: an extraction that also names what the layer is washed with is two."""
    step = _step(clause, catalog)
    if step is None:
        return ()
    if step.action == "Extract" and step.of(*SOLVENTS):
        washes = tuple(item for item in step.reagents if item not in step.of(*SOLVENTS))
        wash = (replace(step, action="Wash", reagents=washes, duration=None),) if washes else ()
        return (replace(step, reagents=step.of(*SOLVENTS)), *wash)
    return (step,)


def _amount(clause: Clause, name: str) -> str:
    """Return the amount of a reagent in a clause; a concentration alone is combined with the usual volume."""
    strength = clause.strengths.get(name, "")
    share = next((share for ratio in clause.mixtures for liquid, share in ratio if liquid == name), None)
    if share is not None and name not in clause.amounts:
        action = clause.operation.action if clause.operation else ""
        return f"{share * MIXED.get(action, 40.0):.3g} mL{ASSUMED}"
    return clause.amounts.get(name, "") or (f"40 mL of {strength}{ASSUMED}" if strength else "")


def _usual(kind: Transformation, catalog: Catalog) -> dict[str, list[WorkUpStep]]:
    quench = []
    if kind.quench is not None:
        quench = [WorkUpStep(kind.quench.action, ((catalog.get(kind.quench.asset), ""),))]
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
        mixture: the reaction mixture.
        factor: size of the batch relative to that of the table.

    Attributes:
        assumed: actions that the text does not name, in words.
    """

    def __init__(self, builder: ProtocolBuilder, kind: Transformation, mixture: Mixture, factor: float) -> None:
        self.builder, self.kind, self.mixture = builder, kind, mixture
        self.volume, self.vessel = mixture.volume, mixture.vessel
        self.catalog = builder.catalog
        self.factor = min(max(factor, MIN_SCALE), MAX_SCALE)
        self.hot = mixture.hottest > COOLED
        self.assumed: list[str] = []

    def carry_out(self, step: WorkUpStep) -> None:
        """Append the protocol's steps for a step of the work-up; a hot mixture is left to cool first."""
        if self.hot and step.action != "Distill":
            text = f"Let the mixture cool to {ROOM_TEMPERATURE:g} C."
            self.builder.do("Cool", text, (), ROOM_TEMPERATURE, 20.0, vessel=(self.vessel,))
        self.hot = False
        if not step.text:
            self.assumed.append(_IN_WORDS.get(step.action, step.action.lower()))
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
            self.builder.take(asset, role, stated or self._fitting(scaled(amount, self.factor)) + ASSUMED)
            for asset, stated in reagents
        )

    def _fitting(self, amount: str) -> str:
        """Return an assumed volume, less where the separating funnel would overflow."""
        room = max(LEAST_WASH, (FUNNEL_ROOM - self.volume) / 2.0)
        stated = read_amount(amount).volume
        if stated is None:
            return _WHOLE.sub(lambda match: f"{round(float(match[1]))} g", amount)
        if stated <= room:
            return amount
        return scaled(amount, 5.0 * (room // 5.0) / stated)

    def _names(self, names: Sequence[str]) -> str:
        return " and ".join(short_name(name, self.catalog) for name in names) or "water"

    def _dissolved(self, names: Sequence[str]) -> str:
        """Return the names of the liquids that are poured in; solids are dissolved in water."""
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
        if _NEUTRALIZING.search(step.text):
            fallback = "HydrochloricAcid" if self._is_basic() else "SodiumBicarbonate"
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
        if step.keep == "residue":
            self._do(step, f"Take up the residue in {words}.", names, ROOM_TEMPERATURE, beaker=("Beaker",))
            return
        gas = "; let the gas escape" if self._evolves_gas(names) else ""
        texts = {
            "Quench": f"Pour the mixture slowly, with stirring, onto {words} with {_ice(step.text)}{gas}.",
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

    def _is_basic(self) -> bool:
        groups = [set(groups_of(asset)) for asset in self.mixture.reagents]
        bases = any(item & {"strong_base", "carbonate", "basic_salt"} for item in groups)
        return bases and not any(item & {"strong_acid", "oxidizing_acid"} for item in groups)

    def _evolves_gas(self, names: Sequence[str]) -> bool:
        """Return whether a quench releases gas: a carbonate with acid, or residual hydride."""
        groups = {group for name in names for group in groups_of(self.catalog.get(name))}
        present = {group for asset in self.mixture.reagents for group in groups_of(asset)}
        acidic = bool(present & {"strong_acid", "oxidizing_acid", "carboxylic_acid", "acyl_halide"})
        return ("carbonate" in groups and acidic) or "metal_hydride" in present

    def _quench_hydride(self, names: tuple[str, ...], step: WorkUpStep) -> None:
        """Destroy the excess of a hydride or organometallic in its flask, dropwise in the cold."""
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
            f"Cool the flask in an ice bath and add {liquids} drop by drop{shield}; wait until gas evolution ends.",
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
        portions = max((self._portions(name) for name in names), default=2)
        times = {1: "once", 2: "twice", 3: "three times"}.get(portions, f"{portions} times")
        text = f"Transfer to the separating funnel, extract {times} with {self._names(names)} and combine the organic"
        self._do(step, f"{text} layers.", (*names, *rest))

    def _portions(self, name: str) -> int:
        amounts = [use.amount for use in self.builder.reagents if use.name == name]
        return read_amount(amounts[0].split(";")[-1]).portions if amounts else 2

    def _dissolve(self, step: WorkUpStep) -> None:
        solvents = replace(step, reagents=step.of(*SOLVENTS))
        usual = self._usual_reagent("workup", "Extract", "EthylAcetate")
        names = self._list(solvents, "solvent of the work-up", "40 mL", usual)
        text = f"Dissolve the residue in {self._names(names)}."
        self._do(step, text, names, vessel=("ErlenmeyerFlask",), bath=("MagneticStirrer",))

    def _separate(self, step: WorkUpStep) -> None:
        self._do(step, "Separate the organic layer from the aqueous one in the separating funnel.")

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
        if "Celite" in step.devices and not aids:
            aids = (self.builder.take(self.catalog.get("Celite"), "filter aid", f"5 g{ASSUMED}"),)
        rinses = tuple(
            self.builder.take(asset, "rinse", stated or f"20 mL{ASSUMED}")
            for asset, stated in step.reagents
            if asset.name not in aids and asset.category in (*SOLVENTS, "inorganic_salt", "inorganic_base")
        )
        text = "Filter by suction" + (f" through {self._names(aids)}" if aids else "")
        text += f", rinse with {self._dissolved(rinses)}" if rinses else ""
        text += {"filtrate": " and keep the filtrate", "solid": " and collect the solid"}.get(step.keep, "")
        stated = step.temperature
        at = stated if stated is not None and stated < 25.0 else ROOM_TEMPERATURE
        self._do(step, f"{text}.", (*aids, *rinses), at)

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
        text = "Chill until the product crystallizes"
        text += "." if step.keep == "filtered" else ", and collect it by suction."
        self._do(step, text, names, cold, bath=("IceBath",), suction=SUCTION[:2])

    def _distil(self, step: WorkUpStep) -> None:
        stated = step.temperature
        vacuum = _VACUUM.search(step.text) is not None or (stated is None and "steam" not in step.text.lower())
        above = next(iter(temperatures(step.text)), None)
        at = stated + BATH_ABOVE if stated is not None and stated > 30.0 else usual_temperature("Distill")
        at = min(at, HOTTEST_BATH)
        peroxides = any(_forms_peroxides(self.catalog.get(use.name)) for use in self.builder.reagents)
        if vacuum and _VACUUM.search(step.text) is None:
            self.builder.notes.append("the distillation is assumed to be under reduced pressure")
        text = "Test for peroxides, then distil" if peroxides else "Distil"
        text += " with steam" if "steam" in step.text.lower() else ""
        text += " under reduced pressure" if vacuum else ""
        pressure = next(iter(pressures(step.text)), None)
        text += f" at {pressure.text}" if pressure is not None else ""
        text += f" from a bath at {at:g} C"
        text += f" and collect what comes over at {above.text}" if above is not None else ""
        self._do(
            step,
            f"{text}.",
            (),
            at,
            vessel=("RoundBottomFlask",),
            pump=("VacuumPump",) if vacuum else (),
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


def _ice(text: str) -> str:
    """Return the ice of a quench: "100 g of ice" if the text states the amount."""
    stated = _ICE.search(text)
    return f"{stated[1]} of ice" if stated is not None else "ice"


_WHOLE = re.compile(r"^(\d+\.\d+) g\b")
_NEUTRALIZING = re.compile(r"neutrali|中和", re.IGNORECASE)
_ICE = re.compile(r"(\d+(?:\.\d+)?\s*(?:g|kg|mL))\s*(?:of\s+)?(?:crushed\s+|cracked\s+)?(?:ice|碎?冰)", re.IGNORECASE)


def _forms_peroxides(asset: Asset) -> bool:
    return asset.chemistry is not None and asset.chemistry.peroxide_former


_VACUUM = re.compile(r"reduced pressure|vacuum|in vacuo|mbar|mm\s?hg|torr|减压|真空", re.IGNORECASE)
_IN_WORDS = {
    "Acidify": "acidification",
    "Basify": "basification",
    "Concentrate": "evaporation",
    "Crystallize": "crystallization",
    "Dissolve": "dissolution of the residue",
    "DrySolid": "drying",
    "DrySolution": "drying of the organic layer",
    "DryVacuum": "drying under vacuum",
    "Distill": "distillation",
    "Chromatograph": "chromatography",
    "Recrystallize": "recrystallization",
    "Extract": "extraction",
    "Filter": "filtration",
    "PhaseSeparation": "separation of the layers",
    "Quench": "quench",
    "Wash": "wash",
}
_STEPS: dict[str, Callable[[WorkUp, WorkUpStep], None]] = {
    "Quench": WorkUp._quench,
    "Acidify": WorkUp._quench,
    "Basify": WorkUp._quench,
    "Dissolve": WorkUp._dissolve,
    "Extract": WorkUp._extract,
    "PhaseSeparation": WorkUp._separate,
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
"""Methods that append the steps of each action of a work-up."""
