"""A layout for the planar kernel, and what a single environment reads from it."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.envs.planar.body import Body, body_of
from labgym.envs.planar.compiled import compiled, entry
from labgym.envs.planar.lidar import Beams, lidar_beams, scan
from labgym.envs.planar.outlines import solids_of
from labgym.envs.planar.plan import Outlines, Plan, outlines, plan_of
from labgym.envs.robot import ROBOT
from labgym.envs.simulation import Pose
from labgym.envs.world import World
from labgym.navigation.barriers import Barriers

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


class Scene(NamedTuple):
    """A layout for the kernel.

    Attributes:
        plan: what the robot touches and the lidar sees. body: the robot. boxes: the barriers.
    """

    plan: Plan
    body: Body
    boxes: Boxes


def scene_of(world: World) -> Scene:
    """Return the scene of a world; it is built once.

    Raises:
        OptionError: the world has solids that move or are neither boxes nor meshes.
    """
    return world.derived(
        "planar scene", lambda layout: Scene(plan_of(world.model), body_of(world.model), boxes_of(Barriers.of(layout)))
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
