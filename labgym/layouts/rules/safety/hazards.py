"""Classes of reagents and cylinders that decide what must stand near them and what must not."""

from __future__ import annotations

from typing import Literal

from labgym.assets import Asset

FireClass = Literal["B", "D"]
GasDensity = Literal["light", "heavy", "neutral"]

BURNING_METALS = frozenset({"alkali_metal", "metal_powder", "metal_hydride", "organometallic"})
"""Reactive groups whose fires need a class D extinguisher (NFPA 10, 5.2.4 and A.5.2.4: combustible metals and their
reactive compounds; safety data sheets of hydrides and alkyls, section 5: dry powder, no water, no CO2)."""
CLASS_B = frozenset({"FireExtinguisher", "CO2Extinguisher"})
"""Extinguishers for burning liquids and gases: ABC powder and carbon dioxide."""
CLASS_D = frozenset({"ClassDExtinguisher"})
"""Extinguishers for burning metals and hydrides."""
VOLATILE_STATEMENTS = frozenset({"H224", "H225"})
"""Flammable liquids of GHS categories 1 and 2: their vapor burns at room temperature."""
TOXIC_GAS_STATEMENTS = frozenset({"H330", "H331"})
MOLAR_MASS_OF_AIR_G_MOL = 29.0
LIGHT_GAS_SHARE = 0.9
HEAVY_GAS_SHARE = 1.1
"""A gas rises below, and sinks above, this share of the molar mass of air (IEC 60079-29-2, 4.4: relative density)."""
BURNING_CYLINDERS = frozenset({"HydrogenCylinder"})
"""Cylinders of the catalog whose gas burns; the others hold inert gases."""
HYDROGEN_MOLAR_MASS_G_MOL = 2.0


def water_reactive(asset: Asset) -> bool:
    """Whether a reagent reacts dangerously with water, or ignites in air."""
    chemistry = asset.chemistry
    return chemistry is not None and (chemistry.water_reactive or pyrophoric(asset))


def pyrophoric(asset: Asset) -> bool:
    """Whether a reagent ignites in air as it is sold (GHS statement H250)."""
    chemistry = asset.chemistry
    return chemistry is not None and (chemistry.pyrophoric or "H250" in chemistry.h_codes)


def hazardous(asset: Asset) -> bool:
    """Whether a reagent has any hazard flag."""
    return asset.kind == "reagent" and any(value for _, value in asset.hazards)


def burning(asset: Asset) -> bool:
    """Whether a reagent burns, or feeds a fire: flammables and oxidizers."""
    return asset.kind == "reagent" and (asset.hazards.flammable or asset.hazards.oxidizer)


def fire_classes(asset: Asset) -> frozenset[FireClass]:
    """Return the fire classes of a reagent or a cylinder: B for flammables, D for metals and hydrides."""
    classes: set[FireClass] = set()
    if (asset.kind == "reagent" and asset.hazards.flammable) or asset.role in BURNING_CYLINDERS:
        classes.add("B")
    burning_metal = asset.hazards.active_metal or not BURNING_METALS.isdisjoint(asset.groups)
    if asset.kind == "reagent" and (burning_metal or pyrophoric(asset)):
        classes.add("D")
    return frozenset(classes)


def detected_gas(asset: Asset) -> GasDensity | None:
    """Return the density of a burning or toxic gas relative to air; None for other assets."""
    if asset.role in BURNING_CYLINDERS:
        return _density(HYDROGEN_MOLAR_MASS_G_MOL)
    chemistry = asset.chemistry
    if chemistry is None or chemistry.state != "gas":
        return None
    toxic = not TOXIC_GAS_STATEMENTS.isdisjoint(chemistry.h_codes)
    if not (asset.hazards.flammable or asset.hazards.oxidizer or toxic or asset.hazards.volatile_or_toxic):
        return None
    return _density(MOLAR_MASS_OF_AIR_G_MOL if chemistry.molar_mass is None else chemistry.molar_mass)


def calls_for_detector(asset: Asset) -> bool:
    """Whether a burning or toxic gas, or a flammable liquid of GHS category 1 or 2, calls for a gas detector."""
    if detected_gas(asset) is not None:
        return True
    chemistry = asset.chemistry
    return (
        asset.kind == "reagent"
        and chemistry is not None
        and chemistry.state == "liquid"
        and not VOLATILE_STATEMENTS.isdisjoint(chemistry.h_codes)
    )


def _density(molar_mass: float) -> GasDensity:
    share = molar_mass / MOLAR_MASS_OF_AIR_G_MOL
    return "light" if share < LIGHT_GAS_SHARE else "heavy" if share > HEAVY_GAS_SHARE else "neutral"
