"""Rays and clearance among things that the robot pushes, where they are."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.envs.assembly import without
from labgym.envs.conditions.bodies import Body, BodyRays, Shape
from labgym.envs.palette import Palette
from labgym.envs.pushing import PushingSimulation
from labgym.envs.robot import RobotSpec
from labgym.envs.world import World, world_of
from labgym.geometry import OrientedBox
from labgym.layouts import Layout
from labgym.layouts.floor import Finishes
from labgym.navigation import OBSTACLE_HEIGHT
from labgym.scenes.finishes import finishes_at
from labgym.scenes.fittings import drawn_asset
from labgym.scenes.mesh import ROOM, own_mesh
from labgym.scenes.rays import Geometry, RaySource


class PushedRays(BodyRays):
    """The scene without the things that the robot can push, and these where they are."""

    def __init__(self, source: RaySource, faces: int, bodies: tuple[Body, ...], index: NDArray[np.int64]) -> None:
        super().__init__(source, faces, bodies)
        self._placements = index

    def owners(self, faces: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the index of the placement of each face in the whole layout, `ROOM` for what is none."""
        faces = np.asarray(faces)
        owners, fixed = super().owners(faces), faces < self._first[0]
        of_fixed = owners[fixed]
        owners[fixed] = np.where(of_fixed == ROOM, ROOM, self._placements[of_fixed])
        return owners


class PushedScene:
    """A simulation with things that the robot pushes, as sensors see it.

    Args:
        simulation: the simulation. layout: the whole layout. robot: dimensions of the robot.
        exact: whether readings must be equal on every processor. palette: colors of the episode.
    """

    def __init__(
        self,
        simulation: PushingSimulation,
        layout: Layout,
        robot: RobotSpec,
        exact: bool = False,
        palette: Palette | None = None,
    ) -> None:
        self.simulation = simulation
        self._radius, self._exact, self._palette = robot.chassis_radius, exact, palette
        names = [thing.name for thing in simulation.things]
        self.fixtures: World = world_of(without(layout, names))
        index = {placement.id: number for number, placement in enumerate(layout.placements)}
        self._index = np.array([number for name, number in index.items() if name not in names], dtype=np.int64)
        self._owners = [index[name] for name in names]
        self._boxes = [layout.box(name) for name in names]
        self._looks = [
            (drawn_asset(layout, name), finishes_at(layout.floor, *layout.placement(name).position[:2]))
            for name in names
        ]

    def bodies(self, geometry: Geometry = "visual") -> tuple[Body, ...]:
        """Return the things that are there, as solids or as they look."""
        simulation = self.simulation
        return tuple(
            Body(thing.name, shape_of(*look, geometry), simulation.pose_of(index), owner)
            for index, (thing, look, owner) in enumerate(zip(simulation.things, self._looks, self._owners, strict=True))
            if thing.name not in simulation.absent
        )

    def rays(self, geometry: Geometry) -> RaySource:
        """Return the scene that sensors cast rays against."""
        world = self.fixtures
        if geometry == "solid":
            source: RaySource = world.solid_exact if self._exact else world.solid
        else:
            scene = world.visible_exact if self._exact else world.visible
            source = scene if self._palette is None else self._palette.paint(scene)
        return PushedRays(source, len(world.mesh(geometry).faces), self.bodies(geometry), self._index)

    def clearance(self, x: float, y: float) -> float:
        """Return the distance from the chassis to the nearest footprint or wall, meters; 0 if they overlap."""
        nearest, simulation = self.fixtures.clearance(x, y, self._radius), self.simulation
        for index, box in enumerate(self._boxes):
            if simulation.things[index].name not in simulation.absent and box.z0 < OBSTACLE_HEIGHT:
                nearest = min(nearest, _distance(box, simulation.pose_of(index), x, y) - self._radius)
        return max(nearest, 0.0)


@lru_cache(maxsize=64)
def shape_of(asset: Asset, finishes: Finishes, geometry: Geometry) -> Shape:
    """Return an asset as a body that sensors see; solids have no finishes."""
    return Shape(own_mesh(asset, finishes, geometry))


def _distance(box: OrientedBox, pose: tuple[float, float, float], x: float, y: float) -> float:
    """Return the distance of a point to the outline of a box whose middle is at a pose, meters; 0 inside."""
    a, b, yaw = pose
    cosine, sine = math.cos(yaw), math.sin(yaw)
    ahead, aside = cosine * (x - a) + sine * (y - b), cosine * (y - b) - sine * (x - a)
    return math.hypot(max(abs(ahead) - box.width / 2.0, 0.0), max(abs(aside) - box.depth / 2.0, 0.0))
