"""Installations, and the furniture that they are planned from, with its load and the wall behind it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from labgym.assets import Asset
from labgym.assets.model import APPARATUS_STAND
from labgym.assets.shapes import Part, tessellate
from labgym.assets.shapes.parts import Quaternion, Vector
from labgym.geometry import OrientedBox, rotate
from labgym.layouts import Layout, Placement
from labgym.layouts.floor import Floor
from labgym.layouts.ground import without
from labgym.layouts.placement import FLOOR, WALL
from labgym.scenes.patches import Patch, join
from labgym.scenes.wall_faces import upper, wall_name

Kind = Literal["duct", "trunking", "turret", "sink", "cable", "hose", "restraint", "gas_line"]
NEAR = 0.12
"""Largest distance between a piece of furniture and the wall behind it, meters."""
ALIGNED = math.cos(math.radians(1.0))
"""Cosine of the largest angle between the back of furniture and the wall behind it."""
NEARBY = 2.0
"""Distance within which wall-mounted objects are looked at, meters."""
FRAME = 0.08
"""Width of wall around an opening that its frame takes, meters."""

Interval = tuple[float, float]


@dataclass(frozen=True)
class Installation:
    """Visible parts that belong to a placement but not to its asset.

    Attributes:
        owner: id of the placement.
        kind: what it is.
        parts: in the frame of the floor.
        wall: name of the wall, or of the upper part of one, on which it is mounted; empty for none. Pictures hide it
            with that wall.
    """

    owner: str
    kind: Kind
    parts: tuple[Part, ...]
    wall: str = ""

    @cached_property
    def patches(self) -> tuple[Patch, ...]:
        """One mesh for each material, in the frame of the floor."""
        by_material: dict[str, list[Part]] = {}
        for part in self.parts:
            by_material.setdefault(part.material, []).append(part)
        return tuple(
            Patch(
                self.wall,
                f"{self.owner}/{self.kind}/{material}",
                material,
                *join([tessellate(part) for part in parts]),
            )
            for material, parts in by_material.items()
        )


def moved(parts: Iterable[Part], x: float, y: float, z: float, yaw: float = 0.0) -> tuple[Part, ...]:
    """Return parts of a frame at (x, y, z), turned by yaw about the vertical, in the frame around it."""
    turn = (math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0))
    return tuple(
        replace(part, position=_point(part.position, x, y, z, yaw), quaternion=_product(turn, part.quaternion))
        for part in parts
    )


def _point(point: Vector, x: float, y: float, z: float, yaw: float) -> Vector:
    dx, dy = rotate(point[0], point[1], yaw)
    return x + dx, y + dy, z + point[2]


def _product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the rotation b followed by the rotation a."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@dataclass(frozen=True)
class Item:
    """An object on a piece of furniture.

    Attributes:
        box: its bounding box in the furniture's frame.
        stand: the bounding box of the stand that holds it in an apparatus, or None.
    """

    id: str
    asset: Asset
    box: OrientedBox
    stand: OrientedBox | None = None


@dataclass(frozen=True)
class Backing:
    """A wall behind a piece of furniture, in the furniture's frame.

    Attributes:
        wall: name of the wall, or of its upper part, as pictures hide it.
        gap: distance between the furniture's back and the wall, meters.
        span: interval along x in which the wall stands.
        openings: interval along x and interval of heights of each opening with its frame.
    """

    wall: str
    gap: float
    span: Interval
    openings: tuple[tuple[Interval, Interval], ...]

    def free(self, interval: Interval, low: float, high: float) -> list[Interval]:
        """Return the parts of an interval along x where the wall has no opening between two heights, meters."""
        within = max(interval[0], self.span[0]), min(interval[1], self.span[1])
        if within[0] >= within[1]:
            return []
        cut = [x for x, z in self.openings if z[0] < high and z[1] > low]
        return without(within, cut)


@dataclass(frozen=True)
class Host:
    """A piece of furniture or equipment on the floor.

    Attributes:
        use: use of the space that it stands in. ceiling: height of that space, meters.
        items: everything on or in it. backing: the wall behind it, or None.
        mounted: bounding boxes of what hangs on walls nearby, in its frame.
    """

    placement: Placement
    asset: Asset
    use: str
    ceiling: float
    items: tuple[Item, ...]
    backing: Backing | None
    mounted: tuple[OrientedBox, ...] = ()

    @property
    def half(self) -> tuple[float, float]:
        """Half its width and half its depth, meters."""
        return self.asset.size.width / 2.0, self.asset.size.depth / 2.0

    def free(self, box: OrientedBox) -> bool:
        """Whether no item overlaps an upright box that is aligned with the furniture."""
        return not any(overlap(box, item.box) for item in self.items)

    def installation(self, kind: Kind, parts: Iterable[Part], wall: str = "", owner: str = "") -> Installation:
        """Return parts of its frame as an installation.

        Args:
            owner: id of the placement that the parts belong to, by default the furniture.
        """
        x, y, z = self.placement.position
        return Installation(owner or self.placement.id, kind, moved(parts, x, y, z, self.placement.yaw), wall)


def hosts(layout: Layout) -> Iterator[Host]:
    """Yield everything that stands on the floor inside a space, in the layout's order."""
    children: dict[str, list[Placement]] = {}
    for placement in layout.placements:
        children.setdefault(placement.support, []).append(placement)
    for placement in children.get(FLOOR, ()):
        space = layout.floor.space_at(*placement.position[:2])
        if space is not None:
            asset = layout.asset(placement.id)
            items = tuple(_items(layout, children, placement.id, layout.box(placement.id), None))
            backing = _backing(layout.floor, placement, asset)
            mounted = tuple(_mounted(layout, children.get(WALL, ()), placement)) if backing is not None else ()
            yield Host(placement, asset, space.use, space.ceiling, items, backing, mounted)


