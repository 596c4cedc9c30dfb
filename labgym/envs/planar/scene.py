"""A layout for the planar kernel, and what a single environment reads from it."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.envs.planar.body import PlanarBody, body_of
from labgym.envs.planar.compiled import compiled, entry
from labgym.envs.planar.plan import Outlines, PlanarPlan, outlines, plan_of, solids_of
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import LIDAR_RAYS
from labgym.envs.simulation import Pose
from labgym.envs.world import World
from labgym.navigation.barriers import Barriers

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


@compiled
def scan(
    x: float, y: float, yaw: float, walls: Outlines, beams: Beams, reach: float, ranges: NDArray[np.float32]
) -> None:
    """Write the ranges (n,) from a pose, in meters, at most `reach`.

    A convex outline shows the sides whose front the robot is on. Going around counter-clockwise, their directions fall,
    so each covers the rays between those of its two ends; neighbors share an end and leave no gap.
    """
    rays = len(beams.x)
    for k in range(rays):
        ranges[k] = reach
    cosine, sine = math.cos(yaw), math.sin(yaw)
    for outline in range(len(walls.first) - 1):
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


def ranges(world: World, pose: Pose, rays: int, reach: float, height: float) -> NDArray[np.float32]:
    """Return what a lidar reads from a pose: (rays,) meters, at most `reach`.

    Args:
        height: of its plane above the floor, meters.
    """
    readings = np.empty(rays, np.float32)
    _scan(*pose, walls_at(world, height), beams(rays), reach, readings)
    return readings


def walls_at(world: World, height: float) -> Outlines:
    """Return what a lidar sees in a plane at a height in meters."""
    if height == ROBOT.lidar_height:
        return scene_of(world).plan.walls

    def build(_: object) -> Outlines:
        sections = [section for solid in solids_of(world.model) if len(section := solid.at(height))]
        return outlines(sections, [0.0] * len(sections))

    return world.derived(f"planar walls at {height!r}", build)


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
def _scan(
    x: float, y: float, yaw: float, walls: Outlines, beams: Beams, reach: float, readings: NDArray[np.float32]
) -> None:
    scan(x, y, yaw, walls, beams, reach, readings)
