"""Where the robot gets stuck on an infeasible transition, and the updates that would free it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array, OrientedBox, wrap_angle
from labgym.layouts.model import Layout
from labgym.layouts.moves import Move, Rotate, may_move
from labgym.layouts.placement import FLOOR, Placement
from labgym.layouts.rules.building import building_of
from labgym.navigation import PLANNING_RADIUS, STAND_OFF, Transition, goal_pose
from labgym.navigation.clearance import Obstacles
from labgym.navigation.grid_search import astar
from labgym.navigation.occupancy import RESOLUTION, occupancy

GRID_ERROR = 2.0 * RESOLUTION
"""Room that a grid asks for beyond the disc: a cell of the obstacle and one of the disc, meters."""
DETOUR_COST = 40.0
"""Cost of a meter of path per meter of overlap between the disc and movable furniture."""

Cause = Literal["start_blocked", "goal_blocked", "start_outside", "goal_outside", "path_blocked"]


@dataclass(frozen=True)
class RouteBlockage:
    """A place of a transition at which the robot does not fit.

    Attributes:
        cause: what fails: an end is blocked by objects, an end lies in a wall or in no room, or the way is blocked.
        location: asset name of the end that fails; of the goal if the way is blocked.
        point: (x, y) of the disc's center, meters.
        radius: room that the disc needs around the point, meters.
        objects: floor objects that reach into this room, the deepest first.
        depth: how far the first of them reaches into it, meters; 0 without objects.
    """

    cause: Cause
    location: str
    point: tuple[float, float]
    radius: float
    objects: tuple[str, ...] = ()
    depth: float = 0.0


def blockages(layout: Layout, transition: Transition, on_grid: bool = False) -> tuple[RouteBlockage, ...]:
    """Return the places at which a transition fails: its invalid ends, or else the blocked waypoints of its path.

    The path is the one that overlaps movable furniture least. The result is empty without a failure, with a missing
    location, and where fixed objects and walls alone separate the ends.

    Args:
        on_grid: whether the transition was judged on a grid, which asks for more room.
    """
    if transition.failure in (None, "missing"):
        return ()
    radius = PLANNING_RADIUS + (GRID_ERROR if on_grid else 0.0)
    if transition.failure == "unreachable":
        return tuple(_waypoints(layout, transition, radius))
    return tuple(_ends(layout, transition, radius))


def _ends(layout: Layout, transition: Transition, radius: float) -> Iterator[RouteBlockage]:
    outside = transition.failure == "outside_room"
    for end in transition.ends:
        pose = transition.start if end == "start" else transition.goal
        location = transition.start_location if end == "start" else transition.goal_location
        if pose is None:
            continue
        place = _blockage(layout, "start_blocked" if end == "start" else "goal_blocked", location, pose[:2], radius)
        if outside or not place.objects:
            cause: Cause = "start_outside" if end == "start" else "goal_outside"
            place = RouteBlockage(cause, location, pose[:2], radius)
        yield place


def _waypoints(layout: Layout, transition: Transition, radius: float) -> Iterator[RouteBlockage]:
    """Yield, for each stretch of the path on which the disc overlaps furniture, the place where it is deepest."""
    if transition.start is None or transition.goal is None:
        return
    movable = {item.id for item in _floor_objects(layout) if may_move(layout, item.id)}
    carried = {item.id for item in layout.placements if layout.root(item.id).id in movable}
    rest = layout.replace(placements=tuple(item for item in layout.placements if item.id not in carried))
    grid = occupancy(rest).dilated(PLANNING_RADIUS)
    solids = [solid for item in sorted(carried) for solid in layout.solids(item)]
    boxes = Obstacles(solids)
    xs, ys = grid.centres()
    overlap = _overlap(solids, xs, ys, radius)
    path = astar(grid, transition.start[:2], transition.goal[:2], 1.0 + DETOUR_COST * overlap)
    if path is None:
        return
    depths = np.maximum(radius - boxes.nearest(path), 0.0)
    for blocked, run in groupby(range(len(path)), key=lambda index: bool(depths[index] > 0.0)):
        if blocked:
            x, y = path[max(run, key=lambda index: (float(depths[index]), -index))].tolist()
            yield _blockage(layout, "path_blocked", transition.goal_location, (x, y), radius)


def _overlap(boxes: Sequence[OrientedBox], xs: Array, ys: Array, radius: float) -> Array:
    """Return the depth to which a disc at each point of a grid overlaps the nearest box, (ny, nx) meters."""
    overlap = np.zeros((len(ys), len(xs)))
    for box in boxes:
        x0, y0, x1, y1 = box.bounds()
        columns = slice(*np.searchsorted(xs, (x0 - radius, x1 + radius)))
        rows = slice(*np.searchsorted(ys, (y0 - radius, y1 + radius)))
        points = np.stack(np.meshgrid(xs[columns], ys[rows]), axis=-1)
        depth = radius - Obstacles([box]).nearest(points.reshape(-1, 2)).reshape(points.shape[:2])
        np.maximum(overlap[rows, columns], depth, out=overlap[rows, columns])
    return overlap


def _blockage(layout: Layout, cause: Cause, location: str, point: tuple[float, float], radius: float) -> RouteBlockage:
    reach = {item.id: radius - gap(layout.box(item.id), point) for item in _floor_objects(layout)}
    objects = sorted((item for item, depth in reach.items() if depth > 0.0), key=lambda item: (-reach[item], item))
    return RouteBlockage(cause, location, point, radius, tuple(objects), reach[objects[0]] if objects else 0.0)


def gap(box: OrientedBox, point: Sequence[float] | NDArray[np.float64]) -> float:
    """Return the distance of a point (x, y) from a box's footprint, meters; 0 inside."""
    return float(Obstacles([box]).nearest(np.asarray([point], dtype=np.float64))[0])


def _floor_objects(layout: Layout) -> tuple[Placement, ...]:
    return tuple(item for item in layout.placements if item.support == FLOOR)


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


def rotation_fixes(layout: Layout, blockage: RouteBlockage) -> tuple[Rotate, ...]:
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


def translations(layout: Layout, blockage: RouteBlockage) -> tuple[Translation, ...]:
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


def responsible(layout: Layout, blockage: RouteBlockage) -> tuple[Translation, ...]:
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


def _pushes(item: str, box: OrientedBox, blockage: RouteBlockage) -> Iterator[Translation]:
    """Yield the least translation of a box along each axis and direction that leaves the disc free."""
    for axis, dx, dy in AXES:
        for sign in (1.0, -1.0):
            distance = _least(box, blockage, sign * dx, sign * dy)
            if distance is not None:
                yield Translation(item, axis, round(sign * (distance + MARGIN), 6))


def _least(box: OrientedBox, blockage: RouteBlockage, dx: float, dy: float) -> float | None:
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
