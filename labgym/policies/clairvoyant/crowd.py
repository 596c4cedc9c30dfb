"""Plans among people: each is played through with the people who answer to it, and the best is taken."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from labgym.envs.robot import ROBOT
from labgym.geometry import Array, wrap_angle
from labgym.navigation import Pose
from labgym.policies.clairvoyant.planning import Errand, is_clear
from labgym.policies.clairvoyant.reaction import yielding_drive
from labgym.policies.clairvoyant.reference import ReferenceMotion, Rehearsal, along_route, rehearsed, standing, turn
from labgym.policies.clairvoyant.route import DriveLimits, Gait, Route
from labgym.policies.clairvoyant.schedule import Crossing, best_schedule
from labgym.policies.clairvoyant.smoothing import BandWeights, smooth_path
from labgym.policies.clairvoyant.space_time import MOVE_S, SpaceTime
from labgym.policies.clairvoyant.worth import NEAR_PEOPLE_M, Worth

DT = ROBOT.control_dt

SCHEDULE_DISTANCE_M, GRID_DISTANCE_M, EARLY_DISTANCE_M = 0.63, 0.66, 0.95
"""Least distances between the centers of a moving robot and a person, meters: of schedules, of ways on the grid, and of
drives that give way early."""
ANSWERED_DISTANCE_M = 0.585
"""Least distance between centers in a plan that people have answered, meters; they touch at 0.57."""
MOVING_VELOCITIES = (0.04, 0.08)
"""Forward velocity, m/s, and turn rate, rad/s, of a robot that counts as moving: slightly below those of the rules."""
FORESIGHT_S, FORESIGHT_AFTER_PLAN_S = 25.0, 4.0
"""Longest time that people are foreseen, and time that they are foreseen after the end of a plan, seconds."""
TOUCH_DELAY_S, TOUCH_NEAR_S = 5.0, 1.0
"""Expected cost of a touch far ahead, which can still be avoided, seconds: of delay, and near people."""
SET_OFF_MARGIN_S, BRAKE_MARGIN_S = 2.0, 1.6
"""Time to a touch below which a robot at rest stays, and below which a moving robot brakes, seconds."""
SCHEDULE_ROUNDS = 2
"""Number of schedules in a row, each for the people's answer to the previous one."""
GUIDED_BAND = BandWeights(radius=0.31, bend=0.01, twist=0.002, guide=8.0)
"""Weights of the smooth path along a way around people."""


@dataclass(frozen=True, eq=False)
class Start:
    """The robot at the time of planning.

    Attributes:
        time: seconds. pose: in the room frame. velocity: m/s and rad/s. moving: whether it drives.
    """

    time: float
    pose: Pose
    velocity: tuple[float, float]
    moving: bool


@dataclass(frozen=True, eq=False)
class RouteStart:
    """A route to take.

    Attributes:
        route: the route. before: (k, 2) places on it, meters, and speeds, m/s, until now, the last one now.
        reference: the turn in place that comes first. turning: number of its steps.
    """

    route: Route
    before: Array
    reference: ReferenceMotion
    turning: int


@dataclass(frozen=True, eq=False)
class CrowdPlan:
    """A motion to the goal.

    Attributes:
        route: the way; None to stand. raw: (k, 2) places on it, meters, and speeds, m/s, before the filter.
        reference: the motion to follow. motion: how the robot follows it. worth: of the drive so far.
        near: seconds near people from now on, as they answer to it. touch: time of the first touch; inf without one.
        driving: number of the step at which the turn in place ends. rests: whether it only comes to rest.
    """

    route: Route | None
    raw: Array
    reference: ReferenceMotion
    motion: Rehearsal
    worth: Worth
    near: float = 0.0
    touch: float = math.inf
    driving: int = 0
    rests: bool = False

    @property
    def rank(self) -> tuple[int, float]:
        """The order of plans: by points; a touch that is far ahead costs a stop, a near one everything."""
        if self.touch < self.motion.start + SET_OFF_MARGIN_S:
            return 0, self.touch
        stop_s, near_s = (0.0, 0.0) if self.touch == math.inf else (TOUCH_DELAY_S, TOUCH_NEAR_S)
        return 1, self.worth.points(DT * (len(self.motion.poses) - 1) + stop_s, self.near + near_s)


