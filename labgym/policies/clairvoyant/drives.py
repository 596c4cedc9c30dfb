"""Drives to a goal: alone by one plan, and among people by plans that are revised."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from labgym.envs.robot import ROBOT
from labgym.navigation import Pose
from labgym.policies.clairvoyant.crowd import BRAKE_MARGIN_S, CrowdPlan, CrowdPlanner, is_moving
from labgym.policies.clairvoyant.planning import Errand, reference_of
from labgym.policies.clairvoyant.reference import standing
from labgym.policies.clairvoyant.route import Route
from labgym.policies.clairvoyant.worth import NEAR_PEOPLE_M, Worth

CHECK_PERIOD_S, IMPROVE_PERIOD_S, RETRY_PERIOD_S = 1.0, 3.0, 0.4
"""Time between checks of a plan, between searches for a better one, and between searches of a robot that stands,
seconds."""
REPLAN_DISTANCE_M = 0.05
"""Distance from the start of the way alone at which it is planned anew, meters."""
KEEP_BEFORE_END_S = 0.45
"""A plan that ends within this time is kept, seconds."""
KEEP_AFTER_END_S = 1.0
"""Time after its end until which a plan is kept, seconds."""


class AloneDrive:
    """A drive by one plan.

    Args:
        errand: the drive.
    """

    def __init__(self, errand: Errand) -> None:
        self._world, pose, time = errand.world, errand.world.pose, errand.world.time
        way = errand.way(pose)
        if way is None:
            self._reference = standing(time, ROBOT.control_dt, pose)
        else:
            self._reference = reference_of(way, pose, errand.limits, time, errand.weights)
        self._late = 0.0

    @property
    def over(self) -> float:
        """Time since the end of the plan, seconds."""
        return self._world.time - self._late - self._reference.end

    def wanted(self) -> tuple[float, float]:
        """Return the velocities to command, m/s and rad/s. Wheels that slip make the plan late."""
        time, pose = self._world.time, self._world.pose
        self._late += self._reference.behind(time - self._late, pose)
        return self._reference.wanted(time - self._late, pose)


class CrowdDrive:
    """A drive among people.

    Args:
        errand: the drive. worth: its weights.
    """

    def __init__(self, errand: Errand, worth: Worth) -> None:
        self._errand, self._world = errand, errand.world
        pose, time = self._world.pose, self._world.time
        way = errand.way(pose)
        self._alone: tuple[Pose, Route] | None = None if way is None else (pose, way.route)
        length = 1.0 if way is None else way.route.length
        self._planner = CrowdPlanner(errand, replace(worth, ideal=max(length, 0.5)))
        self._began, self._beside, self._last = time, 0.0, pose
        self._due, self._improve = time, time
        self._plan: CrowdPlan | None = None

    @property
    def over(self) -> float:
        """Time since the end of a plan that leads to the goal, seconds; negative without one."""
        if self._plan is None or self._plan.rests:
            return -math.inf
        return self._world.time - self._plan.reference.end

    def wanted(self) -> tuple[float, float]:
        """Return the velocities to command, m/s and rad/s."""
        world = self._world
        people = world.people([world.time])[0] - np.array(world.pose[:2])
        if np.hypot(people[:, 0], people[:, 1]).min(initial=math.inf) < NEAR_PEOPLE_M:
            self._beside += ROBOT.control_dt
        self._planner.driven += math.dist(world.pose[:2], self._last[:2])
        self._last = world.pose
        if world.time >= self._due - 1e-6:
            self._replan()
        if self._plan is None or self._plan.route is None:
            return 0.0, 0.0
        return self._plan.reference.wanted(world.time, world.pose)

    def _replan(self) -> None:
        """Check the plan, or make another."""
        world, plan, time = self._world, self._plan, self._world.time
        if plan is not None and self._stays(plan):
            return
        if plan is not None and (plan.rests or time > plan.reference.end):
            plan = None
        alone = None
        if not is_moving(plan, len(self._errand.weights), time, world.velocity):
            alone = self._way_alone()
        elif plan is None:
            return
        improve = time >= self._improve - 1e-6
        if improve:
            self._improve = time + IMPROVE_PERIOD_S
        self._planner.worth = self._planner.worth.after(time - self._began, self._beside)
        self._plan = self._planner.plan(alone, plan, improve)
        pause = RETRY_PERIOD_S if self._plan.route is None else 0.0
        self._due = time + (pause if self._plan.rests else CHECK_PERIOD_S)
        # In time to brake before a touch that is expected.
        self._due = min(self._due, max(self._plan.touch - BRAKE_MARGIN_S, time + ROBOT.control_dt))

    def _stays(self, plan: CrowdPlan) -> bool:
        """Return whether a plan is carried out without a check now."""
        if plan.route is None:
            return False
        time = self._world.time
        left = plan.reference.end - time
        if plan.rests:
            return left > 0.05
        turning = plan.reference.index(time) < plan.driving
        return -KEEP_AFTER_END_S < left < KEEP_BEFORE_END_S or (turning and plan.touch > time + 1.5)

    def _way_alone(self) -> Route | None:
        """Return the way that the robot would take from here alone."""
        pose = self._world.pose
        if self._alone is None or math.dist(self._alone[0][:2], pose[:2]) > REPLAN_DISTANCE_M:
            way = self._errand.way(pose, quick=True)
            self._alone = None if way is None else (pose, way.route)
        return None if self._alone is None else self._alone[1]
