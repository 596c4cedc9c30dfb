"""Navigation by the released rules: goal poses of two kinds, and paths on a grid of 5 mm."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from labgym.paper.labbuilder.frame import WALL_THICKNESS
from labgym.paper.labbuilder.scene import key
from labgym.paper.labbuilder_rules.stage import Piece, RatedScene, Stage

GoalRule = Literal["released", "published"]
"""`released`: half of the short side and 0.5 m in front, as the program has it; `published`: half of the long side and
0.6 m, as in the authors' goal_pairs.json."""
GOAL_RULES: tuple[GoalRule, ...] = ("released", "published")
RADIUS, PIXELS = 0.3, 200
"""Radius of the robot, meters, and pixels per meter."""
STAND_OFF: dict[GoalRule, float] = {"released": RADIUS + 0.2, "published": 0.6}
OUTSIDE, SAME = 0.01, 0.01
"""How far a goal may be outside of the room, and distance below which two goals are one; meters."""
NEAR = 0.3
"""Greatest distance between a goal pose of a file and that of the object which it belongs to, meters."""
SPECIAL = {"labbench": "ExperimentalPlatform", "bench": "ExperimentalPlatform", "hood": "FumeHood"}
"""Objects that the program takes for other names of places."""


@dataclass(frozen=True)
class Goal:
    """A goal: the object that it belongs to, its pose, and whether the object would be turned for it."""

    piece: Piece
    x: float
    y: float
    turned: bool = False


class Navigation:
    """Paths in a scene; the grid is computed once for both rules of goals."""

    def __init__(self, stage: Stage) -> None:
        self.stage = stage

    def paths(self, rule: GoalRule) -> tuple[int, int]:
        """Return the number of paths by a rule of goals, and of those that the robot can drive.

        Both are 0 if the scene does not state its room.
        """
        if self.stage.scene.room is None:
            return 0, 0
        goals = [goal for place in self.stage.scene.places if (goal := self._goal(place, rule)) is not None]
        if not self.stage.reading.literal("keys"):
            drives = [pair for pair in pairwise(goals) if not _same(*pair)]
            return len(drives), sum(self._connected(*pair) for pair in drives)
        results = {
            (start.piece.id, end.piece.id): _same(start, end) or self._connected(start, end)
            for start, end in pairwise(goals)
        }
        further = int(any(goal.turned for goal in goals))
        return len(results) + further, sum(results.values()) + further

    def _size(self, piece: Piece) -> tuple[float, float] | None:
        """Return the sides along x and y at 0 degrees; None if navigation does not know the object."""
        if not self.stage.reading.literal("exact"):
            return self.stage.sides(piece)[:2]
        entry = self.stage.library.last(piece.id)
        return None if entry is None else self.stage.own_sides(piece, entry)[:2]

    def _goal(self, place: str, rule: GoalRule) -> Goal | None:
        piece = _placed(self.stage.scene.pieces, place)
        size = None if piece is None else self._size(piece)
        if piece is None or size is None:
            return None
        reach = (size[1] if rule == "released" else size[0]) / 2 + STAND_OFF[rule]
        yaw = math.radians(piece.degrees)
        dx, dy = -reach * math.sin(yaw), reach * math.cos(yaw)
        ahead, behind = (piece.x + dx, piece.y + dy), (piece.x - dx, piece.y - dy)
        room = self.stage.room_piece if rule == "released" and self.stage.reading.literal("flip") else None
        turned = room is not None and not self._inside(room, *ahead) and self._inside(room, *behind)
        return Goal(piece, *(behind if turned else ahead), turned)

    def _outline(self) -> tuple[float, float, float, float]:
        """Return the least x and y of the room, walls included, and its extents."""
        scene = self.stage.scene
        width, depth = scene.room or (0.0, 0.0)
        room = scene.pieces[0] if self.stage.reading.literal("room") and scene.pieces else self.stage.room_piece
        x, y = (width / 2, depth / 2) if room is None else (room.x, room.y)
        return x - width / 2, y - depth / 2, width, depth

    def _inside(self, room: Piece, x: float, y: float) -> bool:
        width, depth = self.stage.scene.room or (0.0, 0.0)
        margin = WALL_THICKNESS - OUTSIDE
        return abs(x - room.x) <= width / 2 - margin and abs(y - room.y) <= depth / 2 - margin

    def _connected(self, start: Goal, end: Goal) -> bool:
        regions = [self._region(goal.x, goal.y) for goal in (start, end)]
        return regions[0] == regions[1] > 0

    def _pixel(self, x: float, y: float) -> tuple[int, int]:
        left, front, _, depth = self._outline()
        return int((x - left) * PIXELS), int(depth * PIXELS) - 1 - int((y - front) * PIXELS)

    def _region(self, x: float, y: float) -> int:
        column, row = self._pixel(x, y)
        inside = 0 <= column < self._regions.shape[1] and 0 <= row < self._regions.shape[0]
        return int(self._regions[row, column]) if inside else 0

    @cached_property
    def _regions(self) -> NDArray[Any]:
        """The number of the region that each pixel belongs to, 0 where the robot does not fit."""
        from PIL import Image, ImageDraw
        from scipy import ndimage

        _, _, width, depth = self._outline()
        image = Image.new("L", (int(width * PIXELS), int(depth * PIXELS)), 1)
        draw = ImageDraw.Draw(image)
        if not self.stage.reading.literal("walls"):
            draw.rectangle((0, 0, image.width - 1, image.height - 1), outline=0, width=round(WALL_THICKNESS * PIXELS))
        for piece in self.stage.pieces:
            if piece.on_floor:
                size = self._size(piece)
                corners = [self._pixel(piece.x, piece.y)] if size is None else list(self._corners(piece, *size))
                (draw.point if size is None else draw.polygon)(corners, fill=0)
        free = np.asarray(image) > 0
        if not free.all():  # Without an obstacle the distance is undefined.
            free = ndimage.distance_transform_edt(free) > int(RADIUS * PIXELS)
        return np.asarray(ndimage.label(free, structure=np.ones((3, 3)))[0])

    def _corners(self, piece: Piece, width: float, depth: float) -> Iterable[tuple[int, int]]:
        yaw = math.radians(piece.degrees)
        cosine, sine = math.cos(yaw), math.sin(yaw)
        for fx, fy in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
            x, y = fx * width / 2, fy * depth / 2
            yield self._pixel(x * cosine - y * sine + piece.x, x * sine + y * cosine + piece.y)


