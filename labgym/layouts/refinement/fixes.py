"""Updates that a blockage suggests: turns of pieces that face a wall, translations of what is in the way."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

from labgym.geometry import OrientedBox, wrap_angle
from labgym.layouts.model import Layout
from labgym.layouts.moves import Move, Rotate, may_move
from labgym.layouts.refinement.blockages import Blockage, gap
from labgym.layouts.rules.building import building_of
from labgym.navigation import PLANNING_RADIUS, STAND_OFF, goal_pose

MARGIN = 0.02
"""Added to every translation, meters."""
FARTHEST = 4.0
"""Longest translation that is suggested, meters."""

Axis = Literal["x", "y"]
AXES: tuple[tuple[Axis, float, float], ...] = (("x", 1.0, 0.0), ("y", 0.0, 1.0))


@dataclass(frozen=True)
class Translation:
    """A suggestion (o, d, delta): an object, an axis of the floor's frame, and a signed distance in meters."""

    id: str
    axis: Axis
    delta: float

    @property
    def command(self) -> Move:
        """The edit of the layout."""
        return Move(self.id, self.delta, 0.0) if self.axis == "x" else Move(self.id, 0.0, self.delta)


def rotation_fixes(layout: Layout, blockage: Blockage) -> tuple[Rotate, ...]:
    """Return the turn of a piece that faces a wall: its back to that wall, or else to the greatest free depth.

    A piece faces a wall if the robot does not fit between the two. Nothing is suggested for a piece that is fixed, that
    faces the room, or for which no other quarter has a place for the robot.
    """
    root = _root(layout, blockage.location)
    if root is None or blockage.cause == "path_blocked" or not may_move(layout, root):
        return ()
    building, box = building_of(layout), layout.box(root)
    if building.ahead(box) >= STAND_OFF + PLANNING_RADIUS and blockage.cause not in ("start_outside", "goal_outside"):
        return ()
    turned = [replace(box, yaw=wrap_angle(box.yaw + quarter * math.pi / 2.0)) for quarter in (2, 1, 3)]
    roomy = [candidate for candidate in turned if building.roomy(*goal_pose(candidate)[:2], PLANNING_RADIUS)]
    if not roomy:
        return ()
    best = roomy[0] if roomy[0] is turned[0] else max(roomy, key=building.ahead)
    return (Rotate(root, round(best.yaw, 9)),)


def translations(layout: Layout, blockage: Blockage) -> tuple[Translation, ...]:
    """Return the translations that free the disc of a blockage, the shortest first.

    Each object that may move is pushed out of the disc along either axis, in either direction. If an end is blocked,
    the piece at which the robot works can move instead, and the disc moves with it.
    """
    suggestions: list[Translation] = []
    for item in blockage.objects:
        if may_move(layout, item):
            suggestions += _pushes(item, layout.box(item), blockage)
    root = _root(layout, blockage.location)
    if root is not None and blockage.cause in ("start_blocked", "goal_blocked") and may_move(layout, root):
        for item in blockage.objects:
            if item != root:
                opposite = _pushes(root, layout.box(item), blockage)
                suggestions += [replace(push, delta=-push.delta) for push in opposite]
    return tuple(sorted(suggestions, key=lambda push: (abs(push.delta), push.id, push.axis, push.delta)))


def responsible(layout: Layout, blockage: Blockage) -> tuple[Translation, ...]:
    """Return the shortest translation of each object that is in the way."""
    shortest: dict[str, Translation] = {}
    for push in translations(layout, blockage):
        if push.id in blockage.objects:
            shortest.setdefault(push.id, push)
    return tuple(shortest.values())


def deduplicated(suggestions: Iterable[Translation]) -> tuple[Translation, ...]:
    """Return one translation for each object and axis, the one with the largest distance."""
    largest: dict[tuple[str, str], Translation] = {}
    for one in suggestions:
        key = (one.id, one.axis)
        if key not in largest or abs(one.delta) > abs(largest[key].delta):
            largest[key] = one
    return tuple(largest.values())


def _pushes(item: str, box: OrientedBox, blockage: Blockage) -> Iterator[Translation]:
    """Yield the least translation of a box along each axis and direction that leaves the disc free."""
    for axis, dx, dy in AXES:
        for sign in (1.0, -1.0):
            distance = _least(box, blockage, sign * dx, sign * dy)
            if distance is not None:
                yield Translation(item, axis, round(sign * (distance + MARGIN), 6))


def _least(box: OrientedBox, blockage: Blockage, dx: float, dy: float) -> float | None:
    """Return how far a box moves along a unit vector until it leaves the disc, None beyond `FARTHEST`.

    The distance of a convex shape from a point is convex along a line, so that it exceeds the radius from there on.
    """

    def free(distance: float) -> bool:
        moved = replace(box, x=box.x + distance * dx, y=box.y + distance * dy)
        return gap(moved, blockage.point) >= blockage.radius

    if not free(FARTHEST):
        return None
    near, far = 0.0, FARTHEST
    while far - near > 1e-4:
        middle = (near + far) / 2.0
        near, far = (near, middle) if free(middle) else (middle, far)
    return far


def _root(layout: Layout, location: str) -> str | None:
    placement = layout.find(location)
    return None if placement is None else layout.root(placement.id).id
