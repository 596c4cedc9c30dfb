"""A policy behind the NavDP benchmark's protocol: from frames and a goal to a trajectory."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.parts.vectors import GOAL_RANGE
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import IMAGE_SHAPE, RANGE
from labgym.errors import LabgymError
from labgym.geometry import Array, relative, to_local, to_world
from labgym.navigation import Pose
from labgym.policies.http.wire import FULL_SCALE, intrinsic_matrix
from labgym.policies.policy import EpisodeStart, GoalKind, Observation, Policy
from labgym.policies.tracking import lengths_along, points_at

REST_DISTANCE_M = 0.02
"""Largest distance between the points of a trajectory that means "stand still", meters."""

TRAJECTORY_POINTS = 24
"""Points of a trajectory; the first point is one step ahead."""

POINT_DISTANCE_M = 0.1
"""Distance between the points, meters, if the path is long enough."""

TURN_TIME_S = 1.0
"""Look-ahead of a turn in place, seconds: the trajectory points in the direction that the robot faces then."""

STILL_VELOCITY = 0.05
"""Speed (m/s) and turn rate (rad/s) below which a command counts as standing still."""


def to_start_frame(trajectory: Array, pose: Pose, camera_forward: float) -> Array:
    """Return a trajectory as a path (n, 2) of the robot's axis in the start frame, meters, beginning at the robot.

    Points within `camera_forward` of the lens are dropped: a path through the lens would prevent a turn in place. The
    last point of a trajectory that has no others is kept, unless the trajectory means "stand still".

    Args:
        trajectory: (n, 2) in the camera's ground frame.
        pose: pose of the robot in the start frame.
        camera_forward: distance from the robot's axis to the lens, meters.
    """
    ahead = trajectory[np.linalg.norm(trajectory, axis=1) > camera_forward]
    if not len(ahead) and np.linalg.norm(trajectory - trajectory[-1], axis=1).max() > REST_DISTANCE_M:
        ahead = trajectory[-1:]
    return np.concatenate([[pose[:2]], to_world(ahead + np.array([camera_forward, 0.0]), pose)])


def to_camera_frame(path: Array, pose: Pose, camera_forward: float) -> Array:
    """Return points (n, 2) of the start frame in the camera's ground frame of a robot at a pose, meters."""
    return to_local(path, pose) - (camera_forward, 0.0)


def state_of(pose: Pose, velocity: NDArray[Any]) -> dict[str, list[list[float]]]:
    """Return `state_data`: position and quaternion (x, y, z, w) as x-navdp sends them, and velocity (m/s, rad/s)."""
    half = pose[2] / 2.0
    return {
        "robot_pos": [[pose[0], pose[1], 0.0]],
        "robot_quat": [[0.0, 0.0, math.sin(half), math.cos(half)]],
        "velocity": [[float(velocity[0]), float(velocity[1])]],
    }


@dataclass(frozen=True, eq=False)
class Frame:
    """The part of a request that belongs to one robot.

    Attributes:
        color: (H, W, 3) RGB.
        depth: (H, W) planar, meters.
        goal: (x, y) in the camera's ground frame, meters; None if the goal is not a point.
        intrinsic: camera matrix (3, 3), pixels.
        pose: the robot's (x, y, yaw) in any fixed frame; None if the client does not send it.
        velocity: forward, m/s, and turn, rad/s.
        goal_picture: (H, W, 3) RGB, what the camera would see at the goal; None if the goal is not an image. Another
            size than that of `color` stands for the same field of view.
    """

    color: NDArray[np.uint8]
    depth: NDArray[np.float32]
    goal: tuple[float, float] | None
    intrinsic: Array
    pose: Pose | None = None
    velocity: tuple[float, float] = (0.0, 0.0)
    goal_picture: NDArray[np.uint8] | None = None

    @property
    def goal_kind(self) -> GoalKind:
        """Kind of the goal."""
        if self.goal is not None:
            return "point"
        return "none" if self.goal_picture is None else "image"


