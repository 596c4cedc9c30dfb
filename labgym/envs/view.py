"""A picture of the robot at work, from behind and above."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import attach_robot
from labgym.envs.simulation import Pose, Simulation
from labgym.layouts import Layout
from labgym.scenes import to_mjcf
from labgym.scenes.render import make_renderer

DISTANCE = 3.6
"""From the camera to what it looks at, metres."""

PITCH, ASIDE = math.radians(38.0), math.radians(25.0)
"""How steeply the camera looks down, and how far to the right of the robot's heading it stands."""

AHEAD, LOOK_AT_HEIGHT = 0.5, 0.6
"""The point it looks at: before the robot and above the floor, metres."""

FOVY = 55.0
"""Vertical field of view, degrees."""


class ChaseView:
    """A camera that follows the robot; the scene is compiled and the renderer made for the first picture of a layout.

    Args:
        width, height: of the pictures, pixels.
    """

    def __init__(self, width: int, height: int) -> None:
        self._size = (width, height)
        self._layout: Layout | None = None
        self._scene: Simulation | None = None
        self._renderer: mujoco.Renderer | None = None

    def picture(self, layout: Layout, pose: Pose) -> NDArray[np.uint8]:
        """Return the robot at a pose in a layout, (height, width, 3).

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
        self._scene.place(pose)
        self._renderer.update_scene(self._scene.data, _chasing(pose))
        picture: NDArray[np.uint8] = self._renderer.render().copy()
        return picture

    def close(self) -> None:
        """Free the renderer; the next picture makes another."""
        if self._renderer is not None:
            self._renderer.close()
        self._layout = self._scene = self._renderer = None


def _chasing(pose: Pose) -> mujoco.MjvCamera:
    """Return the camera behind and above a robot; walls are seen through from outside, so that it may stand there."""
    x, y, yaw = pose
    camera = mujoco.MjvCamera()
    camera.lookat = [x + AHEAD * math.cos(yaw), y + AHEAD * math.sin(yaw), LOOK_AT_HEIGHT]
    camera.distance, camera.azimuth, camera.elevation = DISTANCE, math.degrees(yaw + ASIDE), -math.degrees(PITCH)
    return camera
