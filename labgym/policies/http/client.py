"""A policy on a server of the NavDP benchmark: it receives images and answers with a path."""

from __future__ import annotations

import json
import mmap
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, get_args

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.errors import OptionError
from labgym.geometry import Array, to_world
from labgym.navigation import Pose
from labgym.policies.http.connection import Connection, ServerError, StatusError
from labgym.policies.http.forms import encode_form
from labgym.policies.http.served import state_of, to_start_frame
from labgym.policies.http.wire import Step, encode_color, encode_depth, intrinsic_matrix, path_of
from labgym.policies.policy import EpisodeStart, Observation, Policy, Sensors
from labgym.policies.tracking import PathTracker, velocities_to_action

WIDTH, HEIGHT = 640, 360
"""Size of the images that are sent, as in that benchmark."""
PICTURE_FORMATS = ("PNG", "JPEG", "BMP", "PPM", "TIFF", "WEBP")
"""Formats of a goal's picture; others, such as EPS, would run another program."""
MAX_PIXELS = 16_000_000
MAX_POINTS = 2048
FARTHEST_POINT_M = 50.0
"""Largest coordinate of a trajectory, meters."""
MOVING_SPEED = 0.1
"""Speed above which a new path continues the previous one, m/s."""
ARRIVED_DISTANCE_M = 0.03
"""Distance from a goal point at which the robot stands still, meters."""


class SharedFlag:
    """A flag that is set for the process that made it and all its forks at once; a copy is a new flag, not set.

    The evaluator runs each episode in a fork of the process that loaded the policy. What the policy knows of a server
    outlives the fork, as the server does; it holds nothing of the episode.
    """

    def __init__(self) -> None:
        self._byte = mmap.mmap(-1, 1)

    def __bool__(self) -> bool:
        return self._byte[0] == 1

    def set(self, value: bool) -> None:
        """Change the flag."""
        self._byte[0] = int(value)

    def __reduce__(self) -> tuple[type[SharedFlag], tuple[()]]:
        return SharedFlag, ()


