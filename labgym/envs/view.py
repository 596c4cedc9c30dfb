"""A picture of the robot at work, from behind and above."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import attach_robot
from labgym.envs.simulation import Pose, Simulation
from labgym.layouts import Layout
from labgym.scenes import RayScene, make_renderer, to_mjcf
from labgym.scenes.mesh import ROOM

DISTANCE = 3.6
"""From the camera to what it looks at, metres."""

STATIONS = tuple(
    (math.radians(aside), math.radians(pitch))
    for pitch in (38.0, 58.0, 78.0)
    for aside in (25.0, -25.0, 0.0, 60.0, -60.0)
)
"""Where the camera may stand, best first: how far to the right of straight behind, and how steeply it looks down."""

SEEN = (0.15, 0.7, 1.25)
"""Heights of the robot that must be in sight, metres."""

AHEAD, LOOK_AT_HEIGHT = 0.5, 0.6
"""The point it looks at: before the robot and above the floor, metres."""

FOVY = 55.0
"""Vertical field of view, degrees."""


class ChaseView:
    """A camera that follows the robot, from where furniture does not hide it.

    The scene is compiled and the renderer made for the first picture of a layout.

    Args:
        width, height: of the pictures, pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self._size = (width, height)
        self._station = 0
        self._layout: Layout | None = None
        self._scene: Simulation | None = None
        self._renderer: mujoco.Renderer | None = None

    def picture(self, layout: Layout, rays: RayScene, pose: Pose) -> NDArray[np.uint8]:
        """Return the robot at a pose in a layout, (height, width, 3).

        Args:
            rays: the layout's visible scene.

        Raises:
            OptionError: the picture is larger than the scene's off-screen buffer.
            MissingRendererError: there is no OpenGL.
        """
        if self._renderer is None or self._scene is None or self._layout is not layout:
            self.close()
            spec = to_mjcf(layout)
            attach_robot(spec)
            spec.visual.global_.fovy = FOVY
            self._scene, self._layout = Simulation(spec.compile()), layout
            self._renderer = make_renderer(self._scene.model, *self._size)
        hidden = _hidden(rays, pose)
        if hidden[self._station] > 0:
            self._station = int(hidden.argmin())
        self._scene.place(pose)
        self._renderer.update_scene(self._scene.data, _camera(pose, STATIONS[self._station]))
        picture: NDArray[np.uint8] = self._renderer.render().copy()
        return picture

    def close(self) -> None:
        """Free the renderer; the next picture makes another."""
        if self._renderer is not None:
            self._renderer.close()
        self._layout = self._scene = self._renderer = None


def _camera(pose: Pose, station: tuple[float, float]) -> mujoco.MjvCamera:
    aside, pitch = station
    camera = mujoco.MjvCamera()
    camera.lookat = _looked_at(pose)
    camera.distance, camera.azimuth, camera.elevation = DISTANCE, math.degrees(pose[2] + aside), -math.degrees(pitch)
    return camera


def _looked_at(pose: Pose) -> tuple[float, float, float]:
    x, y, yaw = pose
    return x + AHEAD * math.cos(yaw), y + AHEAD * math.sin(yaw), LOOK_AT_HEIGHT


def _hidden(rays: RayScene, pose: Pose) -> NDArray[np.int64]:
    """Return how many of the heights in `SEEN` furniture hides from each station; walls hide nothing from outside."""
    target = np.array(_looked_at(pose))
    bearing = np.array([pose[2] + aside for aside, _ in STATIONS])
    pitch = np.array([pitch for _, pitch in STATIONS])
    back = np.column_stack([-np.cos(bearing) * np.cos(pitch), -np.sin(bearing) * np.cos(pitch), np.sin(pitch)])
    robot = np.array([(pose[0], pose[1], height) for height in SEEN])
    sight = (target + DISTANCE * back)[:, None, :] - robot[None, :, :]
    length = np.linalg.norm(sight, axis=-1)
    origins = np.broadcast_to(robot, sight.shape).reshape(-1, 3)
    distances, faces = rays.cast(origins, (sight / length[..., None]).reshape(-1, 3), 2.0 * DISTANCE)
    blocked = (distances < length.ravel()) & (faces >= 0) & (rays.mesh.owner[faces] != ROOM)
    counts: NDArray[np.int64] = blocked.reshape(length.shape).sum(axis=1)
    return counts
