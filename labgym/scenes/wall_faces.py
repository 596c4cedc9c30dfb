"""The visible faces of the walls and columns of a floor of any shape.

A wall is a grid of cells: spans along it, between the ends of openings and of other walls, times intervals of height.
A face is drawn between a solid cell and an open one, in the color of the space that lies in front of it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import to_local, to_world
from labgym.geometry.frames import PlanarPose
from labgym.layouts.floor import Floor, Opening, Wall
from labgym.layouts.floor.walls import extensions
from labgym.scenes.finishes import PLAIN, EndWall, end_wall, paint
from labgym.scenes.floor_covering import spaces_at
from labgym.scenes.patches import Array, Corners, Patch, welded

SKIRTING = 0.10
"""Height of the skirting, meters."""
CUT = 0.6
"""Height of the lower part of a wall, which pictures show if its upper part would hide a space, meters."""
CAP = "wall_cap"
"""Material of the top of a wall, and of the section of a wall without its upper part."""
REVEALS = {"door": "door_frame", "window": "plastic_white", "glazing": "door_frame", "passage": PLAIN}
"""Material of the faces of a wall inside an opening, by kind."""
BEYOND = 0.03
"""Distance from a face at which the space in front of it is looked up, meters."""
JUNCTION = 0.05
"""Corners of other walls that are nearer than this to a wall divide it into spans, meters."""
SAME = 1e-6
"""Distance within which cuts are one, meters."""

Bools = NDArray[np.bool_]


def wall_name(index: int) -> str:
    """Return the name of a wall by its index in the floor."""
    return f"wall_{index}"


def column_name(index: int) -> str:
    """Return the name of a column by its index in the floor."""
    return f"column_{index}"


def upper(name: str) -> str:
    """Return the name of the part of a wall or column above `CUT`."""
    return f"{name}/upper"


def wall_patches(floor: Floor) -> Iterator[Patch]:
    """Yield the faces of all walls of a floor, without doors and panes.

    Sides that no space lies in front of are left out above `CUT`, so that one can look in from outside.
    """
    colors = _Colors(floor)
    for index, (wall, reach) in enumerate(zip(floor.walls, extensions(floor.walls), strict=True)):
        grid = _Grid.of(floor, index, wall, reach)
        yield from _patches(wall_name(index), (*wall.start, wall.yaw), wall.thickness / 2.0, grid, colors)


def column_patches(floor: Floor) -> Iterator[Patch]:
    """Yield the faces of the columns of a floor."""
    colors = _Colors(floor)
    for part in floor.parts:
        if part.kind == "column":
            box, reach = part.box, part.box.width / 2.0
            grid = _Grid((-reach, reach), (0.0, SKIRTING, CUT, box.z1), np.ones((1, 3), dtype=np.bool_), (None,))
            yield from _patches(column_name(part.source), (box.x, box.y, box.yaw), box.depth / 2.0, grid, colors)


@dataclass(frozen=True)
class _Grid:
    """Cells of a wall: cuts along it (n + 1) and in height (m + 1), which cells are solid (n, m), openings of spans."""

    along: tuple[float, ...]
    heights: tuple[float, ...]
    solid: Bools
    openings: tuple[Opening | None, ...]

    @classmethod
    def of(cls, floor: Floor, index: int, wall: Wall, reach: tuple[float, float]) -> _Grid:
        along = _distinct(
            [*(u for opening in wall.openings for u in opening.span), *_junctions(floor, index, wall)],
            -reach[0],
            wall.length + reach[1],
        )
        heights = _distinct([SKIRTING, CUT, *(z for o in wall.openings for z in (o.sill, o.top))], 0.0, wall.height)
        middles, levels = _middles(along), _middles(heights)
        openings = tuple(
            next((opening for opening in wall.openings if opening.span[0] < u < opening.span[1]), None)
            for u in middles.tolist()
        )
        solid = np.array(
            [[opening is None or not opening.sill < z < opening.top for z in levels.tolist()] for opening in openings]
        )
        return cls(along, heights, solid, openings)


class _Colors:
    """Materials of faces by the spaces in front of them."""

    def __init__(self, floor: Floor) -> None:
        self._floor = floor
        self._ends = [end_wall(floor, space) for space in floor.spaces]

    def of(self, points: Array, direction: tuple[float, float], yaw: float) -> list[str | None]:
        """Return the paint of faces with middles (n, 2) that look along a direction of a frame turned by yaw.

        It is None where no space is in front.
        """
        normals = np.tile(to_world([direction], (0.0, 0.0, yaw)), (len(points), 1))
        front = spaces_at(self._floor, points + BEYOND * normals)
        return [
            None if k < 0 else paint(self._floor.spaces[k].finishes, _at_end(self._ends[k], point, normal))
            for k, point, normal in zip(front.tolist(), points, normals, strict=True)
        ]


def _at_end(end: EndWall | None, point: Array, normal: Array) -> bool:
    return end is not None and bool(end.holds(point[None], normal[None])[0])


def _patches(name: str, pose: PlanarPose, half: float, grid: _Grid, colors: _Colors) -> Iterator[Patch]:
    """Yield the faces of the cells of a wall of half a thickness along the x axis of a frame."""
    rectangles: dict[tuple[str, str], list[Corners]] = {}
    # Colors of the two sides of each span, and of the two ends.
    middles = _middles(grid.along)
    sides = [
        colors.of(to_world(np.column_stack([middles, np.full(len(middles), v)]), pose), (0.0, v / half), pose[2])
        for v in (half, -half)
    ]
    ends = [
        colors.of(to_world([(u, 0.0)], pose), (sign, 0.0), pose[2])[0]
        for u, sign in ((grid.along[0], -1.0), (grid.along[-1], 1.0))
    ]

    def add(material: str, z: tuple[float, float], face: Corners) -> None:
        level = name if z[1] <= CUT + SAME else upper(name)
        rectangles.setdefault((level, material), []).append(face)

    def add_side(color: str | None, z: tuple[float, float], face: Corners) -> None:
        if color is not None or z[1] <= CUT + SAME:
            add("skirting" if color is not None and z[1] <= SKIRTING + SAME else color or PLAIN, z, face)

    for i, k in np.argwhere(grid.solid).tolist():
        (a, b), (low, high) = grid.along[i : i + 2], grid.heights[k : k + 2]
        z = (low, high)
        add_side(sides[0][i], z, ((b, half, low), (a, half, low), (a, half, high), (b, half, high)))
        add_side(sides[1][i], z, ((a, -half, low), (b, -half, low), (b, -half, high), (a, -half, high)))
        for u, step, end in ((a, -1, 0), (b, 1, 1)):
            face = _across(u, half * step, z)
            if not 0 <= i + step < len(middles):
                add(ends[end] or CAP, z, face)
            elif not grid.solid[i + step, k]:
                add(_reveal(grid, i + step), z, face)
        top: Corners = ((a, -half, high), (b, -half, high), (b, half, high), (a, half, high))
        above = k + 1 < grid.solid.shape[1]
        if not above or (math.isclose(high, CUT) and grid.solid[i, k + 1]):
            add(CAP, z, top)
        elif not grid.solid[i, k + 1]:
            add(_reveal(grid, i), z, top)
        if k > 0 and not grid.solid[i, k - 1]:
            add(_reveal(grid, i), z, ((a, half, low), (b, half, low), (b, -half, low), (a, -half, low)))
    for (level, material), faces in rectangles.items():
        vertices, triangles = welded(faces)
        vertices = np.column_stack([to_world(vertices[:, :2], pose), vertices[:, 2]])
        yield Patch(level, f"{level}/{material}", material, vertices, triangles)


def _reveal(grid: _Grid, span: int) -> str:
    opening = grid.openings[span]
    return REVEALS[opening.kind] if opening is not None else PLAIN


def _across(u: float, v: float, z: tuple[float, float]) -> Corners:
    """Return the face across a wall at a distance along it, which looks along it if v > 0, and back otherwise."""
    return (u, -v, z[0]), (u, v, z[0]), (u, v, z[1]), (u, -v, z[1])


def _junctions(floor: Floor, index: int, wall: Wall) -> Iterator[float]:
    """Yield where the corners of other walls, and of spaces, meet a wall: distances from its start, meters."""
    corners = [point for k, other in enumerate(floor.walls) if k != index for point in other.box.corners().tolist()]
    corners += [point for space in floor.spaces for box in space.boxes for point in box.corners().tolist()]
    local = to_local(corners, (*wall.start, wall.yaw))
    near = np.abs(local[:, 1]) < wall.thickness / 2.0 + JUNCTION
    yield from local[near, 0].tolist()


def _distinct(values: Sequence[float], low: float, high: float) -> tuple[float, ...]:
    """Return the values between two limits, and the limits, in order and without near duplicates."""
    cuts = [low]
    for value in sorted(values):
        if cuts[-1] + SAME < value < high - SAME:
            cuts.append(value)
    return (*cuts, high)


def _middles(cuts: Sequence[float]) -> Array:
    edges = np.array(cuts)
    return np.asarray((edges[1:] + edges[:-1]) / 2.0)
