"""What a safety officer would reject in a written layout, found with shapely, numpy and scipy alone.

    PYTHONPATH=. python tests/outside/safety_checker.py LAYOUT.json...

prints a line for each fault and exits with 1 if there is one. The checker reads layout files and the catalog's files as
data. It imports neither rules nor navigation: it finds rooms, ways, distances and heights by itself.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra
from shapely.affinity import rotate, translate
from shapely.geometry import LineString, Point, Polygon

from labgym.eval.outside import WrittenPlan, findings
from labgym.eval.outside.written_plan import WrittenItem, entries

WET_GAP_M = 1.0
"""Least distance of water-reactives and pyrophorics from wet fittings, in plan."""
EXIT_GAP_M = 1.0
"""Least distance of flammables and oxidizers from exits, in plan."""
HEAT_GAP_M = 0.3
"""Least distance of flammables and oxidizers outside closed cabinets from ovens and furnaces."""
CLASS_B_WALK_M, CLASS_D_WALK_M = 15.2, 22.9
"""Longest walks to an extinguisher (NFPA 10, 6.3 and 6.5)."""
EXTINGUISHER_TOP_M, EXTINGUISHER_BOTTOM_M = 1.53, 0.10
"""Highest top and lowest bottom of an extinguisher on a wall (NFPA 10, 6.1.3.8)."""
RINSE_WALK_M = 16.8
"""Longest walk to a shower and an eyewash: 10 s (ANSI/ISEA Z358.1-2014)."""
REAGENT_BASE_M = 1.40
"""Highest base of a reagent above the floor: below the eyes of a small person (ISO 7250-3)."""
FASTENED_GAP_M = 0.1
"""Sinks, eyewashes and showers stand at most this far from a wall or from low furniture (IPC 405.4)."""
LOW_M = 1.5
"""Furniture below this height carries pipes between benches that stand back to back."""
LIGHT_GAS_DETECTOR_M = 1.8
"""Lowest center of a detector for a gas lighter than air."""
SQUARE_TURN = math.radians(2.0)
"""Furniture counts as square up to this turn."""
CAPS = {"IceMachine": 1, "NoticeBoard": 2, "UltraLowFreezer": 2}
"""Optional pieces of a laboratory, however many rooms it has."""
SLACK_M = 5e-3
"""Rounding of coordinates."""
WET = {"sink", "eyewash", "shower", "ice"}
"""Subtypes of wet fittings."""
LOOSE = {
    "seat",
    "trolley",
    "carton",
    "drum",
    "floor_sign",
    "container",
    "spill",
    "fire",
    "robot",
    "pump",
    "gas_cylinder",
}
"""Subtypes of floor objects that people push or carry: they may stand askew."""
PERSON_M, CELL_M, GRID_EXCESS = 0.25, 0.025, 1.03
"""Half the width of a walking person, side of a grid cell, and how much ways over 16 neighbors overstate at most.

