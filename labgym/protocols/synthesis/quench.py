"""Steps that end a reaction: quench, acidification, basification, and the careful end of hydrides."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

from labgym.protocols.apparatus import BEAKERS, usual_temperature, vessel_for
from labgym.protocols.refusals import refusals
from labgym.protocols.synthesis.frame import groups_of
from labgym.protocols.synthesis.phases import WorkUpStep
from labgym.protocols.synthesis.roles import PROTECTIVE_GASES
from labgym.protocols.synthesis.workup_writer import WorkUpWriter
from labgym.quantities import ROOM_TEMPERATURE

ALUMINIUM_HYDRIDES = ("LithiumAluminumHydride", "DIBALH")
QUENCH_FILL = 0.95
"""Largest share of a beaker that a quench may fill."""
_NEUTRALIZING = re.compile(r"neutrali|中和", re.IGNORECASE)
_ICE = re.compile(
    r"(?<!\d)(\d+(?:\.\d+)?\s*(?:g|kg|mL))\s*(?:of\s+)?(?:crushed\s+|cracked\s+)?(?:ice|碎?冰)", re.IGNORECASE
)


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
        beaker=(vessel_for(2.0 * work.volume + 60.0, work.catalog, BEAKERS, QUENCH_FILL),),
        bath=("IceBath", "MagneticStirrer"),
        paper=("PHPaper",) if step.action != "Quench" else (),
    )


def _is_basic(work: WorkUpWriter) -> bool:
    groups = [set(groups_of(asset)) for asset in work.mixture.reagents]
    bases = any(item & {"strong_base", "carbonate", "basic_salt"} for item in groups)
    return bases and not any(item & {"strong_acid", "oxidizing_acid"} for item in groups)


def _evolves_gas(work: WorkUpWriter, names: Sequence[str]) -> bool:
    """Return whether a quench releases gas: a carbonate with acid, or residual hydride."""
    groups = {group for name in names for group in groups_of(work.catalog.get(name))}
    present = {group for asset in work.mixture.reagents for group in groups_of(asset)}
    acidic = bool(present & {"strong_acid", "oxidizing_acid", "carboxylic_acid", "acyl_halide"})
    return ("carbonate" in groups and acidic) or "metal_hydride" in present


def _quench_hydride(work: WorkUpWriter, names: tuple[str, ...], step: WorkUpStep) -> None:
    """Destroy the excess of a hydride or organometallic in its flask, dropwise in the cold."""
    gas = tuple(name for name in PROTECTIVE_GASES if work.builder.takes(name))
    after: tuple[str, ...] = ()
    if any(work.builder.takes(name) for name in ALUMINIUM_HYDRIDES):
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
