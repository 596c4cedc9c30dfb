"""A policy as the servers of the NavDP benchmark see one: frames and a goal in, a trajectory out."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.point_nav import GOAL_RANGE
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import IMAGE_SHAPE, RANGE
from labgym.errors import LabgymError
from labgym.geometry import relative
from labgym.navigation import Pose
from labgym.policies.http.frames import to_camera_frame
from labgym.policies.http.wire import FULL_SCALE, intrinsic_matrix
from labgym.policies.policy import EpisodeStart, Observation, Policy

POINTS = 24
"""Points of a trajectory; the first is the first step."""
SPACING = 0.1
"""Distance between them, metres, where the path is long enough."""
TURN_TIME = 1.0
"""How long a turn in place is looked ahead, seconds: the trajectory leads off in the direction faced then."""
STILL = 0.05
"""Speed (m/s) and turn rate (rad/s) below which a command is rest."""

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Frame:
    """One request's share of one robot.

    Attributes:
        colour: (H, W, 3) RGB. depth: (H, W) planar, metres.
        goal: (x, y) in the camera's ground frame, metres.
        intrinsic: camera matrix (3, 3), pixels.
        pose: the robot's (x, y, yaw) in any fixed frame, None where the client does not say.
        velocity: forward, m/s, and turn, rad/s.
    """

    colour: NDArray[np.uint8]
    depth: NDArray[np.float32]
    goal: tuple[float, float]
    intrinsic: Array
    pose: Pose | None = None
    velocity: tuple[float, float] = (0.0, 0.0)


class _Seen(dict[str, NDArray[Any]]):
    """An observation that says what is not in it."""

    def __missing__(self, key: str) -> NDArray[Any]:
        raise LabgymError(f"the policy asks for {key!r}; the NavDP benchmark's protocol carries {', '.join(self)}")


class ServedPolicy:
    """One policy for one robot.

    With the client's pose the policy drives an episode as in the evaluator. Without one its odometry is unknown: each
    frame then begins an episode of its own, and the policy remembers nothing.

    Args:
        policy: who drives; not privileged.
        entropy: of the policy's randomness.
    """

    def __init__(self, policy: Policy, entropy: np.random.SeedSequence) -> None:
        self._policy, self._entropy = policy, entropy
        self._origin: Pose | None = None

    def forget(self) -> None:
        """Begin a new episode with the next frame."""
        self._origin = None

    def trajectory(self, frame: Frame) -> Array:
        """Return where to drive, (24, 3): x and y in the camera's ground frame, metres, and the heading, radians."""
        goal = _within_range(frame.goal[0] + ROBOT.camera_forward, frame.goal[1])
        if self._origin is None or frame.pose is None:
            self._origin = frame.pose
            rng = np.random.default_rng(self._entropy.spawn(1)[0])
            self._policy.reset(EpisodeStart(goal=goal, rng=rng))
        pose = relative(self._origin, frame.pose) if self._origin and frame.pose else (0.0, 0.0, 0.0)
        action = np.asarray(self._policy.act(_observation(frame, goal, pose)), dtype=np.float64)
        if action.shape != (2,) or not np.isfinite(action).all():
            raise LabgymError(
                f"policy {self._policy.name!r} returned shape {action.shape}, expected two finite numbers"
            )
        path = self._policy.planned_path()
        if path is None:
            return rolled_out(*ROBOT.twist(float(action[0]), float(action[1])))
        return _with_headings(to_camera_frame(_ahead(path, pose), pose, ROBOT.camera_forward))

    def close(self) -> None:
        """Free what the policy holds."""
        self._policy.close()