People are narrower by 0.8 cells on each side, so that a way just as wide as they are holds cells that touch.
"""
ENTRY_M = 0.9
"""Cells this near to a door or a passage are where people come in."""
HEADROOM_M = 2.0


@dataclass(frozen=True)
class Fault:
    """A fault: its kind, the objects concerned and what was measured."""

    kind: str
    who: tuple[str, ...]
    text: str

    def __str__(self) -> str:
        """Return the fault in one line."""
        return f"{self.kind}: {', '.join(self.who)}: {self.text}"


@dataclass(frozen=True)
class Opening:
    """An opening of a wall: its area in plan, the spaces on its sides, and the unit vector along the wall."""

    kind: str
    polygon: Polygon
    z0: float
    z1: float
    spaces: tuple[int, ...]
    along: tuple[float, float]

    @property
    def exit(self) -> bool:
        """Whether it is a door to the outside."""
        return self.kind == "door" and len(self.spaces) == 1


class Laboratory:
    """A layout's spaces, openings, hazards and walks."""

    def __init__(self, data: dict[str, Any]) -> None:
        self.plan = WrittenPlan(data)
        self.items = self.plan.items
        self.spaces = [_space(space) for space in data["floor"]["spaces"]]
        self.axes = [float(space.get("yaw", 0.0)) for space in data["floor"]["spaces"]]
        self.walls = data["floor"]["walls"]
        self.openings = [opening for wall in self.walls for opening in self._openings(wall)]
        self.protocols = data["protocols"]

    def _openings(self, wall: dict[str, Any]) -> Iterator[Opening]:
        (ax, ay), (bx, by) = wall["start"], wall["end"]
        yaw, half = math.atan2(by - ay, bx - ax), wall["thickness"] / 2
        along = math.cos(yaw), math.sin(yaw)
        for opening in wall["openings"]:
            low, high = opening["position"] - opening["width"] / 2, opening["position"] + opening["width"] / 2
            hole = translate(rotate(shapely.box(low, -half, high, half), yaw, (0, 0), use_radians=True), ax, ay)
            beyond = hole.buffer(0.35, join_style="mitre", cap_style="flat")
            sides = tuple(k for k, space in enumerate(self.spaces) if space.intersection(beyond).area > 0.05)
            sill = opening.get("sill", 0.0)
            yield Opening(opening["kind"], hole, sill, sill + opening["height"], sides, along)

    def space_of(self, item: WrittenItem) -> int:
        """Return the index of the space in which an object is."""
        return min(range(len(self.spaces)), key=lambda k: self.spaces[k].distance(Point(item.x, item.y)))

    @cached_property
    def rooms(self) -> list[int]:
        """The room of each space: spaces with a passage without a door between them are one room."""
        links = [o.spaces for o in self.openings if o.kind == "passage" and len(o.spaces) == 2]
        for first, one in enumerate(self.spaces):
            links += [(first, k) for k in range(first) if one.distance(self.spaces[k]) < 0.01]
        rows, columns = [link[0] for link in links], [link[1] for link in links]
        count = len(self.spaces)
        graph = coo_matrix((np.ones(len(links)), (rows, columns)), shape=(count, count))
        return [int(label) for label in connected_components(graph, directed=False)[1]]

    def room_of(self, item: WrittenItem) -> int:
        """Return the room in which an object is."""
        return self.rooms[self.space_of(item)]

    def used(self, where: Callable[[dict[str, Any]], bool]) -> list[tuple[str, WrittenItem]]:
        """Return the reagents of a class that protocols use, each with the furniture on which a step uses it."""
        places = []
        for protocol in self.protocols:
            for step in protocol["steps"]:
                item = self.plan.at_location(step["location"])
                for name in step["uses"]:
                    entry = entries().get(name)
                    if item is not None and entry is not None and entry["kind"] == "reagent" and where(entry):
                        places.append((name, self.plan.root(item)))
        return list({(name, item.id): (name, item) for name, item in places}.values())

    def working_area(self, carrier: WrittenItem) -> Polygon:
        """Return the area of the vessels and devices in use on a piece of furniture; its outline without any."""
        used = {name for protocol in self.protocols for step in protocol["steps"] for name in step["uses"]}
        items = [i for i in self.items if i.entry["name"] in used and i.entry["kind"] == "instrument"]
        areas = [item.footprint for item in items if item.id != carrier.id and self.plan.root(item) is carrier]
        return shapely.union_all(areas) if areas else carrier.footprint

    def stored(self, where: Callable[[dict[str, Any]], bool]) -> list[WrittenItem]:
        """Return the objects of a class: reagents, and cylinders."""
        return [item for item in self.items if item.entry["kind"] in ("reagent", "facility") and where(item.entry)]

    def closed_in(self, item: WrittenItem) -> bool:
        """Whether an object is in a closed cabinet or refrigerator."""
        carrier = self.plan.by_id.get(item.support)
        cavity = carrier.entry.get("cavity") if carrier is not None else None
        hood = carrier is not None and carrier.entry.get("fume_hood", False)
        return cavity is not None and not cavity.get("open_front", False) and not hood

    @cached_property
    def _grid(self) -> tuple[np.ndarray, np.ndarray]:
        """Centers of cells, and the objects and walls that stand in the way of people."""
        x0, y0, x1, y1 = shapely.union_all(self.spaces).bounds
        xs, ys = np.arange(x0 - 0.5, x1 + 0.5, CELL_M), np.arange(y0 - 0.5, y1 + 0.5, CELL_M)
        return np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1), np.array([len(xs), len(ys)])

    def _free(self, doors: bool) -> np.ndarray:
        joined = [o.polygon.buffer(0.07, join_style="mitre") for o in self.openings if self._walkable(o, doors)]
        domain = shapely.union_all([*(s.buffer(0.06, join_style="mitre") for s in self.spaces), *joined])
        standing = [i.footprint for i in self.items if i.support == "floor" and i.entry["subtype"] not in LOOSE]
        leaves = " leaf"
        walls = [
            b.polygon for b in self.plan.building if b.z0 < HEADROOM_M and not (doors and b.owner.endswith(leaves))
        ]
        blocked = shapely.union_all([*standing, *walls]).buffer(PERSON_M - 0.8 * CELL_M)
        free = domain.difference(blocked)
        shapely.prepare(free)
        points = self._grid[0]
        return shapely.contains_xy(free, points[..., 0].ravel(), points[..., 1].ravel()).reshape(points.shape[:2])

    @staticmethod
    def _walkable(opening: Opening, doors: bool) -> bool:
        return len(opening.spaces) == 2 and (opening.kind == "passage" or (doors and opening.kind == "door"))

    @cached_property
    def _graphs(self) -> dict[bool, tuple[Any, np.ndarray]]:
        """Graph of free cells and the cells' numbers, without and with doors that people open."""
        return {doors: _graph(self._free(doors)) for doors in (False, True)}

    def walks(self, targets: Iterable[WrittenItem], doors: bool) -> Callable[[WrittenItem], float]:
        """Return a function that gives the shortest walk from the front of an object to the front of a target, in m."""
        graph, numbers = self._graphs[doors]
        starts = [cell for item in targets if (cell := self._cell(item, numbers)) is not None]
        if not starts:
            return lambda _: math.inf
        lengths = dijkstra(graph, directed=False, indices=starts, min_only=True)

        def walk(item: WrittenItem) -> float:
            cell = self._cell(item, numbers)
            return math.inf if cell is None else float(lengths[cell]) * CELL_M / GRID_EXCESS

        return walk

    def entered(self, item: WrittenItem) -> bool:
        """Whether people who come in at a door or a passage can walk to a place in front of an object."""
        groups, entries = self._entered
        cell = self._cell(item, self._graphs[False][1])
        return cell is not None and (not entries or int(groups[cell]) in entries)

    @cached_property
    def _entered(self) -> tuple[np.ndarray, set[int]]:
        """The group of connected cells of each free cell, and the groups of the cells near doors and passages."""
        graph, numbers = self._graphs[False]
        groups, entries = connected_components(graph, directed=False)[1], set[int]()
        for opening in self.openings:
            if opening.kind in ("door", "passage"):
                x0, y0, x1, y1 = opening.polygon.bounds
                window = self._window(x0 - ENTRY_M, y0 - ENTRY_M, x1 + ENTRY_M, y1 + ENTRY_M)
                points, own = self._grid[0][window], numbers[window]
                near = (own >= 0) & (shapely.distance(shapely.points(points), opening.polygon) < ENTRY_M)
                entries |= set(groups[own[near]].tolist())
        return groups, entries

    def _window(self, x0: float, y0: float, x1: float, y1: float) -> tuple[slice, slice]:
        """Return the rows and columns of the cells in a rectangle, one more on each side."""
        origin, (rows, columns) = self._grid[0][0, 0], self._grid[1]
        low = np.clip(np.floor((np.array([x0, y0]) - origin) / CELL_M).astype(int) - 1, 0, [rows - 1, columns - 1])
        high = np.clip(np.ceil((np.array([x1, y1]) - origin) / CELL_M).astype(int) + 2, 1, [rows, columns])
        return slice(int(low[0]), int(high[0])), slice(int(low[1]), int(high[1]))

    def _cell(self, item: WrittenItem, numbers: np.ndarray) -> int | None:
        """Return the number of the free cell nearest to the place in front of an object, within 0.7 m of it."""
        place = item.in_front(PERSON_M + 0.15)
        window = self._window(place.x - 0.7, place.y - 0.7, place.x + 0.7, place.y + 0.7)
        points, own = self._grid[0][window], numbers[window]
        gaps = np.where(own >= 0, np.hypot(points[..., 0] - place.x, points[..., 1] - place.y), np.inf)
        nearest = np.unravel_index(np.argmin(gaps), gaps.shape)
        return int(own[nearest]) if gaps[nearest] <= 0.7 else None


