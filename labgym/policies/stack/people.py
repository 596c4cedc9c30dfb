"""People: clusters of returns that the map does not explain, tracked at constant velocity; rest for people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT
from labgym.geometry import Array
from labgym.navigation import Pose

CLUSTER_GAP_M = 0.30
"""Returns farther apart than this belong to different clusters, meters: a stride of two legs is one cluster."""

WIDEST_PERSON_M = 1.3
"""Clusters wider than this are not people, meters."""

TRACK_GATE_M = 0.7
"""Greatest distance from a predicted place at which a cluster continues a track, meters."""

LOST_STEPS = 10
"""Control steps without a cluster after which a track ends."""

WALKING_SPEED = 0.25
"""Speed above which a track is a person who walks, m/s."""

PERSON_WAY_M, THING_STEPS, THING_STEPS_AT_REST = 0.5, 80, 300
"""Way after which a track is a person for good, meters, for what is seen of a thing from its sides differs by less;
control steps after which one without it is a thing, and after which one is that was first seen by a robot at rest."""

REST_STEP_M = 0.006
"""Way in a control step below which the robot rests, meters."""

CONFIRMED_CLUSTERS = 3
"""Number of clusters after which the velocity of a track counts."""

PERSON_ACCELERATION, CENTER_NOISE_M = 2.5, 0.08
"""Standard deviations of the tracker: of a person's acceleration, m/s2, and of a cluster's center, m."""

PERSON_RADIUS_M = 0.30
"""Radius of a person, meters."""

TOUCH_DISTANCE_M = ROBOT.chassis_radius + PERSON_RADIUS_M + 0.09
"""Distance between the centers of robot and person that must not be reached while driving, meters."""

WALKING_MARGIN_M, WALKING_SPREAD = 0.12, 0.10
"""What is added to it for a person who walks: at once, meters, and with the time of the prediction, m/s."""

STANDING_MARGIN_M = 0.05
"""What is added to it for one who stands, and may set off, meters."""

PERSONAL_DISTANCE_M = 1.05
"""Distance beyond which a robot does not disturb a person, meters."""

WALK_AHEAD_S, WALK_ASIDE_M, WALK_COST = 2.5, 0.80, 28.0
"""Time for which people are expected to walk straight on, seconds; distance from that line that leaves them room,
meters; cost of an end on it."""

TRACKING_RANGE_M = 7.0
"""Distance beyond which returns are not tracked, meters."""

SUDDEN_DISTANCE_M, SUDDEN_SPEED = 2.2, 1.0
"""Distance within which a new cluster may be a person who comes round a corner, meters, and their speed, m/s."""


@dataclass(frozen=True)
class TrackedPerson:
    """A person at a place, who goes on at a velocity.

    Attributes:
        place: (x, y) of the center, meters. velocity: m/s. walking: whether the person walks.
        alive: False for what has stood there for long and never walked: a thing.
        sure: False for one that was seen only just now, and may not exist.
    """

    place: tuple[float, float]
    velocity: tuple[float, float]
    walking: bool
    alive: bool = True
    sure: bool = True


class Track:
    """A Kalman filter of place and velocity, of constant velocity with white acceleration, for each axis."""

    def __init__(self, place: Array, stands: float = THING_STEPS) -> None:
        self._stands = stands
        self.state: Array = np.vstack([place, np.zeros(2)])
        self.covariance: Array = np.diag([CENTER_NOISE_M**2, 1.0])
        self.seen, self.unseen, self.walked, self.age = 1, 0, 2 * LOST_STEPS, 0
        self._first, self._has_walked = place, False

    def predict(self, dt: float) -> None:
        """Advance by a time, seconds."""
        move = np.array([[1.0, dt], [0.0, 1.0]])
        spread = PERSON_ACCELERATION**2 * np.array([[dt**4 / 4.0, dt**3 / 2.0], [dt**3 / 2.0, dt**2]])
        self.state = move @ self.state
        self.covariance = move @ self.covariance @ move.T + spread
        self.unseen += 1
        self.walked += 1
        self.age += 1

    def correct(self, place: Array) -> None:
        """Take in the center of a cluster, (2,) meters."""
        gain = self.covariance[:, 0] / (self.covariance[0, 0] + CENTER_NOISE_M**2)
        self.state = self.state + np.outer(gain, place - self.state[0])
        self.covariance = self.covariance - np.outer(gain, self.covariance[0])
        self.seen, self.unseen = self.seen + 1, 0
        if self.seen >= CONFIRMED_CLUSTERS and float(np.linalg.norm(self.state[1])) > WALKING_SPEED:
            self.walked = 0
        if self.seen == CONFIRMED_CLUSTERS:
            self._first = self.state[0]
        self._has_walked = self._has_walked or float(np.linalg.norm(self.state[0] - self._first)) > PERSON_WAY_M

    @property
    def person(self) -> TrackedPerson:
        """The track as a person; one who stopped walking less than a second ago still walks."""
        walking = self.walked < LOST_STEPS and self.seen >= CONFIRMED_CLUSTERS
        velocity = self.state[1] if walking else np.zeros(2)
        (x, y), (vx, vy) = self.state[0].tolist(), velocity.tolist()
        return TrackedPerson((x, y), (vx, vy), walking, self._has_walked or self.age < self._stands)


class PeopleTracker:
    """Tracks the clusters around the robot.

    Args:
        dt: time between scans, seconds.
        things: whether the map may lack things; otherwise all that it lacks are people.
    """

    def __init__(self, dt: float = ROBOT.control_dt, things: bool = True) -> None:
        self._dt, self._things = dt, things
        self._stands = math.inf
        self._tracks: list[Track] = []
        self._robot: Pose = (0.0, 0.0, 0.0)

    def observe(self, pose: Pose, points: Array, unexplained: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Update the tracks by a scan, and return which returns belong to people who walk, (n,).

        Args:
            pose: of the robot in the map's frame.
            points: (n, 2) returns in the map's frame, in the order of their bearings.
            unexplained: (n,) whether the map has nothing there.
        """
        if self._things:
            self._stands = THING_STEPS_AT_REST if math.dist(pose[:2], self._robot[:2]) < REST_STEP_M else THING_STEPS
        self._robot = pose
        for track in self._tracks:
            track.predict(self._dt)
        away = np.hypot(points[:, 0] - pose[0], points[:, 1] - pose[1])
        chosen = np.flatnonzero(unexplained & (away < TRACKING_RANGE_M))
        groups = clusters(points[chosen])
        centers = [_center(points[chosen[group]], pose) for group in groups]
        owners = self._associate(centers)
        walking = np.zeros(len(points), dtype=bool)
        for group, track in zip(groups, owners, strict=True):
            walking[chosen[group]] = track.person.walking
        self._tracks = [
            track for track in self._tracks if track.unseen <= (LOST_STEPS if track.seen >= CONFIRMED_CLUSTERS else 2)
        ]
        return walking

    @property
    def people(self) -> tuple[TrackedPerson, ...]:
        """The tracks as people; a new one nearby is expected to come towards the robot until its velocity is known."""
        confirmed = [track.person for track in self._tracks if track.seen >= CONFIRMED_CLUSTERS]
        fresh = [track.state[0] for track in self._tracks if track.seen < CONFIRMED_CLUSTERS and track.unseen == 0]
        robot = np.array(self._robot[:2])
        for place in fresh:
            towards = robot - place
            away = float(np.linalg.norm(towards))
            if 0.1 < away < SUDDEN_DISTANCE_M:
                (x, y), (vx, vy) = place.tolist(), (SUDDEN_SPEED * towards / away).tolist()
                confirmed.append(TrackedPerson((x, y), (vx, vy), True, sure=False))
        return tuple(confirmed)

    @property
    def alive(self) -> tuple[TrackedPerson, ...]:
        """The people without the things among them."""
        return tuple(person for person in self.people if person.alive)

    def _associate(self, centers: list[Array]) -> list[Track]:
        """Return the track of each center; nearest pairs first, new tracks for the rest."""
        owners: list[Track | None] = [None] * len(centers)
        pairs = sorted(
            (float(np.linalg.norm(track.state[0] - center)), k, index)
            for k, center in enumerate(centers)
            for index, track in enumerate(self._tracks)
        )
        used: set[int] = set()
        for distance, k, index in pairs:
            if distance < TRACK_GATE_M and owners[k] is None and index not in used:
                used.add(index)
                owners[k] = self._tracks[index]
                self._tracks[index].correct(centers[k])
        fresh = [Track(center, self._stands) for center, owner in zip(centers, owners, strict=True) if owner is None]
        self._tracks += fresh
        supply = iter(fresh)
        return [next(supply) if owner is None else owner for owner in owners]


