"""The warm start: the network imitates a privileged expert on the states that it visits (DAgger, Ross et al. 2011)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.sparse.csgraph import dijkstra
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv
from tqdm import tqdm

from labgym.envs.robot import turn_towards
from labgym.envs.tasks import Task
from labgym.layouts import Layout
from labgym.navigation import PLANNING_RADIUS, Pose, occupancy
from labgym.navigation.grid_search import grid_graph
from labgym.policies.grid_planner import clearance_field
from labgym.policies.ppo.inputs import SPEED
from labgym.policies.ppo.options import PPOOptions
from labgym.policies.ppo.practice import PracticeEnv
from labgym.policies.tracking import PathTracker

REPLAN_DISTANCE_M = 0.30
"""Distance from its path beyond which the expert replans, meters."""

COMFORT_M = 0.50
"""Clearance beyond which more has no benefit, meters."""

AVERSION = 2.0
"""Extra cost per meter at the planning radius compared with `COMFORT_M`, as a multiple of length."""

SMOOTHING_CELLS = 7
"""Cells over which a path is averaged."""

Cell = tuple[int, int]

Floats = NDArray[np.float32]

ACTION_NOISE = 0.3
"""Standard deviation of the noise on the driver's actions, so that states off the path are visited."""


class Atlas:
    """Paths to goals from every free cell of a layout; each goal is searched once and its result cached."""

    def __init__(self, layout: Layout) -> None:
        grid = occupancy(layout)
        self._grid = grid.dilated(PLANNING_RADIUS)
        self._inside = np.argwhere(~self._grid.occupied)
        lack = np.clip((COMFORT_M - clearance_field(grid)) / (COMFORT_M - PLANNING_RADIUS), 0.0, 1.0)
        self._graph = grid_graph(self._grid, 1.0 + AVERSION * lack**2)
        self._next: dict[Cell, NDArray[np.int32]] = {}

    def path(self, start: tuple[float, float], goal: tuple[float, float]) -> NDArray[np.float64] | None:
        """Return a path (n, 2) in room coordinates, meters, that prefers clearance; None if no path exists.

        An end where the robot does not fit is joined to the nearest free cell by a straight piece.
        """
        if len(self._inside) == 0:
            return None
        source, target = self._nearest(start), self._nearest(goal)
        width = self._grid.shape[1]
        if target not in self._next:
            self._next[target] = dijkstra(
                self._graph, directed=False, indices=target[0] * width + target[1], return_predecessors=True
            )[1].astype(np.int32)
        onward, cell, end = self._next[target], source[0] * width + source[1], target[0] * width + target[1]
        cells = [cell]
        while cell != end:
            cell = int(onward[cell])
            if cell < 0:
                return None
            cells.append(cell)
        rows, columns = np.divmod(np.array(cells), width)
        xs, ys = self._grid.centres()
        return np.concatenate([[start], _smooth(np.column_stack([xs[columns], ys[rows]])), [goal]])

    def _nearest(self, point: tuple[float, float]) -> Cell:
        row, column = self._grid.cell_of(*point)
        if not self._grid.free(*point):
            row, column = self._inside[np.argmin(((self._inside - (row, column)) ** 2).sum(axis=1))]
        return int(row), int(column)


class Expert:
    """Gives the expert's action at any pose of a drive; replans when the robot has left its path.

    Args:
        atlases: by layout id, filled as needed; experts of one process may share them.
    """

    def __init__(self, atlases: dict[str, Atlas]) -> None:
        self._atlases = atlases
        self._task: Task | None = None
        self._path: NDArray[np.float64] | None = None
        self._tracker: PathTracker | None = None

    def action(self, task: Task, pose: Pose, speed: float) -> NDArray[np.float64]:
        """Return the action (2,) at a pose in the room frame: a turn in place if no path leads to the goal.

        Args:
            task: the current drive; a new one starts a new path.
            pose: (x, y, yaw).
            speed: forward velocity, m/s.
        """
        if task is not self._task or (self._path is not None and _distance(self._path, *pose[:2]) > REPLAN_DISTANCE_M):
            if task.layout.id not in self._atlases:
                self._atlases[task.layout.id] = Atlas(task.layout)
            self._task = task
            self._path = self._atlases[task.layout.id].path(pose[:2], task.pair.goal[:2])
            self._tracker = None if self._path is None else PathTracker(self._path)
        return turn_towards(1.0) if self._tracker is None else self._tracker.action(pose, speed)