def _space(space: dict[str, Any]) -> Polygon:
    boxes = [shapely.box(r.get("x0", 0.0), r.get("y0", 0.0), r["x1"], r["y1"]) for r in space["region"]]
    local = shapely.union_all(boxes)
    turned = rotate(local, space.get("yaw", 0.0), origin=(0, 0), use_radians=True)
    return translate(turned, space.get("x", 0.0), space.get("y", 0.0))


def _graph(free: np.ndarray) -> tuple[Any, np.ndarray]:
    numbers = np.where(free, np.cumsum(free.ravel()).reshape(free.shape) - 1, -1)
    rows, columns, lengths = [], [], []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1), (2, 1), (1, 2), (2, -1), (1, -2)):
        one = numbers[: numbers.shape[0] - dx, max(-dy, 0) : numbers.shape[1] - max(dy, 0)]
        other = numbers[dx:, max(dy, 0) : numbers.shape[1] - max(-dy, 0)]
        both = (one >= 0) & (other >= 0)
        rows.append(one[both])
        columns.append(other[both])
        lengths.append(np.full(int(both.sum()), math.hypot(dx, dy)))
    count = int(free.sum())
    edges = (np.concatenate(rows), np.concatenate(columns))
    return coo_matrix((np.concatenate(lengths), edges), shape=(count, count)).tocsr(), numbers


