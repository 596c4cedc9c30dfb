"""Chemistry by flags: constraints C1 and C3 to C8, the curve of satisfaction, and the four categories."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal, NamedTuple

from labgym.paper.labbuilder.scene import key
from labgym.paper.labbuilder_rules.bodies import CM, Body, excess
from labgym.paper.labbuilder_rules.library import REAGENT
from labgym.paper.labbuilder_rules.quirks import Reading
from labgym.paper.labbuilder_rules.stage import CABINET, FLOOR_KINDS, Piece, Stage, names_cabinet, snake

Category = Literal["flam", "store", "incomp", "glass"]
DISTANCE_CM, EDGE_CM = 150.0, 30.0
"""Least distance of a pair, between centers in the plane, and of glass from the edge of its surface."""
LAYER = 0.1
"""Difference in height above which two reagents of a cabinet are on different layers, meters."""
WORST = 3
"""Number of constraints that flam and incomp average, the worst ones."""


class Kind(NamedTuple):
    """A kind of constraint: its category, its weight in the overall score, and the flags of a pair's ends."""

    category: Category
    weight: int
    flags: tuple[str, str] | None = None


KINDS: Mapping[str, Kind] = {
    "C1": Kind("flam", 5, ("flammable", "heat_source")),
    "C3": Kind("store", 5),
    "C5": Kind("incomp", 4, ("flammable", "oxidizer")),
    "C6": Kind("incomp", 4, ("acid", "base")),
    "C7": Kind("incomp", 3, ("oxidizer", "flammable")),
    "C8": Kind("incomp", 2, ("reactive_metal", "acid")),
    "C4": Kind("glass", 3),
}
CATEGORIES: tuple[Category, ...] = ("flam", "store", "incomp", "glass")
KNOWN = {
    **{kind.lower(): kind for kind in FLOOR_KINDS},
    **{snake(kind): kind for kind in FLOOR_KINDS[:5]},
}
"""Surfaces by the spellings that the evaluator of edges knows; it knows two of them in one spelling only."""


@dataclass(frozen=True)
class Constraint:
    """A constraint and how far it is satisfied.

    Attributes:
        kind: key of `KINDS`. pieces: the object or the two objects that it names.
        satisfaction: 0 to 1. attainable: of a C4, what the best place on its surface would give; else 1.
    """

    kind: str
    pieces: tuple[Piece, ...]
    satisfaction: float
    attainable: float = 1.0


@dataclass(frozen=True)
class Chemistry:
    """The constraints of a scene and their scores.

    Attributes:
        constraints: all of them. scores: of the categories; None if it does not apply.
        glassware: glass without reagents. ceiling: greatest glass that the surfaces admit, each object alone on its
            own; None if they do not apply.
        overall: mean of all satisfactions by weight.
    """

    constraints: tuple[Constraint, ...]
    scores: Mapping[str, float | None]
    glassware: float | None
    ceiling: float | None
    overall: float | None

    def count(self, category: Category) -> int:
        """Return the number of constraints of a category."""
        return sum(KINDS[each.kind].category == category for each in self.constraints)


def satisfaction(ratio: float, reading: Reading) -> float:
    """Return how far a requirement is satisfied, from actual over required."""
    if ratio >= 1.0:
        return 1.0
    if ratio >= 0.9:
        return 0.7 + (ratio - 0.9) / 0.1 * 0.3
    if ratio < 0.7:
        return ratio * 0.3
    low = 0.2 if reading.literal("jump") else 0.21
    return low + (ratio - 0.7) / 0.2 * (0.7 - low)


def chemistry(stage: Stage) -> Chemistry:
    """Return the chemical scores of a scene."""
    constraints = tuple(_constraints(stage))
    empty = 1.0 if stage.reading.literal("empty") else None
    scores: dict[str, float | None] = {}
    for category in CATEGORIES:
        values = [each.satisfaction for each in constraints if KINDS[each.kind].category == category]
        if category in ("flam", "incomp"):
            values = sorted(values)[:WORST]
        scores[category] = _mean(values, empty)
    glass = [each for each in constraints if each.kind == "C4"]
    wares = [each.satisfaction for each in glass if stage.library.flagged(each.pieces[0].id).kind != REAGENT]
    weights = [KINDS[each.kind].weight for each in constraints]
    earned = sum(each.satisfaction * weight for each, weight in zip(constraints, weights, strict=True))
    return Chemistry(
        constraints,
        scores,
        _mean(wares, empty),
        _mean([each.attainable for each in glass], empty),
        earned / sum(weights) if weights else empty,
    )