def is_moving(plan: CrowdPlan | None, weights: int, time: float, velocity: tuple[float, float]) -> bool:
    """Return whether a robot drives, or is about to after the delay of a filter of a number of weights."""
    if plan is not None and plan.route is not None:
        step = plan.reference.index(time) - plan.driving
        if step >= 0 and plan.raw[step : step + weights, 1].max(initial=0.0) > 0.0:
            return True
    return abs(velocity[0]) > MOVING_VELOCITIES[0]


def touch_of(motion: Rehearsal, people: Array) -> tuple[float, float]:
    """Return the time of the first touch of a motion, s (inf: none), and the time that it is near people, s.

    Args:
        motion: of the robot. people: (k, n, 2) centers after 1, 2, ... steps of the motion.
    """
    count = min(len(people), len(motion.poses) - 1)
    if count == 0 or people.shape[1] == 0:
        return math.inf, 0.0
    offsets = motion.poses[1 : count + 1, None, :2] - people[:count]
    away = np.hypot(offsets[..., 0], offsets[..., 1]).min(axis=1)
    moves = np.asarray((np.abs(motion.velocities[: count + 1]) > np.array(MOVING_VELOCITIES)).any(axis=1))
    # A robot that comes to rest still moves in the step before.
    touched = np.flatnonzero((moves[1:] | moves[:-1]) & (away < ANSWERED_DISTANCE_M))
    first = math.inf if len(touched) == 0 else motion.start + motion.dt * (1 + int(touched[0]))
    return first, motion.dt * float((away < NEAR_PEOPLE_M).sum())


def can_follow(route: Route, velocity: tuple[float, float], limits: DriveLimits) -> bool:
    """Return whether a robot in motion can slow down, and turn, in time for the first bends of a route."""
    along = route.spacing * np.arange(len(route.points))
    slowing = np.sqrt(np.maximum(velocity[0] ** 2 - 1.6 * limits.acceleration * along, 0.0))
    rates = np.abs(velocity[0] * route.curvature - velocity[1])[:25]
    turning = 0.3 + limits.turn_acceleration * along[:25] / max(velocity[0], 0.2)
    return bool((route.fastest >= slowing - 0.05).all() and (rates <= turning).all())


