"""A layout prepared for simulation: physics, rays, and privileged quantities that the robot cannot observe."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import cached_property
from typing import Any, TypeVar
from weakref import WeakValueDictionary

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.envs.distance_to_go import DistanceToGo, ExactDistanceToGo, GridDistanceToGo
from labgym.envs.reach import OutOfReach
from labgym.envs.robot import ROBOT, attach_robot
from labgym.envs.simulation import Pose, Simulation
from labgym.envs.stage import Senses, Stage
from labgym.layouts import Layout
from labgym.layouts.model import Floor, Placement
from labgym.navigation import PLANNING_RADIUS, GoalPair, Method, OccupancyGrid, ShortestPaths, goal_pairs, occupancy
from labgym.navigation.barriers import Barriers
from labgym.scenes import ExactRayScene, RayScene, SceneMesh, to_mjcf
from labgym.scenes.rays import Geometry, ray_mesh

_Ends = TypeVar("_Ends", bound=tuple[object, ...])
_Value = TypeVar("_Value")

KEPT = 16
"""Number of worlds that a process keeps in any case."""
FIELDS = 64
"""Number of goals whose distance field a world keeps; a field of the largest room takes 8 MB."""
LENGTHS = 4096
"""Number of drives whose shortest length a world keeps."""


class World:
    """The parts of one layout that do not change while the robot drives; shared by the environments of a process.

    Attributes:
        model: the robot and the colliding geoms of the scene, without visual geoms.
    """

    def __init__(self, layout: Layout, stage: Stage | None = None) -> None:
        """Prepare a layout, or take over what its stage holds."""
        self._layout = layout
        self.model = physics_model(layout) if stage is None else stage.model
        self._barriers = Barriers.of(layout)
        self._fields: dict[tuple[object, ...], DistanceToGo] = {} if stage is None else dict(stage.to_go)
        self._lengths: dict[tuple[float, ...], float] = {} if stage is None else dict(stage.lengths)
        self._meshes: dict[Geometry, SceneMesh] = {} if stage is None else {stage.geometry: stage.mesh}
        if stage is not None:
            self._paths = stage.paths
            if stage.grid is not None:
                self._grid = stage.grid

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy, or an unpickled environment, uses the world that its process has for the layout.
        return world_of, (self._layout,)

    def stage(self, senses: Senses) -> Stage:
        """Return what an environment reads of this world, for the drives of the layout's first protocol."""
        pairs = () if self._layout.protocol is None else goal_pairs(self._layout)
        method = senses.distance_to_go
        return Stage(
            layout=self._layout,
            model=self.model,
            grid=self._grid if method == "grid" else None,
            paths=self._paths,
            to_go={(method, *pair.goal[:2]): self.to_go(pair.goal, method) for pair in pairs},
            lengths={pair.start[:2] + pair.goal[:2]: self.shortest_length(pair) for pair in pairs},
            geometry=senses.geometry,
            mesh=ray_mesh(self._layout, senses.geometry),
        )

    def clearance(self, x: float, y: float) -> float:
        """Return the distance from the chassis to the nearest footprint or wall, meters; 0 if they overlap.

        Footprints are the bounding boxes of all objects whose bottom is below 1.40 m (`OBSTACLE_HEIGHT`).
        """
        return float(self.clearances(np.array([[x, y]]))[0])

    def clearances(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return `clearance` at points (n, 2), shape (n,)."""
        return np.asarray(np.maximum(self._barriers.clearance(points) - ROBOT.chassis_radius, 0.0))

    def depths(self, poses: NDArray[np.float64], clearances: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how deep the robot is inside the solids of the simulation at poses (n, 3), shape (n,), meters.

        Args:
            poses: x, y and yaw.
            clearances: `clearances` of the poses; where they are positive nothing can touch.
        """
        simulation = Simulation(self.model)
        depths = np.zeros(len(poses))
        for index in np.flatnonzero(clearances <= 0.0):
            simulation.place(tuple(poses[index].tolist()))
            depths[index] = -min(simulation.data.contact.dist, default=0.0)
        return depths

    def to_go(self, goal: tuple[float, float, float], method: Method = "grid") -> DistanceToGo:
        """Return the driving distances to a goal, by the grid (version 1) or exact (version 2); see `Method`."""

        def field() -> DistanceToGo:
            return GridDistanceToGo(self._grid, goal) if method == "grid" else ExactDistanceToGo(self._paths, goal)

        return _recalled(self._fields, (method, *goal[:2]), FIELDS, field)

    def shortest_length(self, pair: GoalPair) -> float:
        """Return the length of the shortest any-angle path of a goal pair, meters; inf if no path exists."""

        def length() -> float:
            path = self._paths.path(pair.start[:2], pair.goal[:2])
            return path.length if path is not None else float("inf")

        return _recalled(self._lengths, pair.start[:2] + pair.goal[:2], LENGTHS, length)

    def clear_at(self, pose: Pose) -> bool:
        """Whether the robot at a pose (x, y, yaw) touches nothing in the simulation."""
        simulation = Simulation(self.model)
        simulation.place(pose)
        return bool(simulation.data.ncon == 0)

    def plannable_at(self, pose: Pose) -> bool:
        """Whether a disc of the planning radius fits at a pose."""
        return self._paths.free(*pose[:2])

    @cached_property
    def out_of_reach(self) -> OutOfReach:
        """Where nothing is within reach of the robot between two contact checks."""
        return OutOfReach(self.model)

    @cached_property
    def solid(self) -> RayScene:
        """The solid boxes that stop the robot; the lidar sees them."""
        return RayScene(self._layout, "solid", self._meshes.get("solid"))

    @cached_property
    def visible(self) -> RayScene:
        """The visual shapes; the camera sees them."""
        return RayScene(self._layout, "visual", self._meshes.get("visual"))

    @cached_property
    def solid_exact(self) -> RayScene:
        """The solid boxes, for readings that do not depend on the processor."""
        return ExactRayScene(self._layout, "solid", self._meshes.get("solid"))

    @cached_property
    def visible_exact(self) -> RayScene:
        """The visual shapes, for readings that do not depend on the processor."""
        return ExactRayScene(self._layout, "visual", self._meshes.get("visual"))

    @cached_property
    def _grid(self) -> OccupancyGrid:
        return occupancy(self._layout).dilated(PLANNING_RADIUS)

    @cached_property
    def _paths(self) -> ShortestPaths:
        return ShortestPaths(self._layout)


def physics_model(layout: Layout) -> mujoco.MjModel:
    """Compile a layout with the robot; only colliding geoms are kept, and all but the robot are fixed to the world."""
    scene = to_mjcf(layout, visible=False)
    attach_robot(scene)
    scene.compiler.discardvisual = True
    scene.compiler.fusestatic = True
    return scene.compile()


def _recalled(cache: dict[_Ends, _Value], key: _Ends, limit: int, compute: Callable[[], _Value]) -> _Value:
    """Return a value of a cache, computed if it is missing; the `limit` values used last stay in the cache."""
    value = cache.pop(key) if key in cache else compute()
    cache[key] = value
    if len(cache) > limit:
        del cache[next(iter(cache))]
    return value


_Key = tuple[Floor, tuple[Placement, ...], tuple[Asset, ...]]

_worlds: WeakValueDictionary[_Key, World] = WeakValueDictionary()
_recent: deque[World] = deque(maxlen=KEPT)
"""The newest worlds: kept even if no environment uses them."""


def world_of(layout: Layout) -> World:
    """Return the world of a layout; layouts with the same floor, placements and catalog entries share one.

    A world lives as long as something uses it or it is among the last `KEPT` that were made.
    """
    return _world(layout, None)


def layout_of(stage: Stage) -> Layout:
    """Return the layout of a stage, whose world this process then has."""
    _world(stage.layout, stage)
    return stage.layout


def _world(layout: Layout, stage: Stage | None) -> World:
    key = (layout.floor, layout.placements, tuple(layout.asset(placement.id) for placement in layout.placements))
    world = _worlds.get(key)
    if world is None:
        world = _worlds[key] = World(layout, stage)
        _recent.append(world)
    return world
