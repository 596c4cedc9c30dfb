"""The results of a finished episode."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes, straight
from labgym.envs.labnav.necks import widest_disc
from labgym.envs.labnav.task import SECONDS, LegResult, Level, Result
from labgym.envs.labnav.tasks import task_of
from labgym.envs.parts.endings import TouchedEnding
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.robot import ROBOT
from labgym.envs.state import State
from labgym.envs.tasks import Task
from labgym.eval.driving.actions import StoredActions
from labgym.eval.driving.drive import LabNavDrive
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.labnav.leg import LabNavDriver, LegRecorder
from labgym.eval.labnav.rules import delay_of, is_slow
from labgym.geometry import wrap_angle

MOST_TOUCHED = 20
MOST_OUTCOME = 100
"""Greatest number of entries of a list in the outcomes of a row."""


@dataclass(frozen=True)
class DriveTerms:
    """The terms under which episodes of a task are driven, as their rows name them.

    Attributes:
        task, level: of LabNav. label: name of the policy in the rows. suite: name and version of the suite.
        seed: random seed of the policy.
        seconds: time limit of a drive; in `shift` of each of its drives.
        latency: by which actions come late, seconds; None for what the policy declares.
        properties: of the drives; None for those of the level (`labgym.envs.labnav.nuisances`).
    """

    task: str
    level: int
    label: str
    suite: str
    seed: int
    seconds: float = SECONDS
    latency: float | None = None
    properties: Level | None = None

    @classmethod
    def of(
        cls, part: LabNavEpisodes, label: str, seed: int, seconds: float = SECONDS, latency: float | None = None
    ) -> Self:
        """Return the terms of the episodes of a suite."""
        return cls(part.task, part.level, label, part.label, seed, seconds, latency)

    @property
    def limit(self) -> int:
        """Control steps of a drive."""
        return round(self.seconds / ROBOT.control_dt)


def finished(row: LabNavRow, driver: LabNavDriver, recorder: LegRecorder) -> LabNavDrive:
    """Return the results with what was recorded."""
    actions = StoredActions.of(recorder.tape, driver.stops)
    route = tuple((round(x, 3), round(y, 3), round(yaw, 3)) for x, y, yaw in recorder.poses)
    if not recorder.times:
        return LabNavDrive(row, route, actions)
    high = float(np.percentile(recorder.times, 90.0, method="inverted_cdf"))
    mean = math.fsum(recorder.times) / len(recorder.times)
    return LabNavDrive(row, route, actions, 1e3 * mean, 1e3 * high, is_slow(high, recorder.latency))


def fields_of(terms: DriveTerms, episode: LabNavEpisode, env: LabPointNavEnv, recorder: LegRecorder) -> dict[str, Any]:
    """Return the fields of a row that the state at the end has, whatever the task."""
    state = env.state
    ended = next((each for each in env.config.endings if isinstance(each, TouchedEnding)), None)
    contact = ended.counted(state)[:1] if ended is not None and state.ending == "contact" else ()
    outcomes = {name: one.outcome for name, one in state.presences.items() if name != "contacts"}
    return {
        "suite": terms.suite,
        "task": terms.task,
        "level": terms.level,
        "floor": episode.floor,
        "floor_hash": episode.floor_hash,
        "number": episode.number,
        "policy": terms.label,
        "track": recorder.track,
        "seed": terms.seed,
        "contact": "".join(contact)[:100],
        "touched": tuple(name[:100] for name in recorder.touched)[:MOST_TOUCHED],
        "shortest": round(math.fsum(episode.lengths), 9),
        "straight": round(straight(episode), 9),
        "neck": _neck(state.task),
        "path_length": state.path_length,
        "time": round(state.time, 6),
        "final_distance": state.distance,
        "final_heading": wrap_angle(state.pose[2] - state.pair.goal[2]),
        "odometry_error": math.dist(recorder.believed[:2], state.pose[:2]),
        "steps": state.steps,
        "contacts": state.contacts,
        "waited": round(recorder.waited, 6),
        "delay": delay_of(recorder.latency),
        "outcomes": plain(outcomes),
    }


def scored(row: LabNavRow, state: State) -> LabNavRow:
    """Return the row of an episode with its score; `state` is that at the end."""
    outcomes = {name: presence.outcome for name, presence in state.presences.items()}
    return row.model_copy(update={"score": score_of(row, outcomes, state.conditions)})


def score_of(row: LabNavRow, outcomes: Mapping[str, Any], conditions: Mapping[str, Any]) -> float:
    """Return the score that follows from the other fields of a row, and from outcomes and data of the conditions.

    Raises:
        UnknownNameError: there is no such task.
        KeyError, TypeError, ValueError, AttributeError: the outcomes are not those of the task.
    """
    result = Result(
        success=row.success,
        shortest=row.shortest,
        path_length=row.path_length,
        time=row.time,
        final_distance=row.final_distance,
        final_heading=row.final_heading,
        legs=tuple(LegResult(leg.success, leg.docked, leg.shortest, leg.path_length) for leg in row.legs),
        goals=row.goals,
    )
    return task_of(row.task).score(result, outcomes, conditions)


def _neck(task: Task) -> float | None:
    """Return the radius of the widest disc that reaches all goals."""
    discs = [widest_disc(task.layout, pair) for pair in (task.pair, *task.following)]
    fitting = [disc for disc in discs if disc is not None]
    return min(fitting) if len(fitting) == len(discs) else None


def plain(value: Any) -> Any:
    """Return outcomes as bounded JSON data: at most 100 entries of a list, and no number that is not finite."""
    if isinstance(value, Mapping):
        return {str(key)[:100]: plain(each) for key, each in list(value.items())[:MOST_OUTCOME]}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(each) for each in list(value)[:MOST_OUTCOME]]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return None if value is None else str(value)[:200]
