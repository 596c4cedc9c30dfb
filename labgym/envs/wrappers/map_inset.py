"""A plan of the floor in a corner of the pictures."""

from __future__ import annotations

import math
from typing import Any

import cv2
import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from labgym.counts import is_real
from labgym.envs.robot import ROBOT
from labgym.envs.wrappers.checks import point_nav
from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.navigation import occupancy

FLOOR, FURNITURE, FRAME = (255, 255, 255), (150, 156, 163), (70, 76, 84)
WAY, GOAL, CHASSIS = (226, 122, 34), (46, 160, 67), (32, 92, 196)
"""Colors of the plan, RGB; the way, the goal and the robot as in the viewer."""

Picture = NDArray[np.uint8]


class MapInset(gym.Wrapper[Any, Any, Any, Any], gym.utils.RecordConstructorArgs):
    """Draw a plan with the robot, the way driven and the goal into the upper right corner of `render()`.

    For films, put Gymnasium's own wrapper around it (it needs moviepy):

        env = RecordVideo(MapInset(gym.make("LabFloorNav-v0", render_mode="rgb_array")), "videos")

    Observations, rewards and infos stay as they are.

    Args:
        env: a point navigation environment with render_mode "rgb_array".
        share: largest width and height of the plan, relative to those of the picture.

    Raises:
        OptionError: another render mode, or `share` is not above 0 and at most 1.
    """

    def __init__(self, env: gym.Env[Any, Any], share: float = 0.35) -> None:
        if not is_real(share) or not 0.0 < share <= 1.0:
            raise OptionError(f"share is {share!r}, expected a number above 0, at most 1")
        if env.render_mode != "rgb_array":
            raise OptionError(f"MapInset needs render_mode 'rgb_array', not {env.render_mode!r}")
        gym.utils.RecordConstructorArgs.__init__(self, share=share)
        gym.Wrapper.__init__(self, env)
        point_nav(env, "MapInset")
        self._share = float(share)
        self._way: list[tuple[float, float]] = []
        self._plan: _Plan | None = None

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._way = []
        self._note()
        return observation, info

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Carry out an action."""
        result = self.env.step(action)
        self._note()
        return result

    def render(self) -> Any:
        """Return the picture with the plan."""
        picture: Any = self.env.render()
        state = point_nav(self.env, "MapInset").state
        height, width = picture.shape[:2]
        size = max(1, int(self._share * width)), max(1, int(self._share * height))
        if self._plan is None or not self._plan.fits(state.task.layout, size):
            self._plan = _Plan(state.task.layout, size)
        inset = self._plan.drawn(state.pose, state.goal, self._way)
        picture = np.array(picture)
        picture[: inset.shape[0], width - inset.shape[1] :] = inset
        return picture

    def _note(self) -> None:
        x, y, _ = point_nav(self.env, "MapInset").state.pose
        self._way.append((x, y))


class _Plan:
    """A layout from above: x to the right, y upwards.

    Args:
        size: largest width and height, pixels.
    """

    def __init__(self, layout: Layout, size: tuple[int, int]) -> None:
        self._layout, self._largest = layout, size
        grid = occupancy(layout)
        rows, columns = grid.shape
        per_cell = min(size[0] / columns, size[1] / rows)
        shape = max(1, int(columns * per_cell)), max(1, int(rows * per_cell))
        self._origin, self._scale = grid.origin, per_cell / grid.resolution
        cells = np.where(grid.occupied[::-1, :, None], FURNITURE, FLOOR).astype(np.uint8)
        self._base: Picture = np.asarray(cv2.resize(cells, shape, interpolation=cv2.INTER_AREA), np.uint8)

    def fits(self, layout: Layout, size: tuple[int, int]) -> bool:
        """Whether this is the plan of a layout at a size."""
        return self._layout is layout and self._largest == size

    def drawn(
        self, pose: tuple[float, float, float], goal: tuple[float, float, float], way: list[tuple[float, float]]
    ) -> Picture:
        """Return the plan with the robot at a pose, its goal and the way that it drove."""
        picture = self._base.copy()
        points = np.array([self._pixel(*point) for point in way], np.int32)
        cv2.polylines(picture, [points], False, WAY, 1, cv2.LINE_AA)
        cv2.circle(picture, self._pixel(*goal[:2]), max(3, round(ROBOT.chassis_radius * self._scale)), GOAL, 2)
        x, y, yaw = pose
        radius = max(ROBOT.chassis_radius, 3.0 / self._scale)
        cv2.circle(picture, self._pixel(x, y), round(radius * self._scale), CHASSIS, -1, cv2.LINE_AA)
        nose = self._pixel(x + 1.8 * radius * math.cos(yaw), y + 1.8 * radius * math.sin(yaw))
        cv2.line(picture, self._pixel(x, y), nose, CHASSIS, 2, cv2.LINE_AA)
        height, width = picture.shape[:2]
        cv2.rectangle(picture, (0, 0), (width - 1, height - 1), FRAME, 1)
        return picture

    def _pixel(self, x: float, y: float) -> tuple[int, int]:
        """Return the column and row of a point in the room frame."""
        height = self._base.shape[0]
        return round((x - self._origin[0]) * self._scale), round(height - (y - self._origin[1]) * self._scale)
