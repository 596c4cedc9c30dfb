"""A layout for the planar kernel, and what a single environment reads from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.bodies import BodyShape
from labgym.envs.conditions.glass import NORMAL, GlassPresence
from labgym.envs.conditions.panes import FRAMED, FRAMELESS
from labgym.envs.planar.body import PlanarBody, body_of
from labgym.envs.planar.compiled import compiled, entry, inlined
from labgym.envs.planar.plan import Outlines, PlanarPlan, Solid, hull, outlines, plan_of, solids_of
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import LIDAR_RAYS
from labgym.envs.simulation import Pose
from labgym.envs.world import World
from labgym.layouts import Layout
from labgym.navigation.barriers import Barriers

if TYPE_CHECKING:
    from labgym.envs.state import State

BINS = 1024
"""Number of bins of the table from directions to rays."""


class Beams(NamedTuple):
    """The rays of the lidar in the robot frame, by rising direction.

    A direction is measured by `diamond`, which rises with the angle from -2 to 2 and needs no arc tangent.

    Attributes:
        x, y: (n,) unit vectors. order: (n,) their directions, rising.
        table: (BINS + 1,) the first ray that may be at or beyond the lower end of each bin.
    """

    x: Array
    y: Array
    order: Array
    table: NDArray[np.int64]


def lidar_beams(rays: int = LIDAR_RAYS) -> Beams:
    """Return the rays of `labgym.envs.sensors.Lidar`; ray 0 points backwards."""
    angle = -math.pi + 2.0 * math.pi / rays * np.arange(rays)
    x, y = np.cos(angle), np.sin(angle)
    y[0] = 0.0
    order = np.array([diamond(float(a), float(b)) for a, b in zip(x, y, strict=True)])
    order[0] = -2.0
    table = np.searchsorted(order, -2.0 + 4.0 / BINS * np.arange(BINS + 1)).astype(np.int64)
    return Beams(x, y, order, table)


@compiled
def diamond(x: float, y: float) -> float:
    """Return the direction of a vector other than 0, in (-2, 2]: 0 along x, 1 along y, 2 along -x."""
    size = abs(x) + abs(y)
    if x >= 0.0:
        return y / size
    return 2.0 - y / size if y >= 0.0 else -2.0 - y / size


class LidarPose(NamedTuple):
    """The pose of a lidar: x and y, meters, cosine and sine of its yaw."""

    x: float
    y: float
    cosine: float
    sine: float


@compiled
def scan(
    x: float, y: float, yaw: float, walls: Outlines, beams: Beams, reach: float, ranges: NDArray[np.float32]
) -> None:
    """Write the ranges (n,) from a pose, in meters, at most `reach`."""
    for k in range(len(beams.x)):
        ranges[k] = reach
    _sweep(LidarPose(x, y, math.cos(yaw), math.sin(yaw)), 0, len(walls.first) - 1, walls, beams, reach, ranges)


@inlined
def _sweep(
    eye: LidarPose, begin: int, end: int, walls: Outlines, beams: Beams, reach: float, ranges: NDArray[np.float32]
) -> None:
    """Shorten the ranges (n,) from a pose to the outlines from `begin` to `end` - 1, meters.

    A convex outline shows the sides whose front the robot is on. Going around counter-clockwise, their directions fall,
    so each covers the rays between those of its two ends; neighbors share an end and leave no gap.
    """
    x, y, cosine, sine = eye
    rays = len(beams.x)
    for outline in range(begin, end):
        first, last = walls.first[outline], walls.first[outline + 1]
        end_direction = math.nan
        for k in range(first, last):
            ax, ay = walls.corners[k, 0] - x, walls.corners[k, 1] - y
            gap = -(ax * walls.normals[k, 0] + ay * walls.normals[k, 1])
            if gap <= 0.0 or gap >= reach:
                end_direction = math.nan
                continue
            following = k + 1 if k + 1 < last else first
            bx, by = walls.corners[following, 0] - x, walls.corners[following, 1] - y
            if math.isnan(end_direction):
                begin_direction = diamond(cosine * ax + sine * ay, cosine * ay - sine * ax)
            else:
                begin_direction = end_direction
            end_direction = diamond(cosine * bx + sine * by, cosine * by - sine * bx)
            nx = cosine * walls.normals[k, 0] + sine * walls.normals[k, 1]
            ny = cosine * walls.normals[k, 1] - sine * walls.normals[k, 0]
            low, high = _first(end_direction, beams), _first(begin_direction, beams)
            if end_direction <= begin_direction:
                _range(low, high, -gap, nx, ny, beams, ranges)
            else:  # the side crosses the direction backwards
                _range(low, rays, -gap, nx, ny, beams, ranges)
                _range(0, high, -gap, nx, ny, beams, ranges)


class ShownShapes(NamedTuple):
    """Panes and bodies of an episode, which a lidar sees besides the walls.

    Attributes:
        panes: outlines of glass, which a lidar sees near its normal only. cosine: least of the angle to the normal.
        shapes: outlines of bodies in their own frames. places: (m, 4) x, y, yaw and number of the outline of each body.
    """

    panes: Outlines
    cosine: float
    shapes: Outlines
    places: Array


@compiled
def scan_shown(
    x: float, y: float, yaw: float, shown: ShownShapes, beams: Beams, reach: float, ranges: NDArray[np.float32]
) -> None:
    """Shorten the ranges (n,) from a pose to what an episode shows besides the walls, meters."""
    panes, least, shapes, places = shown
    if len(panes.first) > 1:
        _scan_glass(LidarPose(x, y, math.cos(yaw), math.sin(yaw)), panes, least, beams, reach, ranges)
    for k in range(len(places)):
        outline = int(places[k, 3])
        dx, dy = x - places[k, 0], y - places[k, 1]
        if dx * dx + dy * dy > (reach + 1.0) * (reach + 1.0):
            continue
        # From the pose in the frame of the body.
        c, s = math.cos(places[k, 2]), math.sin(places[k, 2])
        turn = yaw - places[k, 2]
        eye = LidarPose(c * dx + s * dy, c * dy - s * dx, math.cos(turn), math.sin(turn))
        _sweep(eye, outline, outline + 1, shapes, beams, reach, ranges)


@compiled
def _scan_glass(
    eye: LidarPose, panes: Outlines, least: float, beams: Beams, reach: float, ranges: NDArray[np.float32]
) -> None:
    """Shorten the ranges (n,) to glass where the rays meet it near its normal; others pass all of it, meters."""
    x, y, cosine, sine = eye
    rays = len(beams.x)
    nearest, own = np.full(rays, np.float32(reach)), np.empty(rays, np.float32)
    normal = np.zeros(rays)
    for outline in range(len(panes.first) - 1):
        own[:] = nearest
        _sweep(eye, outline, outline + 1, panes, beams, reach, own)
        for k in range(rays):
            if own[k] < nearest[k]:
                nearest[k] = own[k]
                bx, by = cosine * beams.x[k] - sine * beams.y[k], sine * beams.x[k] + cosine * beams.y[k]
                normal[k] = _cosine_at(x + own[k] * bx, y + own[k] * by, bx, by, outline, panes)
    for k in range(rays):
        if nearest[k] < ranges[k] and normal[k] >= least:
            ranges[k] = nearest[k]


@compiled
def _cosine_at(x: float, y: float, bx: float, by: float, outline: int, panes: Outlines) -> float:
    """Return the cosine between a ray and the normal of the side of an outline on which a point lies."""
    best, cosine = math.inf, 0.0
    for k in range(panes.first[outline], panes.first[outline + 1]):
        nx, ny = panes.normals[k, 0], panes.normals[k, 1]
        off = abs((x - panes.corners[k, 0]) * nx + (y - panes.corners[k, 1]) * ny)
        along = -(bx * nx + by * ny)
        if along > 0.0 and off < best:
            best, cosine = off, along
    return cosine


@compiled
def _first(direction: float, beams: Beams) -> int:
    """Return the first ray at or beyond a direction."""
    ray = beams.table[int((direction + 2.0) * (BINS / 4.0))]
    while ray < len(beams.order) and beams.order[ray] < direction:
        ray += 1
    return int(ray)


@compiled
def _range(begin: int, end: int, gap: float, nx: float, ny: float, beams: Beams, ranges: NDArray[np.float32]) -> None:
    """Shorten the ranges of some rays to their distance from a line at the signed distance `gap` along its normal."""
    for k in range(begin, end):
        along = beams.x[k] * nx + beams.y[k] * ny
        if along * ranges[k] < gap:
            ranges[k] = gap / along


Array = NDArray[np.float64]

RADIUS = ROBOT.chassis_radius
"""Radius of the disc that clearances belong to, meters."""


class Boxes(NamedTuple):
    """The barriers of a floor, from which clearances are measured.

    Attributes:
        center: (n, 2). half: (n, 2) half extents. axis: (n, 2) unit vector of each box's own x.
    """

    center: Array
    half: Array
    axis: Array


class PlanarScene(NamedTuple):
    """A layout for the kernel.

    Attributes:
        plan: what the robot touches and the lidar sees. body: the robot. boxes: the barriers.
    """

    plan: PlanarPlan
    body: PlanarBody
    boxes: Boxes


def scene_of(world: World) -> PlanarScene:
    """Return the scene of a world; it is built once.

    Raises:
        OptionError: the world has solids that move or are neither boxes nor meshes.
    """
    return world.derived(
        "planar scene",
        lambda layout: PlanarScene(plan_of(world.model), body_of(world.model), boxes_of(Barriers.of(layout))),
    )


def boxes_of(barriers: Barriers) -> Boxes:
    """Return barriers as arrays."""
    boxes = barriers.obstacles.boxes
    axis = np.column_stack([np.cos(boxes.yaw), np.sin(boxes.yaw)])
    return Boxes(*(np.ascontiguousarray(array, dtype=np.float64) for array in (boxes.centre, boxes.half, axis)))


def ranges(
    world: World, pose: Pose, rays: int, reach: float, height: float, shown: ShownShapes | None = None
) -> NDArray[np.float32]:
    """Return what a lidar reads from a pose: (rays,) meters, at most `reach`.

    Args:
        height: of its plane above the floor, meters. shown: what the episode shows; None for the solids of the layout.
    """
    readings = np.empty(rays, np.float32)
    if shown is None:
        _scan(*pose, walls_at(world, height), beams(rays), reach, readings)
    else:
        _scan_among(pose, walls_at(world, height, shown), shown, beams(rays), reach, readings)
    return readings


def walls_at(world: World, height: float, shown: ShownShapes | None = None) -> Outlines:
    """Return what a lidar sees in a plane at a height in meters; without glass if an episode shows panes apart."""
    if shown is not None and len(shown.panes.reach):
        return glass_at(world, height)[0]
    if height == ROBOT.lidar_height:
        return scene_of(world).plan.walls

    def build(_: object) -> Outlines:
        return _sections(solids_of(world.model), height)

    return world.derived(f"planar walls at {height!r}", build)


def glass_at(world: World, height: float) -> tuple[Outlines, Outlines]:
    """Return the outlines of all solids but panes, and of panes, in a plane at a height in meters."""

    def build(layout: Layout) -> tuple[Outlines, Outlines]:
        panes = {each.id for each in layout.placements if each.asset in (FRAMED, FRAMELESS)}
        solids = solids_of(world.model)
        others = [solid for solid in solids if solid.name not in panes]
        return _sections(others, height), _sections([solid for solid in solids if solid.name in panes], height)

    return world.derived(f"planar glass at {height!r}", build)


def _sections(solids: Sequence[Solid], height: float) -> Outlines:
    sections = [section for solid in solids if len(section := solid.at(height))]
    return outlines(sections, [0.0] * len(sections))


def shown_at(state: State, height: float) -> ShownShapes | None:
    """Return what a lidar in a plane at a height, meters, sees of the conditions of an episode; None for nothing."""
    visible = [presence for presence in state.presences.values() if presence.visible]
    if not visible:
        return None
    glass = any(isinstance(presence, GlassPresence) for presence in visible)
    bodies = [body for presence in visible for body in presence.bodies]
    shapes, numbers = shapes_at(tuple(dict.fromkeys(body.shape for body in bodies)), height)
    places = [(*body.pose, number) for body in bodies for number in numbers[body.shape]]
    panes = glass_at(state.world, height)[1] if glass else NO_OUTLINES
    return ShownShapes(panes, NORMAL, shapes, np.array(places, dtype=np.float64).reshape(-1, 4))


NO_OUTLINES = outlines([], [])


@lru_cache(maxsize=64)
def shapes_at(shapes: tuple[BodyShape, ...], height: float) -> tuple[Outlines, dict[BodyShape, range]]:
    """Return the outlines of bodies at a height, meters, and the numbers of those of each shape.

    The parts of a body that share no corner have an outline each, the convex hull of their section.
    """
    sections: list[Array] = []
    numbers = {}
    for shape in shapes:
        points = [shape.mesh.vertices[edges] for edges in shape.edges]
        own = [outline for ends in points if len(outline := hull(_crossings(ends, height)))]
        numbers[shape] = range(len(sections), len(sections) + len(own))
        sections += own
    return outlines(sections, [0.0] * len(sections)), numbers


def _crossings(ends: Array, height: float) -> Array:
    """Return the points (k, 2) at a height of those of the segments (n, 2, 3) that cross it, meters."""
    low, high = ends[:, 0, 2], ends[:, 1, 2]
    low, high, ends = (each[(low <= height) != (high <= height)] for each in (low, high, ends))
    share = ((height - low) / (high - low))[:, None]
    return np.asarray(ends[:, 0, :2] + share * (ends[:, 1, :2] - ends[:, 0, :2]))


def clearance(world: World, pose: Pose) -> float:
    """Return the distance from the chassis to the nearest footprint or wall, meters, as `World.clearance`."""
    return float(_clearance(pose[0], pose[1], scene_of(world).boxes))


@cache
def beams(rays: int) -> Beams:
    """Return the rays of a lidar."""
    return lidar_beams(rays)


@compiled
def clearance_at(x: float, y: float, boxes: Boxes) -> float:
    """Return the distance from the chassis at a point to the nearest barrier, meters; 0 if they overlap."""
    nearest = math.inf
    for k in range(len(boxes.half)):
        dx, dy = x - boxes.center[k, 0], y - boxes.center[k, 1]
        cosine, sine = boxes.axis[k, 0], boxes.axis[k, 1]
        u = max(abs(cosine * dx + sine * dy) - boxes.half[k, 0], 0.0)
        v = max(abs(cosine * dy - sine * dx) - boxes.half[k, 1], 0.0)
        nearest = min(nearest, u * u + v * v)
    return max(math.sqrt(nearest) - RADIUS, 0.0)


@entry
def _clearance(x: float, y: float, boxes: Boxes) -> float:
    return clearance_at(x, y, boxes)


@entry
def _scan_among(
    pose: tuple[float, float, float],
    walls: Outlines,
    shown: ShownShapes,
    beams: Beams,
    reach: float,
    readings: NDArray[np.float32],
) -> None:
    x, y, yaw = pose
    scan(x, y, yaw, walls, beams, reach, readings)
    scan_shown(x, y, yaw, shown, beams, reach, readings)


@entry
def _scan(
    x: float, y: float, yaw: float, walls: Outlines, beams: Beams, reach: float, readings: NDArray[np.float32]
) -> None:
    scan(x, y, yaw, walls, beams, reach, readings)