def reactive(entry: dict[str, Any]) -> bool:
    """Whether a reagent reacts dangerously with water or ignites in air."""
    chemistry = entry.get("chemistry") or {}
    codes = {"H250", "H260", "H261", "EUH014"}
    return chemistry.get("storage_class") == "WaterReactive" or not codes.isdisjoint(chemistry.get("h_codes", ()))


def burning_metal(entry: dict[str, Any]) -> bool:
    """Whether a reagent burns as metals do, so that only a class D agent puts it out."""
    chemistry, hazards = entry.get("chemistry") or {}, entry.get("hazards") or {}
    groups = {"metal_hydride", "alkali_metal", "organometallic"}
    pyrophoric = "H250" in chemistry.get("h_codes", ())
    return bool(hazards.get("active_metal")) or pyrophoric or not groups.isdisjoint(chemistry.get("groups", ()))


def _flag(*names: str) -> Callable[[dict[str, Any]], bool]:
    return lambda entry: any((entry.get("hazards") or {}).get(name, False) for name in names)


def _burns(entry: dict[str, Any]) -> bool:
    return _flag("flammable")(entry) and (entry.get("chemistry") or {}).get("state") == "liquid"


def _vapors(entry: dict[str, Any]) -> bool:
    """Whether a burning or toxic gas, or a highly flammable liquid, calls for a detector."""
    return _dangerous_gas(entry) or not {"H224", "H225"}.isdisjoint((entry.get("chemistry") or {}).get("h_codes", ()))


def _dangerous_gas(entry: dict[str, Any]) -> bool:
    gas = (entry.get("chemistry") or {}).get("state") == "gas" or entry.get("subtype") == "gas_cylinder"
    return gas and _flag("flammable", "volatile_or_toxic")(entry)


HAZARDOUS = _flag("flammable", "volatile_or_toxic", "acid", "base", "oxidizer", "active_metal")