def rolled_out(v: float, w: float) -> Array:
    """Return the trajectory (24, 3) of a robot that keeps a velocity for 2.4 s, in the camera's ground frame.

    A turn in place, which moves no point of the axis, becomes a straight metre in the direction that the robot faces
    in a second, at least 0.5 and at most 1.57 rad aside: whoever follows it has to turn. Rest is 24 times the lens.

    Args:
        v, w: m/s and rad/s.
    """
    times = ROBOT.control_dt * np.arange(1, POINTS + 1)
    if abs(v) < STILL and abs(w) < STILL:
        return np.zeros((POINTS, 3))
    if abs(v) < STILL:
        bearing = math.copysign(min(max(abs(w) * TURN_TIME, 0.5), math.pi / 2.0), w)
        along = np.linspace(1.0 / POINTS, 1.0, POINTS)
        points = along[:, None] * (math.cos(bearing), math.sin(bearing))
    elif abs(w) < 1e-6:
        points = np.column_stack([v * times, np.zeros(POINTS)])
    else:
        # Further round than a half circle an arc comes back: what follows paths would cut across it.
        turned = np.clip(w * times, -math.pi, math.pi)
        points = v / w * np.column_stack([np.sin(turned), 1.0 - np.cos(turned)])
    return _with_headings(points - (ROBOT.camera_forward, 0.0))


def resampled_view(frame: Frame) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Return picture (72, 128, 3) and depth (72, 128) as our camera would have them, by the frame's intrinsic matrix.

    Each of our pixels takes the nearest one of theirs; what their camera does not see takes the edge's. Saturated
    depth means that nothing is near: it becomes our camera's range.
    """
    rows, columns = IMAGE_SHAPE
    ours = intrinsic_matrix(columns, rows, ROBOT.camera_hfov)
    u = (np.arange(columns) + 0.5 - ours[0, 2]) / ours[0, 0] * frame.intrinsic[0, 0] + frame.intrinsic[0, 2]
    v = (np.arange(rows) + 0.5 - ours[1, 2]) / ours[1, 1] * frame.intrinsic[1, 1] + frame.intrinsic[1, 2]
    height, width = frame.depth.shape
    across = np.clip(np.floor(u), 0, width - 1).astype(np.intp)
    down = np.clip(np.floor(v), 0, height - 1).astype(np.intp)
    depth = frame.depth[np.ix_(down, across)]
    far = np.round(depth * 10_000.0) >= FULL_SCALE
    return frame.colour[np.ix_(down, across)], np.where(far, np.float32(RANGE), depth)


def blank_frame() -> Frame:
    """Return a frame that shows nothing, with a goal 3 m ahead: to see whether a policy can be served at all."""
    return Frame(
        colour=np.zeros((360, 640, 3), np.uint8),
        depth=np.full((360, 640), 3.0, np.float32),
        goal=(3.0, 0.0),
        intrinsic=intrinsic_matrix(640, 360, ROBOT.camera_hfov),
        pose=(0.0, 0.0, 0.0),
    )


def _within_range(x: float, y: float) -> tuple[float, float]:
    """Return a goal no farther than the environment tells: a policy may map everything as far as its goal."""
    shrink = min(1.0, GOAL_RANGE / max(math.hypot(x, y), 1e-9))
    return shrink * x, shrink * y


def _observation(frame: Frame, goal: tuple[float, float], pose: Pose) -> Observation:
    bearing = math.atan2(goal[1], goal[0])
    colour, depth = resampled_view(frame)
    return _Seen(
        goal=np.array([math.hypot(*goal), math.cos(bearing), math.sin(bearing)], np.float32),
        velocity=np.array(frame.velocity, np.float32),
        odometry=np.array(pose, np.float64),
        depth=depth.ravel(),
        rgb=colour,
    )


def _ahead(path: Array, pose: Pose) -> Array:
    """Return the next 24 points of a path from the place on it that is nearest to the robot."""
    points = np.asarray(path, dtype=np.float64)
    if len(points) == 1:
        return np.repeat(points, POINTS, axis=0)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    dense = np.linspace(0.0, along[-1], max(2, math.ceil(along[-1] / 0.02) + 1))
    fine = np.column_stack([np.interp(dense, along, points[:, axis]) for axis in range(2)])
    begin = dense[int(np.argmin(((fine - np.asarray(pose[:2])) ** 2).sum(axis=1)))]
    step = min(SPACING, (along[-1] - begin) / POINTS)
    places = begin + step * np.arange(1, POINTS + 1)
    return np.column_stack([np.interp(places, along, points[:, axis]) for axis in range(2)])


def _with_headings(points: Array) -> Array:
    steps = np.diff(points, axis=0, prepend=[(-ROBOT.camera_forward, 0.0)])
    return np.column_stack([points, np.arctan2(steps[:, 1], steps[:, 0])])
