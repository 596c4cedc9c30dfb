"""Schedule of services: what each object of a layout needs of power, water, gas and exhaust, as CSV."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from labgym.assets import Asset
from labgym.exchange.tables import write_table
from labgym.geometry import compose
from labgym.layouts import Layout
from labgym.layouts.floor import Service
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.supplies import REACH, reach_of, shortfall, supplies_of

UNITS = {"power": "W", "water": "L/min", "gas": "", "exhaust": "m3/h"}
"""Services in the order of the schedule, each with the unit of its demand."""
EXHAUSTED = {"local_exhaust", "ventilated"}
"""Features of assets that are connected to the exhaust."""
COLUMNS = ("service", "id", "asset", "space", "demand", "unit", "x_m", "y_m", "z_m", "distance_m", "reach_m", "status")


@dataclass(frozen=True)
class Demand:
    """A service that an object needs.

    Attributes:
        service: power, water, gas or exhaust. id: of the object. asset: its name.
        space: id of its space, "" outside of the spaces.
        amount: in the unit of the service; None if the catalog does not state it.
        point: the service point of the space that is nearest; None without one.
        distance: from the object's footprint to the point in the plan, meters.
        status: "connected", "out of reach", or "no point".
    """

    service: str
    id: str
    asset: str
    space: str
    amount: float | None
    point: Service | None
    distance: float | None
    status: str


def demands(layout: Layout) -> tuple[Demand, ...]:
    """Return the services that the objects of a layout need, by service and then in the order of its objects.

    Instruments on furniture draw their own power; water, gas and exhaust are connected to the furniture.
    """
    found = (demand for placement in layout.placements for demand in _demands_of(layout, placement.id))
    return tuple(sorted(found, key=lambda demand: tuple(UNITS).index(demand.service)))


def write_schedule(layout: Layout, path: str | Path) -> Path:
    """Write the schedule of services of a layout as CSV and return the path.

    Service points are in the frame of the file that the floor was read from, otherwise in the floor's; in meters. The
    last line of each service is its total: the known demands, and the number of objects.
    """
    rows: list[tuple[str, ...]] = []
    every = demands(layout)
    for service, unit in UNITS.items():
        lines = [demand for demand in every if demand.service == service]
        rows += [_row(layout, demand) for demand in lines]
        if lines:
            known = [demand.amount for demand in lines if demand.amount is not None]
            note = f"{len(lines)} objects, demand of {len(lines) - len(known)} not stated"
            total = f"{math.fsum(known):g}" if known else ""
            rows.append((service, "total", "", "", total, unit, "", "", "", "", "", note))
    return write_table(path, COLUMNS, rows)


def _demands_of(layout: Layout, name: str) -> Iterator[Demand]:
    placement, asset = layout.placement(name), layout.asset(name)
    box = layout.box(name)
    where = space_of(layout, name)
    standing = placement.support in (FLOOR, WALL)
    contents = [layout.asset(each.id) for each in layout.placements if each.support == name] if standing else []
    for service in services_of(asset, contents):
        if service != "power" and not standing:
            continue
        points = [each for each in layout.floor.services_of(where) if each.kind == service]
        point = min(points, key=lambda each: _apart(layout, name, each), default=None)
        status, distance = "no point", None
        if point is not None:
            distance = _apart(layout, name, point)
            reached = service not in REACH and point.reach is None
            status = "connected" if reached or shortfall(box, [point]) <= 1e-6 else "out of reach"
        yield Demand(service, name, asset.name, where, amount_of(asset, service), point, distance, status)


def space_of(layout: Layout, name: str) -> str:
    """Return the id of the space of an object, "" in none; a wall-mounted one may reach into its wall."""
    box = layout.box(name)
    fx, fy = box.front
    ahead = layout.floor.space_at(box.x + box.depth * fx, box.y + box.depth * fy)
    space = layout.floor.space_at(box.x, box.y) or ahead
    return "" if space is None else space.id


def services_of(asset: Asset, contents: list[Asset]) -> tuple[str, ...]:
    """Return the services that an object needs with what stands on it, in the order of the schedule."""
    kinds = set(supplies_of(asset, contents))
    if "electrical" in asset.specs.features or asset.specs.power_W is not None:
        kinds.add("power")
    if asset.specs.exhaust_m3_h is not None or EXHAUSTED & set(asset.specs.features):
        kinds.add("exhaust")
    return tuple(kind for kind in UNITS if kind in kinds)


def amount_of(asset: Asset, service: str) -> float | None:
    """Return the demand of an asset in the unit of a service, None if the catalog does not state it.

    The air flow of a fume hood is its face velocity times the area of its working opening.
    """
    specs = asset.specs
    if service == "exhaust" and specs.face_velocity_m_s and specs.sash_open_m and asset.cavity is not None:
        return 3600.0 * specs.face_velocity_m_s * specs.sash_open_m * asset.cavity.width
    return {"power": specs.power_W, "water": specs.water_L_min, "exhaust": specs.exhaust_m3_h}.get(service)


def _apart(layout: Layout, name: str, point: Service) -> float:
    """Return the distance from the footprint of an object to a service point in the plan, meters."""
    box = layout.box(name)
    x, y = box.to_local(point.x, point.y)
    return math.hypot(max(abs(x) - box.width / 2.0, 0.0), max(abs(y) - box.depth / 2.0, 0.0))


def _row(layout: Layout, demand: Demand) -> tuple[str, ...]:
    place: tuple[str, ...] = ("", "", "", "", "")
    point = demand.point
    if point is not None and demand.distance is not None:
        x, y, _ = compose(layout.floor.origin, (point.x, point.y, 0.0))
        reach = f"{reach_of(point):.2f}" if point.kind in REACH or point.reach is not None else ""
        place = (f"{x:.3f}", f"{y:.3f}", f"{point.z:.3f}", f"{demand.distance:.2f}", reach)
    amount = "" if demand.amount is None else f"{demand.amount:.4g}"
    object_ = (demand.service, demand.id, demand.asset, demand.space)
    return (*object_, amount, UNITS[demand.service], *place, demand.status)
