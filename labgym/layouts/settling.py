"""Free spots for objects on surfaces and shelves: where an object belongs, and the nearest spots there."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.assets.model import APPARATUS_STAND
from labgym.geometry import BoxArray, OrientedBox, interpenetrating
from labgym.layouts.model import Layout
from labgym.layouts.moves import Settle, descendants
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.rules.storage import STORAGE_CLASSES
from labgym.layouts.rules.thresholds import CORROSIVE_HEIGHT, MOVABLE, SURFACE_TOLERANCE, Profile
from labgym.layouts.stocking import BENCH_MARGIN, SHELF_MARGIN
from labgym.protocols import Protocol

GRID = 0.02
"""Spacing of the spots that are tried, meters."""
GAPS = (0.03, 0.004)
"""Gaps to other objects that are tried, meters."""
TURNING = 0.1
"""Cost of a quarter turn, as a distance, meters."""
SPREAD = 0.15
"""Least distance between two spots that are returned, meters."""
REACH = 0.5
"""Height above an object's top up to which obstacles are looked at, meters."""

Slot = tuple[str, int]


def free_spots(
    layout: Layout, item: str, support: str, slot: int, profile: Profile, most: int = 2
) -> tuple[Settle, ...]:
    """Return commands that stand an object on free spots of a slot, the spots nearest to where it is first.

    The object keeps a gap to everything else there, glassware `profile.glass` to the edges of open surfaces if they are
    deep enough. It stands parallel to the surface, turned by at most a quarter from where it is.
    """
    asset, holder = layout.asset(item), layout.asset(support)
    if item == support or support in descendants(layout, item) or not _high_enough(asset, holder, slot):
        return ()
    surface, here = layout.surface(support, slot), layout.placement(item)
    near = surface.to_local(here.position[0], here.position[1])
    fragile = asset.hazards.glass_container and holder.storage_class is None and asset.kind == "instrument"
    margin = profile.glass if fragile else SHELF_MARGIN if holder.storage_class else BENCH_MARGIN
    upright = math.pi / 2.0 * round((here.yaw - surface.yaw) / (math.pi / 2.0))
    poses, costs = [], []
    for turn in (0.0, math.pi / 2.0):
        yaw = upright + turn
        across = abs(math.sin(yaw)) > 0.5
        width, depth = (asset.size.depth, asset.size.width) if across else (asset.size.width, asset.size.depth)
        if width > surface.width + SURFACE_TOLERANCE or depth > surface.depth + SURFACE_TOLERANCE:
            continue
        xs = _offsets(surface.width, width, margin, near[0])
        ys = _offsets(surface.depth, depth, margin, near[1])
        for y in ys.tolist():
            for x in xs.tolist():
                poses.append((x, y, yaw))
                costs.append(math.hypot(x - near[0], y - near[1]) + TURNING * (turn > 0.0))
    order = np.argsort(np.array(costs), kind="stable")
    return tuple(
        Settle(item, support, slot, round(x, 6), round(y, 6), math.remainder(yaw, 2.0 * math.pi))
        for x, y, yaw in _free(layout, item, support, slot, [poses[k] for k in order], most)
    )


def homes(layout: Layout, item: str, protocol: Protocol | None, stays: bool = True) -> Iterator[Slot]:
    """Yield the slots on which an object may stand, those where it belongs first.

    A reagent belongs into a cabinet of its storage class, then into any cabinet for reagents. Other objects stay on
    their support if it is a proper one; then come what the protocol names, work surfaces, and open shelves, the
    nearest first.

    Args:
        stays: whether the support on which the object is counts as its own; not if it was put there for a trial.
    """
    placement, asset = layout.placement(item), layout.asset(item)
    own = placement.support if stays else None
    wanted = _named(layout, asset, protocol)
    ranked = []
    for other in layout.placements:
        holder = layout.asset(other.id)
        if not holder.surfaces or other.id == item or holder.subtype in MOVABLE:
            continue
        rank = _rank(layout, asset, own, other, wanted)
        if rank is not None:
            way = math.dist(other.position[:2], placement.position[:2])
            ranked.append((rank, round(way, 6), other.id))
    for _, _, support in sorted(ranked):
        first = placement.slot if support == own else None
        slots: Sequence[int] = range(len(layout.asset(support).surfaces))
        if layout.asset(support).subtype == APPARATUS_STAND:
            slots = [slot for slot in slots if slot == first]
        for slot in sorted(slots, key=lambda slot: (slot != first, slot)):
            yield support, slot