def faults(data: dict[str, Any]) -> list[Fault]:
    """Return all faults of a layout document."""
    laboratory = Laboratory(data)
    checks = (
        _wet, _at_exits, _at_heat, _extinguishers, _rinsing, _washing, _unfastened, _detecting, _over_openings,
        _heights, _standing, _skewed, _too_many, _unsound,
    )  # fmt: skip
    return [fault for check in checks for fault in check(laboratory)]


def _wet(lab: Laboratory) -> Iterator[Fault]:
    fittings = [item for item in lab.items if item.entry["subtype"] in WET]
    at_risk = [(item.id, item.footprint, item) for item in lab.stored(reactive)]
    holding = {item.support for item in lab.stored(reactive)}
    cabinets = [item for item in lab.items if item.entry.get("storage_class") == "WaterReactive" and item.id in holding]
    at_risk += [(f"cabinet {item.id}", item.footprint, item) for item in cabinets]
    at_risk += [(f"{name} in use", item.footprint, item) for name, item in lab.used(reactive)]
    for name, area, item in at_risk:
        for fitting in fittings:
            gap = area.distance(fitting.footprint)
            if gap < WET_GAP_M - SLACK_M and lab.space_of(item) == lab.space_of(fitting):
                yield Fault("wet", (name, fitting.id), f"{gap:.2f} m, at least {WET_GAP_M} m")


def _at_exits(lab: Laboratory) -> Iterator[Fault]:
    doors = [opening.polygon for opening in lab.openings if opening.exit]
    kind = _flag("flammable", "oxidizer")
    at_risk = [(item.id, item.footprint) for item in lab.stored(kind) if item.entry["category"] != "waste"]
    at_risk += [(f"{name} in use on {item.id}", lab.working_area(item)) for name, item in lab.used(kind)]
    for name, area in at_risk:
        gap = min((area.distance(door) for door in doors), default=math.inf)
        if gap < EXIT_GAP_M - SLACK_M:
            yield Fault("exit", (name,), f"{gap:.2f} m from an exit, at least {EXIT_GAP_M} m")


def _at_heat(lab: Laboratory) -> Iterator[Fault]:
    ovens = [item for item in lab.items if item.entry["subtype"] in ("oven", "furnace")]
    for item in lab.stored(_flag("flammable", "oxidizer")):
        for oven in ovens:
            rise = max(item.z - oven.z - oven.height, oven.z - item.z - item.height, 0.0)
            gap = math.hypot(item.footprint.distance(oven.footprint), rise)
            if gap < HEAT_GAP_M - SLACK_M and not lab.closed_in(item):
                yield Fault("heat", (item.id, oven.id), f"{gap:.2f} m, at least {HEAT_GAP_M} m")


def _extinguishers(lab: Laboratory) -> Iterator[Fault]:
    hung = [item for item in lab.items if item.entry.get("specs", {}).get("agent") is not None]
    for item in hung:
        metal = item.entry["specs"]["agent"] == "class_D"
        top = item.z + item.height
        if top > EXTINGUISHER_TOP_M + SLACK_M:
            yield Fault("extinguisher height", (item.id,), f"top at {top:.2f} m, at most {EXTINGUISHER_TOP_M} m")
        if item.z < EXTINGUISHER_BOTTOM_M - SLACK_M and not (metal and item.support == "floor"):
            yield Fault(
                "extinguisher height", (item.id,), f"bottom at {item.z:.2f} m, at least {EXTINGUISHER_BOTTOM_M} m"
            )
        if not lab.entered(item):
            yield Fault("extinguisher reach", (item.id,), "no way leads to it from a door of its room")
    reach = [item for item in hung if item.z + item.height <= EXTINGUISHER_TOP_M + SLACK_M]
    for metal, kind, limit in ((False, _burns, CLASS_B_WALK_M), (True, burning_metal, CLASS_D_WALK_M)):
        fit = [item for item in reach if (item.entry["specs"]["agent"] == "class_D") == metal]
        walk = lab.walks(fit, doors=not metal)
        places = [lab.plan.root(item) for item in lab.stored(kind)] + [item for _, item in lab.used(kind)]
        for place in {item.id: item for item in places}.values():
            length = walk(place)
            if length > limit + SLACK_M:
                name = "class D extinguisher" if metal else "class B extinguisher"
                yield Fault("extinguisher", (place.id,), f"{length:.1f} m to a {name}, at most {limit} m")


