"""An episode driven again, so that people and things are where they were; compared with the row and route on disk."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from labgym.envs.conditions.bodies import Body
from labgym.envs.conditions.payload import carried
from labgym.envs.labnav.episodes import LabNavEpisode, LabNavEpisodes
from labgym.envs.robot import ROBOT
from labgym.envs.state import Pose, State
from labgym.envs.tasks import Task
from labgym.errors import DocumentError, LabgymError, OptionError, UnknownNameError
from labgym.eval.driving.actions import StoredPolicy
from labgym.eval.driving.drive import LabNavDrive
from labgym.eval.driving.episode_row import LabNavRow
from labgym.eval.driving.evaluation import Evaluation
from labgym.eval.driving.files import ACTIONS, EpisodeActions, read_records, short_name
from labgym.eval.driving.runner import open_driver, policy_source
from labgym.eval.labnav.drive import drive_floor
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.foresight import in_place
from labgym.eval.labnav.results import DriveTerms
from labgym.eval.labnav.shown_drive import ShownThings
from labgym.eval.labnav.suites import LabNavSuite, load_labnav
from labgym.eval.labnav.summary import LabNavSummary
from labgym.layouts import Layout
from labgym.policies.kernels import kernel_mode
from labgym.policies.registry import FILES, SERVER, is_class_place, policy_names, policy_place


@dataclass(frozen=True, eq=False)
class Shot:
    """The world at a control step.

    Attributes:
        pose: of the robot. bodies: people, and things that the robot can push, where they are.
        distance: to the goal, meters. leg: number of the drive in progress, from 0.
        rise: greatest rise of the liquid so far, meters; None without.
        touched: names of what the robot touches.
    """

    pose: Pose
    bodies: tuple[Body, ...]
    distance: float
    leg: int = 0
    rise: float | None = None
    touched: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Replay:
    """An episode that was driven again.

    Attributes:
        episode: the episode. task: layout, map and drive with the conditions.
        fixtures: the layout without the things that the robot can push.
        row: the results. shots: at the start and after each control step.
    """

    episode: LabNavEpisode
    task: Task
    fixtures: Layout
    row: LabNavRow
    shots: tuple[Shot, ...]


def replay(
    evaluation: LabNavEvaluation, key: str, policy: str | None = None, suite: LabNavSuite | None = None
) -> Replay:
    """Drive an episode of an evaluation again.

    Args:
        evaluation: the evaluation.
        key: of the episode: task-level/floor/number, or a unique end of it.
        policy: name of the policy, for one that the folder does not name: a file or a server.
        suite: the suite, if it is not a published one.

    Raises:
        UnknownNameError: the evaluation has no such episode, or the policy is not installed here.
        DocumentError: the episodes have changed since.
        LabgymError: the drive differs from the row or route on disk.
    """
    row = evaluation.row(key)
    suite = load_labnav(evaluation.summary.suite) if suite is None else suite
    part = next((one for one in suite.parts if (one.task, one.level) == (row.task, row.level)), None)
    if part is None:
        raise DocumentError(evaluation.folder, f"episode {row.key}", f"suite {suite.name} does not have this task")
    episode = _episode(part, row)
    name = policy or driver_name(evaluation)
    kernels = None if evaluation.identity is None else evaluation.identity.inputs.get("kernels")
    shown = drive_again(
        name,
        part,
        episode,
        options=evaluation.summary.options,
        seed=evaluation.summary.seed,
        label=row.policy,
        seconds=suite.seconds,
        kernels=str(kernels).partition("/")[0] if kernels else None,
        latency=evaluation.summary.latency,
    )
    difference = _difference(evaluation, row, shown)
    if difference:
        today = f"labgym record {suite.name} --episode {row.key} --policy {name}"
        raise LabgymError(
            f"{evaluation.folder}: {row.key}, driven again, {difference}: policy, code or processor are not those of "
            f"the run; film the drive of today with `{today}`"
        )
    return shown


def drive_again(
    policy: str,
    part: LabNavEpisodes,
    episode: LabNavEpisode,
    options: Mapping[str, Any] | None = None,
    seed: int = 0,
    *,
    label: str = "",
    seconds: float = 120.0,
    kernels: str | None = None,
    latency: float | None = None,
) -> Replay:
    """Drive an episode and keep the world at every control step.

    Args:
        policy: a name for `make_policy`. options: its arguments. seed: random seed of the evaluation.
        part: the episodes of the task. episode: one of them.
        label: name of the policy in the row; by default its name. seconds: time limit.
        kernels: as for `labgym.eval.evaluate`. latency: as in `DriveTerms`.

    Raises:
        LabgymError: the policy cannot be loaded.
    """
    shots: list[Shot] = []
    first: list[State] = []

    def watch(state: State) -> None:
        if not first:
            first.append(state)
        rise = None if carried(state) is None else float(state.presences["payload"].outcome["highest"])
        bodies = tuple(replace(body) for body in state.bodies)
        shots.append(Shot(state.pose, bodies, state.distance, state.leg, rise, state.touched))

    source, mode = policy_source(policy, dict(options or {})), kernel_mode(kernels)
    terms = DriveTerms.of(part, label or short_name(policy), seed, seconds, latency)
    with open_driver(policy, source, None, mode, isolated=True) as driver:
        (drive,) = drive_floor(
            in_place(driver, source),
            part.layout(episode.floor),
            (episode,),
            terms,
            watch,
        )
    return _shown(episode, first[0], drive, shots)


def things_along(evaluation: Evaluation[LabNavSummary, LabNavRow], suite: LabNavSuite, key: str) -> ShownThings | None:
    """Return where the things that a robot can push were along a drive; None if its actions are not known.

    The drive is simulated again with its actions.

    Args:
        evaluation: the folder. suite: its suite. key: of the episode.
    """
    part, episode = suite.by_key[key]
    row = next(row for row in evaluation.rows if row.key == key)
    try:
        actions = read_records(evaluation.folder / ACTIONS, EpisodeActions)[row.key].actions
        policy = StoredPolicy(actions, row.error)
    except (DocumentError, FileNotFoundError, KeyError, ValueError):
        return None
    summary, shots = evaluation.summary, list[dict[str, Pose]]()

    def watch(state: State) -> None:
        names = [placement.id for placement in state.task.layout.placements]
        shots.append({names[body.owner]: body.pose for body in state.bodies if body.owner >= 0})

    terms = DriveTerms.of(part, row.policy, summary.seed, suite.seconds, summary.latency)
    drive_floor(policy, part.layout(episode.floor), (episode,), terms, watch, blind=True)
    return ShownThings.along(shots)


def driver_name(evaluation: LabNavEvaluation) -> str:
    """Return the name of the policy that drove, for `make_policy`.

    Raises:
        OptionError: the folder does not say which it was: a file or a server.
        UnknownNameError: it is not installed here.
    """
    label = evaluation.summary.policy
    identity = None if evaluation.identity is None else evaluation.identity.inputs.get("policy")
    place = str(identity.get("place", "")) if isinstance(identity, dict) else ""
    if label in policy_names() and place in ("", policy_place(label)):
        return label
    if place == SERVER or place in FILES.values():
        raise OptionError(f"{evaluation.folder}: {label!r} drove by a file or a server: name it with --policy")
    if is_class_place(place):
        return place
    raise UnknownNameError("policy", label, policy_names(), remedy="name it with --policy")


def _episode(part: LabNavEpisodes, row: LabNavRow) -> LabNavEpisode:
    """Return the episode of a row.

    Raises:
        DocumentError: the suite has no such episode, or it is another one.
    """
    key = f"{row.floor}/{row.number}"
    episode = next((each for each in part.episodes if each.key == key), None)
    same = episode is not None and episode.floor_hash == row.floor_hash
    if episode is None or not same or round(math.fsum(episode.lengths), 9) != row.shortest or part.label != row.suite:
        raise DocumentError(row.suite, f"episode {key}", f"is not that of {part.label}: evaluate the policy again")
    return episode


def _shown(episode: LabNavEpisode, state: State, drive: LabNavDrive, shots: list[Shot]) -> Replay:
    layout = state.fixtures.layout if state.task.pushable else state.task.layout
    return Replay(episode, state.task, layout, drive.row, tuple(shots))


def _difference(evaluation: LabNavEvaluation, row: LabNavRow, shown: Replay) -> str:
    """Return in what a drive differs from its row or route, "" if in nothing."""
    route = evaluation.routes.get(row.key)
    if route is not None:
        for step, (recorded, shot) in enumerate(zip(route, shown.shots, strict=False)):
            if recorded != tuple(round(value, 3) for value in shot.pose):
                away = math.dist(recorded[:2], shot.pose[:2])
                return f"leaves its route after {step * ROBOT.control_dt:.1f} s (by {away:.3f} m)"
        if len(route) != len(shown.shots):
            return f"has {len(shown.shots)} poses instead of {len(route)}"
    fields = [name for name in row.model_fields_set if getattr(row, name) != getattr(shown.row, name)]
    return f"has another {', '.join(sorted(fields)[:3])}" if fields else ""
