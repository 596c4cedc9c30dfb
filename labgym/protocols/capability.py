"""What equipment can do, as the catalogue specifies it, and which other asset could do what one cannot."""

from __future__ import annotations

from collections.abc import Callable, Collection

from labgym.assets import Asset, Catalog

MATERIAL_LIMITS = {"glassware": 500.0, "plasticware": 120.0}
"""What ware withstands where the catalogue does not say, degrees Celsius: borosilicate glass 3.3 for a short time, and
polypropylene in an autoclave."""
LINE_WIDTH = 15.0
"""How far a lamp's light or a filter reaches to either side of its line, nm."""
Span = tuple[float, float]
"""From the least to the most."""


def capacity(asset: Asset) -> float | None:
    """Return how many millilitres a vessel or device takes, or None where the catalogue does not say."""
    return asset.specs.capacity_mL


def heats_to(asset: Asset) -> float | None:
    """Return the highest temperature of a heating device, degrees Celsius, or None where it heats nothing."""
    heating = asset.specs.heating_C
    return heating[1] if heating is not None and asset.hazards.heat_source else None


def cools_to(asset: Asset) -> float | None:
    """Return the lowest temperature that a cooling device reaches, degrees Celsius, or None where it cools nothing."""
    return None if asset.specs.cooling_C is None else asset.specs.cooling_C[0]


def stands_to(asset: Asset) -> float | None:
    """Return the highest temperature that something which does not heat withstands or measures, degrees Celsius."""
    specs = asset.specs
    if asset.hazards.heat_source:
        return None
    if specs.withstands_C is not None:
        return specs.withstands_C
    span = specs.working_C or specs.measures_C
    return span[1] if span is not None else MATERIAL_LIMITS.get(asset.category)


def speeds(asset: Asset) -> tuple[Span, ...]:
    """Return the slowest and the fastest rotation in turns a minute; empty where nothing turns."""
    return () if asset.specs.rotation_rpm is None else (asset.specs.rotation_rpm,)


def forces(asset: Asset) -> tuple[Span, ...]:
    """Return the centrifugal forces that a rotor gives, in multiples of gravity; empty where none spins."""
    return () if asset.specs.centrifuge_xg is None else ((0.0, asset.specs.centrifuge_xg),)


def flows(asset: Asset) -> tuple[Span, ...]:
    """Return the flows that a liquid pump delivers, mL/min; empty where it is none."""
    return () if asset.specs.flow_mL_min is None else (asset.specs.flow_mL_min,)


def shines(asset: Asset) -> tuple[Span, ...]:
    """Return the wavelengths that a lamp gives or an instrument measures at, nm; empty where there is no light."""
    specs = asset.specs
    lines = tuple((line - LINE_WIDTH, line + LINE_WIDTH) for line in specs.lines_nm)
    return lines if specs.spectrum_nm is None else (specs.spectrum_nm, *lines)


def stirs(asset: Asset) -> float | None:
    """Return how many millilitres of water a stirrer moves at most, or None where the catalogue does not say."""
    return asset.specs.stirring_mL


def evacuates_to(asset: Asset) -> float | None:
    """Return the lowest pressure that a pump or a device with one reaches, mbar, or None where it is no pump."""
    return asset.specs.ultimate_mbar


def withstands(asset: Asset) -> float | None:
    """Return the pressure that a closed vessel is built for, bar, or None where it is built for none."""
    return asset.specs.withstands_bar


def delivers(asset: Asset) -> float | None:
    """Return the pressure that a liquid pump delivers against, bar, or None where it is no pump."""
    return asset.specs.delivery_bar


def weighs(asset: Asset) -> tuple[float, float] | None:
    """Return a balance's resolution and the most that it weighs, grams, or None where it is no balance."""
    least, most = asset.specs.resolution_g, asset.specs.capacity_g
    return None if least is None or most is None else (least, most)


def alternative(
    catalog: Catalog,
    asset: Asset,
    measure: Callable[[Asset], float | None],
    fits: Callable[[float], bool],
    among: Collection[str] | None = None,
) -> str | None:
    """Return the asset that could take the place of another, or None where none can.

    Of its subtype first, then of its category; the one whose measure is nearest to what it has to be.

    Args:
        measure: what it is about, such as `capacity`.
        fits: whether a value of the measure would do.
        among: the names to choose from; all by default.
    """
    found = [
        (other.subtype != asset.subtype, abs(value - (measure(asset) or 0.0)), other.name)
        for other in catalog.of_kind("instrument")
        if (among is None or other.name in among)
        and other.category == asset.category
        and (value := measure(other)) is not None
        and fits(value)
    ]
    return min(found)[2] if found else None
