"""The structure of a floor in plan: walls cut at their openings, corners, door leaves and outlines of spaces."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from labgym.geometry import OrientedBox
from labgym.geometry.polygons import grown, union
from labgym.layouts.floor import Floor, Opening, Space, Wall
from labgym.layouts.floor.spaces import CONTACT
from labgym.layouts.floor.walls import extensions

if TYPE_CHECKING:
    from shapely import Geometry

Point = tuple[float, float]
WAYS = ("door", "passage")
"""Kinds of openings that lead through a wall."""
NEAR = 1e-3
"""Lengths below this count as nothing, meters."""


@dataclass(frozen=True)
class PlacedOpening:
    """An opening in the floor's frame.

    Attributes:
        wall: index of the wall.
        x, y: middle of the opening on the wall's middle line, meters.
        yaw: direction of the wall from start to end, radians.
        thickness: of the wall, meters.
    """

    wall: int
    opening: Opening
    x: float
    y: float
    yaw: float
    thickness: float

    @property
    def side(self) -> int:
        """1 if the leaf opens to the left of the wall, -1 if to the right."""
        return 1 if self.opening.swing == "left" else -1

    @property
    def hinge(self) -> Point:
        """The hinge: an end of the opening, on the face of the wall to which the leaf opens."""
        end = -0.5 if self.opening.hinge == "start" else 0.5
        return self.point(end * self.opening.width, self.side * self.thickness / 2.0)

    @property
    def closed_yaw(self) -> float:
        """Direction of the closed leaf from its hinge, radians."""
        return self.yaw if self.opening.hinge == "start" else self.yaw + math.pi

    @property
    def turn(self) -> int:
        """1 if the leaf opens counter-clockwise, -1 if clockwise."""
        return self.side if self.opening.hinge == "start" else -self.side

    def leaf(self, angle: float) -> Point:
        """Return the free end of the leaf, opened by an angle in radians."""
        x, y = self.hinge
        yaw = self.closed_yaw + self.turn * angle
        return x + self.opening.width * math.cos(yaw), y + self.opening.width * math.sin(yaw)

    def point(self, along: float, across: float) -> Point:
        """Return the point at a distance from the middle along the wall, and to the left of its middle line."""
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + along * cosine - across * sine, self.y + along * sine + across * cosine


def openings(floor: Floor) -> Iterator[PlacedOpening]:
    """Yield every opening of a floor, wall by wall."""
    for index, wall in enumerate(floor.walls):
        for opening in wall.openings:
            yield PlacedOpening(index, opening, *wall.point(opening.position), wall.yaw, wall.thickness)


def wall_pieces(wall: Wall, reach: tuple[float, float] = (0.0, 0.0)) -> Iterator[OrientedBox]:
    """Yield the parts of a wall between its openings as boxes.

    Args:
        reach: by how much the wall runs on past its start and past its end, meters.
    """
    here, end = -reach[0], wall.length + reach[1]
    for low, high in sorted(opening.span for opening in wall.openings):
        if low - here > NEAR:
            yield wall.piece(here, low, 0.0, wall.height)
        here = max(here, high)
    if end - here > NEAR:
        yield wall.piece(here, end, 0.0, wall.height)


def joined_pieces(floor: Floor) -> Iterator[OrientedBox]:
    """Yield the parts of all walls between their openings; walls run on at corners, so that no gap is left."""
    for wall, reach in zip(floor.walls, extensions(floor.walls), strict=True):
        yield from wall_pieces(wall, reach)


def polygon(box: OrientedBox) -> Geometry:
    """Return the footprint of a box as a shapely polygon."""
    from shapely import Polygon

    return Polygon(box.corners())


def walls_in_plan(floor: Floor) -> Geometry:
    """Return the area of the walls without their openings, corners included, as a shapely geometry."""
    # Closing by a tenth of a millimeter joins parts whose common edge differs by rounding.
    return grown(grown(union(polygon(box) for box in joined_pieces(floor)), 1e-4), -1e-4)


def outline(space: Space) -> Geometry:
    """Return the region of a space in the floor's frame as a shapely geometry."""
    from shapely import Polygon
    from shapely.affinity import rotate, translate

    region = union(Polygon([(r.x0, r.y0), (r.x1, r.y0), (r.x1, r.y1), (r.x0, r.y1)]) for r in space.region)
    if region.geom_type == "MultiPolygon":  # rectangles that touch but for rounding
        region = grown(grown(region, CONTACT), -CONTACT)
    return translate(rotate(region, space.yaw, (0.0, 0.0), use_radians=True), space.x, space.y)
