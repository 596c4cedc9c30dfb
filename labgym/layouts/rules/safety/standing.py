"""Lists of the places where objects do not belong, by kind, with the reason and the remedy."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from labgym.assets import Asset
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.earlier import kinds
from labgym.layouts.rules.rule import Breach, FacilityRule
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.storage import STORAGE_CLASSES

Kind = Callable[[Asset], bool]

WASTE_PLACES = frozenset({"station", "trolley"})
"""Subtypes of furniture on which waste containers stand."""
ELECTRONIC = frozenset({"computer", "balance", "spectroscopy", "mass_spectrometry", "chromatography", "thermal"})
"""Subtypes of electronic instruments that no vapor and no splash may reach."""
HOT = frozenset({"flame", "hot_surface", "bath", "oven"})
"""Heat classes of what is hot when it is used."""
HAZARD_CABINETS = STORAGE_CLASSES - {"General", "Refrigerator"}
"""Storage classes of cabinets for hazardous reagents alone."""
CONTAINERS = frozenset({("glassware", "bottle"), ("glassware", "vial"), ("support", "rack")})
"""Categories and subtypes of what holds chemicals in cabinets."""


@dataclass(frozen=True)
class Misplacement:
    """A kind of object and the places where it does not belong, with the reason.

    Attributes:
        what: the objects, in words. is_kind: whether an asset is one.
        where: the places, in words. excludes: whether an asset is such a place.
        belongs: where it belongs instead, for the remedy.
    """

    what: str
    is_kind: Kind
    where: str
    excludes: Kind
    reason: str
    belongs: str
    source: str


def _subtype(*names: str) -> Kind:
    accepted = frozenset(names)
    return lambda asset: asset.subtype in accepted


def _hot(asset: Asset) -> bool:
    return asset.heat_class in HOT


def _waste(asset: Asset) -> bool:
    return asset.category == "waste" and asset.subtype == "container"


def _no_place_for_waste(asset: Asset) -> bool:
    return not (asset.subtype in WASTE_PLACES or asset.fume_hood or asset.storage_class == "Waste")


def _instrument(asset: Asset) -> bool:
    return asset.subtype == "computer" or asset.category in INSTRUMENTS


def _holds_no_chemical(asset: Asset) -> bool:
    """Whether an object is water, paper, ware or an instrument; glass bottles and vials, and their racks, are none."""
    return asset.kind == "instrument" and (asset.category, asset.subtype) not in CONTAINERS


def _hazard_cabinet(asset: Asset) -> bool:
    return asset.storage_class in HAZARD_CABINETS and not asset.fume_hood


def _emergency(asset: Asset) -> bool:
    return asset.subtype in ("fire", "spill")


def _out_of_sight(asset: Asset) -> bool:
    return asset.subtype in ("desk", "sink") or asset.fume_hood or _enclosed(asset) or _open_shelf(asset)


def _labware(asset: Asset) -> bool:
    """Whether an object touches chemicals: reagents, vessels, and what heats, cools or separates them."""
    return asset.kind == "reagent" or asset.category in LABWARE


def _of_the_bench(asset: Asset) -> bool:
    """Whether an object is for work with chemicals: reagents, and all instruments but computers and boxes of gloves."""
    return asset.kind == "reagent" or (asset.kind == "instrument" and asset.subtype not in ("computer", "dispenser"))


def _vapors(asset: Asset) -> bool:
    return asset.fume_hood or asset.category == "containment"


def _cabinet(asset: Asset) -> bool:
    return asset.storage_class is not None and asset.storage_class != "Glassware"


def _enclosed(asset: Asset) -> bool:
    return asset.storage_class is not None or asset.category == "cold_storage"


def _open_shelf(asset: Asset) -> bool:
    return asset.subtype in ("shelf", "rack") or asset.subtype == "trolley"


def _reagent(asset: Asset) -> bool:
    return asset.kind == "reagent"


LABWARE = frozenset(
    {
        "glassware", "ceramic", "heating", "cooling", "evaporation", "reaction", "vacuum", "stirring", "separation",
        "purification", "plasticware", "liquid_handling", "drying", "support", "weighing", "analytical", "mixing",
    }
)  # fmt: skip
"""Categories of instruments that are used with chemicals."""

INSTRUMENTS = frozenset({"analytical", "weighing", "mixing", "separation"})
"""Categories of electric instruments."""

MISPLACEMENTS = (
    Misplacement(
        "computers and electronic instruments", _subtype(*ELECTRONIC), "fume hoods and glove boxes", _vapors,
        "vapors corrode them and they may ignite vapors", "a bench or a desk",
        "Prudent Practices, 9.C.2: no unnecessary equipment in hoods; NFPA 45, 7.",
    ),
    Misplacement(
        "computers and electric instruments", _instrument, "sinks", _subtype("sink"),
        "water damages them and electrocutes people", "a bench or a desk", "Prudent Practices, 7.C.1.2",
    ),
    Misplacement(
        "computers and electric instruments", _instrument, "cabinets", _enclosed,
        "they are ignition sources", "a bench or a desk", "NFPA 30, 9.5; OSHA 29 CFR 1910.106(d)",
    ),
    Misplacement(
        "waste containers", _waste, "furniture other than a waste station, a trolley, a hood or a waste cabinet",
        _no_place_for_waste, "spills reach people at work", "the waste station or the floor", "40 CFR 262.15",
    ),
    Misplacement(
        "chemicals, laboratory ware and apparatus", _of_the_bench, "desks", _subtype("desk"),
        "people write, eat and drink there", "a bench, a hood or a cabinet", "Prudent Practices, 6.C.2",
    ),
    Misplacement(
        "reagents", _reagent, "open shelves, racks and trolleys", _open_shelf,
        "they fall off and nothing contains a spill", "a cabinet of their class", "Prudent Practices, 5.E.1",
    ),
    Misplacement(
        "reagents", _reagent, "waste stations, sinks and glassware cabinets",
        lambda asset: asset.subtype in ("station", "sink", "glassware_cabinet"),
        "they meet waste, water or clean ware", "a cabinet of their class", "Prudent Practices, 5.E.1",
    ),
    Misplacement(
        "hot devices", _hot, "reagent cabinets, refrigerators and freezers",
        lambda asset: _cabinet(asset) or asset.category == "cold_storage",
        "they ignite what is stored there", "a bench or a hood", "NFPA 30, 9.5; OSHA 29 CFR 1910.106(d)",
    ),
    Misplacement(
        "extinguishers and spill kits", _emergency, "desks, sinks, hoods, cabinets, racks and trolleys", _out_of_sight,
        "nobody finds them there", "the floor or a wall near the exit", "NFPA 10, 6.1.3.3",
    ),
    Misplacement(
        "cartons", _subtype("carton"), "hoods, glove boxes and cabinets",
        lambda asset: _vapors(asset) or _cabinet(asset),
        "they burn and block the air", "the floor or a rack", "Prudent Practices, 9.C.2",
    ),
    Misplacement(
        "water, paper, ware and instruments", _holds_no_chemical, "cabinets for hazardous reagents", _hazard_cabinet,
        "they burn or react with what leaks, or carry it out", "a bench, a shelf or a glassware cabinet",
        "Prudent Practices, 5.E.1",
    ),
    Misplacement(
        "laboratory ware", _labware, "waste stations", _subtype("station"),
        "clean ware meets waste", "a bench, a hood or a cabinet", "40 CFR 262.15",
    ),
    Misplacement(
        "hot devices", _hot, "shelves", _open_shelf,
        "they heat what stands above and fall off", "a bench or a hood", "planning practice",
    ),
)  # fmt: skip
"""What does not belong where. Reagents outside of cabinets of their class count as not stored, too."""


def forbidden(asset: Asset, support: Asset) -> Misplacement | None:
    """Return why an object does not belong on or in another, or None if it may stand there."""
    return next((one for one in MISPLACEMENTS if one.is_kind(asset) and one.excludes(support)), None)


def _judged(site: Site) -> list[int]:
    """Rows of the objects on or in furniture of which some kind is listed."""
    assets = site.arrangement.assets
    distinct = {id(asset): asset for asset in assets}
    listed = {key for key, asset in distinct.items() if any(one.is_kind(asset) for one in MISPLACEMENTS)}
    return [row for row in site.arrangement.supported if id(assets[row]) in listed]


def _check(site: Site) -> Iterator[Breach]:
    arrangement, reasons = site.arrangement, dict[tuple[int, int], Misplacement | None]()
    for row in _judged(site):
        support = arrangement.placements[row].support
        while support not in (FLOOR, WALL):
            carrier = arrangement.row(support)
            pair = arrangement.assets[row], arrangement.assets[carrier]
            key = id(pair[0]), id(pair[1])
            if key not in reasons:
                reasons[key] = forbidden(*pair)
            misplaced = reasons[key]
            if misplaced is not None:
                ids = arrangement.placements[row].id, support
                message = f"{ids[0]} is on or in {support}; {misplaced.what} do not belong on {misplaced.where}"
                yield Breach(
                    ids,
                    None,
                    0.0,
                    f"{message} ({misplaced.reason}; {misplaced.source})",
                    f"put it on {misplaced.belongs}",
                )
                break
            support = arrangement.placements[carrier].support


RULES = (
    FacilityRule(
        name="misplaced",
        requires="Objects stand where they belong: no computers in hoods, no waste or chemicals on desks, no heat in "
        "cabinets",
        limit="by kind (`MISPLACEMENTS`)",
        source="Prudent Practices, 5.E, 6.C and 9.C; 40 CFR 262.15; NFPA 30, 9.5",
        count=lambda site: len(_judged(site)),
        check=_check,
        looks_at=kinds,
    ),
)