def _rinsing(lab: Laboratory) -> Iterator[Fault]:
    hoods = [item for item in lab.items if item.entry.get("fume_hood")]
    places = {item.id: item for item in [*hoods, *(item for _, item in lab.used(HAZARDOUS))]}
    for subtype in ("shower", "eyewash"):
        walk = lab.walks([item for item in lab.items if item.entry["subtype"] == subtype], doors=False)
        for place in places.values():
            length = walk(place)
            if length > RINSE_WALK_M + SLACK_M:
                yield Fault(subtype, (place.id,), f"{length:.1f} m without a door, at most {RINSE_WALK_M} m")


def _washing(lab: Laboratory) -> Iterator[Fault]:
    places = {lab.room_of(item): item for _, item in lab.used(HAZARDOUS)}
    sinks = {lab.room_of(item) for item in lab.items if item.entry["subtype"] == "sink"}
    for room, place in places.items():
        if room not in sinks:
            yield Fault("sink", (place.id,), "hazardous work in a room without a sink to wash hands")
    if places and all(item.entry["name"] != "HandWashSink" for item in lab.items):
        yield Fault("sink", (), "hazardous work without a hand-wash sink")
    for item in lab.items:
        if item.entry["name"] == "HandWashSink" and not lab.entered(item):
            yield Fault("sink reach", (item.id,), "no way leads to it from a door of its room")


def _unfastened(lab: Laboratory) -> Iterator[Fault]:
    walls = shapely.union_all([part.polygon for part in lab.plan.building if not part.owner.endswith(" leaf")])
    low = [i for i in lab.items if i.support == "floor" and i.height < LOW_M and i.entry["subtype"] not in LOOSE]
    for item in lab.items:
        if item.entry["subtype"] not in ("sink", "eyewash", "shower") or item.support != "floor":
            continue
        back = item.rectangle(-item.width / 2, item.width / 2, -item.depth / 2, -item.depth / 2 + 0.01)
        near = [other.footprint for other in low if other.id != item.id] if item.height < LOW_M else []
        gap = back.distance(shapely.union_all([walls, *near]))
        if gap > FASTENED_GAP_M + 1e-3:
            yield Fault("unfastened", (item.id,), f"{gap:.2f} m from a wall, at most {FASTENED_GAP_M} m")


def _detecting(lab: Laboratory) -> Iterator[Fault]:
    detectors = [item for item in lab.items if item.entry["subtype"] == "sensor"]
    for kind in (_vapors, _dangerous_gas):
        places = [*(lab.plan.root(item) for item in lab.stored(kind)), *(item for _, item in lab.used(kind))]
        for room, place in {lab.room_of(place): place for place in places}.items():
            near = [item for item in detectors if lab.room_of(item) == room]
            if not near and kind is _vapors:
                yield Fault("gas detector", (place.id,), "gases or vapors that burn, in a room without a detector")
            highest = max((item.z + item.height / 2 for item in near), default=math.inf)
            if kind is _dangerous_gas and highest < LIGHT_GAS_DETECTOR_M - SLACK_M:
                yield Fault("gas detector", (near[0].id,), f"center at {highest:.2f} m, too low for hydrogen")


def _over_openings(lab: Laboratory) -> Iterator[Fault]:
    for item in lab.items:
        for opening in lab.openings if item.support == "wall" else ():
            rise = min(item.z + item.height, opening.z1) - max(item.z, opening.z0)
            width = _overlap(item.footprint, opening.polygon, opening.along)
            gap = item.footprint.distance(opening.polygon)
            if rise > SLACK_M and width > SLACK_M and gap < 0.1:
                yield Fault("opening", (item.id,), f"covers {width:.2f} m of a {opening.kind}")


