"""A layout prepared for simulation: physics, rays, and privileged quantities that the robot cannot observe."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable
from threading import RLock
from typing import Any, TypeVar
from weakref import WeakValueDictionary

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.envs.distance_to_go import DistanceToGo, ExactDistanceToGo, GridDistanceToGo
from labgym.envs.reach import OutOfReach
from labgym.envs.residents import RESIDENT_MB, Residents
from labgym.envs.robot import ROBOT, attach_robot
from labgym.envs.simulation import Pose, Simulation
from labgym.envs.stage import LayoutSenses, LayoutStage
from labgym.layouts import Layout
from labgym.layouts.floor import Floor
from labgym.layouts.placement import Placement
from labgym.navigation import PLANNING_RADIUS, GoalPair, Method, OccupancyGrid, ShortestPaths, goal_pairs, occupancy
from labgym.navigation.barriers import Barriers, PointClearance
from labgym.navigation.lengths import length_to_disc
from labgym.scenes import ExactRayScene, RayScene, SceneMesh, to_mjcf
from labgym.scenes.rays import Geometry, ray_mesh

_Value = TypeVar("_Value")

KEPT = 16
"""Number of worlds that a process keeps in any case."""
FIELDS = 64
"""Number of goals whose distance field a world keeps; a field of the largest room takes 8 MB."""
LENGTHS = 4096
"""Number of drives whose shortest length a world keeps."""
MODEL, GRID, PATHS, OUT_OF_REACH = "model", "grid", "paths", "out of reach"
"""Names of derived data; the meshes have the names of their geometry."""


def size_of(value: Any) -> int:
    """Return the bytes of the arrays and models that a value refers to, each counted once.

    An object with an attribute `nbytes` states its size itself; of any other object of this package the attributes
    are counted. Embree's copies of a mesh are in `RayScene.nbytes`.
    """
    return _size(value, set())


def _size(value: Any, counted: set[int]) -> int:
    if value is None or isinstance(value, int | float | str) or id(value) in counted:
        return 0
    counted.add(id(value))
    if isinstance(value, mujoco.MjModel):
        return int(value.nbuffer)
    if isinstance(value, bytes):
        return len(value)
    if hasattr(value, "nbytes"):
        return int(value.nbytes)
    if isinstance(value, dict):
        return sum(_size(item, counted) for item in value.values())
    if isinstance(value, tuple | list | set | frozenset):
        return sum(_size(item, counted) for item in value)
    if type(value).__module__.startswith("labgym."):
        return _size(getattr(value, "__dict__", None), counted)
    return 0


class World:
    """The parts of one layout that do not change while the robot drives; shared by the environments of a process."""

    def __init__(self, layout: Layout, stage: LayoutStage | None = None) -> None:
        """Prepare a layout, or take over what its stage holds."""
        self._layout = layout
        self._barriers = Barriers.of(layout)
        self._points = PointClearance(self._barriers)
        self._lock = RLock()
        self._derived: dict[Hashable, Any] = {}
        self._fields: dict[tuple[object, ...], DistanceToGo] = {} if stage is None else dict(stage.to_go)
        self._lengths: dict[tuple[float, ...], float] = {} if stage is None else dict(stage.lengths)
        if stage is not None:
            self._derived |= {PATHS: stage.paths, OUT_OF_REACH: stage.out_of_reach, stage.geometry: stage.mesh}
            self._derived[MODEL] = stage.model
            if stage.grid is not None:
                self._derived[GRID] = stage.grid
        self._nbytes = 0 if stage is None else stage.nbytes

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy, or an unpickled environment, uses the world that its process has for the layout.
        return world_of, (self._layout,)

    def stage(self, senses: LayoutSenses) -> LayoutStage:
        """Return what an environment reads of this world, for the drives of the layout's first protocol."""
        pairs = () if self._layout.protocol is None else goal_pairs(self._layout)
        method, grid = senses.distance_to_go, self.planning_grid if senses.distance_to_go == "grid" else None
        to_go: dict[tuple[object, ...], DistanceToGo] = {
            (method, *pair.goal[:2]): self.to_go(pair.goal, method) for pair in pairs
        }
        lengths: dict[tuple[float, ...], float] = {
            pair.start[:2] + pair.goal[:2]: self.shortest_length(pair) for pair in pairs
        }
        geometry, mesh = senses.geometry, self.mesh(senses.geometry)
        paths, out_of_reach, nbytes = self.paths, self.out_of_reach, self.nbytes
        return LayoutStage(self._layout, self.model, grid, paths, to_go, lengths, geometry, mesh, out_of_reach, nbytes)

    @property
    def model(self) -> mujoco.MjModel:
        """The robot and the colliding geoms of the scene, without visual geoms."""
        return self.derived(MODEL, physics_model)

    @property
    def nbytes(self) -> int:
        """Approximate size in memory, bytes; it grows with what is derived."""
        return self._nbytes

    @property
    def layout(self) -> Layout:
        """The layout."""
        return self._layout

    def derived(self, name: Hashable, build: Callable[[Layout], _Value]) -> _Value:
        """Return what a function makes of the layout, computed once and shared by all that use this world.

        Args:
            name: of the derived data; the same function must come with it every time.
            build: makes them; they must not change afterwards.
        """
        if name not in self._derived:
            with self._lock:
                if name not in self._derived:
                    value = build(self._layout)
                    self._nbytes += size_of(value)
                    self._derived[name] = value
        derived: _Value = self._derived[name]
        return derived

    def clearance(self, x: float, y: float, radius: float = ROBOT.chassis_radius) -> float:
        """Return the distance from a chassis to the nearest footprint or wall, meters; 0 if they overlap.

        Footprints are the bounding boxes of all objects whose bottom is below 1.40 m (`OBSTACLE_HEIGHT`).
        """
        return max(self._points.at(x, y) - radius, 0.0)

    def clearances(self, points: NDArray[np.float64], radius: float = ROBOT.chassis_radius) -> NDArray[np.float64]:
        """Return `clearance` at points (n, 2), shape (n,)."""
        return np.asarray(np.maximum(self._barriers.clearance(points) - radius, 0.0))

    def to_go(self, goal: tuple[float, float, float], method: Method = "grid") -> DistanceToGo:
        """Return the driving distances to a goal, by the grid (version 1) or exact (version 2); see `Method`."""

        def field() -> DistanceToGo:
            return (
                GridDistanceToGo(self.planning_grid, goal) if method == "grid" else ExactDistanceToGo(self.paths, goal)
            )

        with self._lock:
            key = (method, *goal[:2])
            if key not in self._fields and len(self._fields) >= FIELDS:
                self._nbytes -= size_of(self._fields.pop(next(iter(self._fields))))
            if key not in self._fields:
                self._fields[key] = field()
                self._nbytes += size_of(self._fields[key])
            self._fields[key] = self._fields.pop(key)  # the latest one is the last to go
            return self._fields[key]

    def shortest_length(self, pair: GoalPair) -> float:
        """Return the length of the shortest any-angle path of a goal pair, meters; inf if no path exists."""

        def length() -> float:
            path = self.paths.path(pair.start[:2], pair.goal[:2])
            return path.length if path is not None else float("inf")

        return self._length(pair.start[:2] + pair.goal[:2], length)

    def length_to_disc(self, pair: GoalPair, radius: float) -> float:
        """Return the length of the shortest any-angle path from a start to a disc around a goal, meters.

        Args:
            radius: radius of the disc, meters.
        """
        key = (*pair.start[:2], *pair.goal[:2], radius)
        return self._length(key, lambda: length_to_disc(self.paths, pair.start, pair.goal, radius))

    def _length(self, key: tuple[float, ...], length: Callable[[], float]) -> float:
        """Return a length of the cache, computed if it is missing."""
        cached = self._lengths.get(key)
        if cached is not None:
            return cached
        with self._lock:
            if len(self._lengths) >= LENGTHS:
                del self._lengths[next(iter(self._lengths))]
            return self._lengths.setdefault(key, length())

    def clear_at(self, pose: Pose) -> bool:
        """Whether the robot at a pose (x, y, yaw) touches nothing in the simulation."""
        simulation = Simulation(self.model)
        simulation.place(pose)
        return bool(simulation.data.ncon == 0)

    def plannable_at(self, pose: Pose) -> bool:
        """Whether a disc of the planning radius fits at a pose."""
        return self.paths.free(*pose[:2])

    @property
    def out_of_reach(self) -> OutOfReach:
        """Where nothing is within reach of the robot between two contact checks."""
        return self.derived(OUT_OF_REACH, lambda _: OutOfReach(self.model))

    @property
    def solid(self) -> RayScene:
        """The solid boxes that stop the robot; the lidar sees them."""
        return self._rays(RayScene, "solid")

    @property
    def visible(self) -> RayScene:
        """The visual shapes; the camera sees them."""
        return self._rays(RayScene, "visual")

    @property
    def solid_exact(self) -> RayScene:
        """The solid boxes, for readings that do not depend on the processor."""
        return self._rays(ExactRayScene, "solid")

    @property
    def visible_exact(self) -> RayScene:
        """The visual shapes, for readings that do not depend on the processor."""
        return self._rays(ExactRayScene, "visual")

    def _rays(self, kind: type[RayScene], geometry: Geometry) -> RayScene:
        name = f"{kind.__name__} {geometry}"
        return self.derived(name, lambda layout: kind(layout, geometry, self.mesh(geometry)))

    def mesh(self, geometry: Geometry) -> SceneMesh:
        """Return the triangles of the solid boxes, or of the visual shapes."""
        return self.derived(geometry, lambda layout: ray_mesh(layout, geometry))

    @property
    def planning_grid(self) -> OccupancyGrid:
        """The cells that are free for the disc of the planning radius."""
        return self.derived(GRID, lambda layout: occupancy(layout).dilated(PLANNING_RADIUS))

    @property
    def paths(self) -> ShortestPaths:
        """Shortest paths for a disc of the planning radius."""
        return self.derived(PATHS, ShortestPaths)


