"""The steps of a work-up: ending the reaction, isolating the crude product and purifying it."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

from labgym.protocols.amounts import read_amount, scaled
from labgym.protocols.apparatus import SUCTION, usual_temperature
from labgym.protocols.refusals import refusals
from labgym.protocols.rules.conditions import STEAM, STEAM_BATH
from labgym.protocols.rules.hazards import forms_peroxides
from labgym.protocols.synthesis.conditions import STEAM_BATH_C
from labgym.protocols.synthesis.phases import WorkUpStep
from labgym.protocols.synthesis.roles import ASSUMED, PROTECTIVE_GASES, SOLVENTS
from labgym.protocols.synthesis.workup_plan import parsed_step, usual_steps
from labgym.protocols.synthesis.workup_writer import WorkUpWriter
from labgym.quantities import ROOM_TEMPERATURE, pressures, temperatures

ALUMINUM_HYDRIDES = ("LithiumAluminumHydride", "DIBALH")
_NEUTRALIZING = re.compile(r"neutrali|中和", re.IGNORECASE)
_ICE = re.compile(
    r"(?<!\d)(\d+(?:\.\d+)?\s*(?:g|kg|mL))\s*(?:of\s+)?(?:crushed\s+|cracked\s+)?(?:ice|碎?冰)", re.IGNORECASE
)
BATH_EXCESS_K, HOTTEST_BATH_C = 30.0, 170.0
"""Excess of a still's bath over its vapor, kelvins, and the hottest oil bath, degrees Celsius."""
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


