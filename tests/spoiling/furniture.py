"""Furniture in the wrong place or turned about."""

from __future__ import annotations

import math

from labgym.layouts.model import Layout
from labgym.layouts.moves import Move, Place, Settle, apply
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.rules.building import Entrance, building_of
from labgym.layouts.rules.thresholds import MOVABLE
from labgym.navigation import goal_poses
from labgym.protocols import Protocol
from spoiling.edits import in_front_of, inside_door, on_floor, turned_about
from spoiling.objects import benches_of, cabinets_of, furniture_of, hoods_of, ids_where


def sink_in_door(layout: Layout, _: Protocol) -> Layout:
    """Put the sink, or else a bench, in every door that leads out."""
    pieces = ids_where(layout, lambda p, a: p.support == FLOOR and a.subtype == "sink") + benches_of(layout)
    for piece, entrance in zip(pieces, _exits(layout), strict=False):
        layout = inside_door(layout, piece, entrance, layout.asset(piece).size.depth / 2.0 + 0.02)
    return layout


def stools_in_doors(layout: Layout, _: Protocol) -> Layout:
    """Leave movable objects, or else furniture, just inside each door."""
    loose = ids_where(layout, lambda p, a: p.support == FLOOR and a.subtype in MOVABLE) + benches_of(layout)
    for piece, entrance in zip(loose, building_of(layout).entrances, strict=False):
        layout = inside_door(layout, piece, entrance, 0.35)
    return layout


def narrow_way(layout: Layout, _: Protocol) -> Layout:
    """Put furniture before every exit so that the way on is 0.65 m wide."""
    pieces = sorted(furniture_of(layout), key=lambda each: -layout.asset(each).size.width)
    for piece, entrance in zip(pieces, _exits(layout), strict=False):
        layout = inside_door(layout, piece, entrance, 0.65 + layout.asset(piece).size.depth / 2.0)
    return layout


def hood_at_door(layout: Layout, _: Protocol) -> Layout:
    """Put a hood next to a door, with its back to the wall."""
    hoods, entrances = hoods_of(layout), building_of(layout).entrances
    if not hoods or not entrances:
        return layout
    (x, y, yaw), size = entrances[0].pose, layout.asset(hoods[0]).size
    along, out = entrances[0].width / 2.0 + 0.1 + size.width / 2.0, size.depth / 2.0
    across = (math.cos(yaw), math.sin(yaw))
    place = (x + along * across[0] - out * math.sin(yaw), y + along * across[1] + out * math.cos(yaw))
    return apply(layout, Place(hoods[0], *place, yaw))


def goal_pose_blocked(layout: Layout, protocol: Protocol) -> Layout:
    """Put a bench where the robot works."""
    poses, benches = list(goal_poses(layout, protocol).values()), benches_of(layout)
    places = {found.id for name in protocol.locations if (found := layout.find(name)) is not None}
    free = [bench for bench in benches if bench not in places] or furniture_of(layout)
    return apply(layout, Place(free[0], poses[0][0], poses[0][1], poses[0][2] + math.pi / 2.0))


def furniture_faces_wall(layout: Layout, _: Protocol) -> Layout:
    """Turn all furniture about, so that it faces the wall behind it."""
    return turned_about(layout, furniture_of(layout))


def cabinet_faces_wall(layout: Layout, _: Protocol) -> Layout:
    """Turn one reagent cabinet about."""
    cabinets = [each for each in cabinets_of(layout) if layout.placement(each).support == FLOOR]
    return turned_about(layout, cabinets[:1])


def hood_faces_wall(layout: Layout, _: Protocol) -> Layout:
    """Turn the first hood about."""
    return turned_about(layout, hoods_of(layout)[:1])


def hood_without_clearance(layout: Layout, _: Protocol) -> Layout:
    """Put a bench 0.4 m in front of a hood."""
    hoods, benches = hoods_of(layout), benches_of(layout)
    return in_front_of(layout, benches[0], hoods[0], 0.4) if hoods and benches else layout


def shower_crowded(layout: Layout, _: Protocol) -> Layout:
    """Push the nearest furniture against the emergency shower."""
    showers = ids_where(layout, lambda _, a: a.subtype == "shower")
    if not showers:
        return layout
    box = layout.box(showers[0])
    others = [each for each in furniture_of(layout) if each != showers[0]]
    nearest = min(others, key=lambda each: math.dist((box.x, box.y), layout.placement(each).position[:2]))
    return in_front_of(layout, nearest, showers[0], 0.0)


def furniture_stacked(layout: Layout, _: Protocol) -> Layout:
    """Put one piece of furniture into another."""
    first, second = furniture_of(layout)[:2]
    return apply(layout, Place(second, *layout.placement(first).position[:2], layout.placement(first).yaw))


def bench_on_bench(layout: Layout, _: Protocol) -> Layout:
    """Stand a piece of furniture on top of a bench."""
    top = benches_of(layout)[0]
    piece = min((each for each in furniture_of(layout) if each != top), key=lambda each: layout.asset(each).size.width)
    return apply(layout, Settle(piece, top, 0, 0.0, 0.0))


def furniture_in_wall(layout: Layout, _: Protocol) -> Layout:
    """Push furniture 0.1 m into the wall behind it."""
    for each in furniture_of(layout):
        fx, fy = layout.box(each).front
        layout = apply(layout, Move(each, round(-0.1 * fx, 6), round(-0.1 * fy, 6)))
    return layout


def wall_units_on_floor(layout: Layout, _: Protocol) -> Layout:
    """Take what hangs on walls down to the floor."""
    for each in ids_where(layout, lambda p, _: p.support == WALL):
        layout = on_floor(layout, each)
    return layout


def _exits(layout: Layout) -> list[Entrance]:
    """Return the doors that lead out."""
    return [entrance for entrance in building_of(layout).entrances if entrance.exit]