class CrowdPlanner:
    """Plans of a drive among people.

    Candidates are the present plan and, on the way alone and on one around the people as they are expected, drives that
    give way and schedules by the expected people, all or those who do not avoid the robot. Each is rehearsed, people
    answer to the rehearsal, and points count.

    Args:
        errand: the drive.
        worth: of the drive so far; to be kept up to date, as `driven`, the length driven so far, meters.
    """

    def __init__(self, errand: Errand, worth: Worth) -> None:
        self._errand, self._world, self.worth, self.driven = errand, errand.world, worth, 0.0
        self._late, self._gait = len(errand.weights) - 1, Gait.of(errand.limits, errand.weights)
        self._grid = SpaceTime(errand.field, np.array(self._world.goal[:2]), errand.short)
        self._answers: dict[bytes, Array] = {}

    def plan(self, alone: Route | None, current: CrowdPlan | None, improve: bool = True) -> CrowdPlan:
        """Return a plan for the robot now.

        Args:
            alone: the way that the robot would take from here alone, if it rests. current: the plan so far.
            improve: whether a better plan than a good one is looked for.
        """
        time, pose, velocity = self._world.time, self._world.pose, self._world.velocity
        start = Start(time, pose, velocity, is_moving(current, len(self._errand.weights), time, velocity))
        self._answers.clear()
        best: CrowdPlan | None = None
        if current is not None and current.route is not None:
            current = replace(current, motion=rehearsed(current.reference, pose, velocity, time))
            if not improve:
                best, _ = self._judged(current, beyond=0.0)
                if best.touch == math.inf:
                    return best
            best, people = self._judged(current)
        else:
            away = 1.5 * self._grid.seconds(np.array(pose[:2])) + FORESIGHT_AFTER_PLAN_S
            people = self._world.people(_times(time, min(away, FORESIGHT_S)))
        routes = [self._begun(*each, start) for each in self._routes(alone, current, people, start)]
        for begun in routes:
            for apart in (SCHEDULE_DISTANCE_M, EARLY_DISTANCE_M) if self.worth.distance else (SCHEDULE_DISTANCE_M,):
                drawn = self._giving_way(begun, apart, start, _least(best))
                if drawn is not None:
                    best = _better(best, self._judged(drawn, beyond=0.0)[0])
        for some in (np.ones(people.shape[1], dtype=bool), ~self._world.yields):
            expected = people[:, some]
            for _ in range(SCHEDULE_ROUNDS):
                drawn = self._scheduled(routes, expected, start, _least(best))
                if drawn is None:
                    break
                judged, answer = self._judged(drawn)
                best, expected = _better(best, judged), answer[:, some]
                if judged.touch == math.inf:
                    break
        if best is not None and best.touch >= time + (BRAKE_MARGIN_S if start.moving else SET_OFF_MARGIN_S):
            return best
        return self._braking(routes[0], start) if start.moving and routes else self._still(start)

    def _judged(self, plan: CrowdPlan, beyond: float = FORESIGHT_AFTER_PLAN_S) -> tuple[CrowdPlan, Array]:
        """Return a plan with what people's answer to it costs, and the people until some seconds beyond its end."""
        motion = plan.motion
        ahead = min(DT * (len(motion.poses) - 1) + beyond, FORESIGHT_S)
        people = self._answer(motion, ahead)
        touch, near = touch_of(motion, people)
        along = np.hypot(*np.diff(motion.poses[:, :2], axis=0).T).sum()
        worth = self.worth.along(self.driven + float(along))
        return replace(plan, worth=worth, touch=touch, near=near), people

    def _answer(self, motion: Rehearsal, seconds: float) -> Array:
        """Return the people for some seconds as they answer to a motion; plans in which it is the same share them."""
        times, key = _times(motion.start, seconds), motion.poses.tobytes() + motion.velocities.tobytes()
        people = self._answers.get(key)
        if people is None or len(people) < len(times):
            people = self._answers[key] = self._world.people(times, motion.at)
        return people[: len(times)]

    def _worth(self, begun: RouteStart) -> Worth:
        """Return the worth of the drive on a route."""
        return self.worth.along(self.driven + begun.route.length - float(begun.before[-1, 0]))

    def _begun(self, route: Route, before: Array, start: Start) -> RouteStart:
        """Return a route with the turn in place that comes first."""
        reference = standing(start.time, DT, start.pose)
        if not start.moving:
            yaw = start.pose[2] + wrap_angle(float(route.yaw[0]) - start.pose[2])
            reference = reference.then(*turn(start.pose, yaw, self._errand.limits, DT))
        return RouteStart(route, before, reference, len(reference.poses) - 1)

    def _giving_way(self, begun: RouteStart, apart: float, start: Start, least: float) -> CrowdPlan | None:
        """Return the plan that gives way on a route; None if it is not worth more than `least`."""
        forecast = self._world.forecast()
        if forecast is None:
            return None
        near, reference = 0.0, begun.reference
        for (x, y, _), (_, w) in zip(reference.poses[1:].tolist(), reference.velocities[1:].tolist(), strict=True):
            forecast.step(x, y, 0.0, 0.0, w)
            near += DT * (min(math.dist((x, y), each) for each in forecast.places.tolist()) < NEAR_PEOPLE_M)
        worth = self._worth(begun).after(self.worth.spent + begun.turning * DT, self.worth.close + near)
        drive = yielding_drive(begun.route, forecast, worth, apart, self._gait, begun.before, least)
        return None if drive is None else self._built(begun, drive.places, drive.speeds, start)

    def _scheduled(self, routes: Sequence[RouteStart], people: Array, start: Start, least: float) -> CrowdPlan | None:
        """Return the plan worth most for people who move as expected; None if none is worth more than `least`."""
        best: CrowdPlan | None = None
        for begun in routes:
            worth = self._worth(begun).after(self.worth.spent + begun.turning * DT, self.worth.close)
            place, speed = begun.before[-1].tolist()
            # The filter delays the schedule.
            crossing = Crossing(people[begun.turning + round(self._gait.delay) :], SCHEDULE_DISTANCE_M)
            found = best_schedule(begun.route, crossing, worth, self._gait, place, speed, least)
            if found is not None:
                best, least = self._built(begun, found.places, found.speeds, start), found.points
        return best

    def _built(self, begun: RouteStart, places: Array, speeds: Array, start: Start, arrives: bool = True) -> CrowdPlan:
        """Return the plan that drives a schedule on a route, and turns at its end if it arrives."""
        raw = np.concatenate([begun.before, np.column_stack([places, speeds])])
        raw = np.concatenate([raw, np.tile([raw[-1, 0], 0.0], (self._late, 1))])
        along, driven = (np.convolve(each, self._errand.weights, "valid")[1:] for each in raw.T)
        reference = begun.reference.then(*along_route(begun.route, along, driven))
        heading, last = self._errand.heading, reference.poses[-1].tolist()
        if arrives and heading is not None:
            reference = reference.then(*turn(last, last[2] + wrap_angle(heading - last[2]), self._errand.limits, DT))
        motion = rehearsed(reference, start.pose, start.velocity, start.time)
        return CrowdPlan(begun.route, raw, reference, motion, self.worth, driving=begun.turning)

    def _routes(
        self, alone: Route | None, current: CrowdPlan | None, people: Array, start: Start
    ) -> list[tuple[Route, Array]]:
        """Return the routes from here, each with the places and speeds on it until now, (k, 2)."""
        routes, before = [], np.zeros((self._late + 1, 2))
        if start.moving and current is not None and current.route is not None:
            step = current.reference.index(start.time) - current.driving
            before = current.raw[step : step + self._late + 1]
            routes.append((current.route, before))
            # On another route the robot is at its beginning, and what the filter still holds is ahead.
            before = before - [float(np.convolve(before[:, 0], self._errand.weights, "valid")[0]), 0.0]
        elif alone is not None:
            routes.append((alone, before))
        around = self._around(current, people, start)
        return routes if around is None else [*routes, (around, before)]

    def _around(self, current: CrowdPlan | None, people: Array, start: Start) -> Route | None:
        """Return the route around people who move as expected; None without one that the robot can take."""
        stride, here = round(MOVE_S / DT), np.array(start.pose[:2])
        expected = self._grid.seconds(here) + 3.0 if current is None else current.reference.end - start.time
        places = np.concatenate([people[:1], people[stride - 1 :: stride]])
        way = self._grid.way(here, places, GRID_DISTANCE_M, NEAR_PEOPLE_M, self.worth.price(max(expected, 0.0)))
        if way is None:
            return None
        way = way[np.concatenate([[True], np.linalg.norm(np.diff(way, axis=0), axis=1) > 1e-6])]
        if len(way) < 3:
            return None
        yaw = start.pose[2] if start.moving else None
        route = Route.of(smooth_path(way, self._errand.field, GUIDED_BAND, yaw), self._errand.limits, yaw)
        if not is_clear(route, self._errand.field):
            return None
        return route if not start.moving or can_follow(route, start.velocity, self._errand.limits) else None

    def _braking(self, begun: RouteStart, start: Start) -> CrowdPlan:
        """Return the plan that comes to rest on a route as soon as the limits allow."""
        place, speed = begun.before[-1].tolist()
        rise = self._gait.rise
        levels = np.arange(min(round(speed / rise), self._gait.levels), -1, -1)
        moves = 0.5 * rise * DT * np.cumsum(levels[:-1] + levels[1:])
        places = np.minimum(place + moves, begun.route.length)
        return replace(self._built(begun, places, rise * levels[1:], start, arrives=False), rests=True)

    def _still(self, start: Start) -> CrowdPlan:
        """Return the plan to stand."""
        motion = Rehearsal(start.time, DT, np.array([start.pose]), np.zeros((1, 2)))
        return CrowdPlan(None, np.zeros((1, 2)), standing(start.time, DT, start.pose), motion, self.worth, rests=True)


def _times(start: float, seconds: float) -> list[float]:
    """Return the times of the control steps of some seconds after a time."""
    return [start + DT * k for k in range(1, round(seconds / DT) + 1)]


def _least(best: CrowdPlan | None) -> float:
    """Return the points that a plan must exceed to be better."""
    return -math.inf if best is None or best.rank[0] == 0 else best.rank[1]


def _better(best: CrowdPlan | None, other: CrowdPlan) -> CrowdPlan:
    """Return the better of two plans."""
    return other if best is None or other.rank > best.rank else best