def clusters(points: Array) -> list[NDArray[np.intp]]:
    """Return the indices of points (n, 2) by cluster; neighbors in order are together if they are near each other.

    Clusters that are too wide for a person are left out.
    """
    if len(points) == 0:
        return []
    breaks = np.flatnonzero(np.linalg.norm(np.diff(points, axis=0), axis=1) > CLUSTER_GAP_M) + 1
    groups = np.split(np.arange(len(points)), breaks)
    if len(groups) > 1 and np.linalg.norm(points[0] - points[-1]) <= CLUSTER_GAP_M:
        groups = [np.concatenate([groups[-1], groups[0]]), *groups[1:-1]]
    return [group for group in groups if np.ptp(points[group], axis=0).max() <= WIDEST_PERSON_M]


def approach_cost(
    people: Sequence[TrackedPerson], here: tuple[float, float], places: Array, moving: NDArray[np.bool_], dt: float
) -> Array:
    """Return what sequences of places (n, steps, 2) from `here` cost for people who go on as before, (n,).

    A robot at rest is not run into: only motion can touch. Nearness costs at rest too, in proportion to its time.
    """
    steps = places.shape[1]
    times = dt * np.arange(1, steps + 1)
    reach = float(np.abs(places - np.array(here)).max(initial=0.0)) * math.sqrt(2.0) + PERSONAL_DISTANCE_M
    cost = np.zeros(len(places))
    for person in people:
        speed = math.hypot(*person.velocity)
        # Those who are too far away to matter within the time of the sequences cost nothing.
        if math.dist(person.place, here) > reach + speed * times[-1]:
            continue
        dx = places[..., 0] - (person.place[0] + times * person.velocity[0])
        dy = places[..., 1] - (person.place[1] + times * person.velocity[1])
        away = np.sqrt(dx * dx + dy * dy)
        touch = TOUCH_DISTANCE_M + (
            WALKING_MARGIN_M + WALKING_SPREAD * np.minimum(times, 1.5)
            if person.walking
            else np.full(steps, STANDING_MARGIN_M)
        )
        # A person who is nearer already can be left.
        near_by = math.dist(person.place, here) - 0.01
        count = (moving & (away < np.minimum(touch, near_by))).sum(axis=1)
        near = np.minimum(np.maximum((PERSONAL_DISTANCE_M - away) / (PERSONAL_DISTANCE_M - TOUCH_DISTANCE_M), 0.0), 1.0)
        cost += np.where(count > 0, 60.0 + 8.0 * count, 0.0) + 6.0 * dt * near.sum(axis=1)
    return cost


