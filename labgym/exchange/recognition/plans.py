"""Pictures of floors from DXF drawings: the unit by vote, the layers of walls by name and content, doors by arcs."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import shapely
from shapely import LineString, Polygon, STRtree, line_interpolate_point

from labgym.errors import DocumentError
from labgym.exchange.dxf import layers
from labgym.exchange.dxf.opening import CODES, UNITS
from labgym.exchange.recognition.picture import (
    MAX_PIXELS,
    Array,
    Mask,
    Picture,
    components,
    main_direction,
    opened,
    turned,
)
from labgym.exchange.recognition.strokes import Line, lines_of
from labgym.exchange.strips import Point

CELL = 0.025
"""Side of a cell, meters; in large drawings it is greater."""
MARGIN = 4.0
"""Empty space around the drawing, meters; wider than the gaps that are closed."""
OTHERS = re.compile(
    r"FURN|CHAIR|TABLE|DESK|SEAT|TOILET|SANIT|WC|STAIR|TREPPE|ESCAL|ELEV|LIFT|TEXT|ANNO|DIM|HATCH|GRID|AXIS|ACHSE|DEFPOINTS"
    r"|PLANT|TREE|ROOF|CEIL|CLNG|BEAM|SITE|TITLE|FRAME|BORDER|JOURNEY|WAYPOINT|DISTRIB|EXIT|PEOPLE|VOID|EQPM|EQUIP|LIGHT|ELEC|HVAC",
    re.IGNORECASE,
)
"""Words in the names of layers without walls."""
NO_WALLS = (layers.FURNITURE, layers.DIMENSIONS, layers.SPACE_TAGS, layers.SERVICES, layers.KEEP_OUTS, layers.WALL_FILL)
EXTENTS = (6.0, 120.0)
"""Usual extents of a floor, meters."""
FURNITURE = re.compile(r"FURN|CHAIR|TABLE|DESK|SEAT|TOILET|SANIT|WC|MOEBEL|MÖBEL|MOBIL", re.IGNORECASE)
"""Words in the names of layers of furniture."""
FURNITURE_SIZES = (0.3, 2.6)
"""Usual lengths of closed lines that are furniture, meters."""
PAIRED = (0.05, 0.5)
"""Usual distances between the two faces of a wall, meters."""
DOOR_RADII = (0.55, 1.35)
"""Usual widths of leaves, meters."""
SWEEPS = (math.radians(8.0), math.radians(185.0))
"""Angles by which drawn leaves are open."""
SHUT = 0.15
"""Greatest distance of a door that is drawn shut from the lines of its wall, and half of its thickness, meters."""
ROOM_AREA = 4.0
"""Area of the smallest closed line that is read as a room, square meters."""
ALONG, PLACES = 0.3, 40
"""Distance within which a closed line runs along others, meters, and the number of places at which that is tested."""
FRAME = 1.8
"""Largest distance of the outline of a floor from its walls, meters."""
GAPS = (1.1, 1.6, 2.2, 3.2)
"""Widths of gaps in the outer walls that are closed, meters; the first that leaves enough inside counts."""
INSIDE = 0.65
"""Least share of the hull of the walls that lies inside."""
MAX_SEGMENTS = 3000
"""Largest number of segments, the longest ones, that are compared for pairs."""


@dataclass(frozen=True)
class _Pairs:
    """Segments (n, 2, 2) of lines, the line of each, and the distance to its nearest parallel neighbor or inf."""

    segments: Array
    owners: list[int]
    gaps: Array


def picture_of_drawing(
    path: Path, scale: float | None, names: Sequence[str]
) -> tuple[Picture, Sequence[str], Sequence[str]]:
    """Return the picture of a drawing, the parts that were left out, and questions.

    Args:
        scale: meters per unit; None for a vote of extent, arcs of doors, walls, furniture and the drawing's unit.
        names: layers of walls; none for those with names of walls or with pairs of parallel lines.

    Raises:
        DocumentError: the file is damaged, or has no lines of walls.
        MissingDependencyError: ezdxf is not installed.
    """
    lines, code, skipped = lines_of(path)
    questions: list[str] = []
    if names:
        wanted = {name.casefold() for name in names}
        if not any(line.layer.casefold() in wanted for line in lines):
            there = ", ".join(sorted({line.layer[:40] for line in lines})[:20])
            raise DocumentError(path, "", f"--layers {','.join(names)}: no line is on them; the layers are {there}")
    possible = [line for line in lines if _may_be_wall(line)]
    if not possible:
        raise DocumentError(path, "", "no lines that could be walls: name their layers with --layers")
    pairs = _pairs(possible)
    unit, doubt = (scale, "") if scale is not None else _unit(possible, lines, pairs, code)
    questions += [doubt] if doubt else []
    if names:
        walls = [line for line in lines if line.layer.casefold() in wanted]
        picture = _drawn(walls, lines, unit)
    else:
        # Where the layers of walls by name enclose nothing, walls are on others, such as that of the doors.
        for walls in (_walls(possible, pairs, unit), possible, [*possible, *_straight_on_doors(lines, unit)]):
            picture = _drawn(walls, lines, unit)
            if opened(picture.free, picture.cells(math.sqrt(ROOM_AREA))).any():
                break
    used = sorted({line.layer for line in walls})
    unused = sorted({line.layer for line in possible} - set(used))
    if unused:
        skipped.append(f"layers {', '.join(unused)[:200]}")
        questions.append(f"walls are read from {', '.join(used)[:200]}: give other layers with --layers")
    return picture, skipped, questions


def _straight_on_doors(lines: Sequence[Line], unit: float) -> list[Line]:
    """Return the lines on layers of doors that are longer than doors."""
    return [
        line
        for line in lines
        if line.role == layers.DOORS and line.arc is None and line.length * unit > 2.0 * DOOR_RADII[1]
    ]


def _may_be_wall(line: Line) -> bool:
    if line.role in (layers.WALLS, layers.WINDOWS, layers.COLUMNS):
        return True
    return line.role not in (*NO_WALLS, layers.DOORS) and line.arc is None and not OTHERS.search(line.layer)


def _pairs(lines: Sequence[Line]) -> _Pairs:
    """Return the longest segments of lines with the distance to their nearest parallel neighbor."""
    segments = np.concatenate([np.stack([line.points[:-1], line.points[1:]], axis=1) for line in lines])
    owners = np.repeat(np.arange(len(lines)), [len(line.points) - 1 for line in lines])
    lengths = np.hypot(*(segments[:, 1] - segments[:, 0]).T)
    order = np.argsort(-lengths, kind="stable")[:MAX_SEGMENTS]
    order = order[lengths[order] > 0.0]
    segments, owners, lengths = segments[order], owners[order], lengths[order]
    u = (segments[:, 1] - segments[:, 0]) / lengths[:, None]
    gaps = np.full(len(segments), np.inf)
    for index, ((start, _), (ux, uy), length) in enumerate(zip(segments, u, lengths, strict=True)):
        parallel = np.abs(ux * u[:, 1] - uy * u[:, 0]) < 0.02
        offset = segments - start
        along, across = offset @ (ux, uy), np.abs(offset @ (-uy, ux)).mean(axis=1)
        overlap = np.minimum(along.max(axis=1), length) - np.maximum(along.min(axis=1), 0.0)
        near = parallel & (overlap > 0.3 * np.minimum(length, lengths)) & (across > 1e-3 * length)
        gaps[index] = across[near].min(initial=np.inf)
    return _Pairs(segments, owners.tolist(), gaps)


def _unit(possible: Sequence[Line], lines: Sequence[Line], pairs: _Pairs, code: int) -> tuple[float, str]:
    """Return meters per unit with the most votes, and a question if another has almost as many."""
    extent = _extent(possible)
    lengths = np.hypot(*(pairs.segments[:, 1] - pairs.segments[:, 0]).T)
    radii = np.array([line.arc[2] for line in lines if line.arc is not None])
    furniture = [line.points for line in lines if line.closed and FURNITURE.search(line.layer)]
    sizes = np.array([float(np.ptp(points, axis=0).max()) for points in furniture])
    votes: dict[str, float] = {}
    for name, unit in UNITS.items():
        vote = 2.0 * (EXTENTS[0] <= extent * unit <= EXTENTS[1]) + 1.5 * (CODES.get(code) == name)
        inside = (pairs.gaps * unit >= PAIRED[0]) & (pairs.gaps * unit <= PAIRED[1])
        vote += 2.0 * float(lengths[inside].sum() / max(lengths.sum(), 1e-12))
        if len(radii):
            vote += 2.0 * float(((radii * unit >= DOOR_RADII[0]) & (radii * unit <= DOOR_RADII[1])).mean())
        if len(sizes):
            vote += 2.0 * float(((sizes * unit >= FURNITURE_SIZES[0]) & (sizes * unit <= FURNITURE_SIZES[1])).mean())
        votes[name] = vote - 0.5 * (name == "dm")
    first, second = sorted(votes, key=lambda name: (-votes[name], name))[:2]
    size = f"{extent * UNITS[first]:.3g} m"
    if votes[first] - votes[second] > 1.0:
        return UNITS[first], ""
    return UNITS[first], f"the unit is taken for {first}, the drawing is {size} long: if not, give --scale or --area"


def _extent(lines: Sequence[Line]) -> float:
    points = np.concatenate([line.points for line in lines])
    return float(np.ptp(points, axis=0).max())


def _walls(possible: Sequence[Line], pairs: _Pairs, unit: float) -> list[Line]:
    """Return the lines of walls: by the names of their layers, else of layers with many pairs, else all; and rooms."""
    named = [line for line in possible if line.role == layers.WALLS]
    others = [line for line in possible if line.role in (layers.WINDOWS, layers.COLUMNS)]
    if len(named) < 1 or sum(line.length for line in named) * unit < 4.0 * math.sqrt(ROOM_AREA):
        named = _by_pairs(possible, pairs, unit)
    chosen = {id(line) for line in named}
    walls = named + [line for line in others if id(line) not in chosen]
    chosen |= {id(line) for line in others}
    rooms = [line for line in possible if id(line) not in chosen and line.closed and _area(line) * unit**2 >= ROOM_AREA]
    return walls + _along_walls(rooms, walls, unit)


def _by_pairs(possible: Sequence[Line], pairs: _Pairs, unit: float) -> list[Line]:
    """Return the lines on layers of which much is in pairs as far apart as the faces of a wall; without any, all."""
    lengths = np.hypot(*(pairs.segments[:, 1] - pairs.segments[:, 0]).T) * unit
    total: dict[str, float] = {}
    paired: dict[str, float] = {}
    for owner, length, gap in zip(pairs.owners, lengths.tolist(), (pairs.gaps * unit).tolist(), strict=True):
        layer = possible[owner].layer
        total[layer] = total.get(layer, 0.0) + length
        paired[layer] = paired.get(layer, 0.0) + (length if PAIRED[0] <= gap <= PAIRED[1] else 0.0)
    best = max(paired.values(), default=0.0)
    good = {layer for layer in total if paired[layer] >= 0.3 * total[layer] and paired[layer] >= 0.2 * best > 0.0}
    return [line for line in possible if line.layer in good or not good]


def _area(line: Line) -> float:
    x, y = line.points.T
    return abs(float(x[:-1] @ y[1:] - x[1:] @ y[:-1])) / 2.0


def _along_walls(rooms: Sequence[Line], walls: Sequence[Line], unit: float) -> list[Line]:
    """Return the closed lines that run along walls, or along each other, for most of their length."""
    if not rooms:
        return []
    tree = STRtree([LineString(line.points * unit) for line in [*walls, *rooms]])
    kept = []
    for index, line in enumerate(rooms, start=len(walls)):
        ring = LineString(line.points * unit)
        places = line_interpolate_point(ring, np.linspace(0.0, 1.0, PLACES, endpoint=False), normalized=True)
        if _frames(line, walls, unit):
            kept.append(line)
            continue
        place, hit = tree.query(places, predicate="dwithin", distance=ALONG)
        if len(set(place[hit != index].tolist())) >= 0.6 * PLACES:
            kept.append(line)
    return kept


def _frames(line: Line, walls: Sequence[Line], unit: float) -> bool:
    """Return whether a closed line is the outline of a floor: just around all walls."""
    points = np.concatenate([wall.points for wall in walls])
    beyond = np.array([points.min(axis=0) - line.points.min(axis=0), line.points.max(axis=0) - points.max(axis=0)])
    return bool((beyond * unit >= -ALONG).all() and (beyond * unit <= FRAME).all())


def _drawn(walls: Sequence[Line], lines: Sequence[Line], unit: float) -> Picture:
    """Return the picture of lines of walls, with the ways through doors closed."""
    dense = np.concatenate([spread(line.points * unit, 0.2) for line in walls])
    yaw = main_direction(dense, 0.05)
    solid_lines = [turned(line.points * unit, -yaw) for line in walls]
    points = np.concatenate(solid_lines)
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    cell = max(CELL, math.sqrt(float(np.prod(high - low)) / MAX_PIXELS))
    shape = tuple(math.ceil(extent / cell) for extent in (high - low)[::-1])
    arcs = [line for line in lines if line.arc is not None and _is_door(line, unit)]
    doors, leaves = _doors(arcs, solid_lines, unit, yaw)
    doors += _shut_doors([line for line in lines if line.role == layers.DOORS and line.closed], solid_lines, unit, yaw)
    kept = [part for line in solid_lines for part in _without(line, leaves)]
    solid = _raster([*kept, *(np.array(door) for door in doors)], low, cell, shape)
    outside = outside_of(~solid, cell)
    return Picture(~solid & ~outside, solid, outside, cell, float(low[0]), float(low[1]), yaw, tuple(doors), unit, True)


def spread(points: Array, step: float) -> Array:
    """Return points along a polyline, about a step apart; their number is bounded."""
    parts = []
    for a, b in pairwise(points):
        count = min(max(int(np.hypot(*(b - a)) / step), 1), 500)
        parts.append(a + (b - a) * np.linspace(0.0, 1.0, count, endpoint=False)[:, None])
    return np.concatenate(parts)


def _raster(lines: Sequence[Array], low: Array, cell: float, shape: tuple[int, ...]) -> Mask:
    """Return the cells that lines in meters cross."""
    image = np.zeros(shape, dtype=np.uint8)
    for line in lines:
        pixels = np.round(((line - low) / cell - 0.5) * 16.0).astype(np.int32)
        cv2.polylines(image, [pixels.reshape(-1, 1, 2)], isClosed=False, color=1, thickness=1, shift=4)
    return image > 0


def outside_of(free: Mask, cell: float) -> Mask:
    """Return the area around a building: what a square as wide as a gap of its walls reaches from the border."""
    ys, xs = np.nonzero(~free)
    hull = cv2.convexHull(np.column_stack([xs, ys]).astype(np.int32))
    enclosed = max(cv2.contourArea(hull), 1.0)
    best = np.zeros(free.shape, dtype=np.bool_)
    most = 0.0
    for gap in GAPS:
        _, labels, _ = components(opened(free, max(2, round(gap / cell))))
        border = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
        outer = np.isin(labels, np.unique(border)) & (labels > 0)
        inside = float((free & ~outer).sum()) / enclosed
        wide = float(opened(free & ~outer, max(2, round(1.1 / cell))).sum()) / enclosed
        if wide > most + 0.1 or not best.any():
            best, most = outer, max(wide, most)
        if inside >= INSIDE and wide >= 0.8 * INSIDE:
            break
    return best


def _is_door(line: Line, unit: float) -> bool:
    radius = line.arc[2] * unit if line.arc is not None else 0.0
    sweep = line.length * unit / radius if radius > 0.0 else 0.0
    return DOOR_RADII[0] <= radius <= DOOR_RADII[1] and SWEEPS[0] <= sweep <= SWEEPS[1] + 0.1


@dataclass(frozen=True)
class _Leaf:
    """The area of an open leaf: hinge, radius, and the directions of the closed and of the open leaf, radians."""

    hinge: Point
    radius: float
    shut: float
    open: float


def _doors(
    arcs: Sequence[Line], walls: Sequence[Array], unit: float, yaw: float
) -> tuple[list[tuple[Point, Point]], list[_Leaf]]:
    """Return the closed leaves of doors, and the areas of the open ones.

    A closed leaf ends at a wall; of the two ends of an arc it is the one that is nearer to one.
    """
    tree = STRtree([LineString(line) for line in walls])
    shapes = tree.geometries
    doors: list[tuple[Point, Point]] = []
    leaves: list[_Leaf] = []
    for line in arcs:
        if line.arc is None:
            continue
        x, y = turned(np.array([line.arc[:2]]) * unit, -yaw)[0].tolist()
        ends = turned(line.points[[0, -1]] * unit, -yaw)
        radius = line.arc[2] * unit

        def distance(end: Array, x: float = x, y: float = y) -> float:
            """Return how far the end is from a wall that does not run along the leaf."""
            point = LineString([end + 0.06 * (end - (x, y)), end + 1e-6])
            near = shapes[int(tree.nearest(point))]
            return float(near.distance(point))

        first, second = (distance(end) for end in ends)
        shut, other = (ends[0], ends[1]) if first <= second else (ends[1], ends[0])
        doors.append(((x, y), (float(shut[0]), float(shut[1]))))
        angles = [math.atan2(end[1] - y, end[0] - x) for end in (shut, other)]
        leaves.append(_Leaf((x, y), radius, angles[0], angles[1]))
    return doors, leaves


def _shut_doors(outlines: Sequence[Line], walls: Sequence[Array], unit: float, yaw: float) -> list[tuple[Point, Point]]:
    """Return the middle lines of oblong outlines that lie along walls: doors that are drawn shut."""
    shapes = shapely.union_all([LineString(line) for line in walls])
    doors: list[tuple[Point, Point]] = []
    for outline in outlines:
        box = Polygon(turned(outline.points * unit, -yaw)).minimum_rotated_rectangle
        if box.geom_type != "Polygon":
            continue
        corners = shapely.get_coordinates(box)[:4]
        if math.dist(corners[0], corners[1]) < math.dist(corners[1], corners[2]):
            corners = np.roll(corners, -1, axis=0)
        start, end = (corners[0] + corners[3]) / 2.0, (corners[1] + corners[2]) / 2.0
        wide = DOOR_RADII[0] <= math.dist(start, end) <= 2.0 * DOOR_RADII[1]
        if not wide or math.dist(corners[0], corners[3]) > 2.0 * SHUT:
            continue
        if all(shapes.distance(shapely.Point(end_)) <= SHUT for end_ in (start, end)):
            doors.append(((float(start[0]), float(start[1])), (float(end[0]), float(end[1]))))
    return doors


def _without(line: Array, leaves: Sequence[_Leaf]) -> list[Array]:
    """Return the parts of a polyline that are not drawn within the areas of open leaves."""
    bad = np.zeros(len(line) - 1, dtype=np.bool_)
    for leaf in leaves:
        offset = line - leaf.hinge
        near = np.hypot(*offset.T) <= 1.15 * leaf.radius
        turn = math.remainder(leaf.open - leaf.shut, 2.0 * math.pi)
        angle = np.remainder(np.arctan2(offset[:, 1], offset[:, 0]) - leaf.shut + math.pi, 2.0 * math.pi) - math.pi
        angle = angle * (1.0 if turn > 0.0 else -1.0)
        slack = math.radians(10.0)
        within = (angle >= -slack) & (angle <= abs(turn) + slack) | (np.hypot(*offset.T) <= 0.12 * leaf.radius)
        inner = near & within
        middle = (line[:-1] + line[1:]) / 2.0 - leaf.hinge
        turned_middle = (
            np.remainder(np.arctan2(middle[:, 1], middle[:, 0]) - leaf.shut + math.pi, 2.0 * math.pi) - math.pi
        )
        turned_middle = turned_middle * (1.0 if turn > 0.0 else -1.0)
        bad |= inner[:-1] & inner[1:] & (turned_middle > min(0.4 * abs(turn), slack))
    parts = np.split(np.arange(len(line) - 1), np.flatnonzero(np.diff(bad.astype(np.int8))) + 1)
    return [line[part[0] : part[-1] + 2] for part in parts if len(part) and not bad[part[0]]]
