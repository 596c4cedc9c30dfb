"""Floors of several shapes for round trips, and a comparison of floors by their geometry."""

from __future__ import annotations

import math
from itertools import pairwise

from shapely import Polygon, box, hausdorff_distance, union_all
from shapely.affinity import rotate, translate

from labgym.layouts.floor import Column, Door, Floor, KeepOut, Opening, Rectangle, Room, Service, Space, Wall

DOORS = (Door(wall="front", offset=1.4), Door(wall="left", offset=6.5, width=1.2), Door(wall="back", offset=3.0))


def rectangle() -> Floor:
    return Room(width=7.0, depth=13.0, height=2.8, wall_thickness=0.15, doors=DOORS).floor


def ell() -> Floor:
    corners = ((0.0, 0.0), (8.0, 0.0), (8.0, 3.5), (4.5, 3.5), (4.5, 9.0), (0.0, 9.0))
    walls = around(corners, {0: (Opening(position=1.3),), 2: (Opening(position=1.5, swing="left", width=0.9),)})
    region = (Rectangle(x1=4.5, y1=9.0), Rectangle(x0=4.5, x1=8.0, y1=3.5))
    return Floor(walls=walls, spaces=(Space(region=region),))


def suite() -> Floor:
    """A laboratory and a store beside it, both behind a corridor with an exit; a column and services."""
    inner = Opening(position=2.0, hinge="end", swing="right", state="open", angle=1.2)
    glass = Opening(kind="glazing", position=4.2, width=1.4, height=1.5, sill=0.8)
    passage = Opening(kind="passage", position=7.5)
    pane = Opening(kind="window", position=3.0, width=2.0, height=1.2, sill=0.9)
    walls = (
        *around(((0.0, 0.0), (9.0, 0.0), (9.0, 7.0), (0.0, 7.0)), {1: (Opening(position=6.0, width=1.2),), 2: (pane,)}),
        Wall(start=(0.0, 5.05), end=(9.0, 5.05), thickness=0.1, openings=(inner, glass, passage)),
        Wall(start=(6.06, 0.0), end=(6.06, 5.0), thickness=0.12),
    )
    spaces = (
        Space(id="lab", region=(Rectangle(x1=6.0, y1=5.0),)),
        Space(id="store", use="store", x=6.12, region=(Rectangle(x1=2.88, y1=5.0),), ceiling=2.6),
        Space(id="corridor", use="corridor", y=5.1, region=(Rectangle(x1=9.0, y1=1.9),)),
    )
    return Floor(
        walls=walls,
        spaces=spaces,
        columns=(Column(id="c1", x=3.0, y=2.5, yaw=0.4, width=0.3, depth=0.4),),
        services=(Service(kind="gas", x=0.1, y=1.0, z=1.1),),
        keep_outs=(KeepOut(id="hatch", x=1.0, y=4.0, width=1.0, depth=0.8, reason="floor hatch"),),
    )


def turned(floor: Floor, angle: float) -> Floor:
    """Return a floor rotated about the origin: every wall is oblique."""

    def place(record):
        x, y = point((record.x, record.y))
        changes = {"x": x, "y": y} | ({"yaw": record.yaw + angle} if hasattr(record, "yaw") else {})
        return record.model_copy(update=changes)

    def point(at):
        cosine, sine = math.cos(angle), math.sin(angle)
        return at[0] * cosine - at[1] * sine, at[0] * sine + at[1] * cosine

    return Floor(
        walls=tuple(w.model_copy(update={"start": point(w.start), "end": point(w.end)}) for w in floor.walls),
        spaces=tuple(map(place, floor.spaces)),
        columns=tuple(map(place, floor.columns)),
        services=tuple(map(place, floor.services)),
        keep_outs=tuple(map(place, floor.keep_outs)),
    )


def chamfered() -> Floor:
    """A room of 8 x 6 m with a corner cut off at 45 degrees, and a region with stairs there."""
    corners = ((0.0, 0.0), (8.0, 0.0), (8.0, 5.1), (7.1, 6.0), (0.0, 6.0))
    edges = [7.1 + 0.09 * k for k in range(11)]
    stairs = (Rectangle(x0=a, x1=b, y1=13.1 - b) for a, b in pairwise(edges))
    steps = (Rectangle(x1=7.1, y1=6.0), *stairs)
    return Floor(walls=around(corners, {0: (Opening(position=2.0),)}), spaces=(Space(region=steps),))


