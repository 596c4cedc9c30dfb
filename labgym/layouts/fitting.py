"""Finds free places in a layout for one more object: on a surface, on a wall, on the floor."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from labgym.assets import Asset
from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.floor.doorways import Doorway
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.rules.building import building_of
from labgym.layouts.rules.thresholds import SHOWER_RADIUS, WALL_TOLERANCE, Profile
from labgym.layouts.rules.zones import HEADROOM, INTRUSION, front_zone
from labgym.layouts.stocking import BENCH_MARGIN
from labgym.layouts.surroundings import BRACKET, Pose, door_areas, door_openings, inside, wall_poses
from labgym.layouts.tabletop import SurfaceItem, SurfaceSpot, pack
from labgym.navigation import PLANNING_RADIUS, goal_pose
from labgym.protocols import Protocol

COVERING = 0.5
"""Depth before a wall in which an object covers its openings, meters."""
PERSON = 0.6
"""Width of the free space in front of equipment on a wall, meters: a person with elbows."""
ELBOW = 0.03
"""Gap to all other objects, meters."""
WORKING_HEIGHT = 0.35
"""Free height between a worktop and wall-mounted objects, meters: a gooseneck tap, a flask on its stand."""
LINTEL_GAP = 0.05
"""Height of an object over a door above its upper edge, meters."""
BATCH = 32
"""Places that are checked together: most searches end with the first few."""
ACCEPTED_TRIES = 8
"""Free places on a wall for which a further condition is asked."""

Accept = Callable[[OrientedBox], bool]


@dataclass(frozen=True)
class Keepouts:
    """Boxes that accessories must leave free: robot poses, front zones and the shower's surroundings.

    Attributes:
        areas: the floor inside doors, and the floor's keep-outs.
    """

    areas: tuple[OrientedBox, ...]
    stands: tuple[OrientedBox, ...]
    zones: tuple[OrientedBox, ...]

    @classmethod
    def of(cls, layout: Layout, protocol: Protocol | None) -> Keepouts:
        """Collect the keep-outs of a layout; robot poses only with a protocol."""
        stands = []
        for location in protocol.locations if protocol is not None else ():
            placed = layout.find(location)
            if placed is not None:
                x, y, _ = goal_pose(layout.box(placed.id))
                side = 2.0 * (PLANNING_RADIUS + 0.2)
                stands.append(OrientedBox(x, y, side, side, 0.0, 0.0, 2.0))
        zones = [
            front_zone(layout.box(placement.id), layout.asset(placement.id).clearance)
            for placement in layout.placements
            if placement.support == FLOOR and layout.asset(placement.id).clearance > 0.0
        ]
        zones += [_surroundings(layout.box(p.id)) for p in layout.placements if layout.asset(p.id).subtype == "shower"]
        areas = (*door_areas(layout.floor), *(area.box for area in layout.floor.keep_outs))
        return cls(areas, tuple(stands), tuple(zones))


def _surroundings(shower: OrientedBox) -> OrientedBox:
    """The space around an emergency shower that stays clear."""
    side = 2.0 * SHOWER_RADIUS
    return OrientedBox(shower.x, shower.y, side, side, shower.yaw, 0.0, HEADROOM)


def on_surface(
    layout: Layout, asset: Asset, support: str, slot: int, profile: Profile, generator: np.random.Generator
) -> Placement | None:
    """Return a placement of an asset on a slot of a support next to what stands there, or None if it is full."""
    spot = free_spot(layout, asset, support, slot, profile, generator)
    if spot is None:
        return None
    surface = layout.surface(support, slot)
    x, y = surface.to_world(spot.x, spot.y)
    return _placement(layout, asset, (x, y, surface.z0), surface.yaw + spot.yaw, support, slot)


def free_spot(
    layout: Layout,
    asset: Asset,
    support: str,
    slot: int,
    profile: Profile,
    generator: np.random.Generator,
    ignored: Collection[str] = (),
) -> SurfaceSpot | None:
    """Return a free spot for an asset on a slot of a support, or None if it is full.

    Args:
        ignored: placements that do not count as standing there.
    """
    surface = layout.surface(support, slot)
    taken = []
    for child in layout.children(support):
        if child.slot == slot and child.id not in ignored:
            size, yaw = layout.asset(child.id).size, child.yaw - surface.yaw
            across = abs(math.sin(yaw)) > 0.5
            x, y = surface.to_local(child.position[0], child.position[1])
            taken.append(SurfaceSpot(x, y, yaw, *((size.depth, size.width) if across else (size.width, size.depth))))
    holder = layout.asset(support)
    fragile = asset.hazards.glass_container and holder.storage_class is None
    item = SurfaceItem.of(asset, profile.glass if fragile else BENCH_MARGIN)
    headroom = holder.surfaces[slot].headroom
    spots = pack([item], surface.width, surface.depth, headroom, generator, taken)
    if not spots:
        return None
    spot = spots[0]
    return None if fragile and spot.inset(surface) < profile.glass - 1e-9 else spot


def on_wall(
    layout: Layout,
    asset: Asset,
    keepouts: Keepouts,
    near: tuple[float, float],
    *,
    height: float | None = None,
    space: str | None = None,
    accept: Accept | None = None,
    front: float = 0.0,
    tries: int = ACCEPTED_TRIES,
) -> Placement | None:
    """Return a placement at the free place on a wall that is nearest to a point, or None if the walls are full.

    Args:
        height: of its bottom, meters; the asset's mount height by default.
        space: id of the space on whose walls; None for all.
        accept: a further condition on the box of a free place; only the first few are asked.
        tries: free places for which the condition is asked.
        front: depth in front of it in which nothing stands up to its top, where a person does, meters.
    """
    bottom = asset.mount_height if height is None else height
    top = bottom + asset.size.height
    candidates = wall_poses(layout.floor, asset, top, space)
    candidates.sort(key=lambda pose: (math.hypot(pose[0] - near[0], pose[1] - near[1]), pose))
    doors = [*door_openings(layout.floor), *_openings(layout)]
    if BRACKET + asset.size.depth > INTRUSION:
        doors += keepouts.areas
    barred = [*doors, *_worktops(layout), *keepouts.stands, *keepouts.zones]
    obstacles = [box for box in (*_boxes(layout), *barred) if box.z0 < top + ELBOW and box.z1 > bottom - ELBOW]
    barriers, solid, refused = BoxArray.of(obstacles), BoxArray.of(_boxes(layout) if front > 0.0 else ()), 0
    for some in _batched(candidates, BATCH):
        boxes = [OrientedBox(x, y, asset.size.width, asset.size.depth, yaw, bottom, top) for x, y, yaw in some]
        fronts = [_front(box, front) for box in boxes] if front > 0.0 else []
        reached = _free(fronts, solid) if front > 0.0 else [True] * len(boxes)
        for box, is_free, is_reached in zip(boxes, _free(boxes, barriers), reached, strict=True):
            if not (is_free and is_reached and _backed(layout, box)):
                continue
            if accept is None or accept(box):
                return _placement(layout, asset, (box.x, box.y, bottom), box.yaw, WALL, None)
            refused += 1
            if refused == tries:
                return None
    return None


def _backed(layout: Layout, box: OrientedBox) -> bool:
    """Whether the back of a box is at a wall: the outline of a space may run before an oblique one."""
    return float(building_of(layout).gaps(box.corners()[:2]).max(axis=-1).min()) <= WALL_TOLERANCE


def _openings(layout: Layout) -> list[OrientedBox]:
    """The doors, passages, windows and glazed parts of all walls, as deep as what covers them stands off."""
    return [
        OrientedBox(*wall.point(o.position), o.width, wall.thickness + 2.0 * COVERING, wall.yaw, o.sill, o.top)
        for wall in layout.floor.walls
        for o in wall.openings
    ]


def _front(box: OrientedBox, depth: float) -> OrientedBox:
    """The space in front of what hangs on a wall in which a person stands to take it."""
    zone = front_zone(box, depth)
    return replace(zone, width=max(zone.width, PERSON), z0=0.0, z1=box.z1)


def on_floor(
    layout: Layout,
    asset: Asset,
    keepouts: Keepouts,
    poses: Iterable[tuple[float, float, float]],
    in_front: bool,
    accept: Accept | None = None,
) -> Placement | None:
    """Return a placement at the first free pose (x, y, yaw), or None.

    Args:
        in_front: whether it may stand in a front zone, as a stool does; otherwise its own front must be free too.
        accept: a further condition on the box of a free pose.
    """
    size = asset.size
    barred = [*keepouts.areas, *keepouts.stands, *(() if in_front else keepouts.zones)]
    floor = layout.floor
    # Furniture may touch the outer walls of a plain room: `inside` keeps it within them.
    standing = [*_boxes(layout), *(() if floor.as_room is not None else floor.solids)]
    solid, barriers = BoxArray.of(standing), BoxArray.of([*standing, *barred])
    for some in _batched(list(poses), BATCH):
        boxes = [OrientedBox(x, y, size.width, size.depth, yaw, 0.0, size.height) for x, y, yaw in some]
        reach = [box if in_front else front_zone(box, asset.clearance) for box in boxes]
        free = zip(boxes, _free(boxes, barriers), _free(reach, solid), strict=True)
        for box, is_free, is_served in free:
            if is_free and is_served and inside(floor, box) and (accept is None or accept(box)):
                return _placement(layout, asset, (box.x, box.y, 0.0), box.yaw, FLOOR, None)
    return None


def over_door(layout: Layout, asset: Asset, way: Doorway, space: str) -> Placement | None:
    """Return a placement of an asset over a door, on the wall of a space; None if there is no place for it."""
    x, y, yaw = way.side(space)
    inset, size = BRACKET + asset.size.depth / 2.0, asset.size
    bottom = way.opening.height + LINTEL_GAP
    if bottom + size.height > layout.floor.space(space).ceiling - ELBOW:
        return None
    box = OrientedBox(
        x - math.sin(yaw) * inset, y + math.cos(yaw) * inset, size.width, size.depth, yaw, bottom, bottom + size.height
    )
    if not _free([box], BoxArray.of(_boxes(layout)))[0]:
        return None
    return _placement(layout, asset, (box.x, box.y, bottom), yaw, WALL, None)


def along_walls(
    layout: Layout, asset: Asset, near: tuple[float, float], space: str | None = None
) -> list[tuple[float, float, float]]:
    """Return floor poses (x, y, yaw) with the back to a wall, of one space or of all, nearest to a point first."""
    poses = wall_poses(layout.floor, asset, asset.size.height, space)
    return sorted(poses, key=lambda pose: (math.hypot(pose[0] - near[0], pose[1] - near[1]), pose))


def _batched(poses: Sequence[Pose], size: int) -> Iterator[Sequence[Pose]]:
    """Yield consecutive parts of a sequence, at most `size` long."""
    for start in range(0, len(poses), size):
        yield poses[start : start + size]


def _boxes(layout: Layout) -> list[OrientedBox]:
    return [layout.box(placement.id) for placement in layout.placements]


def _free(boxes: Sequence[OrientedBox], obstacles: BoxArray) -> list[bool]:
    """Whether each box keeps the gap to all obstacles."""
    if not boxes or not len(obstacles):
        return [True] * len(boxes)
    grown = [
        OrientedBox(b.x, b.y, b.width + 2 * ELBOW, b.depth + 2 * ELBOW, b.yaw, b.z0 - ELBOW, b.z1 + ELBOW)
        for b in boxes
    ]
    hits = pairwise_penetration(BoxArray.of(grown), obstacles) > 0.0
    return [not row.any() for row in hits]


def _worktops(layout: Layout) -> list[OrientedBox]:
    """The space above open work surfaces of floor furniture, over their whole footprint."""
    spaces = []
    for placement in layout.placements:
        asset = layout.asset(placement.id)
        if placement.support == FLOOR and any(surface.headroom is None for surface in asset.surfaces):
            box = layout.box(placement.id)
            spaces.append(OrientedBox(box.x, box.y, box.width, box.depth, box.yaw, box.z1, box.z1 + WORKING_HEIGHT))
    return spaces


def _placement(
    layout: Layout, asset: Asset, position: tuple[float, float, float], yaw: float, support: str, slot: int | None
) -> Placement:
    numbers = [p.id.rpartition("_")[2] for p in layout.placements if p.asset == asset.name]
    number = 1 + max((int(n) for n in numbers if n.isdigit()), default=0)
    x, y, z = (round(value, 6) for value in position)
    return Placement(
        id=f"{asset.name}_{number}", asset=asset.name, position=(x, y, z), yaw=yaw, support=support, slot=slot
    )