def _smooth(path: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a path (n, 2) averaged over neighboring points, its ends kept."""
    if len(path) < SMOOTHING_CELLS:
        return path
    half = SMOOTHING_CELLS // 2
    padded = np.concatenate([np.repeat(path[:1], half, 0), path, np.repeat(path[-1:], half, 0)])
    kernel = np.full(SMOOTHING_CELLS, 1.0 / SMOOTHING_CELLS)
    return np.column_stack([np.convolve(padded[:, axis], kernel, mode="valid") for axis in range(2)])


def _distance(path: NDArray[np.float64], x: float, y: float) -> float:
    """Return the distance from a point to a polyline (n, 2), meters."""
    if len(path) == 1:
        return math.dist(path[0], (x, y))
    starts, steps = path[:-1], np.diff(path, axis=0)
    along = ((x, y) - starts) * steps
    share = np.clip(along.sum(axis=1) / np.maximum((steps**2).sum(axis=1), 1e-12), 0.0, 1.0)
    nearest = starts + share[:, None] * steps
    return float(np.hypot(nearest[:, 0] - x, nearest[:, 1] - y).min())


@dataclass(frozen=True, eq=False)
class Lessons:
    """Control steps of one round.

    Attributes:
        vectors: (n, SIZES[sensor]), the network's inputs.
        actions: (n, 2) of the expert.
        returns: (n,) discounted returns of the driver; NaN where the round ended before the episode.
    """

    vectors: Floats
    actions: Floats
    returns: Floats


def clone_expert(learner: PPO, environments: DummyVecEnv, options: PPOOptions) -> list[dict[str, float | None]]:
    """Train the learner's actor on the expert's actions and its critic on the returns; return one record per round.

    The expert drives in the first round. The probability that the learner drives rises to one in the later rounds.
    """
    optimizer = torch.optim.Adam(learner.policy.parameters(), lr=options.cloning_rate)
    lessons: list[Lessons] = []
    atlases: dict[str, Atlas] = {}
    records: list[dict[str, float | None]] = []
    updates = options.cloning_rounds * options.cloning_epochs
    for round_ in range(options.cloning_rounds):
        share = min(1.0, round_ / max(1.0, options.cloning_rounds / 2.0))
        lesson, success = _drive(learner, environments, options, atlases, share, round_)
        lessons.append(lesson)
        loss = 0.0
        for epoch in range(options.cloning_epochs):
            done = (round_ * options.cloning_epochs + epoch) / updates
            optimizer.param_groups[0]["lr"] = options.cloning_rate * (1.0 - 0.9 * done)
            loss = _fit(learner, optimizer, lessons, options, seed=round_ * options.cloning_epochs + epoch)
        records.append({"round": round_, "driven": share, "success": success, "loss": loss})
    return records


def _drive(
    learner: PPO,
    environments: DummyVecEnv,
    options: PPOOptions,
    atlases: dict[str, Atlas],
    share: float,
    round_: int,
) -> tuple[Lessons, float | None]:
    """Drive one round; return its control steps and the share of episodes that succeeded."""
    rng = np.random.default_rng([options.seed, round_])
    practice: list[PracticeEnv] = [env for env in environments.envs if isinstance(env, PracticeEnv)]
    experts = [Expert(atlases) for _ in practice]
    environments.seed(int(rng.integers(2**31)))
    vectors: Any = environments.reset()
    poses = [(*env.task.pair.start, 0.0) for env in practice]
    student = rng.random(len(practice)) < share
    inputs, labels, rewards, ends, outcomes = [], [], [], [], []
    for _ in tqdm(range(options.cloning_steps // len(practice)), desc=f"warm start {round_ + 1}", mininterval=10.0):
        actions = np.array(
            [
                expert.action(env.task, pose[:3], pose[3])
                for expert, env, pose in zip(experts, practice, poses, strict=True)
            ],
            dtype=np.float32,
        )
        own, _ = learner.predict(vectors, deterministic=True)
        noisy = np.where(student[:, None], own, actions) + rng.normal(0.0, ACTION_NOISE, actions.shape)
        inputs.append(vectors)
        labels.append(actions)
        vectors, reward, done, infos = environments.step(np.clip(noisy, -1.0, 1.0).astype(np.float32))
        rewards.append(reward)
        ends.append(done)
        for k, info in enumerate(infos):
            poses[k] = (*info["pose"], float(vectors[k][SPEED]))
            if done[k]:
                outcomes.append(bool(info["success"]))
                poses[k] = (*practice[k].task.pair.start, 0.0)
                student[k] = rng.random() < share
    returns = _returns(np.array(rewards), np.array(ends), options.discount)
    lessons = Lessons(np.concatenate(inputs), np.concatenate(labels), returns.ravel())
    return lessons, float(np.mean(outcomes)) if outcomes else None


def _returns(rewards: Floats, ends: NDArray[np.bool_], discount: float) -> Floats:
    """Return the discounted return of each step, (steps, environments); NaN where the episode did not end."""
    returns = np.full(rewards.shape, np.nan, dtype=np.float32)
    after = np.full(rewards.shape[1], np.nan, dtype=np.float32)
    for k in range(len(rewards) - 1, -1, -1):
        after = rewards[k] + discount * np.where(ends[k], 0.0, after)
        returns[k] = after
    return returns


def _fit(
    learner: PPO, optimizer: torch.optim.Optimizer, lessons: list[Lessons], options: PPOOptions, seed: int
) -> float:
    """Make one pass over the lessons; return the mean loss of the actions."""
    vectors, actions, returns = (
        torch.from_numpy(np.concatenate([getattr(lesson, name) for lesson in lessons]))
        for name in ("vectors", "actions", "returns")
    )
    policy: Any = learner.policy
    policy.train()
    order = torch.randperm(len(vectors), generator=torch.Generator().manual_seed(seed))
    total = 0.0
    for batch in torch.split(order, options.batch):
        features = policy.extract_features(vectors[batch])
        actor, critic = policy.mlp_extractor(features)
        copying = (policy.action_net(actor) - actions[batch]).abs().mean()
        complete = ~returns[batch].isnan()
        judging = (policy.value_net(critic)[:, 0] - returns[batch])[complete].square().mean()
        loss = copying + 0.5 * torch.nan_to_num(judging)
        optimizer.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(policy.parameters(), 1.0)
        optimizer.step()
        total += float(copying.detach()) * len(batch)
    return total / len(vectors)
