"""Spaces of a floor, and what is fixed in them: columns, service points, areas without furniture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from labgym.documents import Growing, Record
from labgym.geometry import Array, OrientedBox, to_local, to_world
from labgym.geometry.frames import PlanarPose
from labgym.layouts.floor.fields import Angle, Coordinate, Height, Identifier

OUTSIDE = "outside"
"""What lies beyond an exit, in place of the id of a space."""
NARROWEST = 0.05
"""Least side of a rectangle of a region, meters."""
CONTACT = 1e-3
"""Rectangles of a region that are nearer than this are joined, meters."""
ROUNDING = 1e-6
"""Margin of bounds within which points are looked up, meters."""
Extent = Annotated[float, Field(ge=0.05, le=100.0)]


class Rectangle(Record):
    """An axis-aligned rectangle in the frame of a space: two opposite corners, meters."""

    x0: Coordinate = 0.0
    y0: Coordinate = 0.0
    x1: Coordinate
    y1: Coordinate

    @model_validator(mode="after")
    def _check_size(self) -> Self:
        for axis, low, high in (("x", self.x0, self.x1), ("y", self.y0, self.y1)):
            if high - low < NARROWEST:
                raise ValueError(f"{axis}1 = {high:g} m must exceed {axis}0 = {low:g} m by at least {NARROWEST:g} m")
        return self


class Finishes(Growing):
    """Surfaces of a space and of the furniture in it.

    Attributes:
        floor: covering of the floor.
        walls: color of the walls.
        accent: color of one wall; None for the color of the others.
        accent_wall: the wall with the accent color, seen from the main door: its opposite, left, right or own wall.
        worktop: material of worktops.
        fronts: material of the doors and drawers of benches and cupboards.
        doors: material of the leaves of doors.
        blinds: kind of blinds in windows.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"accent_wall", "worktop", "fronts", "doors", "blinds"})

    floor: Literal["vinyl", "epoxy", "tile", "terrazzo", "concrete"] = "vinyl"
    walls: Literal["white", "cream", "gray", "sage", "sky"] = "white"
    accent: Literal["teal", "navy", "ochre", "brick", "graphite"] | None = "teal"
    accent_wall: Literal["opposite", "left", "right", "door"] = "opposite"
    worktop: Literal["white", "gray", "black", "sand", "slate"] = "white"
    fronts: Literal["white", "oak", "blue", "gray", "walnut", "mint"] = "white"
    doors: Literal["gray", "white", "oak", "walnut", "green"] = "gray"
    blinds: Literal["none", "roller", "slats"] = "none"


class Space(Growing):
    """A room of a floor.

    Attributes:
        use: purpose of the space.
        x, y, yaw: the space's frame in the floor's; meters, radians.
        region: rectangles whose union is the free floor between the walls, in the space's frame.
        ceiling: height of the ceiling, meters.
        finishes: surfaces.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"finishes"})

    id: Identifier = "laboratory"
    use: Literal["laboratory", "instrument", "store", "write-up", "corridor"] = "laboratory"
    x: Coordinate = 0.0
    y: Coordinate = 0.0
    yaw: Angle = 0.0
    region: Annotated[tuple[Rectangle, ...], Field(min_length=1, max_length=64)]
    ceiling: Height = 3.0
    finishes: Finishes = Finishes()

    @model_validator(mode="after")
    def _check_region(self) -> Self:
        if self.id == OUTSIDE:
            raise ValueError(f"the id {OUTSIDE!r} is what lies beyond an exit: choose another")
        apart = _apart(self.region)
        if apart is not None:
            raise ValueError(
                f"rectangle {apart} of space {self.id!r} does not touch the others: join it, or make it another space"
            )
        return self

    @property
    def frame(self) -> PlanarPose:
        """The space's frame (x, y, yaw) in the floor's."""
        return self.x, self.y, self.yaw

    @property
    def boxes(self) -> tuple[OrientedBox, ...]:
        """The region's rectangles up to the ceiling, in the floor's frame."""
        middles = to_world([((r.x0 + r.x1) / 2.0, (r.y0 + r.y1) / 2.0) for r in self.region], self.frame).tolist()
        return tuple(
            OrientedBox(x, y, r.x1 - r.x0, r.y1 - r.y0, self.yaw, 0.0, self.ceiling)
            for r, (x, y) in zip(self.region, middles, strict=True)
        )

    @property
    def area(self) -> float:
        """Area of the region, square meters."""
        xs = sorted({x for r in self.region for x in (r.x0, r.x1)})
        ys = sorted({y for r in self.region for y in (r.y0, r.y1)})
        x, y = (np.array(xs[:-1]) + xs[1:]) / 2.0, (np.array(ys[:-1]) + ys[1:]) / 2.0
        covered = np.zeros((len(x), len(y)), dtype=np.bool_)
        for r in self.region:
            covered |= ((x > r.x0) & (x < r.x1))[:, None] & ((y > r.y0) & (y < r.y1))[None]
        return float(np.diff(xs) @ covered @ np.diff(ys))

    def contains(self, points: Array, tolerance: float = 0.0) -> NDArray[np.bool_]:
        """Return whether points (n, 2) of the floor's frame lie in the region, shape (n,); edges belong to it.

        Args:
            tolerance: distance in meters by which each rectangle is enlarged.
        """
        local = to_local(points, self.frame)
        x, y = local[:, 0], local[:, 1]
        inside = np.zeros(len(local), dtype=np.bool_)
        for r in self.region:
            within = (x >= r.x0 - tolerance) & (x <= r.x1 + tolerance)
            inside |= within & (y >= r.y0 - tolerance) & (y <= r.y1 + tolerance)
        return inside

    def holds(self, x: float, y: float) -> bool:
        """Return whether one point of the floor's frame lies in the region, as `contains`, to the bit."""
        cosine, sine, dx, dy = math.cos(self.yaw), math.sin(self.yaw), x - self.x, y - self.y
        along, across = cosine * dx + sine * dy, cosine * dy - sine * dx
        return any(r.x0 <= along <= r.x1 and r.y0 <= across <= r.y1 for r in self.region)


