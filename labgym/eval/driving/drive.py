"""Driving: one episode, one goal pair, or all episodes of a layout."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs import LabPointNavEnv
from labgym.envs.labnav.task import spl
from labgym.envs.parts.vectors import VelocitySensor
from labgym.envs.robot import ROBOT
from labgym.envs.state import State
from labgym.eval.driving.actions import ActionTape, StoredActions
from labgym.eval.driving.assignments import Assignment, assignment_between, assignments
from labgym.eval.driving.episode_row import EpisodeRow, LabNavRow, Pose, TransitionRow
from labgym.eval.driving.kinematics import first_jump, possible_contacts
from labgym.eval.driving.loop import Info, Observation, PolicyLoop, episode_rng
from labgym.eval.driving.navigation_metrics import soft_spl
from labgym.geometry import rotate, wrap_angle
from labgym.layouts import Layout
from labgym.policies import EpisodeStart, GroundTruth
from labgym.policies.policy import Driver
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.policies.process.episode import checked_action
from labgym.suites import Suite, suite_of

Route = tuple[Pose, ...]
Watch = Callable[[Info], None]


R = TypeVar("R", bound=EpisodeRow)


@dataclass(frozen=True)
class DrivenEpisode(Generic[R]):
    """A finished episode.

    Attributes:
        row: the results.
        route: poses (x, y, yaw) of the robot in the room frame, at the start and after each control step; meters and
            radians, rounded to 0.001.
        actions: the policy's decisions.
        planning_ms, high_ms, slow: measured, as in `EpisodeTime`.
    """

    row: R
    route: Route
    actions: StoredActions
    planning_ms: float | None = None
    high_ms: float | None = None
    slow: bool = False


TransitionDrive = DrivenEpisode[TransitionRow]
LabNavDrive = DrivenEpisode[LabNavRow]


def drive_layout(policy: Driver, layout: Layout, suite: Suite, label: str, seed: int) -> tuple[TransitionDrive, ...]:
    """Drive all episodes of a layout.

    Args:
        policy: the policy, in a separate process or in this one.
        layout: the layout; its protocol gives the goal pairs.
        suite: the rules.
        label: name of the policy in the rows.
        seed: random seed of the evaluation; a policy's randomness depends only on it, on the goal in the start frame
            and on the repeat.
    """
    return drive_episodes(policy, layout, assignments(layout, suite), suite, label, seed)


def drive_episodes(
    policy: Driver,
    layout: Layout,
    episodes: Sequence[Assignment],
    suite: Suite,
    label: str,
    seed: int,
    *,
    watch: Watch | None = None,
    blind: bool = False,
) -> tuple[TransitionDrive, ...]:
    """Drive the selected episodes of a layout, each as in `drive_layout`.

    Args:
        watch: receives the environment's info at the start and after each control step. An exception that it raises
            ends the episode without a result.
        blind: read no sensor, for a policy that looks at nothing.
    """
    seen: dict[str, Any] = {"sensors": (VelocitySensor(),)} if blind else {"observation": policy.observation}
    env = LabPointNavEnv(layout=layout, **seen, control_dt=suite.control_dt, exact=True)
    try:
        return tuple(TransitionTask(env, policy, episode, suite, seed, watch).drive(label) for episode in episodes)
    finally:
        env.close()


def drive_pair(
    policy: str,
    layout: Layout,
    pair: int = 0,
    seed: int = 0,
    options: Mapping[str, Any] | None = None,
    start: Sequence[float] | None = None,
    goal: Sequence[float] | None = None,
) -> TransitionDrive:
    """Drive one goal pair of a layout, or between two points, under the rules of the published suites.

    Args:
        policy: a name for `make_policy`.
        layout: the layout; its protocol gives the goal pairs.
        pair: index into `goal_pairs(layout)`.
        seed: random seed of the evaluation, as in `drive_layout`.
        options: arguments for `make_policy`.
        start, goal: (x, y, yaw) and (x, y) or (x, y, yaw) that replace the ends of the pair; meters and radians, room
            frame. If both are passed, the layout needs no goal pair.

    Raises:
        OptionError: the layout has no goal pair, or the robot cannot drive from start to goal.
        UnknownNameError: no goal pair has that index.
    """
    episode = assignment_between(layout, pair, start, goal)
    driver = PolicyProcess(PolicySource.named(policy, options))
    try:
        (drive,) = drive_episodes(driver, layout, (episode,), suite_of([layout]), policy, seed)
    finally:
        driver.close()
    return drive


class TransitionTask(PolicyLoop):
    """A drive of the task `transition`: the paper's drive from the place of one protocol step to that of the next.

    The rules are the suite's; by default the robot must come within 0.5 m of the goal, and contacts end nothing. The
    policy has exact odometry and need not come to rest: the true pose decides.
    """

    def __init__(
        self, env: LabPointNavEnv, driver: Driver, episode: Assignment, suite: Suite, seed: int, watch: Watch | None
    ) -> None:
        super().__init__(env, [], ActionTape())
        self._driver = driver
        self._watch, self._assignment, self._suite, self._seed = watch, episode, suite, seed
        self._poses: list[Pose] = []
        self._clearances: list[float] = []
        self._touched: list[bool] = []

    def drive(self, label: str) -> TransitionDrive:
        """Drive to the end and return the results."""
        observation, info = self._env.reset(seed=self._seed, options=dict(self._assignment.options))
        initial, state = float(info["distance"]), self._env.state
        self._note(info)
        self.run(self._driver.reset, observation)
        error = self.error or self._jump()
        route = tuple((round(x, 3), round(y, 3), round(yaw, 3)) for x, y, yaw in self._poses)
        planning_ms = 1e3 * self.seconds / state.steps if state.steps else None
        actions = StoredActions.of(self._tape, stops=False)
        return TransitionDrive(self._row(label, initial, state, error), route, actions, planning_ms)

    def over(self, observation: Observation, state: State) -> bool:
        """Return whether the suite's rules or the time end the episode now."""
        arrival, stuck = self._suite.arrival, self._suite.stuck
        if state.steps >= self._suite.max_steps:
            return True
        if arrival is None:
            return bool(state.distance <= self._suite.success_distance)
        if stuck is not None and len(self._poses) >= stuck.steps:
            last = np.array(self._poses[-stuck.steps :])[:, :2]
            if np.linalg.norm(last - last[-1], axis=1).max() < stuck.distance:
                return True
        return bool(state.distance < arrival.distance and abs(observation["velocity"][0]) < arrival.speed)

    def start(self, state: State) -> EpisodeStart:
        """Return goal, robot, and for a privileged policy the layout."""
        pair, (x, y, yaw) = self._assignment.pair, self._poses[0]
        goal = rotate(pair.goal[0] - x, pair.goal[1] - y, -yaw)
        robot = replace(ROBOT, control_dt=self._suite.control_dt)
        truth = GroundTruth(state.task.layout, pair, self._poses[0]) if self._driver.privileged else None
        return EpisodeStart(
            goal=goal, rng=episode_rng(self._seed, goal, self._assignment.repeat), robot=robot, truth=truth
        )

    def action(self, observation: Observation, state: State) -> NDArray[np.floating]:  # noqa: ARG002 - of other tasks
        """Return the policy's action, with exact odometry."""
        (x0, y0, yaw0), (x, y, yaw) = self._poses[0], self._poses[-1]
        odometry = np.array([*rotate(x - x0, y - y0, -yaw0), wrap_angle(yaw - yaw0)])
        seen = {**observation, "odometry": odometry}
        action: NDArray[np.floating] = self.decided(lambda given: checked_action(self._driver.act(given)), seen)
        return action

    def note(self, observation: Observation, info: Info) -> None:  # noqa: ARG002 - of other tasks
        """Record pose, clearance and contact."""
        self._touched.append(bool(info["collision"]))
        self._note(info)

    def _note(self, info: Info) -> None:
        x, y, yaw = (float(value) for value in info["pose"])
        self._poses.append((x, y, yaw))
        self._clearances.append(float(info["clearance"]))
        if self._watch is not None:
            self._watch(info)

    def _jump(self) -> str | None:
        """Return which pose the robot cannot have driven to; None if it can have driven to all of them."""
        dt = self._suite.control_dt
        touched = possible_contacts(self._poses, self._clearances, dt) | np.array(self._touched, dtype=bool)
        index = first_jump(self._poses, touched, dt)
        if index is None:
            return None
        distance = math.dist(self._poses[index][:2], self._poses[index - 1][:2])
        return f"pose {index} is {distance:.2f} m from the last one, farther than the robot can drive in {dt:g} s"

    def _row(self, label: str, initial: float, state: State, error: str | None) -> TransitionRow:
        final, driven = float(state.distance), float(state.path_length)
        layout, pair = state.task.layout, self._assignment.pair
        # Rounded to a nanometer: the last bit depends on the kernels of NumPy in the evaluator's process.
        shortest = round(float(state.shortest_path_length), 9)
        success = error is None and final <= self._suite.success_distance
        navdp = self._suite.metrics == "navdp"
        has_spl = math.isfinite(shortest) and not navdp
        return TransitionRow(
            suite=self._suite.label,
            split=self._suite.split,
            layout=layout.id,
            layout_hash=layout.hash,
            protocol=layout.protocol_id,
            pair=pair.index,
            repeat=self._assignment.repeat,
            policy=label,
            seed=self._seed,
            start=pair.start,
            goal=pair.goal,
            success=success,
            spl=spl(success, shortest, driven) if has_spl else None,
            soft_spl=soft_spl(initial, final, shortest, driven) if has_spl else None,
            path_length=driven,
            shortest_path_length=shortest if math.isfinite(shortest) else None,
            final_distance=final,
            contacts=state.contacts,
            min_clearance=min(self._clearances),
            steps=state.steps,
            time=state.time,
            error=error,
            navdp_spl=spl(success, initial, driven) if navdp else None,
        )
