"""Rays and clearance in a scene of which furniture moves, against the present places of its geoms."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.assets.shapes import MATERIALS
from labgym.envs.palette import Palette
from labgym.envs.robot import BOTTOM, RobotSpec
from labgym.envs.scene_simulation import SceneSimulation
from labgym.layouts import Layout
from labgym.navigation import OBSTACLE_HEIGHT
from labgym.scenes.mesh import ROOM
from labgym.scenes.mjcf import COLLISION_GROUP, VISUAL_GROUP, looks_of
from labgym.scenes.rays import SKY, Geometry, lit


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
