"""The visible parts in the openings of walls: frames, leaves of doors, panes of windows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np

from labgym.assets.shapes import Part, tessellate
from labgym.assets.shapes.parts import block
from labgym.geometry import to_world
from labgym.geometry.frames import PlanarPose
from labgym.layouts.floor import Doorway, Floor, Opening, Wall
from labgym.scenes.finishes import DOORS
from labgym.scenes.floor_covering import spaces_at
from labgym.scenes.patches import Array, Faces, Patch, join
from labgym.scenes.wall_faces import BEYOND, CUT, upper, wall_name

ARCHITRAVE = (0.05, 0.012)
"""Width of the frame of a door around the opening, and how far it stands out from the wall, meters."""
RECESS = 0.06
"""Distance of the leaf of an exit behind the face of the wall inside, meters."""
RAIL = 0.03
"""Width of the frame of a pane, meters."""
MULLION = 1.6
"""Largest width of an undivided pane, meters."""
SILL = 0.04
"""How far the sill of a window stands out from the wall, meters."""
DROPS = (0.35, 0.0, 0.55, 0.2, 0.8)
"""How far blinds are let down, as shares of the height of their windows."""
SLAT = 0.035
"""Spacing of the slats of a blind, meters."""
DOUBLE = 1.3
"""A wider door has two leaves in the picture, meters."""


def opening_patches(floor: Floor, leaves: bool = True) -> Iterator[Patch]:
    """Yield frames, leaves and panes of all openings of a floor. Leaves are where the solids of the floor have them.

    Args:
        leaves: whether to include the leaves of interior doors.
    """
    ways = {(way.wall, way.opening): way for way in floor.doorways}
    inner = {(part.source, part.opening): part.box for part in floor.parts if leaves and part.kind == "leaf"}
    for index, wall in enumerate(floor.walls):
        meshes: dict[tuple[str, str], list[tuple[Array, Faces]]] = {}
        pose = (*wall.start, wall.yaw)
        for k, opening in enumerate(wall.openings):
            doorway = ways.get((index, opening))
            placed = [(part, pose) for part in _frame(wall, opening)]
            if opening.kind in ("window", "glazing"):
                placed += [(part, pose) for part in _pane(opening)]
            if opening.kind == "window":
                placed += [(part, pose) for part in _dressing(floor, wall, opening, index + k)]
            elif doorway is not None:
                material = leaf_material(floor, doorway)
                if doorway.exit:
                    parts = leaf_parts(opening.width, 0.04, opening.height, "daylight", material)
                    placed += [(part, _exit_leaf(doorway)) for part in parts]
                elif (index, k) in inner:
                    box = inner[index, k]
                    parts = leaf_parts(box.width, box.depth, box.z1, "window_glass", material)
                    placed += [(part, (box.x, box.y, box.yaw)) for part in parts]
            for part, frame in placed:
                level = wall_name(index) if part.position[2] < CUT else upper(wall_name(index))
                meshes.setdefault((level, part.material), []).append(_placed(part, frame))
        for (level, material), pieces in meshes.items():
            vertices, faces = join(pieces)
            yield Patch(level, f"{level}/opening/{material}", material, vertices, faces)


def _placed(part: Part, pose: PlanarPose) -> tuple[Array, Faces]:
    vertices, faces = tessellate(part)
    return np.column_stack([to_world(vertices[:, :2], pose), vertices[:, 2]]), faces


def _cut(parts: Iterable[Part]) -> Iterator[Part]:
    """Yield blocks, those that reach through the height `CUT` in two pieces."""
    for part in parts:
        (x, y, z), (width, depth, height) = part.position, part.size
        low, high = z - height / 2.0, z + height / 2.0
        for bottom, top in ((low, min(high, CUT)), (max(low, CUT), high)):
            if top - bottom > 1e-9:
                sides = (x - width / 2.0, x + width / 2.0), (y - depth / 2.0, y + depth / 2.0)
                yield block(part.material, *sides, (bottom, top))


def _frame(wall: Wall, opening: Opening) -> Iterator[Part]:
    """Yield the frame around a door or a window, in the wall's frame: u along the wall, v to its left."""
    if opening.kind == "passage":
        return
    material = "plastic_white" if opening.kind == "window" else "door_frame"
    wide, out = ARCHITRAVE
    (a, b), half, low, top = (
        opening.span,
        wall.thickness / 2.0 + out,
        opening.sill,
        min(opening.top + wide, wall.height),
    )
    v = (-half, half)
    posts = [block(material, span, v, (low, top)) for span in ((a - wide, a), (b, b + wide))]
    yield from _cut(posts)
    if top > opening.top:
        yield from _cut([block(material, (a, b), v, (opening.top, top))])
    if opening.kind == "window":
        yield from _cut([block(material, (a - wide, b + wide), v, (low - 0.03, low))])