def _constraints(stage: Stage) -> Iterator[Constraint]:
    for name, kind in KINDS.items():
        if kind.flags is not None:
            for pair in _pairs(stage, name, *kind.flags):
                yield Constraint(name, pair, _separated(stage, name, *(_judged(stage, piece) for piece in pair)))
        elif name == "C3":
            for piece in stage.pieces:
                if stage.library.flagged(piece.id).kind == REAGENT:
                    yield Constraint(name, (piece,), float(_is_stored(stage, _judged(stage, piece))))
        else:
            yield from _glass(stage)


def _flagged(stage: Stage, flag: str) -> list[Piece]:
    return [piece for piece in stage.pieces if flag in stage.library.flagged(piece.id).flags]


def _pairs(stage: Stage, name: str, first: str, second: str) -> Iterator[tuple[Piece, Piece]]:
    """Yield the pairs of a kind of constraint."""
    literal = stage.reading.literal("pairs")
    if name == "C7" and not literal:
        return
    seen: set[frozenset[int]] = set()
    for one, other in product(_flagged(stage, first), _flagged(stage, second)):
        pair = frozenset((id(one), id(other)))
        entries = stage.library.flagged(one.id), stage.library.flagged(other.id)
        if (one.id != other.id) if literal else (entries[0].id != entries[1].id and pair not in seen):
            seen.add(pair)
            yield one, other


def _judged(stage: Stage, piece: Piece) -> Piece:
    """Return the object at which a constraint on an object is judged."""
    if not stage.reading.literal("first"):
        return piece
    return next(other for other in stage.pieces if piece.id in other.id)


def _separated(stage: Stage, name: str, one: Piece, other: Piece) -> float:
    if KINDS[name].category == "incomp" and abs(one.z - other.z) > LAYER and _share_cabinet(stage, one, other):
        return 1.0
    distance = math.sqrt((one.x - other.x) ** 2 + (one.y - other.y) ** 2) * CM
    return satisfaction(distance / DISTANCE_CM, stage.reading)


def _share_cabinet(stage: Stage, one: Piece, other: Piece) -> bool:
    if stage.reading.literal("layers"):
        return names_cabinet(one.label) and names_cabinet(other.label)
    return any(_is_in(one, hollow) and _is_in(other, hollow) for hollow in map(stage.hollow, _cabinets(stage)))


def _cabinets(stage: Stage) -> list[Piece]:
    cabinets = [piece for piece in stage.pieces if piece.is_cabinet]
    return cabinets[:1] if stage.reading.literal("cabinet") else cabinets


def _is_in(piece: Piece, hollow: Body | None) -> bool:
    """Return whether an object is in a cabinet; one whose size is not known counts by the label."""
    if hollow is None:
        return key(piece.label) == key(CABINET)
    return hollow.contains(piece.x, piece.y, piece.z)


def _is_stored(stage: Stage, piece: Piece) -> bool:
    return any(_is_in(piece, stage.hollow(cabinet)) for cabinet in _cabinets(stage))


def _glass(stage: Stage) -> Iterator[Constraint]:
    for piece in _flagged(stage, "glass_container"):
        judged = _judged(stage, piece)
        surface = _surface(stage, judged)
        if surface is not None:
            body = stage.body(judged)
            edge = max(0.0, -excess(body, surface.spans()) * CM)
            short, long = sorted((body.width, body.depth))
            narrow, wide = sorted((surface.width, surface.depth))
            best = max(0.0, min(narrow - short, wide - long)) / 2 * CM
            values = [satisfaction(each / EDGE_CM, stage.reading) for each in (edge, max(edge, best))]
            yield Constraint("C4", (piece,), values[0], values[1])
        elif stage.reading.literal("unplaced"):
            yield Constraint("C4", (piece,), 1.0)
        elif not (judged.on_floor and stage.library.flagged(judged.id).kind == "room_asset"):
            yield Constraint("C4", (piece,), 0.0, 0.0)


def _surface(stage: Stage, piece: Piece) -> Body | None:
    """Return the body whose edges count for an object; None if its label names nothing.

    Surfaces are furniture: under glassware on a stand counts what carries the stand.
    """
    if not stage.reading.literal("surface"):
        below = stage.carriers(piece)
        return stage.body(below[-1]) if below else None
    name = _known(piece.label)
    found = next((other for other in stage.scene.pieces if other.on_floor and _known(other.id) == name), None)
    return None if found is None else stage.body(found)


def _known(name: str) -> str:
    return KNOWN.get(name.lower(), name)


def _mean(values: Sequence[float], empty: float | None) -> float | None:
    return sum(values) / len(values) if values else empty