class HttpPolicy(Policy):
    """Follows the trajectories of a server.

    The protocol is that of the NavDP benchmark: `/navigator_reset` before the first episode of a loaded policy and
    after a failure, `/navigator_reset_env` before each other episode, a step while driving. Images are enlarged to
    640 x 360, depth without interpolation. The intrinsic matrix is that of our camera (68 degrees, f = 474.4 pixels;
    theirs has 476.6). Goal and trajectory are in the camera's ground frame, 0.2 m ahead of the robot's axis. The form
    field `state_data` has the odometry, as in x-navdp's client; other servers ignore it.

    Resets are repeated after a lost connection. A step changes the server's memory, so it is repeated only if no
    connection could be opened.

    Args:
        url: URL of the server.
        step: "pointgoal", "imagegoal" or "nogoal", the request that is sent: `/pointgoal_step` and so on.
        goal_image: file of the picture that "imagegoal" sends: the view of the camera at the goal.
        approach: distance from a goal point within which the robot drives straight at it without the server, meters:
            the goal is then below the lens or behind it.
        stop_threshold: passed to the server; NavDP turns in place if its critic's values are below it.
        replan: control steps between two requests.
        step_timeout, reset_timeout: time limit of one answer, seconds; the first reset may load a model.
        retries, backoff: see `Connection`.
        send_state: whether the odometry is sent.
        latency: declared time from an observation to its action, seconds (`Policy.latency`).

    Raises:
        OptionError: an argument is out of range, or "imagegoal" and `goal_image` are not given together.
    """

    name: ClassVar[str] = "http"
    observation: ClassVar[Sensors] = "rgbd"
    exclusive: ClassVar[bool] = True

    def __init__(
        self,
        url: str,
        *,
        step: Step = "pointgoal",
        goal_image: str | None = None,
        approach: float = 0.25,
        stop_threshold: float = -3.0,
        replan: int = 2,
        step_timeout: float = 30.0,
        reset_timeout: float = 180.0,
        retries: int = 3,
        backoff: float = 0.2,
        send_state: bool = True,
        latency: float = 0.0,
    ) -> None:
        if replan < 1 or not 0.0 < step_timeout <= 3600.0 or not 0.0 < reset_timeout <= 3600.0:
            raise OptionError(
                f"replan is {replan}, step_timeout {step_timeout} s and reset_timeout {reset_timeout} s; "
                "expected replan of at least 1 and timeouts above 0 and at most 3600 s"
            )
        if step not in get_args(Step):
            raise OptionError(f"step is {step!r}; expected one of: {', '.join(get_args(Step))}")
        if (step == "imagegoal") != (goal_image is not None):
            raise OptionError(f"step is {step!r} and goal_image {goal_image!r}; imagegoal alone needs a goal_image")
        if not 0.0 <= approach <= 2.0 or not 0.0 <= latency <= 10.0:
            raise OptionError(f"approach is {approach} m and latency {latency} s; expected 0 to 2 m and 0 to 10 s")
        self._connection = Connection(url, retries, backoff)
        self._step: Step = step
        self._goal_file = None if goal_image is None else Path(goal_image)
        self._goal_picture = None if self._goal_file is None else large_picture(read_picture(self._goal_file))
        self._stop_threshold, self._replan, self._send_state = stop_threshold, replan, send_state
        self._step_timeout, self._reset_timeout, self._approach = step_timeout, reset_timeout, approach
        self.latency = latency  # type: ignore[misc] # the user declares it
        self._robot: RobotSpec = ROBOT
        self._ready = SharedFlag()
        self._steps = 0
        self._tracker: PathTracker | None = None

    def reset(self, episode: EpisodeStart) -> None:
        """Start a new episode on the server.

        Raises:
            ServerError: see `Connection.post`; or the answer names no algorithm.
        """
        self._robot, self._steps, self._tracker = episode.robot, 0, None
        ready = bool(self._ready)
        self._ready.set(False)
        if not (ready and self._robot_is_reset()):
            intrinsic = intrinsic_matrix(WIDTH, HEIGHT, episode.robot.camera_hfov)
            self._reset(
                "/navigator_reset",
                {"intrinsic": intrinsic.tolist(), "stop_threshold": self._stop_threshold, "batch_size": 1},
            )
        self._ready.set(True)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Request a trajectory if one is due and follow the latest; stand still if it has no length.

        Raises:
            ServerError: see `Connection.post`; or the answer has no valid trajectory.
        """
        x, y, yaw = (float(value) for value in observation["odometry"])
        pose: Pose = (x, y, yaw)
        speed = float(observation["velocity"][0])
        if self._steps % self._replan == 0:
            path = self._path(observation, pose)
            moving = self._tracker is not None and speed > MOVING_SPEED
            self._tracker = PathTracker(path, self._robot, turning=not moving) if len(path) > 1 else None
        self._steps += 1
        if self._tracker is None:
            return velocities_to_action(0.0, 0.0, self._robot)
        return self._tracker.action(pose, speed)

    def files(self) -> tuple[Path, ...]:
        """Return the picture of the goal, if there is one."""
        return () if self._goal_file is None else (self._goal_file,)

    def parameters(self) -> Mapping[str, Any]:
        """Return the options on which the actions depend."""
        return {
            "url": self._connection.url,
            "step": self._step,
            "approach": self._approach,
            "stop_threshold": self._stop_threshold,
            "replan": self._replan,
            "send_state": self._send_state,
            "latency": self.latency,
        }

    def _robot_is_reset(self) -> bool:
        """Start a new episode of the robot; return False if the server refuses, as one that was restarted does."""
        try:
            self._reset("/navigator_reset_env", {"env_id": 0})
        except StatusError:
            return False
        return True

    def _reset(self, path: str, content: dict[str, Any]) -> None:
        answer = self._connection.post(path, "application/json", json.dumps(content).encode(), self._reset_timeout)
        if not isinstance(answer, dict) or not isinstance(answer.get("algo"), str):
            raise ServerError(f'{self._connection.url}{path}: expected {{"algo": name}}, got {str(answer)[:80]!r}')

    def _path(self, observation: Observation, pose: Pose) -> Array:
        """Return the path (n, 2) of the robot's axis to follow from now on, in the start frame; one point to stand."""
        if self._step == "pointgoal":
            distance, cosine, sine = (float(value) for value in observation["goal"])
            if distance <= self._approach:
                goal = np.array([[distance * cosine, distance * sine]])
                return to_world(
                    np.concatenate([np.zeros((1, 2)), goal if distance > ARRIVED_DISTANCE_M else goal[:0]]), pose
                )
        return to_start_frame(self._trajectory(observation, pose), pose, self._robot.camera_forward)

    def _trajectory(self, observation: Observation, pose: Pose) -> Array:
        """Return the server's trajectory (n, 2) for an observation, in the camera's ground frame."""
        content_type, body = encode_form(*self._form(observation, pose))
        self._ready.set(False)
        path = path_of(self._step)
        answer = self._connection.post(path, content_type, body, self._step_timeout, idempotent=False)
        trajectory = checked_trajectory(answer, f"{self._connection.url}{path}")
        self._ready.set(True)
        return trajectory

    def _form(self, observation: Observation, pose: Pose) -> tuple[dict[str, str], dict[str, tuple[str, str, bytes]]]:
        color, depth = enlarged(observation)
        clock = f"{self._steps * self._robot.control_dt:.3f}"
        fields = {"depth_time": clock, "rgb_time": clock}
        files = {
            "image": ("image.jpg", "image/jpeg", encode_color(color[None])),
            "depth": ("depth.png", "image/png", encode_depth(depth[None])),
        }
        if self._step == "pointgoal":
            distance, cosine, sine = (float(value) for value in observation["goal"])
            goal = {"goal_x": [distance * cosine - self._robot.camera_forward], "goal_y": [distance * sine]}
            fields["goal_data"] = json.dumps(goal)
        if self._goal_picture is not None:
            files["goal"] = ("goal.jpg", "image/jpeg", encode_color(self._goal_picture[None]))
        if self._send_state:
            fields["state_data"] = json.dumps(state_of(pose, observation["velocity"]))
        return fields, files


