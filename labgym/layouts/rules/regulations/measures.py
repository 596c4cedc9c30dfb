"""The quantities that clauses measure in a layout; a measure without values does not apply."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

import numpy as np

from labgym.geometry import OrientedBox, distance, penetration
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.egress import WIDEST, narrow_ways
from labgym.layouts.rules.equipment import EXTINGUISHERS
from labgym.layouts.rules.facility.fronts import blocked_fronts
from labgym.layouts.rules.regulations.clause import Measured
from labgym.layouts.rules.regulations.premises import Premises
from labgym.layouts.rules.separation import incompatible_instances
from labgym.layouts.rules.storage import closed_cabinet
from labgym.layouts.rules.thresholds import profile
from labgym.layouts.rules.zones import HEADROOM, front_zone, standing_in

Measure = Callable[[Premises], list[Measured]]
Hazard = Literal["hood", "corrosive", "flammable"]

LOOKOUT = 4.0
"""Depth in front of furniture in which something opposite is looked for, meters."""
OPPOSITE = -0.9
"""Two pieces face each other if the product of their front directions is at most this."""
PARALLEL = 0.3
"""A wall runs along a side of a hood if the distances of the two ends of its side differ by less than this, meters."""
TALL = 1.5
"""Obstructions of this height and more disturb the air in front of a hood, meters."""


def door_widths(premises: Premises) -> list[Measured]:
    """Clear width of every door and passage, meters."""
    entrances = premises.arrangement.building.entrances
    return [Measured(label, width) for label, width in dict.fromkeys((one.label, one.width) for one in entrances)]


def doors_of_rooms(area: float) -> Measure:
    """Return the measure: number of doors of each laboratory larger than an area in square meters."""

    def measure(premises: Premises) -> list[Measured]:
        building = premises.arrangement.building
        return [
            Measured(
                f"laboratory of {place.area:.0f} m²{place.where}",
                float(sum(entrance.space == place.space for entrance in building.entrances)),
            )
            for place in building.workplaces
            if place.area > area
        ]

    return measure


def ways_out(limit: float) -> Measure:
    """Return the measure: clear width of the ways from exits to places of work, meters; at most 1.2 m is measured.

    Movable objects are left out.
    """

    def measure(premises: Premises) -> list[Measured]:
        exits = [entrance for entrance in premises.arrangement.building.entrances if entrance.exit]
        if not exits or not premises.arrangement.workplaces:
            return []
        narrow = narrow_ways(premises.arrangement, limit) or narrow_ways(premises.arrangement, WIDEST)
        ways = [Measured(f"{way.entrance} to {way.destinations[0]}", way.width) for way in narrow]
        return ways or [Measured("all ways", WIDEST)]

    return measure


def objects_at_doors(premises: Premises) -> list[Measured]:
    """Number of objects in the area inside each door."""
    arrangement = premises.arrangement
    return [
        Measured(one.label, float(len(standing_in(arrangement, one.area, loose=True, space=one.space))))
        for one in arrangement.building.entrances
    ]


def walks_out(premises: Premises) -> list[Measured]:
    """Walk from each place of work to the nearest exit, meters."""
    if not premises.exits:
        return []
    return [
        Measured(premises.name(row), premises.walk(premises.pose(row), premises.exits))
        for row in premises.arrangement.workplaces
    ]


def walks_to(equipment: str, hazard: Hazard) -> Measure:
    """Return the measure: walk from each place of a hazard to the nearest piece of equipment, meters.

    Args:
        equipment: `shower`, `eyewash` or `extinguisher`.
        hazard: `hood` (hoods, and what holds corrosives), `corrosive` or `flammable` (what holds such reagents).
    """

    def measure(premises: Premises) -> list[Measured]:
        starts = dict.fromkeys([*(premises.arrangement.hoods if hazard == "hood" else []), *_stores(premises, hazard)])
        goals = [premises.pose(row) for row in _equipment(premises, equipment)]
        return [Measured(premises.name(row), premises.walk(premises.pose(row), goals)) for row in starts]

    return measure


def _equipment(premises: Premises, kind: str) -> list[int]:
    if kind != "extinguisher":
        return premises.rows(kind)
    return [row for row, asset in enumerate(premises.arrangement.assets) if asset.role in EXTINGUISHERS]


def _stores(premises: Premises, hazard: Hazard) -> list[int]:
    """Rows of the furniture that holds hazardous reagents."""
    arrangement, rows = premises.arrangement, dict[int, None]()
    for row in arrangement.reagents:
        flags = arrangement.assets[row].hazards
        relevant = flags.flammable if hazard == "flammable" else flags.acid or flags.base
        if relevant:
            rows[arrangement.row(arrangement.layout.root(arrangement.placements[row].id).id)] = None
    return list(rows)


def shower_radius(premises: Premises) -> list[Measured]:
    """Distance of the nearest object from the center of each emergency shower, meters."""
    arrangement, radii = premises.arrangement, []
    for row in premises.rows("shower"):
        box = arrangement.box(row)
        center = OrientedBox(box.x, box.y, 0.0, 0.0, 0.0, 0.0, HEADROOM)
        gaps = [
            distance(center, arrangement.box(other))
            for other, placement in enumerate(arrangement.placements)
            if other != row
            and placement.support in (FLOOR, WALL)
            and arrangement.spaces[other] == arrangement.spaces[row]
        ]
        radii.append(Measured(premises.name(row), min(gaps, default=math.inf)))
    return [radius for radius in radii if math.isfinite(radius.value)]


def hood_to_door(premises: Premises) -> list[Measured]:
    """Distance of each hood from the nearest door of its room, meters."""
    arrangement, gaps = premises.arrangement, []
    for row in arrangement.hoods:
        own = [one for one in arrangement.building.entrances if one.space == arrangement.spaces[row]]
        if own:
            box = arrangement.box(row)
            gaps.append(Measured(premises.name(row), min(distance(box, one.opening) for one in own)))
    return gaps


def hood_to_opposite(kind: str) -> Measure:
    """Return the measure: distance from the front of each hood to what is opposite, meters, up to 4 m.

    Args:
        kind: `hood`, `bench` (a work place that faces it), `desk`, or `wall` (a wall or an obstruction of 1.5 m).
    """

    def measure(premises: Premises) -> list[Measured]:
        arrangement, gaps = premises.arrangement, []
        for row in arrangement.hoods:
            box = arrangement.box(row)
            zone = front_zone(box, LOOKOUT)
            others = [
                arrangement.box(other)
                for other in _candidates(premises, kind, row)
                if arrangement.spaces[other] == arrangement.spaces[row]
                and penetration(zone, arrangement.box(other)) > 0.0
            ]
            near = [distance(_plan(box), _plan(other)) for other in others]
            if kind == "wall":
                near.append(min(arrangement.building.ahead(box), LOOKOUT))
            if near:
                gaps.append(Measured(premises.name(row), min(near)))
        return gaps

    return measure


def _candidates(premises: Premises, kind: str, row: int) -> list[int]:
    assets = premises.arrangement.assets
    if kind == "desk":
        return premises.rows("desk")
    if kind == "wall":
        return [
            other for other in premises.arrangement.workplaces if other != row and assets[other].size.height >= TALL
        ]
    pool = premises.arrangement.hoods if kind == "hood" else premises.rows("workbench")
    return [other for other in pool if other != row and _face_each_other(premises, row, other)]


def _face_each_other(premises: Premises, first: int, second: int) -> bool:
    (ax, ay), (bx, by) = (premises.arrangement.box(row).front for row in (first, second))
    return ax * bx + ay * by <= OPPOSITE


def _plan(box: OrientedBox) -> OrientedBox:
    """A box of standing height: distances in the plan."""
    return OrientedBox(box.x, box.y, box.width, box.depth, box.yaw, 0.0, HEADROOM)


def between_work_rows(premises: Premises) -> list[Measured]:
    """Distance between benches or hoods that face each other, at which two people work back to back, meters."""
    arrangement, gaps = premises.arrangement, []
    rows = [*premises.rows("workbench"), *premises.arrangement.hoods]
    for k, row in enumerate(rows):
        box = arrangement.box(row)
        zone = front_zone(box, LOOKOUT)
        for other in rows[k + 1 :]:
            facing = _face_each_other(premises, row, other) and arrangement.spaces[row] == arrangement.spaces[other]
            if facing and penetration(zone, arrangement.box(other)) > 0.0:
                gap = distance(_plan(box), _plan(arrangement.box(other)))
                gaps.append(Measured(f"{premises.name(row)} and {premises.name(other)}", gap))
    return gaps


def free_before_benches(depth: float) -> Measure:
    """Return the measure: free depth in front of each bench and hood, meters, up to a depth."""

    def measure(premises: Premises) -> list[Measured]:
        rows = [*premises.rows("workbench"), *premises.arrangement.hoods]
        blocked = blocked_fronts(premises.arrangement, rows, [depth] * len(rows))
        return [
            Measured(premises.name(row), depth if front is None else min(front[0], depth))
            for row, front in zip(rows, blocked, strict=True)
        ]

    return measure


def ceilings(least_area: float = 0.0, most_area: float = math.inf) -> Measure:
    """Return the measure: ceiling height of each laboratory with an area between two limits, meters."""

    def measure(premises: Premises) -> list[Measured]:
        spaces = premises.arrangement.layout.floor.spaces
        return [
            Measured(f"laboratory of {place.area:.0f} m²{place.where}", spaces[place.space].ceiling)
            for place in premises.arrangement.building.workplaces
            if least_area < place.area <= most_area
        ]

    return measure


def corridor_widths(premises: Premises) -> list[Measured]:
    """Width of each corridor: the shorter side of its narrowest rectangle, meters."""
    return [
        Measured(space.id, min(min(box.width, box.depth) for box in space.boxes))
        for space in premises.arrangement.layout.floor.spaces
        if space.use == "corridor"
    ]


def hood_to_side_wall(premises: Premises) -> list[Measured]:
    """Distance of the sides of each hood from the nearest wall along them, meters."""
    arrangement, gaps = premises.arrangement, []
    for row in arrangement.hoods:
        box = arrangement.box(row)
        corners = box.corners()  # back left, back right, front right, front left
        sides = (corners[[0, 3]], corners[[1, 2]])
        near = []
        for side in sides:
            ends = arrangement.building.gaps(side)
            ends = ends[np.isfinite(ends).all(axis=1)]
            near += ends[np.ptp(ends, axis=1) < PARALLEL].min(axis=1).tolist()
        if near:
            gaps.append(Measured(premises.name(row), max(min(near), 0.0)))
    return gaps


def incompatibles_outside_cabinets(premises: Premises) -> list[Measured]:
    """Distance of each pair of incompatible reagents that are not in two closed cabinets, meters."""
    arrangement = premises.arrangement
    gaps = []
    for instance in incompatible_instances(arrangement, profile("default")):
        cabinets = [closed_cabinet(arrangement, arrangement.index[name]) for name in instance.ids]
        if None in cabinets or len(set(cabinets)) < 2:
            gaps.append(Measured(" and ".join(instance.ids), instance.distance or 0.0))
    return gaps


def incompatible_pairs_together(premises: Premises) -> list[Measured]:
    """Number of pairs of incompatible reagents in one cabinet or outside of cabinets; not without such reagents."""
    pairs = incompatible_instances(premises.arrangement, profile("default"))
    return [Measured("incompatible reagents", float(len(incompatibles_outside_cabinets(premises))))] if pairs else []


def flammables_outside(premises: Premises) -> list[Measured]:
    """Number of flammable liquids outside of cabinets for flammables and refrigerators; not without such reagents."""
    arrangement = premises.arrangement
    liquids = [
        row
        for row in arrangement.reagents
        if arrangement.assets[row].hazards.flammable
        and (chemistry := arrangement.assets[row].chemistry) is not None
        and chemistry.state == "liquid"
        and chemistry.storage_class == "Flammable"
    ]
    cabinets = [closed_cabinet(arrangement, row) for row in liquids]
    outside = [cabinet is None or arrangement.assets[cabinet].storage_class != "Flammable" for cabinet in cabinets]
    return [Measured("flammable liquids", float(sum(outside)))] if liquids else []
