"""Steps that isolate the crude product: extraction, washes, drying, filtration, evaporation."""

from __future__ import annotations

from dataclasses import replace

from labgym.protocols.amounts import read_amount
from labgym.protocols.apparatus import usual_temperature
from labgym.protocols.synthesis.phases import WorkUpStep
from labgym.protocols.synthesis.roles import ASSUMED, SOLVENTS
from labgym.protocols.synthesis.workup_writer import WorkUpWriter
from labgym.quantities import ROOM_TEMPERATURE


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