@dataclass(frozen=True, eq=False)
class FreeRectangles:
    """Rectangles in separate frames, as arrays.

    Attributes:
        frames: (k, 4) x and y of the frames, meters, and cosine and sine of their yaws.
        least, greatest: (k, 2) corners in the frames, meters.
        low, high: (k, 2) bounds in the floor's frame, meters.
    """

    frames: Array
    least: Array
    greatest: Array
    low: Array
    high: Array

    @classmethod
    def of(cls, rows: Sequence[tuple[float, float, float, float, float, float, float]]) -> Self:
        """Return rectangles from x, y and yaw of their frames and x0, y0, x1 and y1 in them."""
        corners = np.array([to_world([(a, b), (c, b), (c, d), (a, d)], frame) for *frame, a, b, c, d in rows])
        return cls(
            np.array([(x, y, math.cos(yaw), math.sin(yaw)) for x, y, yaw, *_ in rows]),
            np.array([row[3:5] for row in rows]),
            np.array([row[5:7] for row in rows]),
            corners.min(axis=1) - ROUNDING,
            corners.max(axis=1) + ROUNDING,
        )

    def holding(self, points: Array) -> NDArray[np.bool_]:
        """Return whether each of k rectangles holds each of points (n, 2), shape (k, n); edges belong to them."""
        low, high = np.fmin.reduce(points), np.fmax.reduce(points)
        near = ((self.low <= high) & (self.high >= low)).all(axis=1)
        x, y, cosine, sine = self.frames[near].T[:, :, None]
        dx, dy = points[:, 0] - x, points[:, 1] - y
        along, across = cosine * dx + sine * dy, cosine * dy - sine * dx
        (x0, y0), (x1, y1) = self.least[near].T[:, :, None], self.greatest[near].T[:, :, None]
        inside = np.zeros((len(self.frames), len(points)), dtype=np.bool_)
        inside[near] = (along >= x0) & (along <= x1) & (across >= y0) & (across <= y1)
        return inside


class Column(Record):
    """A column from floor to ceiling: its middle, its yaw and its sides, meters and radians."""

    id: Identifier
    x: Coordinate
    y: Coordinate
    yaw: Angle = 0.0
    width: Annotated[float, Field(ge=0.05, le=5.0)]
    depth: Annotated[float, Field(ge=0.05, le=5.0)]


class Service(Growing):
    """A point where a supply is available, meters.

    Attributes:
        reach: distance in the plan within which furniture can be connected; None for that of the kind.
        required: whether all furniture that needs this kind must stand within reach of a point of it; else it stands
            there if it can.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"reach", "required"})

    kind: Literal["water", "gas", "exhaust", "power"]
    x: Coordinate
    y: Coordinate
    z: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    reach: Annotated[float, Field(ge=0.1, le=50.0)] | None = None
    required: bool = False


class KeepOut(Record):
    """An area in which no furniture may stand; the robot may pass.

    Attributes:
        x, y, yaw: its middle and orientation; meters, radians.
        width, depth: its sides, meters.
        reason: why, for messages.
    """

    id: Identifier
    x: Coordinate
    y: Coordinate
    yaw: Angle = 0.0
    width: Extent
    depth: Extent
    reason: Annotated[str, Field(max_length=200)] = ""

    @property
    def box(self) -> OrientedBox:
        """The area as a box of standing height, 2 m."""
        return OrientedBox(self.x, self.y, self.width, self.depth, self.yaw, 0.0, 2.0)


def _apart(region: tuple[Rectangle, ...]) -> int | None:
    """Return the first rectangle that is not joined with the first one of a region, None if all are."""
    low = np.array([(r.x0, r.y0) for r in region])
    high = np.array([(r.x1, r.y1) for r in region])
    shared = np.minimum(high[:, None], high[None]) - np.maximum(low[:, None], low[None])
    near = (shared.min(axis=2) >= -CONTACT) & (shared.max(axis=2) >= NARROWEST)
    joined = near[0]
    for _ in region:
        joined = near[joined].any(axis=0)
    return None if joined.all() else int(np.flatnonzero(~joined)[0])