FLOORS = {
    "rectangle": rectangle,
    "ell": ell,
    "suite": suite,
    "oblique suite": lambda: turned(suite(), 0.3),
    "chamfered": chamfered,
}


def around(corners, openings=None, thickness: float = 0.2) -> tuple[Wall, ...]:
    """Return walls outside a counter-clockwise polygon, whose ends meet its corners; openings by index of the side."""
    walls = []
    for index, (start, end) in enumerate(zip(corners, (*corners[1:], corners[0]), strict=True)):
        length = math.dist(start, end)
        dx, dy = (end[1] - start[1]) / length * thickness / 2.0, -(end[0] - start[0]) / length * thickness / 2.0
        ends = ((start[0] + dx, start[1] + dy), (end[0] + dx, end[1] + dy))
        walls.append(Wall(start=ends[0], end=ends[1], thickness=thickness, openings=(openings or {}).get(index, ())))
    return tuple(walls)


def region(space: Space):
    union = union_all([box(r.x0, r.y0, r.x1, r.y1) for r in space.region])
    return translate(rotate(union, space.yaw, origin=(0, 0), use_radians=True), space.x, space.y)


def differences(first: Floor, second: Floor, tolerance: float = 1e-3) -> list[str]:
    """Return how two floors differ by more than a tolerance in meters, as polygons and points in the floor's frame."""
    found = []
    walls = [union_all([Polygon(box_.corners()) for box_ in floor.wall_boxes]) for floor in (first, second)]
    if hausdorff_distance(*walls) > tolerance:
        found.append(f"walls differ by {hausdorff_distance(*walls):.4f} m")
    for kind in ("wall", "lintel", "sill", "leaf", "pane", "column"):
        plans = [[part.box for part in floor.parts if part.kind == kind] for floor in (first, second)]
        areas = [union_all([Polygon(each.corners()) for each in boxes]) for boxes in plans]
        heights = [sorted({round(z, 3) for each in boxes for z in (each.z0, each.z1)}) for boxes in plans]
        apart = 0.0 if all(area.is_empty for area in areas) else hausdorff_distance(*areas)
        if not apart <= tolerance or heights[0] != heights[1]:
            found.append(f"{kind}: {apart:.4f} m, heights {heights}")
    for name in ("x", "y", "width", "exit"):
        values = [sorted(round(float(getattr(way, name)), 2) for way in floor.doorways) for floor in (first, second)]
        if max((abs(a - b) for a, b in zip(*values, strict=True)), default=0.0) > 0.011:
            found.append(f"doorways: {name} {values}")
    swings = [sorted(swing(floor)) for floor in (first, second)]
    if len(swings[0]) != len(swings[1]) or any(
        math.dist(a, b) > tolerance for one, other in zip(*swings, strict=True) for a, b in zip(one, other, strict=True)
    ):
        found.append(f"swings {swings}")
    by_id = [{space.id: space for space in floor.spaces} for floor in (first, second)]
    if by_id[0].keys() != by_id[1].keys():
        return [*found, f"spaces {[sorted(each) for each in by_id]}"]
    for key, space in by_id[0].items():
        other = by_id[1][key]
        apart = hausdorff_distance(region(space), region(other))
        if apart > tolerance or (space.use, space.ceiling) != (other.use, other.ceiling):
            found.append(f"space {key}: {apart:.4f} m, {space.use}, {other.use}, {space.ceiling}, {other.ceiling}")
    for kind in ("columns", "services", "keep_outs"):
        rows = [[rounded(each) for each in getattr(floor, kind)] for floor in (first, second)]
        if rows[0] != rows[1]:
            found.append(f"{kind}: {rows}")
    return found


def swing(floor: Floor):
    """Yield, for each door, its hinge and the free end of its leaf when open at a right angle."""
    for wall in floor.walls:
        for opening in wall.openings:
            if opening.kind == "door":
                ends = opening.span if opening.hinge == "start" else opening.span[::-1]
                side = 1.0 if opening.swing == "left" else -1.0
                face = side * wall.thickness / 2.0
                points = (wall.point(ends[0], face), wall.point(ends[0], face + side * opening.width))
                yield tuple((round(x, 5), round(y, 5)) for x, y in points)


def rounded(record) -> dict:
    values = record.model_dump()
    return {key: round(value, 4) if isinstance(value, float) else value for key, value in values.items()}
