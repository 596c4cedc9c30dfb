"""Safety equipment that a laboratory must have for what it holds: part of completeness."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from labgym.assets import Asset
from labgym.layouts.placement import WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.safety.hazards import CLASS_B, CLASS_D, calls_for_detector, fire_classes, hazardous
from labgym.layouts.rules.whereabouts import resolved
from labgym.protocols import Protocol

if TYPE_CHECKING:
    from labgym.layouts.rules.objective import Assessment

Hazard = Callable[[Asset], bool]


@dataclass(frozen=True)
class Requirement:
    """A kind of safety equipment.

    Attributes:
        asset: the asset that is added where it is missing.
        accepted: assets that meet the requirement.
        calls: whether a reagent or a cylinder calls for it.
        source: the rule that requires it.
        carrier: asset that will carry it, which counts while furniture is arranged (see `furnishing`); or empty. What
            hangs on any wall has the carrier "wall"; it does not count before.
    """

    asset: str
    accepted: frozenset[str]
    calls: Hazard
    source: str
    carrier: str = ""


def _liquid(reagent: Asset) -> bool:
    return hazardous(reagent) and reagent.phase == "liquid"


def _class_d(reagent: Asset) -> bool:
    return "D" in fire_classes(reagent)


EXTINGUISHERS = CLASS_B | CLASS_D
LIQUID_WASTE = frozenset({"SolventWasteContainer"})
CHEMICAL_WASTE = LIQUID_WASTE | {"SolidWasteBin"}
"""Containers for hazardous waste; bins for paper and for broken glass are not."""
COLLECTION = "40 CFR 262.15: waste is collected at or near the point of generation"

REQUIREMENTS = (
    Requirement(
        "EmergencyShower", frozenset({"EmergencyShower"}), hazardous, "OSHA 1910.151(c); Z358.1; JGJ 91-2019, 5.3.3"
    ),
    Requirement(
        "EyewashStation", frozenset({"EyewashStation"}), hazardous, "OSHA 1910.151(c); Z358.1; JGJ 91-2019, 5.3.3"
    ),
    Requirement(
        "HandWashSink", frozenset({"HandWashSink"}), hazardous, "OSHA 1910.141(d)(2); Prudent Practices, 6.C.2"
    ),
    Requirement("FireExtinguisher", CLASS_B, hazardous, "OSHA 1910.157(d)(2), (d)(4); NFPA 10, 6.3"),
    Requirement("ClassDExtinguisher", CLASS_D, _class_d, "OSHA 1910.157(d)(6); NFPA 10, 5.2.4 and 6.5"),
    Requirement("GasDetector", frozenset({"GasDetector"}), calls_for_detector, "IEC 60079-29-2; TRGS 722, 2.4"),
    Requirement("SpillKit", frozenset({"SpillKit"}), _liquid, "Prudent Practices, 6.C.3; OSHA 1910.120(q)"),
    Requirement(
        "FirstAidKit", frozenset({"FirstAidKit"}), hazardous, "OSHA 1910.151(b); ANSI/ISEA Z308.1", carrier=WALL
    ),
    Requirement("SolventWasteContainer", LIQUID_WASTE, _liquid, COLLECTION, "WasteStation"),
    Requirement("SolventWasteContainer", CHEMICAL_WASTE, hazardous, COLLECTION, "WasteStation"),
)
"""What laboratories need, and the reagents and cylinders that call for it; see `safety.rooms` for each room."""


def required_equipment(
    arrangement: Arrangement, protocol: Protocol | None, requirements: Iterable[Requirement] = REQUIREMENTS
) -> tuple[Requirement, ...]:
    """Return those requirements that the reagents of a layout, and those that its protocol requires, call for.

    Of several requirements for the same asset, only the first that is called for counts.
    """
    catalog = arrangement.layout.catalog
    names = () if protocol is None else resolved(tuple(use.name for use in protocol.reagents), catalog)
    stored = [asset for asset in arrangement.assets if asset.kind == "reagent" or asset.subtype == "gas_cylinder"]
    reagents = dict.fromkeys([*stored, *map(catalog.get, names)])
    required: dict[str, Requirement] = {}
    for one in requirements:
        if one.asset not in required and any(map(one.calls, reagents)):
            required[one.asset] = one
    return tuple(required.values())


def missing_equipment(
    arrangement: Arrangement, required: Iterable[Requirement], out_of_bounds: frozenset[str]
) -> tuple[str, ...]:
    """Return the assets to add: of each requirement that nothing meets. What is out of bounds meets none."""
    placed = {
        asset.role
        for placement, asset in zip(arrangement.placements, arrangement.assets, strict=True)
        if placement.id not in out_of_bounds
    }
    return tuple(one.asset for one in required if placed.isdisjoint(one.accepted))


def equipment_figures(assessment: Assessment) -> dict[str, float | None]:
    """Return the share of the required kinds of safety equipment that are placed, None if none is required."""
    required, missing = len(assessment.equipment), len(assessment.unequipped)
    return {"safety": 1.0 - missing / required if required else None}