def goal_places(scene: RatedScene, stage: Stage, goals: Sequence[tuple[float, float]]) -> tuple[str, ...]:
    """Return the names of the objects that the goal poses of a file belong to, by the rule `published`.

    Args:
        scene, stage: the scene. goals: x, y in its frame, meters; a pose farther than `NEAR` from all is left out.
    """
    fronts = []
    for piece in scene.pieces:
        if piece.on_floor and not piece.is_room:
            yaw, reach = math.radians(piece.degrees), stage.sides(piece)[0] / 2 + STAND_OFF["published"]
            fronts.append((piece.id, piece.x - reach * math.sin(yaw), piece.y + reach * math.cos(yaw)))
    names = []
    for x, y in goals:
        name, fx, fy = min(fronts, key=lambda front: math.hypot(front[1] - x, front[2] - y), default=("", x, y))
        if name and math.hypot(fx - x, fy - y) <= NEAR:
            names.append(name)
    return tuple(names)


def _placed(pieces: Sequence[Piece], place: str) -> Piece | None:
    """Return the first object that a place names: with the same letters, else one name beginning with the other."""
    wanted = key(SPECIAL.get(key(place), place))
    names = [(key(piece.id), piece) for piece in pieces]
    exact = (piece for name, piece in names if name == wanted)
    alike = (piece for name, piece in names if name.startswith(wanted) or wanted.startswith(name))
    return next(exact, None) or next(alike, None)


def _same(start: Goal, end: Goal) -> bool:
    return math.hypot(end.x - start.x, end.y - start.y) < SAME