def quench(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append the step that ends the reaction: a quench, an acidification or a basification."""
    usual = work.kind.quench
    fallback = usual.asset if usual is not None else "SodiumBicarbonate" if step.action == "Quench" else ""
    if _NEUTRALIZING.search(step.text):
        fallback = "HydrochloricAcid" if _is_basic(work) else "SodiumBicarbonate"
    fallback = fallback or {"Acidify": "HydrochloricAcid", "Basify": "SodiumHydroxide"}[step.action]
    chosen = [asset.name for asset, _ in step.reagents] or [fallback]
    spare = "40 mL" if step.action == "Quench" else "40 mL of 3 M aq."
    amount = usual.amount if usual is not None and chosen == [usual.asset] else spare
    role = {"Quench": "quench", "Acidify": "acidification", "Basify": "basification"}[step.action]
    names = work.list_reagents(step, role, amount, fallback)
    if step.action == "Quench" and any(work.builder.takes(name) for name in refusals().destroyed_by_protic):
        _quench_hydride(work, names, step)
        return
    words = work.dissolved(names)
    if step.keep == "residue":
        work.do(step, f"Take up the residue in {words}.", names, ROOM_TEMPERATURE, beaker=("Beaker",))
        return
    gas = "; let the gas escape" if _evolves_gas(work, names) else ""
    texts = {
        "Quench": f"Pour the mixture slowly, with stirring, onto {words} with {_ice(step.text)}{gas}.",
        "Acidify": f"Pour the mixture onto ice and acidify slowly with {words}; check with pH paper.",
        "Basify": f"Pour the mixture onto ice and basify slowly with {words}; check with pH paper.",
    }
    stated = step.temperature
    work.do(
        step,
        texts[step.action],
        names,
        stated if stated is not None and stated <= 25.0 else usual_temperature(step.action),
        vessel=(work.vessel,),
        beaker=("Beaker",),
        bath=("IceBath", "MagneticStirrer"),
        paper=("PHPaper",) if step.action != "Quench" else (),
    )


def _is_basic(work: WorkUpWriter) -> bool:
    groups = [set(asset.groups) for asset in work.mixture.reagents]
    bases = any(item & {"strong_base", "carbonate", "basic_salt"} for item in groups)
    return bases and not any(item & {"strong_acid", "oxidizing_acid"} for item in groups)


def _evolves_gas(work: WorkUpWriter, names: Sequence[str]) -> bool:
    """Return whether a quench releases gas: a carbonate with acid, or residual hydride."""
    groups = {group for name in names for group in work.catalog.get(name).groups}
    present = {group for asset in work.mixture.reagents for group in asset.groups}
    acidic = bool(present & {"strong_acid", "oxidizing_acid", "carboxylic_acid", "acyl_halide"})
    return ("carbonate" in groups and acidic) or "metal_hydride" in present


def _quench_hydride(work: WorkUpWriter, names: tuple[str, ...], step: WorkUpStep) -> None:
    """Destroy the excess of a hydride or organometallic in its flask, dropwise in the cold."""
    gas = tuple(name for name in PROTECTIVE_GASES if work.builder.takes(name))
    after: tuple[str, ...] = ()
    if any(work.builder.takes(name) for name in ALUMINUM_HYDRIDES):
        after = tuple(
            work.builder.take(work.catalog.get(name), "hydrolysis", amount)
            for name, amount in (("DeionizedWater", "3.5 mL"), ("SodiumHydroxide", "1.2 mL of 15 % aq."))
            if name not in names
        )
    liquids = ", then ".join(work.dissolved([name]) for name in (*names, *after))
    shield = " under inert gas" if gas else ""
    work.do(
        replace(step, duration=step.duration or 30.0),
        f"Cool the flask in an ice bath and add {liquids} drop by drop{shield}; wait until gas evolution ends.",
        (*names, *after),
        usual_temperature("Quench"),
        vessel=(work.vessel,),
        bath=("IceBath", "MagneticStirrer"),
        funnel=("DroppingFunnel",),
        gas=("SchlenkLine", *gas) if gas else (),
    )


def _ice(text: str) -> str:
    """Return the ice of a quench: "100 g of ice" if the text states the amount."""
    stated = _ICE.search(text)
    return f"{stated[1]} of ice" if stated is not None else "ice"


def extract(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append an extraction, with the solvent that is usual for the reaction if the text names none."""
    solvents = replace(step, reagents=step.of(*SOLVENTS))
    usual = work.usual_reagent("workup", "Extract", "EthylAcetate")
    names = work.list_reagents(solvents, "extraction solvent", "2 x 30 mL", usual)
    rest = tuple(
        work.builder.take(asset, "wash", stated or f"30 mL{ASSUMED}")
        for asset, stated in step.reagents
        if asset.name not in names
    )
    portions = max((_portions(work, name) for name in names), default=2)
    times = {1: "once", 2: "twice", 3: "three times"}.get(portions, f"{portions} times")
    text = f"Transfer to the separating funnel, extract {times} with {work.names(names)} and combine the organic"
    work.do(step, f"{text} layers.", (*names, *rest))


def _portions(work: WorkUpWriter, name: str) -> int:
    amounts = [use.amount for use in work.builder.reagents if use.name == name]
    return read_amount(amounts[0].split(";")[-1]).portions if amounts else 2


def dissolve(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append the dissolution of the residue in an extraction solvent."""
    solvents = replace(step, reagents=step.of(*SOLVENTS))
    usual = work.usual_reagent("workup", "Extract", "EthylAcetate")
    names = work.list_reagents(solvents, "solvent of the work-up", "40 mL", usual)
    text = f"Dissolve the residue in {work.names(names)}."
    work.do(step, text, names, vessel=("ErlenmeyerFlask",), bath=("MagneticStirrer",))


def separate(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append the separation of the layers."""
    work.do(step, "Separate the organic layer from the aqueous one in the separating funnel.")


def wash(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append a wash of the organic layer, with brine if the text names nothing."""
    names = work.list_reagents(step, "wash", "30 mL aq.", "SodiumChloride")
    work.do(step, f"Wash the organic layer in the separating funnel with {work.dissolved(names)}.", names)


def dry_solution(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append the drying of the organic layer."""
    names = work.list_reagents(step, "drying agent", "5 g", "MagnesiumSulfate")
    work.do(step, f"Dry the organic layer over {work.names(names)} in a conical flask and filter.", names)


def filter_off(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append a filtration by suction, with its filter aid and rinses."""
    aids = tuple(
        work.builder.take(asset, "filter aid", stated or f"5 g{ASSUMED}") for asset, stated in step.of("adsorbent")
    )
    if "Celite" in step.devices and not aids:
        aids = (work.builder.take(work.catalog.get("Celite"), "filter aid", f"5 g{ASSUMED}"),)
    rinses = tuple(
        work.builder.take(asset, "rinse", stated or f"20 mL{ASSUMED}")
        for asset, stated in step.reagents
        if asset.name not in aids and asset.category in (*SOLVENTS, "inorganic_salt", "inorganic_base")
    )
    text = "Filter by suction" + (f" through {work.names(aids)}" if aids else "")
    text += f", rinse with {work.dissolved(rinses)}" if rinses else ""
    text += {"filtrate": " and keep the filtrate", "solid": " and collect the solid"}.get(step.keep, "")
    stated = step.temperature
    at = stated if stated is not None and stated < 25.0 else ROOM_TEMPERATURE
    work.do(step, f"{text}.", (*aids, *rinses), at)


def concentrate(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append the evaporation of the solvent."""
    stated = step.temperature
    at = stated if stated is not None and stated >= 25.0 else usual_temperature("Concentrate")
    work.do(step, f"Evaporate the solvent under reduced pressure at a bath temperature of {at:g} C.", (), at)


def recrystallize(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append a recrystallization, just below the boiling point of the solvent."""
    usual = work.usual_reagent("purify", "Recrystallize", "Ethanol")
    names = work.list_reagents(step, "recrystallization", "40 mL", usual)
    chemistry = [work.catalog.get(name).chemistry for name in names]
    points = [item.boiling_point for item in chemistry if item is not None and item.boiling_point is not None]
    hot = round(max(30.0, min(points, default=75.0) - 4.0), 1)
    text = f"Dissolve the product in hot {work.names(names)}, let it cool, chill, filter by suction and let it dry"
    work.do(step, f"{text} in air.", names, hot, vessel=("ErlenmeyerFlask",))


def crystallize(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append a crystallization in the cold."""
    names = work.list_reagents(step, "crystallization", "30 mL")
    stated = step.temperature
    cold = stated if stated is not None and 0.0 <= stated < 20.0 else usual_temperature("Crystallize")
    text = "Chill until the product crystallizes"
    text += "." if step.keep == "filtered" else ", and collect it by suction."
    work.do(step, text, names, cold, bath=("IceBath",), suction=SUCTION[:2])


def distil(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append a distillation; an assumed reduced pressure is noted."""
    stated = step.temperature
    steam, steam_bath = STEAM.search(step.text), STEAM_BATH.search(step.text)
    assumed = stated is None and not (steam or steam_bath or work.mixture.distilled)
    vacuum = _VACUUM.search(step.text) is not None or assumed
    above = next(iter(temperatures(step.text)), None)
    at = stated + BATH_EXCESS_K if stated is not None and stated > 30.0 else usual_temperature("Distill")
    at = STEAM_BATH_C if steam_bath else min(at, HOTTEST_BATH_C)
    peroxides = any(forms_peroxides(work.catalog.get(use.name)) for use in work.builder.reagents)
    if vacuum and _VACUUM.search(step.text) is None:
        work.builder.notes.append("the distillation is assumed to be under reduced pressure")
    text = "Test for peroxides, then distil" if peroxides else "Distil"
    text += " with steam" if steam else ""
    text += " under reduced pressure" if vacuum else ""
    pressure = next(iter(pressures(step.text)), None)
    text += f" at {pressure.text}" if pressure is not None else ""
    text += f" from a {'steam ' if steam_bath else ''}bath at {at:g} C"
    text += f" and collect what comes over at {above.text}" if above is not None else ""
    work.do(
        step,
        f"{text}.",
        (),
        at,
        vessel=("RoundBottomFlask",),
        pump=("VacuumPump",) if vacuum else (),
        bath=("WaterBath" if steam_bath else "OilBath", "MagneticHotplateStirrer"),
    )


def chromatograph(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append a column of silica gel."""
    solvents = replace(step, reagents=step.of(*SOLVENTS))
    if not solvents.reagents:
        usual = [item for item in usual_steps(work.kind, work.catalog)["purify"] if item.action == "Chromatograph"]
        solvents = next(iter(usual), parsed_step("chromatograph:NHexane+EthylAcetate", work.catalog))
    names = work.list_reagents(solvents, "eluent", "200 mL")
    silica = work.builder.take(work.catalog.get("SilicaGel"), "stationary phase", scaled("40 g", work.factor) + ASSUMED)
    text = f"Run a column of silica gel with {work.names(names)}; follow the fractions by TLC."
    work.do(step, text, (silica, *names))


def dry_solid(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append the drying of a solid in an oven."""
    oven = next((name for name in step.devices if name in ("VacuumOven", "DryingOven")), "DryingOven")
    at = step.temperature if step.temperature is not None and step.temperature > 30.0 else 50.0
    work.do(step, f"Dry the product at {at:g} C to constant mass.", (), at, oven=(oven,))


def dry_vacuum(work: WorkUpWriter, step: WorkUpStep) -> None:
    """Append the drying of a residue under vacuum."""
    work.do(step, "Hold the residue under vacuum, a cold trap before the pump, until its mass is constant.")


class WorkUp(WorkUpWriter):
    """Appends the steps of a work-up to a protocol."""

    def carry_out(self, step: WorkUpStep) -> None:
        """Append the protocol's steps for a step of the work-up; a hot mixture is left to cool first."""
        if self.hot and step.action != "Distill":
            text = f"Let the mixture cool to {ROOM_TEMPERATURE:g} C."
            self.builder.do("Cool", text, (), ROOM_TEMPERATURE, 20.0, vessel=(self.vessel,))
        self.hot = False
        if not step.text:
            self.assumed.append(_IN_WORDS.get(step.action, step.action.lower()))
        _STEPS[step.action](self, step)


_STEPS: dict[str, Callable[[WorkUpWriter, WorkUpStep], None]] = {
    "Quench": quench,
    "Acidify": quench,
    "Basify": quench,
    "Dissolve": dissolve,
    "Extract": extract,
    "PhaseSeparation": separate,
    "Wash": wash,
    "DrySolution": dry_solution,
    "Filter": filter_off,
    "Concentrate": concentrate,
    "Recrystallize": recrystallize,
    "Crystallize": crystallize,
    "Distill": distil,
    "Chromatograph": chromatograph,
    "DrySolid": dry_solid,
    "DryVacuum": dry_vacuum,
}
"""Functions that append the steps of each action of a work-up."""