def physics_model(layout: Layout) -> mujoco.MjModel:
    """Compile a layout with the robot; only colliding geoms are kept, and all but the robot are fixed to the world."""
    scene = to_mjcf(layout, visible=False, cameras=False)
    attach_robot(scene)
    scene.compiler.discardvisual = True
    scene.compiler.fusestatic = True
    return scene.compile()


_Key = tuple[Floor, tuple[Placement, ...], tuple[Asset, ...]]

_worlds: WeakValueDictionary[_Key, World] = WeakValueDictionary()
_by_identity: WeakValueDictionary[int, World] = WeakValueDictionary()
"""Worlds by the `id` of the layout that they were made of, which lives as long as its world."""
_recent: deque[World] = deque(maxlen=KEPT)
"""The newest worlds: kept even if no environment uses them."""
residents = Residents()
"""Worlds of layouts that environments will use again, such as those of a published split."""


def world_of(layout: Layout) -> World:
    """Return the world of a layout; layouts with the same floor, placements and catalog entries share one.

    A world lives as long as something uses it or it is among the last `KEPT` that were made.
    """
    return _world(layout, None)


def keep(layout: Layout, megabytes: float = RESIDENT_MB) -> None:
    """Keep the world of a layout in memory, as the one used last, if it fits the budget of this process."""
    residents.keep(world_of(layout), megabytes)


def layout_of(stage: LayoutStage) -> Layout:
    """Return the layout of a stage, whose world this process then has."""
    _world(stage.layout, stage)
    return stage.layout


def _world(layout: Layout, stage: LayoutStage | None) -> World:
    world = _by_identity.get(id(layout))
    if world is not None and world._layout is layout:
        return world
    key = (layout.floor, layout.placements, tuple(layout.asset(placement.id) for placement in layout.placements))
    world = _worlds.get(key)
    if world is None:
        world = _worlds[key] = _by_identity[id(layout)] = World(layout, stage)
        _recent.append(world)
    return world
