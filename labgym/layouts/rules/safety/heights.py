"""Heights: extinguishers, gas detectors, reagents, heavy items, and what hangs on walls."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from labgym.assets import Asset
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.earlier import reagents, standing
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.safety.hazards import GasDensity, detected_gas
from labgym.layouts.rules.safety.rooms import held_in_rooms
from labgym.layouts.rules.site import Site

REAGENT_HEIGHT_M = 1.40
"""Greatest height of a reagent's bottom, meters: below the eyes of a small woman (ISO 7250-3, 5th percentile 1.43 m;
Prudent Practices, 5.E.1: not above eye level)."""
HEAVY_KG = 10.0
HEAVY_HEIGHT_M = 1.40
"""Greatest height of the bottom of an item of 10 kg and more, meters: the shoulder (ISO 11228-1)."""
HEAVY_EXTINGUISHER_KG = 18.14
"""Mass from which an extinguisher hangs lower, kilograms (NFPA 10, 6.1.3.8.2: 40 lb)."""
HEAVY_EXTINGUISHER_TOP_M = 1.07
LIGHT_GAS_BOTTOM_M = 1.8
"""Least height of the bottom of a detector for a gas lighter than air, meters: above the heads of most people."""
HEAVY_GAS_TOP_M = 0.6
"""Greatest height of the top of a detector for a gas heavier than air, meters."""


@dataclass(frozen=True)
class Mounting:
    """The heights between which what hangs on a wall is: least of its bottom, greatest of its top, meters."""

    bottom: float
    top: float
    source: str


MOUNTINGS: dict[str, Mounting] = {
    "FireExtinguisher": Mounting(0.10, 1.53, "NFPA 10, 6.1.3.8"),
    "CO2Extinguisher": Mounting(0.10, 1.53, "NFPA 10, 6.1.3.8"),
    "FireBlanket": Mounting(0.5, 1.8, "BS EN 1869 guidance: within reach"),
    "FirstAidKit": Mounting(0.5, 1.8, "ANSI/ISEA Z308.1: within reach"),
    "GasDetector": Mounting(0.2, 2.6, "IEC 60079-29-2"),
    "ExitSign": Mounting(2.0, 3.5, "NFPA 101, 7.10.1 and 7.1.5"),
    "SafetySign": Mounting(1.0, 2.5, "ISO 3864-1: in the field of view"),
    "NoticeBoard": Mounting(0.6, 2.2, "planning practice: eye level"),
    "Whiteboard": Mounting(0.6, 2.2, "planning practice: eye level"),
    "Clock": Mounting(1.5, 3.0, "planning practice: above heads"),
    "CoatHooks": Mounting(1.0, 2.0, "planning practice: within reach"),
    "PaperTowelDispenser": Mounting(0.6, 1.7, "ADA 2010, 308: within reach"),
    "PowerSocketStrip": Mounting(0.3, 1.5, "ADA 2010, 308: within reach"),
    "WallCabinet": Mounting(1.1, 2.3, "SEFA practice: 1.35 to 1.45 m above the floor"),
    "WallShelf": Mounting(1.0, 2.0, "planning practice: within reach"),
    "DryingRack": Mounting(1.0, 2.3, "planning practice: within reach"),
}
"""Heights by role."""


def mounting(asset: Asset) -> Mounting | None:
    """Return the heights between which a wall item hangs; None if there is no limit."""
    limits = MOUNTINGS.get(asset.role)
    if limits is not None and asset.subtype == "fire" and asset.mass > HEAVY_EXTINGUISHER_KG:
        return Mounting(limits.bottom, HEAVY_EXTINGUISHER_TOP_M, limits.source)
    return limits


def _hanging(site: Site) -> list[tuple[int, Mounting]]:
    """Return the rows and the limits of what hangs on walls; `detector_height` judges those of light gases."""
    high = {room for room, own in gases(site).items() if "light" in own}
    pairs = []
    for row, (placement, asset) in enumerate(zip(site.arrangement.placements, site.arrangement.assets, strict=True)):
        limits = mounting(asset) if placement.support == WALL else None
        if limits is not None and not (asset.role == "GasDetector" and site.room(row) in high):
            pairs.append((row, limits))
    return pairs


def _hanging_and_held(site: Site, row: int) -> object:
    return standing(site, row) or held_in_rooms(site, row)


def _wall_heights(site: Site) -> Iterator[Breach]:
    for row, limits in _hanging(site):
        own = site.arrangement.placements[row].id
        bottom, top = site.arrangement.boxes.z[row].tolist()
        if top > limits.top + 1e-6:
            message = f"the top of {own} is {top:.2f} m high, over {limits.top:g} m ({limits.source})"
            yield Breach((own,), top, limits.top, message, f"hang it {top - limits.top:.2f} m lower")
        elif bottom < limits.bottom - 1e-6:
            message = f"the bottom of {own} is {bottom:.2f} m high, under {limits.bottom:g} m ({limits.source})"
            yield Breach((own,), bottom, limits.bottom, message, f"hang it {limits.bottom - bottom:.2f} m higher")


def _reagent_heights(site: Site) -> Iterator[Breach]:
    for row in site.arrangement.reagents:
        own, bottom = site.arrangement.placements[row].id, float(site.arrangement.boxes.z[row, 0])
        if bottom > REAGENT_HEIGHT_M + 1e-6:
            message = f"{own} stands {bottom:.2f} m high, over {REAGENT_HEIGHT_M:g} m"
            yield Breach((own,), bottom, REAGENT_HEIGHT_M, message, "use a lower shelf")


def _carried(site: Site, row: int) -> object:
    placement = site.arrangement.placements[row]
    return None if placement.support in (FLOOR, WALL) else placement


def _heavy(site: Site) -> list[int]:
    return [row for row in site.arrangement.supported if site.arrangement.assets[row].mass >= HEAVY_KG]


def _heavy_heights(site: Site) -> Iterator[Breach]:
    for row in _heavy(site):
        own, bottom = site.arrangement.placements[row].id, float(site.arrangement.boxes.z[row, 0])
        if bottom > HEAVY_HEIGHT_M + 1e-6:
            mass = site.arrangement.assets[row].mass
            message = f"{own} of {mass:g} kg stands {bottom:.2f} m high, over {HEAVY_HEIGHT_M:g} m"
            yield Breach((own,), bottom, HEAVY_HEIGHT_M, message, "put it on a lower surface")


def gases(site: Site) -> dict[int, dict[GasDensity, tuple[str, ...]]]:
    """Return the burning and toxic gases of each room: what holds them, by density relative to air."""
    found: dict[int, dict[GasDensity, tuple[str, ...]]] = {}
    for room, own in site.contents.items():
        for holder, asset in own:
            density = detected_gas(asset)
            if density is not None:
                by_density = found.setdefault(room, {})
                by_density[density] = (*by_density.get(density, ()), holder)
    return found


def _detector_heights(site: Site) -> Iterator[Breach]:
    for room, by_density in gases(site).items():
        detectors = site.rows_in(room, ("GasDetector",))
        if not detectors:
            continue
        named = tuple(site.arrangement.placements[row].id for row in detectors)
        bottoms, tops = site.arrangement.boxes.z[detectors].T.tolist()
        for density, holders in by_density.items():
            gas = f"{holders[0]} holds a gas {'lighter' if density == 'light' else 'heavier'} than air, but"
            if density == "light" and max(bottoms) < LIGHT_GAS_BOTTOM_M - 1e-6:
                value, limit = max(bottoms), LIGHT_GAS_BOTTOM_M
                message = f"{gas} the highest gas detector is {value:.2f} m high, under {limit:g} m"
                yield Breach((*named, *holders), value, limit, message, "hang it higher")
            if density == "heavy" and min(tops) > HEAVY_GAS_TOP_M + 1e-6:
                value, limit = min(tops), HEAVY_GAS_TOP_M
                message = f"{gas} the lowest gas detector ends {value:.2f} m high, over {limit:g} m"
                yield Breach((*named, *holders), value, limit, message, "hang it lower, or add one")


RULES = (
    FacilityRule(
        name="wall_height",
        requires="What hangs on a wall is at the height for it: extinguishers from 0.10 to 1.53 m (1.07 m above 18 kg)",
        limit="by kind (`MOUNTINGS`)",
        source="NFPA 10, 6.1.3.8; NFPA 101, 7.10; ADA 2010, 308",
        count=lambda site: len(_hanging(site)),
        check=_wall_heights,
        looks_at=_hanging_and_held,
    ),
    FacilityRule(
        name="reagent_height",
        requires="Reagents stand below eye level",
        limit=f"{REAGENT_HEIGHT_M:g} m to the bottom",
        source="Prudent Practices, 5.E.1; ISO 7250-3",
        count=lambda site: len(site.arrangement.reagents),
        check=_reagent_heights,
        looks_at=reagents,
    ),
    FacilityRule(
        name="heavy_height",
        requires=f"Items of {HEAVY_KG:g} kg and more stand below shoulder level",
        limit=f"{HEAVY_HEIGHT_M:g} m to the bottom",
        source="ISO 11228-1",
        count=lambda site: len(_heavy(site)),
        check=_heavy_heights,
        looks_at=_carried,
    ),
    FacilityRule(
        name="detector_height",
        requires="A gas detector hangs high for a gas lighter than air, low for a heavier one",
        limit=f"bottom at {LIGHT_GAS_BOTTOM_M:g} m or more, top at {HEAVY_GAS_TOP_M:g} m or less",
        source="IEC 60079-29-2, 8.4",
        count=lambda site: sum(map(len, gases(site).values())),
        check=_detector_heights,
        looks_at=held_in_rooms,
    ),
)
