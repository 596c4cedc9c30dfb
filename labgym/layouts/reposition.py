"""Moves that a person asks for: what stands on an object goes with it, and every object keeps a proper support."""

from __future__ import annotations

from labgym.errors import LabgymError, OptionError
from labgym.geometry import BoxArray, OrientedBox
from labgym.geometry.overlap import paired_inset
from labgym.layouts.model import Layout
from labgym.layouts.moves import Place, Settle, apply, descendants
from labgym.layouts.placement import FLOOR, WALL, placed_box
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import bounds_faults
from labgym.layouts.rules.thresholds import SURFACE_TOLERANCE

REACH = 100.0
"""Largest coordinate of a place, meters."""


def reposition(layout: Layout, placement_id: str, x: float, y: float, yaw: float | None = None) -> Layout:
    """Return the layout with an object, and what stands on it, at another place.

    An object on a surface must end on a surface: its own, or the one below the new place that is nearest in height and
    high enough inside. A wall-mounted object must keep a side along a wall. Overlaps and other violations are allowed;
    `evaluate_layout` finds them. An object with `fixed` may be moved and stays fixed.

    Args:
        x, y: center of the object in the floor's frame, meters.
        yaw: radians; by default unchanged.

    Raises:
        UnknownNameError: no placement has that id.
        OptionError: the place is more than 100 m from the origin, or the yaw is out of range.
        LabgymError: no surface or no wall is there.
    """
    placement = layout.placement(placement_id)
    yaw = placement.yaw if yaw is None else yaw
    if not (abs(x) <= REACH and abs(y) <= REACH and abs(yaw) <= 7.0):
        raise OptionError(f"place ({x:g}, {y:g}, {yaw:g}) is out of range: at most {REACH:g} m from the origin, 7 rad")
    moved = apply(layout, Place(placement_id, x, y, yaw))
    if placement.support == FLOOR:
        return moved
    if placement.support == WALL:
        _check_wall(moved, placement_id)
        return moved
    if _inset(moved, placement_id, placement.support, placement.slot or 0) >= -SURFACE_TOLERANCE:
        return moved
    return _on_another_surface(layout, moved, placement_id)


def _on_another_surface(layout: Layout, moved: Layout, placement_id: str) -> Layout:
    """Settle an object that has left its surface on the one below its new place."""
    item, box = layout.placement(placement_id), placed_box(moved.placement(placement_id), moved.asset(placement_id))
    carried = {placement_id, *descendants(layout, placement_id)}
    candidates = []
    for other in layout.placements:
        if other.id in carried:
            continue
        for slot, surface in enumerate(layout.asset(other.id).surfaces):
            high_enough = surface.headroom is None or surface.headroom >= box.z1 - box.z0
            if high_enough and _inset(moved, placement_id, other.id, slot) >= -SURFACE_TOLERANCE:
                height = layout.surface(other.id, slot).z0
                candidates.append((abs(height - item.position[2]), other.id, slot))
    if not candidates:
        beyond = -_inset(moved, placement_id, item.support, item.slot or 0)
        raise LabgymError(
            f"{placement_id} at ({box.x:.2f}, {box.y:.2f}) is {beyond:.2f} m beyond the edge of {item.support}, and no "
            f"other surface there has room for {box.width:.2f} x {box.depth:.2f} m: choose a place on a surface"
        )
    _, support, slot = min(candidates)
    surface_box = layout.surface(support, slot)
    along, across = surface_box.to_local(box.x, box.y)
    return apply(layout, Settle(placement_id, support, slot, along, across, box.yaw - surface_box.yaw))


def _inset(layout: Layout, placement_id: str, support: str, slot: int) -> float:
    """Return how far inside a surface the footprint of an object lies, meters; negative if it is over the edge."""
    box: OrientedBox = placed_box(layout.placement(placement_id), layout.asset(placement_id))
    return float(paired_inset(BoxArray.of([box]), BoxArray.of([layout.surface(support, slot)]))[0])


def _check_wall(layout: Layout, placement_id: str) -> None:
    for fault in bounds_faults(Arrangement.of(layout)):
        if fault.id == placement_id and fault.cause == "surface":
            raise LabgymError(
                f"{placement_id} is mounted on a wall and would be {fault.amount:.2f} m away from one: choose a place "
                "along a wall"
            )
