"""Walls, their joints and their openings: doors, passages, windows and glazed parts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from labgym.documents import Growing, Record
from labgym.geometry import BoxArray, OrientedBox, pairwise_distance, rotate
from labgym.geometry.frames import PlanarPose
from labgym.layouts.floor.fields import Coordinate, Height, Thickness

SHORTEST = 0.05
"""Length of the shortest wall, meters."""
ROUNDING = 1e-6
"""Excess over a limit that is taken for rounding, meters."""
WAYS = ("door", "passage")
"""Kinds of openings that lead through a wall."""
DOOR_WIDTH = (0.6, 4.0)
DOOR_HEIGHT = (1.8, 4.0)
"""Least and largest clear width and height of a door, meters; those of `Door` and of version 1."""


class Opening(Growing):
    """A door, a passage without a leaf, a window, or a glazed part of a wall.

    Attributes:
        position: meters from the wall's start to the middle of the opening.
        width, height: clear opening, meters: a door's are 0.6 to 4.0 and 1.8 to 4.0, a passage's at least as much.
        hinge: the end of the wall that is nearer to the hinge.
        swing: the side of the wall, seen from its start, to which the leaf opens.
        sill: height of the opening's bottom above the floor, meters; 0 for doors and passages.
        state: whether the leaf of a door is open. Doors that lead out of the floor count as closed.
        angle: radians by which an open leaf is turned from its closed position.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"sill", "state", "angle"})

    kind: Literal["door", "passage", "window", "glazing"] = "door"
    position: Annotated[float, Field(ge=0.0, le=300.0)]
    width: Annotated[float, Field(ge=0.2, le=20.0)] = 1.0
    height: Annotated[float, Field(ge=0.2, le=10.0)] = 2.1
    hinge: Literal["start", "end"] = "start"
    swing: Literal["left", "right"] = "left"
    sill: Annotated[float, Field(ge=0.0, le=9.8)] = 0.0
    state: Literal["open", "closed"] = "closed"
    angle: Annotated[float, Field(ge=0.0, le=math.pi)] = math.pi / 2.0

    @model_validator(mode="after")
    def _check_size(self) -> Self:
        if self.kind in WAYS:
            limits = {"width": (DOOR_WIDTH, self.width), "height": (DOOR_HEIGHT, self.height)}
            for name, ((least, most), value) in limits.items():
                if value < least or (self.kind == "door" and value > most):
                    allowed = f"{least:g} to {most:g} m" if self.kind == "door" else f"at least {least:g} m"
                    raise ValueError(f"the {name} of {self.label} must be {allowed}, got {value:g} m")
            if self.sill != 0.0:
                raise ValueError(f"{self.label} has a sill of {self.sill:g} m: set it to 0, or make it a window")
        return self

    @property
    def label(self) -> str:
        """Name of the opening in messages."""
        return f"the {self.kind} at position {self.position:g} m"

    @property
    def span(self) -> tuple[float, float]:
        """Interval along the wall, meters from its start."""
        return self.position - self.width / 2.0, self.position + self.width / 2.0

    @property
    def top(self) -> float:
        """Height of the opening's upper edge above the floor, meters."""
        return self.sill + self.height


class Wall(Record):
    """A straight wall: `start` and `end` are the ends (x, y) of its middle line; lengths in meters."""

    start: tuple[Coordinate, Coordinate]
    end: tuple[Coordinate, Coordinate]
    thickness: Thickness = 0.2
    height: Height = 3.0
    openings: Annotated[tuple[Opening, ...], Field(max_length=64)] = ()

    @model_validator(mode="after")
    def _check_openings(self) -> Self:
        if self.length < SHORTEST:
            raise ValueError(f"the wall is {self.length:g} m long; at least {SHORTEST:g} m is required: remove it")
        for opening in self.openings:
            low, high = opening.span
            if low < -ROUNDING or high > self.length + ROUNDING:
                half = opening.width / 2.0
                limits = f"the position of a {opening.width:g} m {opening.kind} must be {half:g} to"
                raise ValueError(
                    f"{opening.label} does not fit the {self.length:g} m wall: {limits} {self.length - half:g} m"
                )
            if opening.top > self.height + ROUNDING:
                raise ValueError(
                    f"{opening.label} reaches {opening.top:g} m, above the wall's top at {self.height:g} m: lower it"
                )
        for first, second in pairwise(sorted(self.openings, key=lambda opening: opening.span)):
            overlap = first.span[1] - second.span[0]
            if overlap > ROUNDING:
                raise ValueError(f"{first.label} and {second.label} overlap by {overlap:.2f} m: move one")
        return self

    @property
    def length(self) -> float:
        """Length of the middle line, meters."""
        return math.dist(self.start, self.end)

    @property
    def yaw(self) -> float:
        """Direction from start to end, radians; the left side of the wall is its front at this yaw."""
        return math.atan2(self.end[1] - self.start[1], self.end[0] - self.start[0])

    def point(self, along: float, across: float = 0.0) -> tuple[float, float]:
        """Return the point (x, y) at a distance along the wall from its start, and to the left of its middle line."""
        x, y = rotate(along, across, self.yaw)
        return self.start[0] + x, self.start[1] + y

    def pose(self, along: float, side: Literal["left", "right"] = "left") -> PlanarPose:
        """Return the pose (x, y, yaw) on the middle line whose front is toward a side of the wall."""
        return *self.point(along), self.yaw if side == "left" else self.yaw + math.pi

    def piece(self, start: float, end: float, z0: float, z1: float) -> OrientedBox:
        """Return the part of the wall between two distances from its start and two heights, all in meters."""
        x, y = self.point((start + end) / 2.0)
        return OrientedBox(x, y, end - start, self.thickness, self.yaw, z0, z1)

    @property
    def box(self) -> OrientedBox:
        """The wall without its openings."""
        return self.piece(0.0, self.length, 0.0, self.height)


