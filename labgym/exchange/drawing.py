"""The parts of a floor in a drawing: strips of wall, marks of openings, outlines and tags of spaces, furniture."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from labgym.exchange.strips import Point, Strip
from labgym.geometry.frames import PlanarPose


@dataclass(frozen=True)
class Mark:
    """An opening in a drawing: the ends of the opening, on or near its wall, in meters.

    Attributes:
        hinge: end of the opening at which the leaf turns; None without a leaf.
        toward: a point on the side to which the leaf opens.
        fields: further fields of `Opening`.
    """

    start: Point
    end: Point
    kind: Literal["door", "passage", "window", "glazing"] = "door"
    hinge: Point | None = None
    toward: Point | None = None
    fields: dict[str, Any] = field(default_factory=dict)

    @property
    def width(self) -> float:
        """Width of the opening, meters."""
        return math.dist(self.start, self.end)


@dataclass(frozen=True)
class Tag:
    """The description of the space around a point of a drawing."""

    x: float
    y: float
    fields: dict[str, Any]
    yaw: float | None = None


@dataclass(frozen=True)
class Piece:
    """A block of furniture in a drawing: its middle in meters and its yaw.

    Attributes:
        id: empty if the drawing gives none.
        asset: its name.
        named: whether an attribute names the asset; otherwise the block's own name may be one.
    """

    id: str
    asset: str
    x: float
    y: float
    yaw: float
    named: bool


@dataclass
class Drawing:
    """The parts of a floor in a drawing, in meters.

    Attributes:
        marks: openings; of the alternatives of each the first that lies in a wall counts.
        outlines: polygons around spaces, inside their walls; if empty, spaces are what walls enclose.
        placed: whether the drawing's coordinates are those of a floor; otherwise its lower left corner is the origin.
        shift: of the assembled floor's coordinates against the drawing's, meters.
        origin: pose of the floor's frame in that of the file, meters and radians.
    """

    strips: list[Strip] = field(default_factory=list)
    marks: list[Sequence[Mark]] = field(default_factory=list)
    outlines: list[tuple[Point, ...]] = field(default_factory=list)
    tags: list[Tag] = field(default_factory=list)
    columns: list[dict[str, Any]] = field(default_factory=list)
    services: list[dict[str, Any]] = field(default_factory=list)
    keep_outs: list[dict[str, Any]] = field(default_factory=list)
    furniture: list[Piece] = field(default_factory=list)
    placed: bool = False
    shift: Point = (0.0, 0.0)
    origin: PlanarPose = (0.0, 0.0, 0.0)

    def bounds(self) -> tuple[float, float, float, float]:
        """Return x0, y0, x1, y1 of the walls and outlines, meters; zeros without walls and outlines."""
        points = [point for strip in self.strips for point in (strip.start, strip.end)]
        points += [point for outline in self.outlines for point in outline]
        xs, ys = zip(*points, strict=True) if points else ((0.0,), (0.0,))
        return min(xs), min(ys), max(xs), max(ys)

    def moved(self, dx: float, dy: float) -> Drawing:
        """Return the parts moved by a distance in meters, furniture excepted."""

        def at(point: Point) -> Point:
            return point[0] + dx, point[1] + dy

        def mark(old: Mark) -> Mark:
            hinge = None if old.hinge is None else at(old.hinge)
            toward = None if old.toward is None else at(old.toward)
            return replace(old, start=at(old.start), end=at(old.end), hinge=hinge, toward=toward)

        def fields(records: list[dict[str, Any]]) -> list[dict[str, Any]]:
            return [{**record, "x": record["x"] + dx, "y": record["y"] + dy} for record in records]

        return replace(
            self,
            strips=[replace(strip, start=at(strip.start), end=at(strip.end)) for strip in self.strips],
            marks=[[mark(each) for each in alternatives] for alternatives in self.marks],
            outlines=[tuple(map(at, outline)) for outline in self.outlines],
            tags=[replace(tag, x=tag.x + dx, y=tag.y + dy) for tag in self.tags],
            columns=fields(self.columns),
            services=fields(self.services),
            keep_outs=fields(self.keep_outs),
        )
