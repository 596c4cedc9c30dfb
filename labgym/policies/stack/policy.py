"""The navigation stack as a policy."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT, RobotSpec, turn_towards
from labgym.errors import LabgymError
from labgym.geometry import Array, compose, to_world, wrap_angle
from labgym.navigation import Pose
from labgym.navigation.search_kernel import prepare
from labgym.policies.arrival import (
    DOCK_ANGLE_RAD,
    DOCK_DISTANCE_M,
    DOCK_REST_STEPS,
    REST_VELOCITIES,
    GoalArrival,
    planar_pose,
)
from labgym.policies.dwa import lidar_points
from labgym.policies.gentle import GentleCommands, GentleLimits
from labgym.policies.policy import EpisodeStart, Observation, Policy, Sensors
from labgym.policies.stack.controller import Controller, MotionLimits, Shaping, bearing_of
from labgym.policies.stack.costmap import UNEXPLAINED_M, Costmap
from labgym.policies.stack.docking import FrontEstimate, StationEstimate
from labgym.policies.stack.localization import LidarMounting, Localizer
from labgym.policies.stack.old_map import OldMap
from labgym.policies.stack.panes import SeenPanes
from labgym.policies.stack.people import PeopleTracker, TrackedPerson, Waiting, too_late
from labgym.policies.stack.planner import PlannedPath, planned
from labgym.policies.stack.recovery import Recovery
from labgym.policies.tracking import PathTracker, TrackingOptions, approach_speed, velocities_to_action

SPEED_AMONG_PEOPLE = 0.95
"""Greatest speed where people may come round a corner, m/s."""
CREEP_SPEED, ALONGSIDE_M = 0.15, 1.6
"""Speed below which a robot rests instead, m/s, if a person is within this distance, meters."""
STOP_INSIDE_M = 0.02
"""Distance from the edge of the goal's disc at which a robot that rests there may stop, meters."""
REST_TURN_SPEED = 0.08
"""Speed below which a robot that rests for people turns towards its path, m/s."""
GENTLE_DELAY_S, GENTLE_DISTANCE_M = 0.35, 0.66
"""Time by which gentle braking comes late, seconds; distance from a person at its end that is too little, meters."""
DOCKING_AXIS_M = 0.5
"""Length of the straight way to a docking pose, meters."""
AXIS_START_M, NO_AXIS_START_M = 0.15, 0.40
"""Distance from the beginning of that way at which docking begins, meters, and from the pose without room for it."""
TURN_IN_PLACE_RAD = 1.1
"""Bearing of the path beyond which a slow robot turns in place, radians."""
REPLAN_STEPS = 10
"""Control steps between two attempts to plan."""
TARGET_SHIFT_M = 0.03
"""Distance by which the place to drive to moves before the robot plans again, meters."""
OFF_PATH_M = 0.8
"""Distance from the path beyond which the robot plans again, meters."""


