"""Sensors that cast rays: a planar lidar, and a level camera that sees depth and color."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from gymnasium import spaces

from labgym.envs.checks import MAX_METERS, count, finite, positive
from labgym.envs.parts.noise import NoisySensor
from labgym.envs.parts.protocols import Noise, Reading
from labgym.envs.parts.registry import registered
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import IMAGE_SHAPE, LIDAR_RAYS, RANGE, Camera, CameraView, Lidar
from labgym.envs.state import State
from labgym.scenes.rays import Geometry


@registered("sensor", "lidar")
class LidarSensor(NoisySensor):
    """A planar range finder, by default on the robot's axis: (rays,) float32, meters, clipped to `reach`.

    Ray i points -180 + 360 i / rays degrees from the heading, counter-clockwise: ray 0 points backwards, ray rays / 2
    straight ahead. It sees the solid boxes that stop the robot.

    Attributes:
        rays: number of rays. reach: largest reading, meters.
        height: of the plane above the floor, meters. At the height of a top, such as 0.9 for worktops, rays run in a
            face: MuJoCo's environments may see it or not, the planar kernels do not. Choose another height.
        forward, left: place in the robot frame, meters. yaw: turn in it, radians, counter-clockwise.
    """

    name: str = "lidar"
    rays: int = LIDAR_RAYS
    reach: float = RANGE
    height: float = ROBOT.lidar_height
    noise: tuple[Noise, ...] = ()
    forward: float = 0.0
    left: float = 0.0
    yaw: float = 0.0

    def __post_init__(self) -> None:
        count(self, "rays")
        positive(self, "reach", "height", most=MAX_METERS)
        finite(self, "forward", "left", "yaw")
        super().__post_init__()

    @property
    def space(self) -> spaces.Space[Any]:
        """Ranges in [0, reach]."""
        return spaces.Box(0.0, self.reach, (self.rays,), np.float32)

    @property
    def sees(self) -> Geometry | None:
        """The solid boxes."""
        return "solid"

    @cached_property
    def _lidar(self) -> Lidar:
        return Lidar(self.rays, self.reach, self.height, self.forward, self.left, self.yaw)

    def measured(self, state: State) -> Reading:
        """Return the ranges."""
        return state.ranges(self._lidar)


@dataclass(frozen=True)
class CameraSensor(NoisySensor):
    """The place and the picture of a camera: a base of the sensors that look through it, level by default.

    Two sensors of equal camera share one cast of its rays.

    Attributes:
        rows, columns: size of the image, pixels. hfov: horizontal field of view, radians.
        reach: largest depth, meters.
        forward, height, left: place of the camera ahead of the robot's axis, above the floor and to the left, meters.
        yaw, pitch, roll: turns to the left, nose down and right side down, radians.
    """

    name: str = "camera"
    rows: int = IMAGE_SHAPE[0]
    columns: int = IMAGE_SHAPE[1]
    hfov: float = ROBOT.camera_hfov
    reach: float = RANGE
    forward: float = ROBOT.camera_forward
    height: float = ROBOT.camera_height
    noise: tuple[Noise, ...] = ()
    left: float = 0.0
    yaw: float = 0.0
    pitch: float = 0.0
    roll: float = 0.0

    def __post_init__(self) -> None:
        count(self, "rows", "columns")
        positive(self, "hfov", "reach", "height", most=MAX_METERS)
        finite(self, "forward", "left", "yaw", "pitch", "roll")
        super().__post_init__()

    @property
    def sees(self) -> Geometry | None:
        """The visual shapes."""
        return "visual"

    @cached_property
    def _optics(self) -> tuple[object, ...]:
        return ("camera", self.rows, self.columns, self.hfov, self.reach, *self._place.values())

    @property
    def _place(self) -> dict[str, float]:
        return {name: getattr(self, name) for name in ("forward", "height", "left", "yaw", "pitch", "roll")}

    @cached_property
    def camera(self) -> Camera:
        """The camera."""
        return Camera((self.rows, self.columns), self.hfov, self.reach, **self._place)

    def _view(self, state: State) -> CameraView:
        """Return what the camera sees; the first sensor of an optic casts its rays."""
        view: CameraView | None = state.views.get(self._optics)
        if view is None:
            view = state.views[self._optics] = self.camera.view(state.rays("visual"), state.pose)
        return view


@registered("sensor", "depth")
class DepthSensor(CameraSensor):
    """Planar depth of a camera: (rows * columns,) float32, meters, clipped to `reach`.

    `reshape(rows, columns)` gives the image, first row at the top. It is flat because learning libraries treat every
    three-dimensional box as an 8-bit image.
    """

    name: str = "depth"

    @property
    def space(self) -> spaces.Space[Any]:
        """Depth in [0, reach]."""
        return spaces.Box(0.0, self.reach, (self.rows * self.columns,), np.float32)

    def measured(self, state: State) -> Reading:
        """Return the depth image, (rows, columns)."""
        return state.depth(self.camera) if state.compiled and self.camera.level else self._view(state).depth

    def reading(self, state: State, rng: np.random.Generator) -> Reading:
        """Return the depth image, flat."""
        return super().reading(state, rng).ravel()


@registered("sensor", "rgb")
class ColorSensor(CameraSensor):
    """The color image of a camera: (rows, columns, 3) uint8."""

    name: str = "rgb"

    @property
    def space(self) -> spaces.Space[Any]:
        """An 8-bit image."""
        return spaces.Box(0, 255, (self.rows, self.columns, 3), np.uint8)

    def measured(self, state: State) -> Reading:
        """Return the color image."""
        view = self._view(state)
        return state.rays("visual").color(view.faces, view.directions).reshape(self.rows, self.columns, 3)
