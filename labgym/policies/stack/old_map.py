"""The old map as the stack needs it: what the lidar sees, what a disc must avoid, and the station at a pose."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from labgym.envs.robot import ROBOT
from labgym.geometry import Array, OrientedBox
from labgym.layouts import Layout
from labgym.navigation import OBSTACLE_HEIGHT, Pose
from labgym.policies.distance_field import DistanceField
from labgym.scenes.building import building_solids

MAP_MARGIN_M = 1.0
"""Width of the region around the floor that the map covers, meters."""
STATION_DISTANCE_M = 1.5
"""Greatest distance from a docking pose to its station, meters."""


@dataclass(frozen=True, eq=False)
class OldMap:
    """A layout as a map.

    Attributes:
        clearance: distances to everything that is lower than the robot.
        seen: distances to what the lidar's plane cuts.
        sections: the boxes that the lidar's plane cuts, by the placement that they belong to; "" for the building.
    """

    clearance: DistanceField
    seen: DistanceField
    sections: tuple[tuple[str, OrientedBox], ...]

    @classmethod
    def of(cls, layout: Layout, height: float = ROBOT.lidar_height) -> OldMap:
        """Return the map of a layout for a lidar at a height, meters."""
        building = tuple(building_solids(layout.floor).values())
        boxes = [("", box) for box in building]
        for placement in layout.placements:
            boxes += [(layout.root(placement.id).id, box) for box in layout.solids(placement.id)]
        sections = tuple((owner, box) for owner, box in boxes if box.z0 < height < box.z1)
        walls = [box for box in building if box.z0 < OBSTACLE_HEIGHT]
        bounds = _bounds([box for _, box in sections] or walls)
        obstacles = [*walls, *layout.obstacles(OBSTACLE_HEIGHT)]
        seen = DistanceField.of_boxes([box for _, box in sections], bounds)
        return cls(DistanceField.of_boxes(obstacles, bounds), seen, sections)

    @classmethod
    def empty(cls, bounds: Sequence[float]) -> OldMap:
        """Return a map of nothing within bounds (x0, y0, x1, y1), meters."""
        nothing = DistanceField.of_boxes((), bounds)
        return cls(nothing, nothing, ())

    def station(self, pose: Pose) -> tuple[OrientedBox, ...]:
        """Return the boxes of the placement that a robot at a pose faces; empty if it faces none within reach."""
        ray = np.array([[math.cos(pose[2]), math.sin(pose[2])]])
        boxes = [box for _, box in self.sections]
        away = ray_lengths(np.array([pose[:2]]), ray, boxes)[0]
        if not boxes:
            return ()
        nearest = int(np.argmin(away))
        owner = self.sections[nearest][0]
        if not owner or away[nearest] > STATION_DISTANCE_M:
            return ()
        return tuple(box for name, box in self.sections if name == owner)

    def others(self, station: Sequence[OrientedBox]) -> tuple[OrientedBox, ...]:
        """Return the boxes that do not belong to a station."""
        return tuple(box for _, box in self.sections if box not in station)


def ray_lengths(origins: Array, directions: Array, boxes: Sequence[OrientedBox]) -> Array:
    """Return where rays first meet boxes.

    Args:
        origins: (n, 2) meters. directions: (n, 2) unit vectors.
        boxes: m rectangles.

    Returns:
        (n, m) meters; 0 from inside, inf for a ray that misses.
    """
    if not boxes:
        return np.full((len(origins), 0), math.inf)
    table = np.array([(box.x, box.y, box.width / 2.0, box.depth / 2.0, box.yaw) for box in boxes])
    cosine, sine = np.cos(table[:, 4]), np.sin(table[:, 4])
    dx, dy = origins[:, 0, None] - table[:, 0], origins[:, 1, None] - table[:, 1]
    ux, uy = directions[:, 0, None], directions[:, 1, None]
    near = np.full(dx.shape, -math.inf)
    far = np.full(dx.shape, math.inf)
    for place, step, half in (
        (cosine * dx + sine * dy, cosine * ux + sine * uy, table[:, 2]),
        (cosine * dy - sine * dx, cosine * uy - sine * ux, table[:, 3]),
    ):
        step = np.where(np.abs(step) < 1e-12, 1e-12, step)
        first, second = (-half - place) / step, (half - place) / step
        near = np.maximum(near, np.minimum(first, second))
        far = np.minimum(far, np.maximum(first, second))
    return np.asarray(np.where((near <= far) & (far >= 0.0), np.maximum(near, 0.0), math.inf))


def _bounds(boxes: Sequence[OrientedBox]) -> tuple[float, float, float, float]:
    """Return bounds of boxes with a margin, at multiples of the resolution."""
    edges = np.array([box.bounds() for box in boxes])
    low, high = np.floor(edges[:, :2].min(axis=0) - MAP_MARGIN_M), np.ceil(edges[:, 2:].max(axis=0) + MAP_MARGIN_M)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])
