"""Drives in which a policy knows an old map, its odometry drifts, people walk and actions are late."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from labgym.envs import LabPointNavEnv
from labgym.envs.conditions.beaker import Beaker
from labgym.envs.labnav.tasks import task_of
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import LIDAR_RAYS
from labgym.geometry import compose, rotate, wrap_angle
from labgym.layouts import Layout
from labgym.navigation import GoalPair
from labgym.policies import EpisodeStart, GroundTruth, Policy

Pose = tuple[float, float, float]
People = Callable[[float], np.ndarray]
LEG = 0.12
"""Radius of a person's disc in the lidar's plane, meters."""


@dataclass
class Driven:
    """A finished drive: what the robot did, and what its policy did."""

    poses: list[Pose] = field(default_factory=list)
    odometry: list[Pose] = field(default_factory=list)
    commands: list[tuple[float, float]] = field(default_factory=list)
    stopped: bool = False
    contacts: int = 0
    nearest_person: float = math.inf
    seconds: list[float] = field(default_factory=list)
    near_people: float = 0.0

    @property
    def length(self) -> float:
        return float(np.linalg.norm(np.diff(np.array(self.poses)[:, :2], axis=0), axis=1).sum())

    def error(self, goal: Pose) -> tuple[float, float]:
        """Return the distance to a pose, meters, and the difference in heading, radians."""
        x, y, yaw = self.poses[-1]
        return math.dist((x, y), goal[:2]), abs(wrap_angle(yaw - goal[2]))


class Drift:
    """Odometry whose increments have normal errors, 5 mm and 0.5 degrees per 0.25 m at `scale` 1."""

    def __init__(self, pose: Pose, scale: float, seed: int) -> None:
        self._last, self._scale, self._rng = pose, scale, np.random.default_rng(seed)
        self.pose: Pose = (0.0, 0.0, 0.0)

    def moved(self, pose: Pose) -> Pose:
        x0, y0, yaw0 = self._last
        dx, dy = rotate(pose[0] - x0, pose[1] - y0, -yaw0)
        turn, way = wrap_angle(pose[2] - yaw0), math.hypot(dx, dy)
        noise = self._rng.standard_normal(2) * self._scale * math.sqrt(way)
        self._last = pose
        self.pose = compose(self.pose, (dx + 0.01 * noise[0], dy, turn + math.radians(1.0) * noise[1]))
        return self.pose


def with_people(ranges: np.ndarray, pose: Pose, centers: np.ndarray, radius: float = LEG) -> np.ndarray:
    """Return a scan (180,) with discs at centers (n, 2) in it."""
    angles = pose[2] - math.pi + 2.0 * math.pi / LIDAR_RAYS * np.arange(LIDAR_RAYS)
    away = centers - np.array(pose[:2])
    along = np.cos(angles)[:, None] * away[:, 0] + np.sin(angles)[:, None] * away[:, 1]
    across = np.sin(angles)[:, None] * away[:, 0] - np.cos(angles)[:, None] * away[:, 1]
    hit = (np.abs(across) < radius) & (along > 0.0)
    discs = np.where(hit, along - np.sqrt(np.maximum(radius**2 - across**2, 0.0)), math.inf).min(
        axis=1, initial=math.inf
    )
    return np.minimum(ranges, discs).astype(np.float32)


def drive(
    policy: Policy,
    true: Layout,
    start: Pose,
    goal: Pose,
    *,
    old: Layout | None = None,
    mapped_goal: Pose | None = None,
    task: str = "aisle",
    docking: bool = False,
    beaker: Beaker | None = None,
    drift: float = 0.0,
    lidar_sigma: float = 0.0,
    people: People | None = None,
    steps: int = 1200,
    seed: int = 0,
    latency: float | None = None,
    env: LabPointNavEnv | None = None,
    watch: Callable[[Driven, Policy], None] | None = None,
) -> Driven:
    """Drive until the policy stops, touches something, or the steps are used up.

    Args:
        true: the layout that is driven in. old: the map of the policy; the true one by default.
        goal: in the room frame; it ends nothing. mapped_goal: where the map has it.
        docking: whether the policy receives the goal's heading.
        drift: multiple of RoboTHOR's odometry error. people: their centers (n, 2) at a time in seconds.
        latency: of the actions, seconds; by default the policy's own.
    """
    env = env or LabPointNavEnv(
        layout=true, observation="lidar" if policy.observation == "lidar" else policy.observation
    )
    rng = np.random.default_rng(seed)
    mapped = mapped_goal or goal
    seen, info = env.reset(seed=seed, options={"start": start, "goal": goal})
    local = rotate(mapped[0] - start[0], mapped[1] - start[1], -start[2])
    pair = GoalPair(0, start, mapped, "anywhere", "anywhere")
    policy.reset(
        EpisodeStart(
            goal=local,
            rng=np.random.default_rng(seed),
            robot=ROBOT,
            truth=GroundTruth(old or true, pair, start) if policy.privileged else None,
            task=task_of(task).announced(2),
            heading=wrap_angle(mapped[2] - start[2]) if docking else None,
            beaker=beaker,
        )
    )
    driven, odometry = Driven(poses=[start]), Drift(start, drift, seed)
    late = math.ceil((policy.latency if latency is None else latency) / ROBOT.control_dt - 1e-9)
    queue = [np.zeros(2)] * late
    for k in range(steps):
        pose = tuple(float(value) for value in info["pose"])
        reckoned = odometry.moved(pose) if k else (0.0, 0.0, 0.0)
        driven.odometry.append(reckoned)
        gx, gy = rotate(local[0] - reckoned[0], local[1] - reckoned[1], -reckoned[2])
        away = max(math.hypot(gx, gy), 1e-9)
        observation = {**seen, "odometry": np.array(reckoned), "goal": np.array([away, gx / away, gy / away])}
        if "lidar" in seen:
            ranges = np.asarray(seen["lidar"], dtype=np.float64)
            if people is not None:
                ranges = with_people(ranges, pose, people(0.1 * k))
            if lidar_sigma:
                ranges = np.where(ranges < 10.0, ranges + lidar_sigma * rng.standard_normal(len(ranges)), ranges)
            observation["lidar"] = np.clip(ranges, 0.0, 10.0).astype(np.float32)
        begin = time.perf_counter()
        if policy.stop(observation):
            driven.stopped = True
            break
        action = np.asarray(policy.act(observation))
        driven.seconds.append(time.perf_counter() - begin)
        queue.append(action)
        action = queue.pop(0)
        driven.commands.append(ROBOT.twist(float(action[0]), float(action[1])))
        seen, _, _, _, info = env.step(action)
        driven.poses.append(tuple(float(value) for value in info["pose"]))
        if watch is not None:
            watch(driven, policy)
        if people is not None:
            away_from = np.linalg.norm(people(0.1 * (k + 1)) - np.array(driven.poses[-1][:2]), axis=1).min()
            driven.nearest_person = min(driven.nearest_person, float(away_from))
            driven.near_people += 0.1 * float(away_from < 1.0)
        if info["collision"]:
            driven.contacts += 1
            break
    return driven