class _ServedObservation(dict[str, NDArray[Any]]):
    """An observation whose missing keys raise an error that names them."""

    def __missing__(self, key: str) -> NDArray[Any]:
        raise LabgymError(f"the policy needs {key!r}; the NavDP benchmark's protocol has only {', '.join(self)}")


class ServedPolicy:
    """One policy for one robot.

    An episode begins after `forget` and when the kind of the goal changes. If the client sends the robot's pose, the
    policy drives an episode as in the evaluator. Otherwise the odometry is unknown: each frame begins a new episode,
    and the policy remembers nothing.

    Args:
        policy: not privileged.
        entropy: source of the policy's randomness.
    """

    def __init__(self, policy: Policy, entropy: np.random.SeedSequence) -> None:
        self._policy, self._entropy = policy, entropy
        self._origin: Pose | None = None
        self._kind: GoalKind | None = None

    def forget(self) -> None:
        """Begin a new episode with the next frame."""
        self._origin = None

    def trajectory(self, frame: Frame) -> Array:
        """Return a trajectory (24, 3): x and y in the camera's ground frame, meters, and the heading, radians."""
        goal = None if frame.goal is None else _within_range(frame.goal[0] + ROBOT.camera_forward, frame.goal[1])
        if self._origin is None or frame.pose is None or frame.goal_kind != self._kind:
            self._origin, self._kind = frame.pose, frame.goal_kind
            rng = np.random.default_rng(self._entropy.spawn(1)[0])
            self._policy.reset(EpisodeStart(goal=goal or (0.0, 0.0), rng=rng, goal_kind=frame.goal_kind))
        pose = relative(self._origin, frame.pose) if self._origin and frame.pose else (0.0, 0.0, 0.0)
        observation = _observation(frame, goal, pose)
        if self._policy.stop(observation):
            return rolled_out(0.0, 0.0)
        action = np.asarray(self._policy.act(observation), dtype=np.float64)
        if action.shape != (2,) or not np.isfinite(action).all():
            raise LabgymError(
                f"policy {self._policy.name!r} returned shape {action.shape}, expected two finite numbers"
            )
        path = self._policy.planned_path()
        if path is None:
            return rolled_out(*ROBOT.twist(float(action[0]), float(action[1])))
        return _with_headings(to_camera_frame(_ahead(path, pose), pose, ROBOT.camera_forward))

    def close(self) -> None:
        """Close the policy."""
        self._policy.close()


def rolled_out(v: float, w: float) -> Array:
    """Return the trajectory (24, 3) of a robot that keeps a velocity for 2.4 s, in the camera's ground frame.

    A turn in place moves no point of the axis. It becomes a straight meter in the direction that the robot faces after
    one second, 0.5 to 1.57 rad aside, so that a client has to turn to follow it. Standing still is 24 times the lens.

    Args:
        v, w: m/s and rad/s.
    """
    times = ROBOT.control_dt * np.arange(1, TRAJECTORY_POINTS + 1)
    if abs(v) < STILL_VELOCITY and abs(w) < STILL_VELOCITY:
        return np.zeros((TRAJECTORY_POINTS, 3))
    if abs(v) < STILL_VELOCITY:
        bearing = math.copysign(min(max(abs(w) * TURN_TIME_S, 0.5), math.pi / 2.0), w)
        along = np.linspace(1.0 / TRAJECTORY_POINTS, 1.0, TRAJECTORY_POINTS)
        points = along[:, None] * (math.cos(bearing), math.sin(bearing))
    elif abs(w) < 1e-6:
        points = np.column_stack([v * times, np.zeros(TRAJECTORY_POINTS)])
    else:
        # Beyond a half circle an arc comes back, and path trackers would cut across it.
        angles = np.clip(w * times, -math.pi, math.pi)
        points = v / w * np.column_stack([np.sin(angles), 1.0 - np.cos(angles)])
    return _with_headings(points - (ROBOT.camera_forward, 0.0))