def way_cost(people: Sequence[TrackedPerson], ends: Array) -> Array:
    """Return what ends of sequences (n, 2) cost in the way of people who walk, (n,): they cannot pass in an aisle."""
    cost = np.zeros(len(ends))
    for person in people:
        speed = math.hypot(*person.velocity)
        if not person.walking or speed < WALKING_SPEED:
            continue
        ux, uy = person.velocity[0] / speed, person.velocity[1] / speed
        dx, dy = ends[:, 0] - person.place[0], ends[:, 1] - person.place[1]
        along = np.minimum(np.maximum(dx * ux + dy * uy, 0.0), speed * WALK_AHEAD_S)
        away = np.hypot(dx - along * ux, dy - along * uy)
        cost += WALK_COST * np.maximum(1.0 - away / WALK_ASIDE_M, 0.0)
    return cost


def _center(points: Array, pose: Pose) -> Array:
    """Return the center of a person of whom the lidar sees the near side, (2,)."""
    middle = points.mean(axis=0)
    dx, dy = middle - np.array(pose[:2])
    away = max(math.hypot(dx, dy), 1e-6)
    return np.asarray(middle + 0.08 * np.array([dx, dy]) / away)


REST_SPEED = 0.05
"""Speed below which the robot rests, m/s."""

HUMAN_REST_DISTANCE_M = 0.66
"""Distance of a person's center within which the robot rests, meters: nobody walks into a robot at rest."""

