"""Geometry by the released rules: number of objects, out of bounds, collisions, heights."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from labgym.layouts.placement import WALL
from labgym.paper.labbuilder.scene import key
from labgym.paper.labbuilder_rules.bodies import CM, excess
from labgym.paper.labbuilder_rules.stage import CABINET, FLOOR_KINDS, Piece, Stage, snake

FLOOR_TOLERANCE_CM, SURFACE_TOLERANCE_CM = 0.5, 1.0
"""How far furniture may extend beyond the room, and an item beyond what carries it."""
DEPTH_LITERAL, DEPTH_CORRECTED = 0.05, 0.001
"""Least overlap along each axis, meters."""
FLOOR_AREA_CM2, ITEM_AREA_CM2 = 1.0, 2.0
"""Least area of an overlap between furniture, and between items."""
STACKED, STACKED_MARGIN = 0.01, 0.05
"""Least difference in height of furniture that stands on other furniture, and how far it may extend; meters."""
WORK_HEIGHT, HEIGHT_TOLERANCE = 0.8, 0.01
LAYERS = ((("acid",), 0.8), (("base",), 1.1), (("flammable", "oxidizer", "reactive_metal"), 1.3))
"""Heights in the reagent cabinet by flag, the first that applies, meters."""
TOP_LAYER = 1.5


def object_count(stage: Stage) -> int:
    """Return Obj."""
    return len(stage.scene.pieces if stage.reading.literal("obj") else stage.pieces)


def out_of_bounds(stage: Stage) -> list[Piece]:
    """Return furniture outside of the room, and items outside of what carries them."""
    return [piece for piece in stage.pieces if _is_out(stage, piece)]


def _is_out(stage: Stage, piece: Piece) -> bool:
    body = stage.body(piece)
    if stage.stands(piece):
        return excess(body, stage.interior) * CM > FLOOR_TOLERANCE_CM
    if piece.label == WALL:
        return False
    literal = stage.reading.literal("surface")
    carrier = _first_named(stage, piece.label) if literal else stage.carrier(piece)
    if carrier is None:
        return not stage.reading.literal("unplaced")
    surface = stage.body(carrier, piece.label if literal else None)
    return excess(body, surface.spans()) * CM > SURFACE_TOLERANCE_CM


def _first_named(stage: Stage, label: str) -> Piece | None:
    name = snake(label)
    return next((p for p in stage.pieces if stage.stands(p) and (p.id in (label, name) or snake(p.id) == name)), None)


def collisions(stage: Stage) -> list[tuple[Piece, Piece]]:
    """Return the pairs of objects that collide."""
    depth = DEPTH_LITERAL if stage.reading.literal("depth") else DEPTH_CORRECTED
    bodies = {id(piece): stage.body(piece) for piece in stage.pieces}
    colliding = []
    for one, other in _compared(stage):
        first, second = bodies[id(one)], bodies[id(other)]
        both = stage.stands(one) and stage.stands(other)
        if not first.overlaps(second, depth) or (both and _is_stacked(stage, one, other)):
            continue
        if first.shared_area(second) * CM**2 >= (FLOOR_AREA_CM2 if both else ITEM_AREA_CM2):
            colliding.append((one, other))
    return colliding


def _compared(stage: Stage) -> Iterator[tuple[Piece, Piece]]:
    if not stage.reading.literal("groups"):
        carriers = {id(piece): {id(one) for one in stage.carriers(piece)} for piece in stage.pieces}
        for one, other in combinations(stage.pieces, 2):
            if id(one) not in carriers[id(other)] and id(other) not in carriers[id(one)]:
                yield one, other
        return
    groups: dict[str | None, list[Piece]] = {}
    for piece in stage.pieces:
        groups.setdefault(None if stage.stands(piece) else piece.label, []).append(piece)
    for group in groups.values():
        yield from combinations(group, 2)


def _is_stacked(stage: Stage, one: Piece, other: Piece) -> bool:
    if abs(one.z - other.z) <= STACKED:
        return False
    upper, lower = (one, other) if one.z > other.z else (other, one)
    return excess(stage.body(upper), stage.body(lower).spans()) <= STACKED_MARGIN


def height_errors(stage: Stage) -> list[Piece]:
    """Return the items that do not stand at the height of their surface or layer."""
    errors = []
    for piece in stage.pieces:
        height = None if stage.stands(piece) else _expected_height(stage, piece)
        if height is not None and abs(piece.z - height) > HEIGHT_TOLERANCE:
            errors.append(piece)
    return errors


def _expected_height(stage: Stage, piece: Piece) -> float | None:
    """Return the height of an item's bottom; None if none is required."""
    literal = stage.reading.literal("snake")
    name = piece.label if literal else next((kind for kind in FLOOR_KINDS if key(kind) == key(piece.label)), "")
    if name in (CABINET, "reagent_cabinet"):
        entry = stage.library.find(piece.id)
        flags = frozenset() if entry is None else entry.flags
        return next((height for any_of, height in LAYERS if flags.intersection(any_of)), TOP_LAYER)
    return WORK_HEIGHT if name in FLOOR_KINDS else None
