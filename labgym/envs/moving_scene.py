"""Rays and clearance in a scene in which furniture moves or is pushed, against the present places of its geoms."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.assets.shapes import MATERIALS
from labgym.envs.conditions.bodies import Body, BodyRays, BodyShape
from labgym.envs.pushing import PushingSimulation
from labgym.envs.robot import BOTTOM, RobotSpec
from labgym.envs.scene_simulation import SceneSimulation
from labgym.envs.setting import Palette
from labgym.envs.world import World, world_of
from labgym.geometry import OrientedBox
from labgym.layouts import Layout
from labgym.layouts.floor import Finishes
from labgym.navigation import OBSTACLE_HEIGHT
from labgym.scenes.finishes import finishes_at
from labgym.scenes.fittings import drawn_asset
from labgym.scenes.mesh import ROOM, own_mesh
from labgym.scenes.mjcf import COLLISION_GROUP, VISUAL_GROUP, looks_of
from labgym.scenes.rays import SKY, Geometry, RaySource, lit


@dataclass(eq=False)
class MovingRays:
    """The geoms of one kind, where they are in a simulation. Faces are geoms.

    Attributes:
        simulation: the simulation, whose robot is in another group. group: geom group that is seen.
        layout: the layout of the scene. palette: colors of the episode; None for those of the layout.
    """

    simulation: SceneSimulation
    group: int
    layout: Layout
    palette: Palette | None = None

    def __post_init__(self) -> None:
        model = self.simulation.model
        index = {placement.id: number for number, placement in enumerate(self.layout.placements)}
        names = [model.body(body).name for body in model.geom_bodyid.tolist()]
        self._owners = np.array([index.get(name, index.get(name.rpartition("/")[0], ROOM)) for name in names])
        self._colors = np.array([_color(model, geom, self.palette) for geom in range(model.ngeom)]) * 255.0
        self._normals = np.zeros((0, 3))
        self._groups = np.zeros(6, dtype=np.uint8)
        self._groups[self.group] = 1

    def cast(
        self, origins: NDArray[np.floating], directions: NDArray[np.floating], max_range: float = 10.0
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Return the distance to the first hit of each ray, and its geom; all rays start at the first origin."""
        count = len(directions)
        distances, geoms, normals = np.empty(count), np.empty(count, dtype=np.int32), np.zeros(3 * count)
        start, along = np.asarray(origins[0], dtype=np.float64), np.asarray(directions, dtype=np.float64).ravel()
        model, data = self.simulation.model, self.simulation.data
        mujoco.mj_multiRay(
            model, data, start, along, self._groups, True, -1, geoms, distances, normals, count, max_range
        )
        self._normals = normals.reshape(-1, 3)
        hit = (geoms >= 0) & (distances <= max_range)
        return np.where(hit, distances, max_range).astype(np.float32), np.where(hit, geoms, -1).astype(np.int32)

    def color(self, faces: NDArray[np.integer], directions: NDArray[np.floating]) -> NDArray[np.uint8]:
        """Return the colors (n, 3) of the rays that were cast last."""
        hit = faces >= 0
        colors = lit(self._colors[np.where(hit, faces, 0)].astype(np.float32), self._normals, directions)
        colors[~hit] = SKY
        return colors

    def owners(self, faces: NDArray[np.integer]) -> NDArray[np.int64]:
        """Return the index of the placement of each geom, `ROOM` for floor and walls."""
        owners: NDArray[np.int64] = self._owners[faces]
        return owners


class MovingScene:
    """A simulation in which furniture moves, as sensors see it.

    Args:
        simulation: the simulation; bodies are at their places after each control step.
        layout: the layout of the scene. robot: dimensions of the robot. palette: colors of the episode.
    """

    def __init__(
        self, simulation: SceneSimulation, layout: Layout, robot: RobotSpec, palette: Palette | None = None
    ) -> None:
        model, own = simulation.model, simulation.mount
        self._simulation, self._radius = simulation, robot.chassis_radius
        self._rays = {
            "solid": MovingRays(simulation, COLLISION_GROUP, layout),
            "visual": MovingRays(simulation, VISUAL_GROUP, layout, palette),
        }
        colliding = (model.geom_contype | model.geom_conaffinity) != 0
        self._solids = np.flatnonzero(colliding & ~own.geoms & ~own.floor)

    def rays(self, geometry: Geometry) -> MovingRays:
        """Return the scene that sensors cast rays against."""
        return self._rays[geometry]

    def clearance(self, x: float, y: float) -> float:
        """Return the distance from the chassis to the outline of the nearest solid below 1.40 m, meters; 0 inside."""
        geoms, data, model = self._solids, self._simulation.data, self._simulation.model
        away = np.hypot(data.geom_xpos[geoms, 0] - x, data.geom_xpos[geoms, 1] - y) - model.geom_rbound[geoms]
        nearest = math.inf
        for place in np.argsort(away).tolist():
            if away[place] >= nearest:
                break
            nearest = min(nearest, self._distance(int(geoms[place]), x, y))
        return max(nearest - self._radius, 0.0)

    def _distance(self, geom: int, x: float, y: float) -> float:
        """Return the distance of a point to the outline of a solid's bounding box, inf above the robot's height."""
        model, data = self._simulation.model, self._simulation.data
        box, center = model.geom_aabb[geom], data.geom_xpos[geom]
        corners = center + (box[:3] + SIGNS * box[3:]) @ data.geom_xmat[geom].reshape(3, 3).T
        if corners[:, 2].min() >= OBSTACLE_HEIGHT or corners[:, 2].max() <= BOTTOM:
            return math.inf
        outline = cv2.convexHull((corners[:, :2] - (x, y)).astype(np.float32))
        return max(-float(cv2.pointPolygonTest(outline, (0.0, 0.0), True)), 0.0)


SIGNS = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1))).reshape(3, 8).T
"""Signs of the corners of a box, (8, 3)."""


def _color(model: mujoco.MjModel, geom: int, palette: Palette | None) -> list[float]:
    """Return the color of a geom, (3,) in [0, 1]; translucent ones are blended with a light gray."""
    material = int(model.geom_matid[geom])
    rgba = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    name = "" if material < 0 else looks_of(model.material(material).name)
    look = MATERIALS.get(name)  # of a textured material, MuJoCo's color is white
    red, green, blue, opacity = rgba if look is None else look.rgba
    color = [channel * opacity + 0.82 * (1.0 - opacity) for channel in (red, green, blue)]
    factors = (1.0, 1.0, 1.0) if palette is None else palette.factors(name)
    return [min(channel * float(factor), 1.0) for channel, factor in zip(color, factors, strict=True)]


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
        self.fixtures: World = world_of(layout.without(names))
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
def shape_of(asset: Asset, finishes: Finishes, geometry: Geometry) -> BodyShape:
    """Return an asset as a body that sensors see; solids have no finishes."""
    return BodyShape(own_mesh(asset, finishes, geometry))


def _distance(box: OrientedBox, pose: tuple[float, float, float], x: float, y: float) -> float:
    """Return the distance of a point to the outline of a box whose middle is at a pose, meters; 0 inside."""
    a, b, yaw = pose
    cosine, sine = math.cos(yaw), math.sin(yaw)
    ahead, aside = cosine * (x - a) + sine * (y - b), cosine * (y - b) - sine * (x - a)
    return math.hypot(max(abs(ahead) - box.width / 2.0, 0.0), max(abs(aside) - box.depth / 2.0, 0.0))
