"""Steps that purify the product: recrystallization, distillation, chromatography, drying."""

from __future__ import annotations

import re
from dataclasses import replace

from labgym.assets import Asset
from labgym.protocols.apparatus import SUCTION, usual_temperature
from labgym.protocols.rules.conditions import STEAM, STEAM_BATH
from labgym.protocols.synthesis.batch import scaled
from labgym.protocols.synthesis.conditions import STEAM_BATH_C
from labgym.protocols.synthesis.phases import WorkUpStep
from labgym.protocols.synthesis.roles import ASSUMED, SOLVENTS
from labgym.protocols.synthesis.workup_plan import parsed_step, usual_steps
from labgym.protocols.synthesis.workup_writer import WorkUpWriter
from labgym.quantities import pressures, temperatures

BATH_ABOVE, HOTTEST_BATH = 30.0, 170.0
"""How much hotter than the vapor the bath of a still is, and the hottest oil bath, degrees Celsius."""
_VACUUM = re.compile(r"reduced pressure|vacuum|in vacuo|mbar|mm\s?hg|torr|减压|真空", re.IGNORECASE)


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
    at = stated + BATH_ABOVE if stated is not None and stated > 30.0 else usual_temperature("Distill")
    at = STEAM_BATH_C if steam_bath else min(at, HOTTEST_BATH)
    peroxides = any(_forms_peroxides(work.catalog.get(use.name)) for use in work.builder.reagents)
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


def _forms_peroxides(asset: Asset) -> bool:
    return asset.chemistry is not None and asset.chemistry.peroxide_former