def _overlap(one: Polygon, other: Polygon, axis: tuple[float, float]) -> float:
    """Return the length over which two polygons overlap along an axis, m."""
    spans = [shapely.get_coordinates(polygon) @ np.array(axis) for polygon in (one, other)]
    return float(min(span.max() for span in spans) - max(span.min() for span in spans))


def _heights(lab: Laboratory) -> Iterator[Fault]:
    for item in lab.items:
        if item.entry["kind"] != "reagent" or item.support == "floor":
            continue
        if item.z > REAGENT_BASE_M + SLACK_M:
            yield Fault("height", (item.id,), f"stands at {item.z:.2f} m, at most {REAGENT_BASE_M} m")


def _standing(lab: Laboratory) -> Iterator[Fault]:
    for item in lab.items:
        if item.support in ("floor", "wall"):
            if item.support == "floor" and item.entry["kind"] == "reagent" and item.entry["placing"] == "desktop":
                yield Fault("standing", (item.id,), "a reagent on the floor")
            continue
        carriers = list(_carriers(lab, item))
        if item.entry["subtype"] == "computer" and any(carrier.entry.get("fume_hood") for carrier in carriers):
            yield Fault("standing", (item.id, item.support), "a computer in a hood")
        desk = any(carrier.entry["subtype"] == "desk" for carrier in carriers)
        if desk and (item.entry["category"] == "waste" or item.entry["kind"] == "reagent"):
            yield Fault("standing", (item.id, item.support), f"{item.entry['kind']} on a desk")
        bench = any(carrier.entry["subtype"] == "workbench" for carrier in carriers)
        if bench and item.entry["category"] == "waste":
            yield Fault("standing", (item.id, item.support), "a waste container on a bench")


def _carriers(lab: Laboratory, item: WrittenItem) -> Iterator[WrittenItem]:
    while item.support not in ("floor", "wall"):
        item = lab.plan.by_id[item.support]
        yield item


def _turn(one: float, other: float) -> float:
    """Return the least turn that makes two directions parallel or perpendicular, radians."""
    quarter = math.pi / 2
    turn = (one - other) % quarter
    return min(turn, quarter - turn)


def _skewed(lab: Laboratory) -> Iterator[Fault]:
    standing = [i for i in lab.items if i.support == "floor" and i.entry["subtype"] not in LOOSE]
    directions = []
    for wall in lab.walls:
        (ax, ay), (bx, by) = wall["start"], wall["end"]
        directions.append((LineString([wall["start"], wall["end"]]), math.atan2(by - ay, bx - ax)))
    for item in standing:
        if item.entry["placing"] != "floor":
            continue
        space = lab.space_of(item)
        near = [yaw for line, yaw in directions if line.distance(lab.spaces[space]) < 0.6]
        neighbors = [
            other.yaw
            for other in standing
            if other.id != item.id and lab.space_of(other) == space and other.footprint.distance(item.footprint) < 3.0
        ]
        turns = [_turn(item.yaw, yaw) for yaw in (lab.axes[space], *near, *neighbors)]
        if min(turns) > SQUARE_TURN:
            yield Fault("skewed", (item.id,), f"{math.degrees(min(turns)):.0f} degrees off walls and neighbors")


def _too_many(lab: Laboratory) -> Iterator[Fault]:
    counts = Counter(item.entry.get("variant_of") or item.entry["name"] for item in lab.items)
    for name, most in CAPS.items():
        if counts[name] > most:
            yield Fault("too many", (name,), f"{counts[name]}, at most {most}")


def _unsound(lab: Laboratory) -> Iterator[Fault]:
    for finding in findings(lab.plan):
        yield Fault(finding.kind, finding.who, f"{finding.value:.3f}")


def main() -> int:
    """Print the faults of layout files and return the exit code."""
    parser = argparse.ArgumentParser(description="Check the safety of written layouts from outside.")
    parser.add_argument("layouts", nargs="+", type=Path)
    wrong = False
    for path in parser.parse_args().layouts:
        for fault in faults(json.loads(path.read_text())):
            wrong = True
            sys.stdout.write(f"{path.name}: {fault}\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
