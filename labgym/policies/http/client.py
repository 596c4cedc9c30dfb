"""A policy on a server of the NavDP benchmark: it receives images and answers with a path."""

from __future__ import annotations

import json
from typing import Any, ClassVar

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.errors import OptionError
from labgym.navigation import Pose
from labgym.policies.http.connection import Connection, ServerError
from labgym.policies.http.forms import encode_form
from labgym.policies.http.frames import state_of, to_start_frame
from labgym.policies.http.wire import encode_color, encode_depth, intrinsic_matrix
from labgym.policies.policy import EpisodeStart, Observation, Policy, Sensors
from labgym.policies.tracking import PathTracker, velocities_to_action

WIDTH, HEIGHT = 640, 360
"""Size of the images that are sent, as in that benchmark."""
MAX_POINTS = 2048
FARTHEST = 50.0
"""Largest coordinate of a trajectory, meters."""
MOVING = 0.1
"""Speed above which a new path continues the previous one, m/s."""

Array = NDArray[np.float64]


class HttpPolicy(Policy):
    """Follows the trajectories of a server.

    The protocol is that of the NavDP benchmark: `/navigator_reset` before the first episode and after a failure,
    `/navigator_reset_env` before each other episode, `/pointgoal_step` while driving. Images are enlarged to 640 x 360,
    depth without interpolation. The intrinsic matrix is that of our camera (68 degrees, f = 474.4 pixels; theirs has
    476.6). Goal and trajectory are in the camera's ground frame, 0.2 m ahead of the robot's axis. The form field
    `state_data` has the odometry, as in x-navdp's client; other servers ignore it.

    Args:
        url: URL of the server.
        stop_threshold: passed to the server; NavDP turns in place if its critic's values are below it.
        replan: control steps between two requests.
        step_timeout, reset_timeout: time limit of one answer, seconds; the first reset may load a model.
        retries, backoff: see `Connection`.
        send_state: whether the odometry is sent.

    Raises:
        OptionError: an argument is out of range.
    """

    name: ClassVar[str] = "http"
    observation: ClassVar[Sensors] = "rgbd"
    exclusive: ClassVar[bool] = True

    def __init__(
        self,
        url: str,
        stop_threshold: float = -3.0,
        replan: int = 2,
        step_timeout: float = 30.0,
        reset_timeout: float = 180.0,
        retries: int = 3,
        backoff: float = 0.2,
        send_state: bool = True,
    ) -> None:
        if replan < 1 or not 0.0 < step_timeout <= 3600.0 or not 0.0 < reset_timeout <= 3600.0:
            raise OptionError(
                f"replan is {replan}, step_timeout {step_timeout} s and reset_timeout {reset_timeout} s; "
                "expected replan of at least 1 and timeouts above 0 and at most 3600 s"
            )
        self._connection = Connection(url, retries, backoff)
        self._stop_threshold, self._replan, self._send_state = stop_threshold, replan, send_state
        self._step_timeout, self._reset_timeout = step_timeout, reset_timeout
        self._robot: RobotSpec = ROBOT
        self._ready = False
        self._steps = 0
        self._tracker: PathTracker | None = None

    def reset(self, episode: EpisodeStart) -> None:
        """Start a new episode on the server.

        Raises:
            ServerError: see `Connection.post`; or the answer names no algorithm.
        """
        self._robot, self._steps, self._tracker = episode.robot, 0, None
        ready, self._ready = self._ready, False
        if ready:
            self._reset("/navigator_reset_env", {"env_id": 0})
        else:
            intrinsic = intrinsic_matrix(WIDTH, HEIGHT, episode.robot.camera_hfov)
            self._reset(
                "/navigator_reset",
                {"intrinsic": intrinsic.tolist(), "stop_threshold": self._stop_threshold, "batch_size": 1},
            )
        self._ready = True

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Request a trajectory if one is due and follow the latest; stand still if it has no points.

        Raises:
            ServerError: see `Connection.post`; or the answer has no valid trajectory.
        """
        x, y, yaw = (float(value) for value in observation["odometry"])
        pose: Pose = (x, y, yaw)
        speed = float(observation["velocity"][0])
        if self._steps % self._replan == 0:
            path = to_start_frame(self._trajectory(observation, pose), pose, self._robot.camera_forward)
            moving = self._tracker is not None and speed > MOVING
            self._tracker = PathTracker(path, self._robot, turning=not moving) if len(path) > 1 else None
        self._steps += 1
        if self._tracker is None:
            return velocities_to_action(0.0, 0.0, self._robot)
        return self._tracker.action(pose, speed)

    def _reset(self, path: str, content: dict[str, Any]) -> None:
        answer = self._connection.post(path, "application/json", json.dumps(content).encode(), self._reset_timeout)
        if not isinstance(answer, dict) or not isinstance(answer.get("algo"), str):
            raise ServerError(f'{self._connection.url}{path}: expected {{"algo": name}}, got {str(answer)[:80]!r}')

    def _trajectory(self, observation: Observation, pose: Pose) -> Array:
        """Return the server's trajectory (n, 2) for an observation, in the camera's ground frame."""
        self._ready = False
        content_type, body = encode_form(*self._form(observation, pose))
        answer = self._connection.post("/pointgoal_step", content_type, body, self._step_timeout)
        path = checked_trajectory(answer, f"{self._connection.url}/pointgoal_step")
        self._ready = True
        return path

    def _form(self, observation: Observation, pose: Pose) -> tuple[dict[str, str], dict[str, tuple[str, str, bytes]]]:
        color, depth = enlarged(observation)
        distance, cosine, sine = (float(value) for value in observation["goal"])
        goal = {"goal_x": [distance * cosine - self._robot.camera_forward], "goal_y": [distance * sine]}
        clock = f"{self._steps * self._robot.control_dt:.3f}"
        fields = {"goal_data": json.dumps(goal), "depth_time": clock, "rgb_time": clock}
        if self._send_state:
            fields["state_data"] = json.dumps(state_of(pose, observation["velocity"]))
        files = {
            "image": ("image.jpg", "image/jpeg", encode_color(color[None])),
            "depth": ("depth.png", "image/png", encode_depth(depth[None])),
        }
        return fields, files


def enlarged(observation: Observation) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return the image (360, 640, 3) and depth (360, 640), meters, of an "rgbd" observation."""
    size = (WIDTH, HEIGHT)
    depth = np.asarray(observation["depth"], dtype=np.float32).reshape(IMAGE_SHAPE)
    color = cv2.resize(np.ascontiguousarray(observation["rgb"]), size, interpolation=cv2.INTER_LINEAR)
    return np.asarray(color, dtype=np.uint8), np.asarray(cv2.resize(depth, size, interpolation=cv2.INTER_NEAREST))


def checked_trajectory(answer: object, source: str) -> Array:
    """Return the trajectory (n, 2), meters, of an answer to one image.

    Raises:
        ServerError: the answer has no `trajectory` of shape (1, n, 2) or (1, n, 3) of finite numbers within 50 m.
    """
    content = answer.get("trajectory") if isinstance(answer, dict) else None
    try:
        points = np.asarray(content, dtype=np.float64)
    except (TypeError, ValueError):
        points = np.empty(0)
    if points.ndim != 3 or len(points) != 1 or not 1 <= points.shape[1] <= MAX_POINTS or points.shape[2] not in (2, 3):
        actual = f"has shape {points.shape}" if points.size else f"is {str(content)[:60]!r}"
        raise ServerError(f"{source}: trajectory {actual}, expected (1, n, 2) or (1, n, 3), n up to {MAX_POINTS}")
    path = points[0, :, :2]
    if not np.isfinite(path).all() or np.abs(path).max() > FARTHEST:
        raise ServerError(f"{source}: trajectory is not finite or exceeds {FARTHEST:g} m")
    return path
