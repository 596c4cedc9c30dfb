"""Capabilities of equipment and places according to the catalog, and alternatives to an asset."""

from __future__ import annotations

from collections.abc import Callable, Collection

from labgym.assets import Asset, Catalog

MATERIAL_LIMITS_C = {"glassware": 500.0, "plasticware": 120.0}
"""Highest temperatures of ware without a specification, degrees Celsius: borosilicate glass 3.3 for a short time, and
polypropylene in an autoclave."""
LINE_HALF_WIDTH_NM = 15.0
"""Half width of a lamp's or filter's line, nm."""
Span = tuple[float, float]
"""Smallest and largest value."""
BENCH_CATEGORIES = ("furniture", "containment", "safety_equipment")


def capacity(asset: Asset) -> float | None:
    """Return the capacity of a vessel or device in mL, or None if the catalog does not state it."""
    return asset.specs.capacity_mL


def heats_to(asset: Asset) -> float | None:
    """Return the highest temperature of a heating device, degrees Celsius, or None if it is not one."""
    heating = asset.specs.heating_C
    return heating[1] if heating is not None and asset.hazards.heat_source else None


def cools_to(asset: Asset) -> float | None:
    """Return the lowest temperature that a cooling device reaches, degrees Celsius, or None if it is not one."""
    return None if asset.specs.cooling_C is None else asset.specs.cooling_C[0]


def stands_to(asset: Asset) -> float | None:
    """Return the highest temperature that a device without heating withstands or measures, degrees Celsius, or None."""
    specs = asset.specs
    if asset.hazards.heat_source:
        return None
    if specs.withstands_C is not None:
        return specs.withstands_C
    span = specs.working_C or specs.measures_C
    return span[1] if span is not None else MATERIAL_LIMITS_C.get(asset.category)


def speeds(asset: Asset) -> tuple[Span, ...]:
    """Return the range of rotation speeds in rpm; empty if nothing rotates."""
    return () if asset.specs.rotation_rpm is None else (asset.specs.rotation_rpm,)


def forces(asset: Asset) -> tuple[Span, ...]:
    """Return the range of centrifugal forces in multiples of gravity; empty without a rotor."""
    return () if asset.specs.centrifuge_xg is None else ((0.0, asset.specs.centrifuge_xg),)


def flows(asset: Asset) -> tuple[Span, ...]:
    """Return the range of flow rates of a liquid pump, mL/min; empty if it is not one."""
    return () if asset.specs.flow_mL_min is None else (asset.specs.flow_mL_min,)


def shines(asset: Asset) -> tuple[Span, ...]:
    """Return the wavelength ranges of a lamp or an optical instrument, nm; empty if it is neither."""
    specs = asset.specs
    lines = tuple((line - LINE_HALF_WIDTH_NM, line + LINE_HALF_WIDTH_NM) for line in specs.lines_nm)
    return lines if specs.spectrum_nm is None else (specs.spectrum_nm, *lines)


def stirs(asset: Asset) -> float | None:
    """Return the largest volume of water that a stirrer moves, mL, or None if the catalog does not state it."""
    return asset.specs.stirring_mL


def evacuates_to(asset: Asset) -> float | None:
    """Return the lowest pressure of a vacuum pump or a device with one, mbar, or None if it is not one."""
    return asset.specs.ultimate_mbar


def withstands(asset: Asset) -> float | None:
    """Return the pressure rating of a closed vessel, bar, or None if it has none."""
    return asset.specs.withstands_bar


def delivers(asset: Asset) -> float | None:
    """Return the highest delivery pressure of a liquid pump, bar, or None if it is not one."""
    return asset.specs.delivery_bar


def weighs(asset: Asset) -> tuple[float, float] | None:
    """Return the resolution and the capacity of a balance, grams, or None if it is not one."""
    least, most = asset.specs.resolution_g, asset.specs.capacity_g
    return None if least is None or most is None else (least, most)


def alternative(
    catalog: Catalog,
    asset: Asset,
    measure: Callable[[Asset], float | None],
    fits: Callable[[float], bool],
    among: Collection[str] | None = None,
) -> str | None:
    """Return the name of the asset that can best replace another, or None.

    Assets of the same subtype come first, then those of the same category; among them, the one with the nearest value.

    Args:
        catalog: the assets to choose from.
        asset: the asset to replace.
        measure: capability that matters, such as `capacity`.
        fits: whether a value of the capability is sufficient.
        among: names to choose from; all if None.
    """
    candidates = [
        (other.subtype != asset.subtype, abs(value - (measure(asset) or 0.0)), other.name)
        for other in catalog.of_kind("instrument")
        if (among is None or other.name in among)
        and other.category == asset.category
        and (value := measure(other)) is not None
        and fits(value)
    ]
    return min(candidates)[2] if candidates else None


def is_workplace(asset: Asset) -> bool:
    """Return whether a step can take place there: a bench, hood or glove box with a surface, not a storage cabinet."""
    return (
        asset.kind == "facility"
        and asset.category in BENCH_CATEGORIES
        and bool(asset.surfaces)
        and asset.storage_class is None
    )


def is_ventilated(asset: Asset) -> bool:
    """Return whether a place is ventilated: a fume hood, a glove box, or a bench with local exhaust."""
    return asset.fume_hood or asset.category == "containment" or "local_exhaust" in asset.specs.features


def needs_ventilation(reagent: Asset) -> bool:
    """Return whether an open container of a reagent releases toxic or flammable vapor.

    Solids do so only if they are dissolved or heated, so weighing them on a bench is allowed; see
    `labgym.protocols.rules.safety`.
    """
    return reagent.hazards.volatile_or_toxic or reagent.hazards.flammable