JOINT = 0.01
"""The end of a wall that is nearer than this to another wall is joined with it, meters."""
LAP = 1e-3
"""Least length by which joined walls overlap, meters."""
PARALLEL = 1e-3
"""Sine of the angle between two walls below which they are taken as parallel."""
CHUNK = 16
"""Consecutive ends, mostly of one room, that are compared with the walls around them at a time."""


def extensions(walls: Sequence[Wall]) -> tuple[tuple[float, float], ...]:
    """Return by how much each wall runs on past its start and past its end, meters.

    A wall is extended at a joint up to the far face of the other wall, so that the corner is filled, and no further:
    it never passes through the other wall into what lies behind.
    """
    ends = [(index, at_end) for index in range(len(walls)) for at_end in (False, True)]
    others = BoxArray.of([wall.box for wall in walls])
    lengths: list[float] = []
    for start in range(0, len(ends), CHUNK):
        lengths += _lengths(walls, ends[start : start + CHUNK], others)
    return tuple(zip(lengths[::2], lengths[1::2], strict=True))


def _lengths(walls: Sequence[Wall], ends: Sequence[tuple[int, bool]], others: BoxArray) -> list[float]:
    """Return by how much some ends (index of the wall, whether it is its end) run on, meters."""
    caps = BoxArray.of([_cap(walls[index], at_end) for index, at_end in ends])
    low, high = caps.corners().min(axis=(0, 1)) - 2.0 * JOINT, caps.corners().max(axis=(0, 1)) + 2.0 * JOINT
    corners = others.corners()
    close = ((corners.max(axis=1) >= low) & (corners.min(axis=1) <= high)).all(axis=1)
    near = np.zeros((len(ends), len(walls)), dtype=np.bool_)
    near[:, close] = pairwise_distance(caps, others.take(np.flatnonzero(close))) <= JOINT
    near[np.arange(len(ends)), [index for index, _ in ends]] = False
    return [
        _length(walls[index], at_end, others, joined) if joined.any() else 0.0
        for (index, at_end), joined in zip(ends, near, strict=True)
    ]


def _cap(wall: Wall, at_end: bool) -> OrientedBox:
    """Return an end of a wall as a box without length."""
    x, y = wall.end if at_end else wall.start
    return OrientedBox(x, y, 0.0, wall.thickness, wall.yaw, 0.0, wall.height)


def _length(wall: Wall, at_end: bool, others: BoxArray, joined: NDArray[np.bool_]) -> float:
    """Return by how much an end can run on without passing through the far face of any of the joined walls."""
    (x, y), direction = (wall.end, wall.yaw) if at_end else (wall.start, wall.yaw + math.pi)
    ux, uy = math.cos(direction), math.sin(direction)
    centre, half, yaw = others.centre[joined], others.half[joined], others.yaw[joined]
    nx, ny = -np.sin(yaw), np.cos(yaw)
    slope = ux * nx + uy * ny
    sign = np.where(slope < 0.0, -1.0, 1.0)  # the normals point to the far side
    slope, middle = sign * slope, sign * ((x - centre[:, 0]) * nx + (y - centre[:, 1]) * ny)
    own = wall.thickness / 2.0 * np.abs(ux * ny - uy * nx)
    reach = (half[:, 1] - middle - own) / np.maximum(slope, PARALLEL)
    reach = np.where(slope < PARALLEL, LAP, np.clip(reach, 0.0, wall.thickness + 2.0 * half[:, 1]))
    return float(reach.max())
