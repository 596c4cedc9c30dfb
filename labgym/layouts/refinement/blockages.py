"""Where the robot gets stuck on an infeasible transition, how deeply, and on what."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import OrientedBox
from labgym.layouts.model import Layout
from labgym.layouts.moves import may_move
from labgym.layouts.placement import FLOOR, Placement
from labgym.navigation import PLANNING_RADIUS, Transition
from labgym.navigation.clearance import Obstacles
from labgym.navigation.grid_search import astar
from labgym.navigation.occupancy import RESOLUTION, occupancy

GRID_ERROR = 2.0 * RESOLUTION
"""Room that a grid asks for beyond the disc: a cell of the obstacle and one of the disc, meters."""
DETOUR_COST = 40.0
"""Cost of a meter of path per meter of overlap between the disc and movable furniture."""

Cause = Literal["start_blocked", "goal_blocked", "start_outside", "goal_outside", "path_blocked"]


@dataclass(frozen=True)
class Blockage:
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


def blockages(layout: Layout, transition: Transition, on_grid: bool = False) -> tuple[Blockage, ...]:
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


def _ends(layout: Layout, transition: Transition, radius: float) -> Iterator[Blockage]:
    outside = transition.failure == "outside_room"
    for end in transition.ends:
        pose = transition.start if end == "start" else transition.goal
        location = transition.start_location if end == "start" else transition.goal_location
        if pose is None:
            continue
        place = _blockage(layout, "start_blocked" if end == "start" else "goal_blocked", location, pose[:2], radius)
        if outside or not place.objects:
            cause: Cause = "start_outside" if end == "start" else "goal_outside"
            place = Blockage(cause, location, pose[:2], radius)
        yield place


def _waypoints(layout: Layout, transition: Transition, radius: float) -> Iterator[Blockage]:
    """Yield, for each stretch of the path on which the disc overlaps furniture, the place where it is deepest."""
    if transition.start is None or transition.goal is None:
        return
    movable = {item.id for item in _floor_objects(layout) if may_move(layout, item.id)}
    carried = {item.id for item in layout.placements if layout.root(item.id).id in movable}
    rest = layout.replace(placements=tuple(item for item in layout.placements if item.id not in carried))
    grid = occupancy(rest).dilated(PLANNING_RADIUS)
    boxes = Obstacles(solid for item in sorted(carried) for solid in layout.solids(item))
    xs, ys = grid.centres()
    cells = np.stack(np.meshgrid(xs, ys), axis=-1).reshape(-1, 2)
    overlap = np.maximum(radius - boxes.nearest(cells), 0.0).reshape(grid.shape)
    path = astar(grid, transition.start[:2], transition.goal[:2], 1.0 + DETOUR_COST * overlap)
    if path is None:
        return
    depths = np.maximum(radius - boxes.nearest(path), 0.0)
    for blocked, run in groupby(range(len(path)), key=lambda index: bool(depths[index] > 0.0)):
        if blocked:
            x, y = path[max(run, key=lambda index: (float(depths[index]), -index))].tolist()
            yield _blockage(layout, "path_blocked", transition.goal_location, (x, y), radius)


def _blockage(layout: Layout, cause: Cause, location: str, point: tuple[float, float], radius: float) -> Blockage:
    reach = {item.id: radius - gap(layout.box(item.id), point) for item in _floor_objects(layout)}
    objects = sorted((item for item, depth in reach.items() if depth > 0.0), key=lambda item: (-reach[item], item))
    return Blockage(cause, location, point, radius, tuple(objects), reach[objects[0]] if objects else 0.0)


def gap(box: OrientedBox, point: Sequence[float] | NDArray[np.float64]) -> float:
    """Return the distance of a point (x, y) from a box's footprint, meters; 0 inside."""
    return float(Obstacles([box]).nearest(np.asarray([point], dtype=np.float64))[0])


def _floor_objects(layout: Layout) -> tuple[Placement, ...]:
    return tuple(item for item in layout.placements if item.support == FLOOR)
