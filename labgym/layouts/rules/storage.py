"""Store: every reagent is stored in a cabinet for reagents."""

from __future__ import annotations

import math
from dataclasses import replace

from labgym.geometry import rotate
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.rule import Instance, Term
from labgym.layouts.rules.thresholds import CONTAINMENT_TOLERANCE, HEIGHT_TOLERANCE

STORAGE_CLASSES = frozenset(
    {"Flammable", "Acid", "Base", "Oxidizer", "Toxic", "WaterReactive", "Refrigerator", "Gas", "General"}
)
"""Classes of cabinets that reagents are stored in; glassware and waste cabinets are not for them."""


def storage_instances(arrangement: Arrangement) -> tuple[Instance, ...]:
    """Return one instance for each placed reagent: 1 if it is stored, else 0."""
    instances = []
    for row in arrangement.reagents:
        stored = storage_cabinet(arrangement, row) is not None
        ids = (arrangement.placements[row].id,)
        note = "" if stored else "not in a storage cabinet"
        instances.append(Instance("storage", ids, None, 0.0, float(stored), not stored, note))
    return tuple(instances)


def class_instances(arrangement: Arrangement) -> tuple[Instance, ...]:
    """Return one instance for each placed reagent: 1 on a shelf of a cabinet of its class, else 0 and hard.

    The classes are the catalog's (segregation of incompatible chemicals: Prudent Practices, 5.E.2; IFC 5003.9.8).
    A reagent without a class is at home in any reagent cabinet.
    """

    def find(rows: list[int]) -> list[Instance]:
        return [_in_class(arrangement, row) for row in rows]

    return tuple(arrangement.facts("storage", arrangement.reagents, find, carried=True))


def _in_class(arrangement: Arrangement, row: int) -> Instance:
    cabinet, chemistry = storage_cabinet(arrangement, row), arrangement.assets[row].chemistry
    own = None if chemistry is None else chemistry.storage_class
    if cabinet is None:
        note = "not in a storage cabinet"
    elif own is not None and arrangement.assets[cabinet].storage_class != own:
        note = f"of storage class {own}, in a cabinet of class {arrangement.assets[cabinet].storage_class}"
    else:
        note = ""
    ids = (arrangement.placements[row].id,)
    return Instance("storage", ids, None, 0.0, float(not note), bool(note), note)


def storage_cabinet(arrangement: Arrangement, row: int) -> int | None:
    """Return the row of the reagent cabinet that an object stands in, wholly inside and on a shelf; else None."""
    support = arrangement.placements[row].support
    if support in (FLOOR, WALL) or support not in arrangement.index:
        return None
    cabinet = arrangement.index[support]
    asset = arrangement.assets[cabinet]
    if asset.storage_class not in STORAGE_CLASSES or asset.fume_hood or asset.cavity is None:
        return None
    return cabinet if _inside(arrangement, row, cabinet) and _on_shelf(arrangement, row, cabinet) else None


def closed_cabinet(arrangement: Arrangement, row: int) -> int | None:
    """Return the row of the storage cabinet with doors that an object stands in, or None."""
    cabinet = storage_cabinet(arrangement, row)
    if cabinet is None:
        return None
    cavity = arrangement.assets[cabinet].cavity
    return cabinet if cavity is not None and not cavity.open_front else None


def in_own_class(arrangement: Arrangement) -> float | None:
    """Return the share of placed reagents stored in a cabinet of their storage class, None without reagents."""
    reagents = arrangement.reagents
    cabinets = [storage_cabinet(arrangement, row) for row in reagents]
    own = sum(
        cabinet is not None
        and (chemistry := arrangement.assets[row].chemistry) is not None
        and arrangement.assets[cabinet].storage_class == chemistry.storage_class
        for row, cabinet in zip(reagents, cabinets, strict=True)
    )
    return own / len(reagents) if reagents else None


def _inside(arrangement: Arrangement, row: int, cabinet: int) -> bool:
    """Whether an object's bounding box lies in a cabinet's hollow."""
    cavity, size = arrangement.assets[cabinet].cavity, arrangement.assets[row].size
    if cavity is None:
        return False
    item, base = arrangement.placements[row], arrangement.placements[cabinet]
    x, y = rotate(item.position[0] - base.position[0], item.position[1] - base.position[1], -base.yaw)
    cosine, sine = abs(math.cos(item.yaw - base.yaw)), abs(math.sin(item.yaw - base.yaw))
    width, depth = size.width * cosine + size.depth * sine, size.width * sine + size.depth * cosine
    low = item.position[2] - base.position[2]
    beyond = (
        abs(x - cavity.x) + (width - cavity.width) / 2.0,
        abs(y - cavity.y) + (depth - cavity.depth) / 2.0,
        cavity.z0 - low,
        low + size.height - cavity.z1,
    )
    return max(beyond) <= CONTAINMENT_TOLERANCE


def _on_shelf(arrangement: Arrangement, row: int, cabinet: int) -> bool:
    """Whether an object's bottom is at the height of one of a cabinet's shelves."""
    bottom = arrangement.placements[row].position[2] - arrangement.placements[cabinet].position[2]
    return any(abs(bottom - surface.z) <= HEIGHT_TOLERANCE + 1e-9 for surface in arrangement.assets[cabinet].surfaces)


def _in_a_cabinet(instance: Instance) -> tuple[float, str, str]:
    reagent = instance.ids[0]
    return 1.0, f"{reagent} is {instance.note}", f"put {reagent} on a shelf of a reagent cabinet"


STORED = Term(
    name="storage",
    metric="store",
    requires="Reagents stand on the shelves of reagent cabinets",
    source="Prudent Practices, 5.E.2",
    instances=lambda site: storage_instances(site.arrangement),
    remedy=_in_a_cabinet,
)
STORED_BY_CLASS = replace(
    STORED,
    requires="Reagents stand on the shelves of cabinets of their storage class",
    source="Prudent Practices, 5.E.2; IFC 5003.9.8",
    instances=lambda site: class_instances(site.arrangement),
)