def _rank(layout: Layout, asset: Asset, present: str | None, other: Placement, wanted: Sequence[str]) -> int | None:
    """Return how well an object suits another as a support, 0 for the best; None if it does not.

    Args:
        present: the object's support now, if it counts.
    """
    holder = layout.asset(other.id)
    if asset.kind == "reagent" and asset.chemistry is not None:
        if holder.storage_class not in STORAGE_CLASSES or holder.fume_hood or holder.cavity is None:
            return None
        own = holder.storage_class == asset.chemistry.storage_class
        return (0 if other.id == present else 1) if own else 2
    if other.id == present and other.support in (FLOOR, WALL):
        return 0
    if (
        holder.storage_class in STORAGE_CLASSES
        or holder.storage_class == "Waste"
        or holder.subtype == "apparatus_stand"
    ):
        return None
    if holder.role in wanted:
        return 1
    if holder.subtype == "workbench" or holder.fume_hood:
        return 2
    if other.id == present:
        return 3
    return 4 if holder.subtype in ("shelf", "glassware_cabinet") else None


def _named(layout: Layout, asset: Asset, protocol: Protocol | None) -> list[str]:
    """Return the names of what a protocol says that an asset stands on or is used at."""
    if protocol is None:
        return []
    names = [rule.object for rule in protocol.spatial_constraints if rule.kind == "on" and rule.subject == asset.role]
    names += [step.location for step in protocol.steps if asset.role in step.uses]
    return list(dict.fromkeys(layout.catalog.find(name).role for name in names))


def _high_enough(asset: Asset, holder: Asset, slot: int) -> bool:
    """Whether a slot has the headroom for an asset, and is not above eye level if it is a corrosive liquid."""
    surface = holder.surfaces[slot]
    corrosive = asset.hazards.corrosive and asset.phase == "liquid"
    return (surface.headroom is None or surface.headroom >= asset.size.height) and not (
        corrosive and surface.z > CORROSIVE_HEIGHT
    )


def _offsets(length: float, size: float, margin: float, near: float) -> NDArray[np.float64]:
    """Centers that keep the margin, on a grid through the one nearest to `near`; the middle if none keeps it."""
    reach = max((length - size) / 2.0 - margin, 0.0)
    start = min(max(near, -reach), reach)
    below, above = math.floor((start + reach) / GRID + 1e-9), math.floor((reach - start) / GRID + 1e-9)
    return np.asarray(start + GRID * np.arange(-below, above + 1), dtype=np.float64)


def _free(
    layout: Layout, item: str, support: str, slot: int, poses: Sequence[tuple[float, float, float]], most: int
) -> list[tuple[float, float, float]]:
    """Return the first poses in a surface's frame at which an object keeps a gap to everything else, spread out."""
    surface, size = layout.surface(support, slot), layout.asset(item).size
    carried = {item, *descendants(layout, item)}
    height = max(layout.box(each).z1 for each in carried) - layout.box(item).z0
    if layout.apparatus(support) == support:
        carried |= {support, *(p.id for p in layout.placements if p.support == support)}
    bottom, top = surface.z0 + 1e-3, surface.z0 + height
    obstacles = _obstacles(layout, carried, surface, bottom, top)
    x, y, yaw = np.array(poses, dtype=np.float64).reshape(-1, 3).T
    cosine, sine = math.cos(surface.yaw), math.sin(surface.yaw)
    middles = np.column_stack([surface.x + (cosine * x - sine * y), surface.y + (sine * x + cosine * y)])
    heights = np.tile((bottom, top), (len(poses), 1))
    for gap in GAPS if poses else ():
        half = np.tile(((size.width + 2.0 * gap) / 2.0, (size.depth + 2.0 * gap) / 2.0), (len(poses), 1))
        grown = BoxArray(middles, half, surface.yaw + yaw, heights)
        free = np.ones(len(poses), dtype=np.bool_)
        if obstacles:
            free[interpenetrating(grown, BoxArray.of(obstacles))[0]] = False
        chosen: list[tuple[float, float, float]] = []
        for index in np.flatnonzero(free).tolist():
            pose = poses[index]
            if all(math.dist(pose[:2], other[:2]) >= SPREAD for other in chosen):
                chosen.append(pose)
                if len(chosen) == most:
                    break
        if chosen:
            return chosen
    return []


def _obstacles(
    layout: Layout, carried: Collection[str], surface: OrientedBox, bottom: float, top: float
) -> list[OrientedBox]:
    """Return the solids near a surface between two heights, without some objects."""
    around = replace(surface, width=surface.width + REACH, depth=surface.depth + REACH, z0=bottom, z1=top)
    others = [placement.id for placement in layout.placements if placement.id not in carried]
    boxes = BoxArray.of([_whole(layout, other) for other in others])
    close, _, _ = interpenetrating(boxes, BoxArray.of([around]))
    solids = [solid for k in close.tolist() for solid in layout.solids(others[k])]
    return [solid for solid in solids if solid.z0 < top and solid.z1 > bottom]


def _whole(layout: Layout, placement_id: str) -> OrientedBox:
    """A placement's bounding box, as high as its fittings."""
    box, fittings = layout.box(placement_id), layout.asset(placement_id).fittings
    return replace(box, z1=max(box.z1, *(box.z0 + fitting.z1 for fitting in fittings))) if fittings else box