def _items(
    layout: Layout,
    children: Mapping[str, Sequence[Placement]],
    carrier: str,
    host: OrientedBox,
    stand: OrientedBox | None,
) -> Iterator[Item]:
    for child in children.get(carrier, ()):
        local = _local(layout.box(child.id), host)
        yield Item(child.id, layout.asset(child.id), local, stand)
        held = layout.asset(child.id).subtype == APPARATUS_STAND
        yield from _items(layout, children, child.id, host, local if held else None)


def _mounted(layout: Layout, hanging: Sequence[Placement], placement: Placement) -> Iterator[OrientedBox]:
    """Yield the boxes of wall-mounted objects within `NEARBY` of an object, in its frame."""
    host = layout.box(placement.id)
    for each in hanging:
        if math.dist(each.position[:2], placement.position[:2]) < NEARBY:
            yield _local(layout.box(each.id), host)


def _local(box: OrientedBox, host: OrientedBox) -> OrientedBox:
    x, y = host.to_local(box.x, box.y)
    return OrientedBox(x, y, box.width, box.depth, box.yaw - host.yaw, box.z0 - host.z0, box.z1 - host.z0)


def _backing(floor: Floor, placement: Placement, asset: Asset) -> Backing | None:
    """Return the wall that the back of an object stands along and that covers most of its width."""
    x, y, _ = placement.position
    best: Backing | None = None
    for index, wall in enumerate(floor.walls):
        turn = placement.yaw - wall.yaw
        along, across = rotate(x - wall.start[0], y - wall.start[1], -wall.yaw)
        side = math.copysign(1.0, across)
        if math.cos(turn) * side < ALIGNED:
            continue
        gap = abs(across) - wall.thickness / 2.0 - asset.size.depth / 2.0
        if not -0.02 <= gap <= NEAR:
            continue
        span = _interval(side, along, 0.0, wall.length)
        openings = tuple(
            (_interval(side, along, a - FRAME, b + FRAME), (opening.sill - FRAME, opening.top + FRAME))
            for opening in wall.openings
            for a, b in (opening.span,)
        )
        backing = Backing(upper(wall_name(index)), max(gap, 0.0), span, openings)
        if best is None or _covered(span, asset) > _covered(best.span, asset):
            best = backing
    return best if best is not None and _covered(best.span, asset) > 0.0 else None


def _interval(side: float, along: float, low: float, high: float) -> Interval:
    """Return an interval along a wall as one along x of an object with its back to it, at `along` on the wall."""
    ends = sorted((side * (low - along), side * (high - along)))
    return ends[0], ends[1]


def _covered(span: Interval, asset: Asset) -> float:
    half = asset.size.width / 2.0
    return min(span[1], half) - max(span[0], -half)


def overlap(first: OrientedBox, second: OrientedBox) -> bool:
    """Whether the axis-aligned bounds of two boxes overlap."""
    x0, y0, x1, y1 = first.bounds()
    a0, b0, a1, b1 = second.bounds()
    return x0 < a1 and a0 < x1 and y0 < b1 and b0 < y1 and first.z0 < second.z1 and second.z0 < first.z1
