"""A layout prepared for an environment, in a form that can be sent to another process."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco

from labgym.envs.distance_to_go import DistanceToGo
from labgym.envs.reach import OutOfReach
from labgym.layouts import Layout
from labgym.navigation import Method, OccupancyGrid, ShortestPaths
from labgym.scenes import SceneMesh
from labgym.scenes.rays import Geometry


@dataclass(frozen=True)
class LayoutSenses:
    """The quantities that an environment reads from a layout.

    Attributes:
        geometry: what its sensor sees.
        distance_to_go: how its reward measures the way to the goal.
    """

    geometry: Geometry = "solid"
    distance_to_go: Method = "grid"


@dataclass(frozen=True, eq=False)
class LayoutStage:
    """A layout prepared for an environment. A world made of it equals, bit for bit, one made of the layout.

    Attributes:
        model: the physics of the layout with the robot.
        grid: the occupancy grid dilated by the planning radius; None if the environment does not read it.
        paths: shortest paths for a disc of the planning radius.
        to_go: driving distances to the goals of the layout's first protocol, by method and goal.
        lengths: lengths of the shortest paths of its goal pairs, meters, by the coordinates of their ends.
        geometry, mesh: what the sensor sees, as triangles.
        out_of_reach: where the robot can touch nothing.
        nbytes: approximate size in memory.
    """

    layout: Layout
    model: mujoco.MjModel
    grid: OccupancyGrid | None
    paths: ShortestPaths
    to_go: Mapping[tuple[object, ...], DistanceToGo]
    lengths: Mapping[tuple[float, ...], float]
    geometry: Geometry
    mesh: SceneMesh
    out_of_reach: OutOfReach
    nbytes: int