def enlarged(observation: Observation) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return the image (360, 640, 3) and depth (360, 640), meters, of an "rgbd" observation."""
    depth = np.asarray(observation["depth"], dtype=np.float32).reshape(IMAGE_SHAPE)
    large = cv2.resize(depth, (WIDTH, HEIGHT), interpolation=cv2.INTER_NEAREST)
    return large_picture(observation["rgb"]), np.asarray(large, dtype=np.float32)


def large_picture(picture: NDArray[Any]) -> NDArray[np.uint8]:
    """Return a picture (H, W, 3) in the size of those that are sent, (360, 640, 3)."""
    size = (WIDTH, HEIGHT)
    return np.asarray(cv2.resize(np.ascontiguousarray(picture), size, interpolation=cv2.INTER_LINEAR), dtype=np.uint8)


def read_picture(path: Path) -> NDArray[np.uint8]:
    """Return the pixels (H, W, 3), RGB, of a picture.

    Raises:
        OptionError: the file cannot be read as a picture.
    """
    try:
        with Image.open(path, formats=PICTURE_FORMATS) as picture:
            if picture.width * picture.height > MAX_PIXELS:
                raise ValueError(f"{picture.width} x {picture.height} pixels, at most {MAX_PIXELS} are read")
            return np.asarray(picture.convert("RGB"), dtype=np.uint8)
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise OptionError(f"goal_image {str(path)!r} is not a readable picture ({error})") from None


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
    if not np.isfinite(path).all() or np.abs(path).max() > FARTHEST_POINT_M:
        raise ServerError(f"{source}: trajectory is not finite or exceeds {FARTHEST_POINT_M:g} m")
    return path
