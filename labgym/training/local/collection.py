"""Driving practice episodes, by LabNav's rules, and recording what the network saw, did and should have done."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray

from labgym.envs.labnav.task import leg_score
from labgym.envs.labnav.tasks import HEADLINE
from labgym.envs.state import State
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.results import DriveTerms
from labgym.navigation import Pose
from labgym.policies.adapters.actor_file import Perceptron
from labgym.policies.local.inputs import SIZE, Vector
from labgym.policies.local.policy import LocalPolicy, checked_actor
from labgym.policies.policy import EpisodeStart
from labgym.policies.stack.planner import PlannedPath
from labgym.policies.stack.policy import StackPolicy
from labgym.policies.tracking import velocities_to_action
from labgym.runs import ExecutorOptions, RunFolder, Shard, ShardOutput, run_shards
from labgym.runs.manifest import file_digest
from labgym.training.local.practice import read_floor
from labgym.training.local.rewards import STRIDE, Meter, final_reward, rewards_of

Mode = Literal["expert", "network", "noisy", "alone"]
"""Who drives: the expert; the network, with the expert's advice; the network with noise; or the network alone."""
GOALS = 2
"""Goals of a shift that are driven to; all five take as long as five drives of another task."""
Records = dict[str, NDArray[Any]]
"""The arrays of `drive`; `record_drives` joins those of several drives."""
ROUNDS = "rounds"
"""Folder of a run for its records."""


@dataclass(frozen=True)
class TrainingDrive:
    """A drive to record.

    Attributes:
        floor: file of the practice floor. task: name. number: of the episode. seed: of the policy and the noise.
    """

    floor: Path
    task: str
    number: int
    seed: int


class Apprentice(LocalPolicy):
    """The local planner while it learns: drives by itself, with noise or by its expert, and records each decision.

    Args:
        actor: the network. mode: who drives. noise: standard deviations of the noise, (2,).
        safety: whether the robot rests for people by the rules of `stack`.
    """

    name = "apprentice"

    def __init__(
        self, actor: Perceptron, mode: Mode, noise: NDArray[np.float32] | None = None, safety: bool = True
    ) -> None:
        super().__init__(actor=actor, safety=safety)
        self._mode, self._noise = mode, noise
        self.begin(0)

    def begin(self, seed: int) -> None:
        """Forget the records; the noise of the next drive depends on the seed."""
        self._rng = np.random.default_rng(seed)
        self.inputs: list[Vector] = []
        self.actions: list[Vector] = []
        self.advice: list[Vector] = []
        self.steps: list[int] = []
        self.progress: list[float] = []
        self.legs: list[int] = []
        """Number of decisions before each drive."""
        self.meter = Meter()
        self._followed: tuple[PlannedPath, float] | None = None

    def reset(self, episode: EpisodeStart) -> None:
        """Begin an episode."""
        super().reset(episode)
        self._begin_leg(episode)

    def next_goal(self, episode: EpisodeStart) -> None:
        """Begin the next drive of a shift."""
        super().next_goal(episode)
        self._begin_leg(episode)

    def watch(self, state: State) -> None:
        """Note the state after a control step."""
        if state.steps:
            self.meter.watch(state)

    def _begin_leg(self, episode: EpisodeStart) -> None:
        self.legs.append(len(self.inputs))
        self.meter.begin_leg(0.0 if episode.beaker is None else episode.beaker.freeboard)

    def _follow(self, plan: PlannedPath, pose: Pose, velocity: tuple[float, float], left: float) -> tuple[float, float]:
        stopping, advice = self._stopping, None
        if self._mode in ("expert", "network"):
            advice = StackPolicy._follow(self, plan, pose, velocity, left)
        if self._mode == "network":
            self._stopping = stopping  # The expert may have decided to stop; the network has not.
        if self._followed is not None and self._followed[0] is plan and self.progress:
            # The robot may rest for people before the next decision.
            self.progress[-1] += min(self._followed[1] - left, STRIDE)
        self._followed = plan, left
        decided = len(self.inputs)
        v, w = LocalPolicy._follow(self, plan, pose, velocity, left)
        if advice is None:
            return v, w
        if len(self.inputs) > decided:
            self.advice.append(velocities_to_action(*advice, self._robot).astype(np.float32))
        return advice if self._mode == "expert" else (v, w)

    def _decided(self, vector: Vector) -> Vector:
        action = super()._decided(vector)
        if self._mode == "noisy" and self._noise is not None:
            action = (action + self._noise * self._rng.standard_normal(2)).astype(np.float32)
        self.inputs.append(vector)
        self.actions.append(action)
        self.steps.append(len(self.meter.costs))
        self.progress.append(0.0)
        return action


