"""Edits of a layout: move, rotate, place, swap, settle, assign. What stands on an object goes with it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from labgym.errors import check_name
from labgym.geometry import OrientedBox, rotate, wrap_angle
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL, Placement, rounded
from labgym.layouts.records import ZoneAssignment


@dataclass(frozen=True)
class Move:
    """Translate a placement in the room frame, meters."""

    id: str
    dx: float
    dy: float


@dataclass(frozen=True)
class Rotate:
    """Turn a placement about its own center to a yaw, radians."""

    id: str
    yaw: float


@dataclass(frozen=True)
class Place:
    """Put a placement at a position (x, y) and yaw in the room frame; meters, radians."""

    id: str
    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class Swap:
    """Exchange the positions of two floor objects: each gets the other's back line, middle and yaw."""

    first: str
    second: str


@dataclass(frozen=True)
class Settle:
    """Stand a placement on a slot of a support, at a position in that surface's frame (center 0, 0)."""

    id: str
    support: str
    slot: int
    x: float
    y: float
    yaw: float = 0.0


@dataclass(frozen=True)
class Assign:
    """Carry out the steps of a location (an asset name) in a zone of the layout."""

    location: str
    zone: str


Command = Move | Rotate | Place | Swap | Settle | Assign


def apply(layout: Layout, command: Command) -> Layout:
    """Return the layout after a command.

    Raises:
        UnknownNameError: a placement or a zone that it names does not exist.
    """
    if isinstance(command, Assign):
        return _reassigned(layout, command)
    if isinstance(command, Move):
        return _carried(layout, command.id, layout.placement(command.id).yaw, command.dx, command.dy)
    if isinstance(command, Rotate):
        return _carried(layout, command.id, command.yaw, 0.0, 0.0)
    if isinstance(command, Place):
        x, y, _ = layout.placement(command.id).position
        return _carried(layout, command.id, command.yaw, command.x - x, command.y - y)
    if isinstance(command, Swap):
        return _swapped(layout, command)
    return _settled(layout, command)


def descendants(layout: Layout, placement_id: str) -> tuple[str, ...]:
    """Return the ids of everything that stands on or in a placement, at any depth."""
    ids: list[str] = []
    for child in layout.children(placement_id):
        ids += [child.id, *descendants(layout, child.id)]
    return tuple(ids)


def may_move(layout: Layout, placement_id: str) -> bool:
    """Whether a placement and everything on it may be moved: nothing of it is fixed."""
    return not any(layout.placement(item).fixed for item in (placement_id, *descendants(layout, placement_id)))


def replaced(layout: Layout, changed: dict[str, Placement]) -> Layout:
    """Return the layout with some placements exchanged for others of the same id."""
    return layout.replace(placements=tuple(changed.get(placement.id, placement) for placement in layout.placements))


def without(layout: Layout, ids: Iterable[str]) -> Layout:
    """Return the layout without some placements and what stands on them; without ids, the layout itself."""
    gone = {item for each in ids for item in (each, *descendants(layout, each))}
    if not gone:
        return layout
    return layout.replace(placements=tuple(placement for placement in layout.placements if placement.id not in gone))


def _carried(layout: Layout, placement_id: str, yaw: float, dx: float, dy: float, dz: float = 0.0) -> Layout:
    """Move a placement rigidly with everything on it."""
    anchor = layout.placement(placement_id)
    turn = yaw - anchor.yaw
    changed: dict[str, Placement] = {}
    for item_id in (placement_id, *descendants(layout, placement_id)):
        item = layout.placement(item_id)
        rx, ry = rotate(item.position[0] - anchor.position[0], item.position[1] - anchor.position[1], turn)
        position = (anchor.position[0] + rx + dx, anchor.position[1] + ry + dy, item.position[2] + dz)
        changed[item_id] = item.model_copy(
            update={"position": rounded(*position), "yaw": round(wrap_angle(item.yaw + turn), 9)}
        )
    return replaced(layout, changed)


def _swapped(layout: Layout, command: Swap) -> Layout:
    first, second = layout.box(command.first), layout.box(command.second)
    for own, other, box in ((command.first, second, first), (command.second, first, second)):
        depth = layout.asset(own).size.depth
        shift = (depth - other.depth) / 2.0
        x, y = other.x + shift * other.front[0], other.y + shift * other.front[1]
        layout = _carried(layout, own, other.yaw, x - box.x, y - box.y)
    return layout


def _settled(layout: Layout, command: Settle) -> Layout:
    """Set an object on another support, with what stands on it."""
    surface: OrientedBox = layout.surface(command.support, command.slot)
    item = layout.placement(command.id)
    x, y = surface.to_world(command.x, command.y)
    moved = _carried(
        layout,
        command.id,
        surface.yaw + command.yaw,
        x - item.position[0],
        y - item.position[1],
        surface.z0 - item.position[2],
    )
    changed = moved.placement(command.id).model_copy(update={"support": command.support, "slot": command.slot})
    return replaced(moved, {command.id: changed})


def _reassigned(layout: Layout, command: Assign) -> Layout:
    """Assign a location to a zone; the others keep theirs."""
    names = [zone.name for zone in layout.zones]
    check_name("zone", command.zone, names)
    others = tuple(one for one in layout.assignment if one.location != command.location)
    return layout.replace(assignment=(*others, ZoneAssignment(location=command.location, zone=command.zone)))


def applied(layout: Layout, commands: Iterable[Command]) -> Layout:
    """Return the layout after some commands."""
    for command in commands:
        layout = apply(layout, command)
    return layout


def rests_on(layout: Layout, placement: Placement) -> float | None:
    """Return the height at which a placement's bottom belongs, meters; None on a wall."""
    if placement.support == WALL:
        return None
    if placement.support == FLOOR:
        return 0.0
    return layout.surface(placement.support, placement.slot or 0).z0


def lifted(layout: Layout, placement_id: str, height: float) -> Layout:
    """Return the layout with a placement, and what stands on it, raised or lowered to a height in meters."""
    item = layout.placement(placement_id)
    return _carried(layout, placement_id, item.yaw, 0.0, 0.0, height - item.position[2])
