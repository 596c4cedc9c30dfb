"""One drive of an episode: the policy drives until the robot rests, a rule ends the drive, or the time is over."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.payload import carried
from labgym.envs.labnav.task import PERSON_NEAR, LabNavTask, docking_error
from labgym.envs.parts.braking import Parking
from labgym.envs.parts.endings import nearest_person
from labgym.envs.parts.odometry import announced_goal
from labgym.envs.parts.protocols import Ending
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.state import Pose, State
from labgym.eval.driving.actions import ActionTape
from labgym.eval.driving.episode_row import Stopped, Track
from labgym.eval.driving.loop import Info, Observation, PolicyLoop, episode_rng
from labgym.eval.labnav.foresight import TrueWorld, handed_track
from labgym.eval.labnav.rules import Finish, delay_of
from labgym.geometry import compose, relative, wrap_angle
from labgym.policies import EpisodeStart, GroundTruth, Policy
from labgym.policies.process import PolicyProcess
from labgym.policies.process.episode import decision

LabNavDriver = PolicyProcess | Policy
AT_REST = 0.05
"""Speed below which a robot waits, m/s."""
BRAKING = 100
"""Greatest number of control steps in which the robot is braked at the end of a drive."""
ORIGIN = (0.0, 0.0, 0.0)


@dataclass
class LegRecorder:
    """The record of an episode, over all its drives.

    Attributes:
        watch: receives the state at the start and after each control step.
        poses: true poses at the start and after each control step. reckoned: pose by odometry in the start frame.
        touched: names of what the robot touched. waited: seconds at rest near people.
        times: wall-clock time of each of the policy's actions, seconds.
        latency: by which actions come late, seconds. tape: the policy's decisions.
        track: what the policy received: no map, the old map, or the world.
    """

    watch: Callable[[State], None] | None = None
    latency: float = 0.0
    track: Track = "mapless"
    poses: list[Pose] = field(default_factory=list)
    reckoned: Pose = ORIGIN
    touched: dict[str, None] = field(default_factory=dict)
    waited: float = 0.0
    times: list[float] = field(default_factory=list)
    tape: ActionTape = field(default_factory=ActionTape)

    def note(self, observation: Observation, state: State) -> None:
        """Record a state, and the pose by odometry."""
        x, y, cosine, sine = (float(each) for each in observation["odometry"])
        self.reckoned = (x, y, math.atan2(sine, cosine))
        self.poses.append(state.pose)
        self.touched |= dict.fromkeys(state.touched)
        if state.presences and math.hypot(state.velocity[0], state.sideways) < AT_REST and state.steps:
            self.waited += state.control_dt if nearest_person(state) < PERSON_NEAR else 0.0
        if self.watch is not None:
            self.watch(state)

    @property
    def believed(self) -> Pose:
        """The pose in the room frame that follows from the true start and the odometry."""
        return compose(self.poses[0], self.reckoned)


class LegDrive(PolicyLoop):
    """A drive to one goal, from where the robot is.

    The policy's frame has its origin at the robot's pose by odometry, so that the goal has the errors of the odometry
    of all drives before.

    Args:
        env: in an episode whose state has been recorded. driver: the policy. task, level: of LabNav.
        recorder: of the episode. seed: of the policy. limit: control steps.
        rules: endings of this drive besides those of the environment.

    Attributes:
        goal: announced, in the frame of this drive. shortest: L* from here, meters.
        stopped: whether the policy or the evaluator brought the robot to rest, "" for neither.
        rule: name of the ending that ended the drive, "" without.
        begun, driven: time and length driven in the episode when this drive began.
    """

    def __init__(
        self,
        env: LabPointNavEnv,
        driver: LabNavDriver,
        task: LabNavTask,
        level: int,
        recorder: LegRecorder,
        seed: int,
        limit: int,
        *,
        rules: Sequence[Ending] = (),
    ) -> None:
        super().__init__(env, recorder.times, recorder.tape)
        self._driver, self._task, self._level, self._recorder = driver, task, level, recorder
        self._seed, self._rules, state = seed, tuple(rules), env.state
        self._origin, self._until, self._waited = recorder.reckoned, state.steps + limit, recorder.waited
        self.goal = self._local(announced_goal(state))
        self.begun, self.driven = state.time, state.path_length
        self._parking: Parking | None = None
        self.stopped: Stopped = ""
        self.rule = state.ending if state.verdict is not None else ""

    def run(self, begin: Callable[[EpisodeStart], None], observation: Observation) -> Observation:
        """Drive to the end and return the last observation; see `PolicyLoop.run`."""
        for each in self._rules:
            each.reset(self._env.state)
        return super().run(begin, observation)

    def over(self, observation: Observation, state: State) -> bool:  # noqa: ARG002 - of other tasks
        """Return whether a rule or the time ends the drive now."""
        return bool(self.rule) or state.steps >= self._until

    def brake(self, observation: Observation) -> Observation:
        """Bring the robot to rest where a rule or the time ended the drive, and return the last observation."""
        parking, state = Parking(None, delay_of(self._recorder.latency)), self._env.state
        for _ in range(BRAKING):
            action = parking.action(self._here, state.velocity)
            if action is None or state.verdict is not None:
                break
            observation = self.step(action)
        return observation

    def note(self, observation: Observation, info: Info) -> None:  # noqa: ARG002 - of other tasks
        """Record the state, and note which rule ends the drive."""
        state = self._env.state
        self._recorder.note(observation, state)
        ended = state.ending if state.verdict is not None else ""
        self.rule = ended or self.rule or next((each.name for each in self._rules if each.verdict(state)), "")

    def finish(self, state: State) -> Finish:
        """Return the facts about the drive that is over."""
        task, heading = self._task, wrap_angle(state.pose[2] - state.pair.goal[2])
        payload = state.presences.get("payload")
        return Finish(
            rule=self.rule,
            parked=self.parked,
            inside=state.distance <= task.radius,
            believed=math.dist(self._here[:2], self.goal[:2]) <= task.radius,
            docked=not task.docks or docking_error(state.distance, heading) <= 1.0,
            spilt=payload is not None and bool(payload.outcome["spilt"]),
            waited=self._recorder.waited - self._waited,
            error=self.error,
        )

    @property
    def _here(self) -> Pose:
        """The pose by odometry in the frame of this drive."""
        return self._local(self._recorder.reckoned)

    def _local(self, pose: Pose) -> Pose:
        return pose if self._origin == ORIGIN else relative(self._origin, pose)

    def action(self, observation: Observation, state: State) -> NDArray[np.floating] | None:
        """Return the next action, None once the robot has been parked."""
        stay = self._task.stay(delay_of(self._recorder.latency))
        here = self._here
        if self._parking is None and not self._driver.stops:
            if math.dist(here[:2], self.goal[:2]) <= self._task.braking_distance:
                self._parking = Parking(self.goal[2] if self._task.docks else None, stay)
                self.stopped = "evaluator"
        if self._parking is None:
            seen = {**observation, "odometry": np.array(here)}
            action: NDArray[np.floating] | None = self.decided(self._decide, seen)
            if action is not None:
                return action
            self._parking, self.stopped = Parking(None, stay), "policy"
        return self._parking.action(here, state.velocity)

    def _decide(self, observation: dict[str, Any]) -> NDArray[np.float32] | None:
        if isinstance(self._driver, PolicyProcess):
            return self._driver.decide(observation)
        return decision(self._driver, observation)

    def start(self, state: State) -> EpisodeStart:
        """Return the goal, the task, and what the track of the policy hands out."""
        goal = (self.goal[0], self.goal[1])
        truth = None
        if self._driver.privileged:
            task, pair, pose = state.task, state.task.announced or state.task.pair, state.pose
            if state.leg:
                pose = self._recorder.believed
                pair = replace(state.pair, start=pose)
            truth = GroundTruth(task.old_map or task.layout, pair, pose)
        world = TrueWorld(state, self._env.actions, self._task.radius) if self._driver.foresees else None
        self._recorder.track = handed_track(truth, world)
        return EpisodeStart(
            goal=goal,
            rng=episode_rng(self._seed, goal),
            truth=truth,
            task=self._task.announced(self._level),
            heading=self.goal[2] if self._task.docks else None,
            beaker=carried(state),
            world=world,
        )