def resampled_view(frame: Frame) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return the image (72, 128, 3) and depth (72, 128) of our camera, cropped from a frame by its intrinsic matrix.

    Each pixel takes the nearest pixel of the frame; pixels outside of the frame take the edge's. Saturated depth means
    that nothing is near, and becomes our camera's range.
    """
    height, width = frame.depth.shape
    seen = _pixels(frame.intrinsic, width, height)
    depth = frame.depth[seen]
    far = np.round(depth * 10_000.0) >= FULL_SCALE
    return frame.color[seen], np.where(far, np.float32(RANGE), depth)


def blank_frame(kind: GoalKind) -> Frame:
    """Return an empty frame with a kind of goal, to test whether a policy can be served."""
    blank = np.zeros((360, 640, 3), np.uint8)
    return Frame(
        color=blank,
        depth=np.full((360, 640), 3.0, np.float32),
        goal=(3.0, 0.0) if kind == "point" else None,
        intrinsic=intrinsic_matrix(640, 360, ROBOT.camera_hfov),
        pose=(0.0, 0.0, 0.0),
        goal_picture=blank if kind == "image" else None,
    )


def _pixels(intrinsic: Array, width: int, height: int) -> tuple[NDArray[np.intp], ...]:
    """Return the rows (72, 1) and columns (1, 128) of a frame's pixels that our camera's pixels take."""
    rows, columns = IMAGE_SHAPE
    ours = intrinsic_matrix(columns, rows, ROBOT.camera_hfov)
    u = (np.arange(columns) + 0.5 - ours[0, 2]) / ours[0, 0] * intrinsic[0, 0] + intrinsic[0, 2]
    v = (np.arange(rows) + 0.5 - ours[1, 2]) / ours[1, 1] * intrinsic[1, 1] + intrinsic[1, 2]
    across = np.clip(np.floor(u), 0, width - 1).astype(np.intp)
    down = np.clip(np.floor(v), 0, height - 1).astype(np.intp)
    return np.ix_(down, across)


def _goal_view(frame: Frame, picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the image (72, 128, 3) of our camera from the picture of a goal."""
    height, width = picture.shape[:2]
    scale = np.diag([width / frame.color.shape[1], height / frame.color.shape[0], 1.0])
    return picture[_pixels(scale @ frame.intrinsic, width, height)]


def _within_range(x: float, y: float) -> tuple[float, float]:
    """Return a goal, shortened to the environment's largest distance: policies may allocate maps as large as it."""
    shrink = min(1.0, GOAL_RANGE / max(math.hypot(x, y), 1e-9))
    return shrink * x, shrink * y


def _observation(frame: Frame, goal: tuple[float, float] | None, pose: Pose) -> Observation:
    color, depth = resampled_view(frame)
    observation = _ServedObservation(
        velocity=np.array(frame.velocity, np.float32),
        odometry=np.array(pose, np.float64),
        depth=depth.ravel(),
        rgb=color,
    )
    if goal is not None:
        bearing = math.atan2(goal[1], goal[0])
        observation["goal"] = np.array([math.hypot(*goal), math.cos(bearing), math.sin(bearing)], np.float32)
    if frame.goal_picture is not None:
        observation["goal_image"] = _goal_view(frame, frame.goal_picture)
    return observation


def _ahead(path: Array, pose: Pose) -> Array:
    """Return the next 24 points of a path after the point nearest to the robot."""
    points = np.asarray(path, dtype=np.float64)
    if len(points) == 1:
        return np.repeat(points, TRAJECTORY_POINTS, axis=0)
    length = lengths_along(points)[-1]
    dense = np.linspace(0.0, length, max(2, math.ceil(length / 0.02) + 1))
    fine = points_at(points, dense)
    begin = dense[int(np.argmin(((fine - np.asarray(pose[:2])) ** 2).sum(axis=1)))]
    step = min(POINT_DISTANCE_M, (length - begin) / TRAJECTORY_POINTS)
    return points_at(points, begin + step * np.arange(1, TRAJECTORY_POINTS + 1))


def _with_headings(points: Array) -> Array:
    steps = np.diff(points, axis=0, prepend=[(-ROBOT.camera_forward, 0.0)])
    return np.column_stack([points, np.arctan2(steps[:, 1], steps[:, 0])])