SET_OFF_DISTANCE_M, RECEDING_SPEED = 1.15, 0.2
"""A robot at rest does not set off while a person who walks is within this distance, meters, unless they recede faster,
m/s."""

STANDING_DISTANCE_M = 0.85
"""Distance within which it does not set off while a person stands there, meters."""

MEETING_S, MEETING_DISTANCE_M = 1.0, 0.72
"""A robot brakes for a person who walks if they would be within this distance, meters, within this time, seconds."""

BRAKING_DECELERATION, BRAKING_DELAY_S = 1.4, 0.2
"""Deceleration of the robot, m/s2, and time by which it comes late, seconds."""


class Waiting:
    """Decides whether the robot has to rest.

    Attributes:
        resting: the latest decision.
    """

    def __init__(self) -> None:
        self.resting = False

    def step(self, pose: Pose, speed: float, people: tuple[TrackedPerson, ...]) -> bool:
        """Return whether a robot at a pose and a speed, m/s, has to rest for people."""
        self.resting = any(self._holds(person, pose, speed) for person in people)
        return self.resting

    def _holds(self, person: TrackedPerson, pose: Pose, speed: float) -> bool:
        """Return whether a person makes the robot rest."""
        dx, dy = person.place[0] - pose[0], person.place[1] - pose[1]
        away = math.hypot(dx, dy)
        if away < HUMAN_REST_DISTANCE_M and not (abs(speed) > REST_SPEED and _parting(person, pose, speed)):
            return True
        if person.walking and (_meet(person, pose, speed) or too_late(person, pose, speed)):
            return True
        if abs(speed) > REST_SPEED or away > (SET_OFF_DISTANCE_M if person.walking else STANDING_DISTANCE_M):
            return False
        # One who stands next to a robot at rest may have been stopped by it, and walks on when it moves.
        return (person.velocity[0] * dx + person.velocity[1] * dy) / away < RECEDING_SPEED


def too_late(
    person: TrackedPerson,
    pose: Pose,
    speed: float,
    braking: float = BRAKING_DECELERATION,
    late: float = BRAKING_DELAY_S,
    near: float = HUMAN_REST_DISTANCE_M,
) -> bool:
    """Return whether one who comes nearer is too near by the time at which the robot has braked to rest.

    Args:
        person: at a velocity. pose, speed: of the robot, m/s.
        braking: its deceleration, m/s2. late: time after which it begins, seconds. near: distance that is too near, m.
    """
    if speed <= REST_SPEED or _parting(person, pose, speed):
        return False
    time = speed / braking + late
    way = speed * speed / (2.0 * braking) + speed * late / 2.0
    dx = person.place[0] + person.velocity[0] * time - pose[0] - way * math.cos(pose[2])
    dy = person.place[1] + person.velocity[1] * time - pose[1] - way * math.sin(pose[2])
    return math.hypot(dx, dy) < near


def _parting(person: TrackedPerson, pose: Pose, speed: float) -> bool:
    """Return whether a person falls behind a robot that drives on: one that brakes would be touched."""
    px, py = person.place[0] - pose[0], person.place[1] - pose[1]
    vx = person.velocity[0] - speed * math.cos(pose[2])
    vy = person.velocity[1] - speed * math.sin(pose[2])
    return vx * px + vy * py > -0.05 * math.hypot(px, py)


def _meet(person: TrackedPerson, pose: Pose, speed: float) -> bool:
    """Return whether a robot that drives straight on and a person who does come near each other soon."""
    px, py = person.place[0] - pose[0], person.place[1] - pose[1]
    vx = person.velocity[0] - speed * math.cos(pose[2])
    vy = person.velocity[1] - speed * math.sin(pose[2])
    time = min(max(-(px * vx + py * vy) / max(vx * vx + vy * vy, 1e-9), 0.0), MEETING_S)
    return time > 0.0 and math.hypot(px + vx * time, py + vy * time) < MEETING_DISTANCE_M