def drive(apprentice: Apprentice, one: TrainingDrive) -> tuple[LabNavRow, Records]:
    """Drive an episode and return its row, and what was recorded.

    The records are `inputs` (n, SIZE), `actions` (n, 2), `advice` (n, 2) or (0, 2) and `rewards` (n,), a row for each
    decision of the network, and `lengths`, the number of decisions of each drive: one, or those of a shift.
    """
    layout, floor = read_floor(one.floor)
    apprentice.begin(one.seed)
    episode = floor.episodes[one.task][one.number]
    episode = episode.model_copy(update={"following": episode.following[: GOALS - 1]})
    (result,) = drive_floor(
        apprentice,
        layout,
        [episode],
        DriveTerms(one.task, HEADLINE, "apprentice", "practice", one.seed),
        apprentice.watch,
    )
    row = result.row
    count = len(apprentice.inputs)
    lengths = np.diff([*apprentice.legs, count])
    ends = list(zip(lengths.tolist(), _finals(row), strict=True))
    rewards = rewards_of(apprentice.meter.costs, apprentice.steps, apprentice.progress, ends)
    return row, {
        "lengths": lengths,
        "inputs": np.array(apprentice.inputs, np.float32).reshape(count, SIZE),
        "actions": np.array(apprentice.actions, np.float32).reshape(count, 2),
        "advice": np.array(apprentice.advice, np.float32).reshape(-1, 2),
        "rewards": rewards.astype(np.float32),
    }


def _finals(row: LabNavRow) -> list[float]:
    """Return the reward at the end of each drive."""
    if not row.legs:
        return [final_reward(row.score, row.success, row.ending == "contact")]
    return [
        final_reward(
            leg_score(leg.success, leg.docked, leg.shortest, leg.path_length), leg.success, leg.ending == "contact"
        )
        for leg in row.legs
    ]


def record_drives(
    drives: Sequence[TrainingDrive],
    network: Path,
    mode: Mode,
    noise: tuple[float, ...] | None = None,
    safety: bool = True,
    file: str = "drives.npz",
) -> ShardOutput:
    """Drive episodes and return the records in one file, and scores as the record of the shard.

    The arrays of all drives follow each other.
    """
    torch.set_num_threads(1)
    deviations = None if noise is None else np.array(noise, np.float32)
    apprentice = Apprentice(checked_actor(network), mode, deviations, safety)
    rows: list[dict[str, object]] = []
    parts: list[Records] = []
    for one in drives:
        row, arrays = drive(apprentice, one)
        key = f"{one.task}/{one.floor.stem}/{one.number}"
        rows.append({"key": key, "task": one.task, "score": row.score, "ending": row.ending})
        parts.append(arrays)
    joined = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **joined)
    return ShardOutput({file: buffer.getvalue()}, rows)


def driven(
    drives: Sequence[TrainingDrive],
    size: int,
    network: Path,
    mode: Mode,
    title: str,
    executor: ExecutorOptions | None = None,
    *,
    noise: tuple[float, ...] | None = None,
    safety: bool = True,
    run: RunFolder | None = None,
) -> tuple[list[Records], list[dict[str, Any]]]:
    """Drive episodes in units of work, and return the records of each unit and the rows of all drives, in their order.

    Args:
        drives: to drive. size: drives of a unit. network: file of the network. mode: who drives.
        title: of the progress bar, and the beginning of the names of the units. executor: where they run.
        noise, safety: as for `Apprentice`.
        run: folder that keeps the records, below `rounds`; None keeps none.
    """
    weights = file_digest(network)
    shards = []
    for k, first in enumerate(range(0, len(drives), size)):
        part, name = tuple(drives[first : first + size]), f"{title} {k:04d}"
        arguments = (part, network, mode, noise, safety, f"{ROUNDS}/{name.replace(' ', '-')}.npz")
        shards.append(Shard(name, record_drives, arguments, len(part), weights))
    done = sorted(run_shards(shards, run, executor, title, "drive"), key=lambda one: one[0].name)
    records = [read_records(next(iter(output.files.values()))) for _, output in done]
    return records, [row for _, output in done for row in output.record]


def read_records(content: bytes) -> Records:
    """Return the arrays of a file of `record_drives`."""
    with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
        return {name: arrays[name] for name in arrays.files}