class StackPolicy(Policy):
    """A compact navigation stack after the architecture of Nav2. Privileged: it knows the old map.

    - Localization: odometry, corrected by scan matching with the old map where the odometry drifts.
    - Costmap: the old map, obstacles marked and cleared by the lidar, clearance.
    - Planner: a taut path on the costmap, planned again when something blocks it.
    - Controller: sampled velocities (MPPI) within limits on acceleration, and on jerk with a beaker.
    - Docking: the goal follows the measured pose of its station, by a lidar whose mounting is measured, too; the last
      half meter is straight.
    - Glass: panes are drawn on from what the lidar has seen of them.
    - People: clusters that move are predicted at constant velocity; the robot goes round them or rests aside.
    - Recovery: wait, back off, forget marks, turn, plan again.
    """

    name: ClassVar[str] = "stack"
    observation: ClassVar[Sensors] = "lidar"
    privileged: ClassVar[bool] = True
    latency: ClassVar[float] = 0.1
    drift: ClassVar[float] = 3.0
    """Multiple of the errors of the odometry that the localization assumes where it drifts."""

    def __init__(self) -> None:
        # Episodes run in copies of this process: what takes long to load is loaded here.
        prepare()
        self._robot: RobotSpec = ROBOT
        self._map: OldMap | None = None
        self._layout = ""
        self._localizer: Localizer | None = None
        self._rested = 0

    def reset(self, episode: EpisodeStart) -> None:
        """Read the old map and begin at the start pose in it.

        Raises:
            LabgymError: the episode has no map.
        """
        old, start, goal = self._known(episode)
        task = episode.task
        # Where the odometry is exact, scan matching with a map that is out of date would only mislead.
        self._localizer = Localizer(old.seen, start, self.drift if task.drift else 0.0)
        # Rays pass panes, so that they clear nothing.
        self._costmap = Costmap(old.clearance, old.seen, not task.drift, not task.glass, cropped=not old.sections)
        # Without people, an obstacle that the map lacks stands.
        things = task.drift or not old.sections
        self._crowd = PeopleTracker(episode.robot.control_dt, things) if task.people else None
        self._panes = SeenPanes() if task.glass else None
        self._mounting = LidarMounting(old.seen, goal) if task.mounting and old.sections else None
        self._begin(episode, goal, old)

    def next_goal(self, episode: EpisodeStart) -> None:
        """Go on to the next goal with the map, its marks and the estimate of the pose."""
        if self._localizer is None or self._map is None:
            self.reset(episode)
            return
        self._localizer.restart()
        self._begin(episode, self._next_place(episode), self._map)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Localize, update the costmap, and drive."""
        pose = self._located(observation)
        velocity = float(observation["velocity"][0]), float(observation["velocity"][1])
        self._sense(pose, np.asarray(observation["lidar"], dtype=np.float64))
        v, w = self._drive(*self._expected(pose, velocity))
        if self._gentle is not None:
            v = self._gentle.command(v, self._emergency(pose, velocity[0]))
        action = velocities_to_action(v, w, self._robot)
        self._pending.append((v, w))
        return action

    def stop(self, observation: Observation) -> bool:
        """Whether the robot rests at the goal by the estimated pose."""
        if self._localizer is None or not self._arrival.active:
            return False
        pose = compose(self._localizer.pose, (0.0, 0.0, 0.0))
        velocity = observation["velocity"]
        resting = abs(float(velocity[0])) <= REST_VELOCITIES[0] and abs(float(velocity[1])) <= REST_VELOCITIES[1]
        if self._docking:
            goal = self._station.goal
            resting = resting and self._parked is not None and self._parked.ended
            near = (
                math.dist(pose[:2], goal[:2]) < DOCK_DISTANCE_M and abs(wrap_angle(pose[2] - goal[2])) < DOCK_ANGLE_RAD
            )
        else:
            near = self._stopping and math.dist(pose[:2], self._goal[:2]) < self._arrival.radius
        self._rested = self._rested + 1 if resting and near else 0
        return self._rested > (DOCK_REST_STEPS if self._docking else 2)

    def planned_path(self) -> Array | None:
        """Return the path that is followed, in the map's frame."""
        return None if self._plan is None else self._plan.points

    @property
    def pose(self) -> Pose:
        """The estimated pose in the map's frame."""
        if self._localizer is None:
            raise LabgymError(f"policy {self.name!r} has no pose before reset")
        return self._localizer.pose

    def _known(self, episode: EpisodeStart) -> tuple[OldMap, Pose, Pose]:
        """Return the map at the start of an episode, and start and goal in its frame.

        Raises:
            LabgymError: the episode has no map.
        """
        truth = episode.truth
        if truth is None:
            raise LabgymError(f"policy {self.name!r} needs the old map: pass an EpisodeStart with truth")
        if self._layout != truth.layout.hash or self._map is None:
            self._layout, self._map = truth.layout.hash, OldMap.of(truth.layout)
        return self._map, truth.start, truth.pair.goal

    def _next_place(self, episode: EpisodeStart) -> Pose:
        """Return the goal of a further drive in the map's frame."""
        assert episode.truth is not None
        return episode.truth.pair.goal

    def _strange(self, pose: Pose, points: Array) -> NDArray[np.bool_]:  # noqa: ARG002
        """Return which returns, (n, 2) meters in the map's frame, may belong to people, (n,)."""
        assert self._map is not None
        return self._map.seen.at(points) > 1.5 * UNEXPLAINED_M

    def _of_panes(self, pose: Pose, ranges: Array, points: Array) -> tuple[Array, Array]:  # noqa: ARG002
        """Return the returns that panes have given, and from where they were seen, (m, 2) and (m, 2) meters.

        Args:
            pose: of the robot in the map's frame. ranges: (180,) of the scan, meters.
            points: (n, 2) its returns in the map's frame, meters.
        """
        returns = self._costmap.unexplained
        return returns, np.tile(pose[:2], (len(returns), 1))

    def _station_at(self, old: OldMap) -> StationEstimate | FrontEstimate:
        """Return an estimate of the station at the goal."""
        return StationEstimate(old, self._goal)

    def _begin(self, episode: EpisodeStart, goal: Pose, old: OldMap) -> None:
        """Begin a drive from the estimated pose to a goal in the map's frame."""
        self._robot, self._arrival = episode.robot, GoalArrival(episode)
        self._docking = episode.heading is not None
        self._goal: Pose = goal
        self._station = self._station_at(old)
        limits = None if episode.beaker is None else GentleLimits.of(episode.beaker, episode.robot)
        self._gentle = None if limits is None else GentleCommands(limits, episode.robot)
        motion = MotionLimits()
        if limits is not None:
            gentle = min(0.9 * limits.acceleration, motion.acceleration)
            motion = MotionLimits(gentle, gentle, lateral=limits.lateral)
        if episode.task.people:
            motion = replace(motion, speed=SPEED_AMONG_PEOPLE, reverse=0.0)
        self._controller = Controller(episode.rng, motion, episode.robot)
        late = math.ceil(self.latency / episode.robot.control_dt - 1e-9) if episode.task.rests else 0
        self._pending: deque[tuple[float, float]] = deque([(0.0, 0.0)] * late, maxlen=late)
        self._plan: PlannedPath | None = None
        self._target = self._goal
        self._since_plan = REPLAN_STEPS
        self._parked: PathTracker | None = None
        self._stopping = False
        self._rested = 0
        self._recovery, self._waiting = Recovery(episode.robot), Waiting()

    def _located(self, observation: Observation) -> Pose:
        """Return the pose in the map's frame."""
        assert self._localizer is not None
        self._localizer.move(planar_pose(observation["odometry"]))
        self._points = lidar_points(np.asarray(observation["lidar"], dtype=np.float64))
        self._localizer.match(self._points)
        if self._mounting is not None:
            self._mounting.observe(self._localizer.pose, self._points)
            self._points = self._mounting.corrected(self._points)
        return self._localizer.pose

    def _sense(self, pose: Pose, ranges: Array) -> None:
        """Update people, costmap and station by a scan."""
        points = self._placed = to_world(self._points, pose) if len(self._points) else np.empty((0, 2))
        walking = np.zeros(len(points), dtype=bool)
        if self._crowd is not None:
            walking = self._crowd.observe(pose, points, self._strange(pose, points))
        self._costmap.observe(pose, ranges, points, walking)
        if self._panes is not None:
            self._costmap.guess(self._panes.observe(pose, ranges, *self._of_panes(pose, ranges, points)))
        if self._docking:
            self._station.observe(pose if self._mounting is None else compose(pose, self._mounting.offset), ranges)

    def _expected(self, pose: Pose, velocity: tuple[float, float]) -> tuple[Pose, tuple[float, float]]:
        """Return pose and velocity after the commands that have not taken effect yet."""
        dt = self._robot.control_dt
        for v, w in self._pending:
            forward, turn = 0.3 * velocity[0] + 0.7 * v, 0.3 * velocity[1] + 0.7 * w
            middle = pose[2] + 0.5 * turn * dt
            step = forward * dt
            pose = (
                pose[0] + step * math.cos(middle),
                pose[1] + step * math.sin(middle),
                wrap_angle(pose[2] + turn * dt),
            )
            velocity = (v, w)
        return pose, velocity

    def _drive(self, pose: Pose, velocity: tuple[float, float]) -> tuple[float, float]:
        """Return the velocities to command, m/s and rad/s."""
        if self._docking and (self._parked is not None or self._at_axis(pose)):
            return self._dock(pose, velocity)
        self._since_plan += 1
        recovered = self._recovery.step(pose, self._alongside(pose), self._stopping, self._points, self._costmap)
        if recovered is not None:
            if self._panes is not None and self._plan is not None:
                self._panes.doubt()
            self._plan = None
            self._controller.restart()
            return recovered
        self._replan(pose)
        if self._plan is None:
            return self._robot.twist(*turn_towards(1.0, self._robot))
        self._plan.advance(pose)
        left = self._plan.remaining - (0.0 if self._docking else self._arrival.short)
        return self._follow(self._plan, pose, velocity, left)

    def _follow(self, plan: PlannedPath, pose: Pose, velocity: tuple[float, float], left: float) -> tuple[float, float]:
        """Return the velocities along a plan, m/s and rad/s: rest for people and at the goal, turn, or drive.

        Args:
            plan: the path. pose, velocity: of the robot when the command takes effect.
            left: length of the path to the place of rest, meters.
        """
        rest = self._rest_for_people(plan, pose, velocity)
        if rest is not None:
            return rest
        if self._arrives(plan, pose, left):
            return 0.0, 0.0
        bearing = bearing_of(plan, pose)
        if abs(bearing) > TURN_IN_PLACE_RAD and velocity[0] < 0.1 and left > 0.3:
            self._controller.restart()
            return self._robot.twist(*turn_towards(bearing, self._robot))
        fastest = approach_speed(left, 0.7) if self._arrival.active else math.inf
        gentle = self._gentle
        shaping = None if gentle is None else Shaping(gentle.limits.weights, gentle.history)
        v, w = self._controller.command(pose, velocity, plan, self._costmap, self._people, fastest, shaping)
        if self._controller.fastest_soon < CREEP_SPEED and self._alongside(pose):
            # Nobody walks into a robot at rest; one that creeps is at fault.
            self._controller.restart()
            self._rest_at_goal(pose)
            return 0.0, 0.0
        return v, w

    def _rest_for_people(
        self, plan: PlannedPath, pose: Pose, velocity: tuple[float, float]
    ) -> tuple[float, float] | None:
        """Return the velocities of a robot that has to rest for people, None if it may drive."""
        if not self._waiting.step(pose, velocity[0], self._people):
            return None
        self._controller.restart()
        bearing = bearing_of(plan, pose)
        # A turn on the spot takes no floor from anybody.
        turn = self._robot.twist(*turn_towards(bearing, self._robot))[1] if abs(velocity[0]) < REST_TURN_SPEED else 0.0
        return self._rest_at_goal(pose) or (0.0, turn)

    def _arrives(self, plan: PlannedPath, pose: Pose, left: float) -> bool:
        """Return whether the robot is where it has to rest, and note that it is about to stop."""
        if self._docking or not (self._stopping or (left < 0.03 and plan.offset(pose) < 0.15)):
            return False
        self._stopping = self._arrival.active
        return self._stopping

    @property
    def _people(self) -> tuple[TrackedPerson, ...]:
        """The people who are tracked."""
        return () if self._crowd is None else self._crowd.alive

    def _alongside(self, pose: Pose) -> bool:
        """Return whether a person is near the robot."""
        return any(math.dist(person.place, pose[:2]) < ALONGSIDE_M for person in self._people)

    def _emergency(self, pose: Pose, speed: float) -> bool:
        """Return whether the robot has to brake for somebody who is too near to brake gently."""
        if self._gentle is None or not self._waiting.resting:
            return False
        braking = self._gentle.limits.acceleration
        return any(
            person.sure and too_late(person, pose, speed, braking, GENTLE_DELAY_S, GENTLE_DISTANCE_M)
            for person in self._people
        )

    def _rest_at_goal(self, pose: Pose) -> tuple[float, float] | None:
        """Return the velocities of a robot that has to rest, and may as well stop: it is in the goal's disc."""
        inside = math.dist(pose[:2], self._goal[:2]) < self._arrival.radius - STOP_INSIDE_M
        if self._docking or not self._arrival.active or not inside:
            return None
        self._stopping = True
        return 0.0, 0.0

    def _replan(self, pose: Pose) -> None:
        """Plan if there is no path, if it is blocked or left, or if the docking pose has moved."""
        if self._plan is not None and self._since_plan > REPLAN_STEPS:
            moved = self._docking and math.dist(self._axis_start()[:2], self._target[:2]) > TARGET_SHIFT_M
            if moved or self._plan.blocked(self._costmap) or self._plan.offset(pose) > OFF_PATH_M:
                self._plan = None
        if self._plan is None and self._since_plan >= REPLAN_STEPS:
            self._target = self._axis_start() if self._docking else self._goal
            self._plan = planned(self._costmap, pose, self._target[:2])
            self._since_plan = 0

    def _axis_start(self) -> Pose:
        """Return the pose from which the way to the docking pose is straight."""
        goal = self._station.goal
        for length in (DOCKING_AXIS_M, 0.7 * DOCKING_AXIS_M):
            start = compose(goal, (-length, 0.0, 0.0))
            if float(self._costmap.clearance(np.array([start[:2]]))[0]) > self._robot.planning_radius:
                return start
        return goal

    def _at_axis(self, pose: Pose) -> bool:
        """Return whether the robot is where the straight way to the docking pose begins."""
        start, goal = self._axis_start(), self._station.goal
        return math.dist(pose[:2], start[:2]) < (NO_AXIS_START_M if start == goal else AXIS_START_M)

    def _dock(self, pose: Pose, velocity: tuple[float, float]) -> tuple[float, float]:
        """Return the velocities of the straight way to the docking pose."""
        goal = self._station.goal
        end = np.array(goal[:2])
        far = self._parked is None or math.dist(self._parked.path[-1], end) > 0.004
        if self._parked is None or (far and not self._parked.ended):
            options = TrackingOptions(rest=True, lookahead=0.15, turn_in_place=0.8, drive_on=0.1, last_turn=0.03)
            path = np.array([pose[:2], goal[:2]])
            self._parked = PathTracker(path, self._robot, options, self._parked is None, goal[2])
        v, w = self._robot.twist(*self._parked.action(pose, velocity[0]))
        if self._crowd is not None and self._waiting.step(pose, velocity[0], self._crowd.alive):
            v = 0.0
        return v, w