def _pane(opening: Opening) -> Iterator[Part]:
    """Yield the pane of a window in its frame, in the wall's frame."""
    (a, b), (low, top), v = opening.span, (opening.sill, opening.top), (-0.02, 0.02)
    material = "plastic_white" if opening.kind == "window" else "door_frame"
    count = max(1, round(opening.width / MULLION))
    posts = np.linspace(a + RAIL / 2.0, b - RAIL / 2.0, count + 1).tolist()
    blocks = [block(material, (u - RAIL / 2.0, u + RAIL / 2.0), v, (low, top)) for u in posts]
    for left, right in pairwise(posts):
        span = (left + RAIL / 2.0, right - RAIL / 2.0)
        blocks += [block(material, span, v, z) for z in ((low, low + RAIL), (top - RAIL, top))]
        blocks.append(block("window_glass", span, (-0.005, 0.005), (low + RAIL, top - RAIL)))
    yield from _cut(blocks)


def _exit_leaf(doorway: Doorway) -> PlanarPose:
    """Return the pose of the closed leaf of an exit: its middle, with the front toward the space inside."""
    x, y, yaw = doorway.side(doorway.spaces[0])
    depth = min(RECESS, doorway.thickness / 2.0)
    return x + np.sin(yaw) * depth, y - np.cos(yaw) * depth, yaw


def _dressing(floor: Floor, wall: Wall, opening: Opening, number: int) -> Iterator[Part]:
    """Yield the sill and the blind of a window towards the space in front of it, in the wall's frame.

    Args:
        number: of the window; neighbors have their blinds at different heights.
    """
    for side in (1.0, -1.0):
        face = side * wall.thickness / 2.0
        (space,) = spaces_at(floor, to_world([(opening.position, face + side * BEYOND)], (*wall.start, wall.yaw)))
        if space < 0:
            continue
        (a, b), (low, top) = opening.span, (opening.sill, opening.top)
        yield from _cut([block("plastic_white", (a - 0.04, b + 0.04), (face, face + side * SILL), (low - 0.025, low))])
        kind = floor.spaces[space].finishes.blinds
        drop = DROPS[number % len(DROPS)] * (top - low)
        v = side * min(0.05, wall.thickness / 2.0 - 0.01)
        span = (a + RAIL, b - RAIL)
        if kind == "none" or drop == 0.0:
            continue
        yield from _cut([block("blind", span, (v - 0.02, v + 0.02), (top - 0.05, top))])
        if kind == "roller":
            yield from _cut([block("blind", span, (v - 0.001, v + 0.001), (top - drop, top - 0.05))])
            continue
        for z in np.arange(top - 0.09, top - drop, -SLAT).tolist():
            yield from _cut([block("blind", span, (v - 0.011, v + 0.011), (z, z + 0.004))])


def leaf_material(floor: Floor, doorway: Doorway) -> str:
    """Return the material of the leaf of a door."""
    return DOORS[floor.space(doorway.spaces[0]).finishes.doors]


def leaf_parts(width: float, thickness: float, height: float, glass: str, material: str) -> Iterator[Part]:
    """Yield the parts of a leaf of a door in its own frame: x along its width, origin in the middle of its bottom."""
    half, v = width / 2.0, (-thickness / 2.0, thickness / 2.0)
    leaves = ((-half, -0.004), (0.004, half)) if width > DOUBLE else ((-half, half),)
    blocks: list[Part] = []
    for low, high in leaves:
        wide = high - low
        pane = (low + 0.34 * wide, low + 0.66 * wide) if width > DOUBLE else (low + 0.56 * wide, low + 0.80 * wide)
        z = (0.48 * height, 0.88 * height)
        blocks += [block(material, span, v, (0.01, height - 0.01)) for span in ((low, pane[0]), (pane[1], high))]
        blocks += [block(material, pane, v, span) for span in ((0.01, z[0]), (z[1], height - 0.01))]
        blocks.append(block(glass, pane, (-0.004, 0.004), z))
        for side in (-1.0, 1.0):
            face = side * thickness / 2.0
            blocks.append(block("stainless", (low + 0.06, high - 0.06), (face, face + side * 0.002), (0.02, 0.24)))
            ends = (low, high) if width <= DOUBLE else ((high,) if low < 0.0 else (low,))
            for end in ends:
                inward = 1.0 if end == low else -1.0
                handle = (end + inward * 0.05, end + inward * 0.17)
                blocks.append(block("stainless", handle, (face + side * 0.03, face + side * 0.05), (1.02, 1.045)))
                stem = (end + inward * 0.05, end + inward * 0.07)
                blocks.append(block("stainless", stem, (face, face + side * 0.05), (1.02, 1.045)))
    yield from _cut(blocks)
