"""Poses of the samples, with goals and expert paths, and learners that lead drives."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from labgym.errors import LabgymError
from labgym.geometry import Array, rotate, to_local, to_world, wrap_angle
from labgym.layouts import Layout
from labgym.navigation import PLANNING_RADIUS, Pose, ShortestPath, ShortestPaths, goal_poses
from labgym.policies.tracking import lengths_along, points_at

Kind = Literal["route", "tight", "anywhere"]

PATH_POINTS = 64
"""Points of an expert path, evenly spaced from the robot to the goal."""

COMFORT_M = 0.40
"""Preferred clearance of an expert path, meters; where it does not fit, the planning radius is used."""

SHORTEST_DRIVE_M = 0.6
"""Minimum path length to a goal, meters; nearer goals are not useful for training."""

PLACES_SHARE = 0.7
"""Share of the drives' ends that are goal poses of the layout's protocol; the others are random."""

KINDS: tuple[tuple[Kind, float], ...] = (("route", 0.7), ("tight", 0.15), ("anywhere", 0.15))

MOST_ATTEMPTS = 200

FRAME_PERIOD_S = 0.5
"""Time between two frames of a drive, seconds."""

STRIDES_M = 0.12, 0.45
"""Smallest and largest distance between two frames of a drive, meters."""

LARGEST_TURN_RAD = 0.75
"""Largest turn between two frames, radians: half a second at 1.5 rad/s."""

HEADING_NOISE_RAD = 0.25
"""Standard deviation of the heading from the expert's, radians: samples have to cover places off the path."""

TURN_IN_PLACE_RAD = 1.0
"""Heading error above which a drive turns without moving, radians."""


@dataclass(frozen=True, eq=False)
class DriveFrame:
    """Geometry of one sample: a frame of a drive.

    Attributes:
        pose: (x, y, yaw) in the room frame; the robot's planning disc is free there.
        goal: (x, y) in the robot frame, meters.
        path: (64, 2) in the robot frame, meters: the shortest way of a disc from the robot to the goal.
        length: of that way, meters.
        clearance: from the center line of that way to the nearest obstacle or wall, meters.
        kind: where the drive began: "route" near the way between two ends, "tight" near obstacles, "anywhere" in free
            space.
        frame: number of the sample in its drive, `FRAME_PERIOD_S` seconds after the previous one.
    """

    pose: Pose
    goal: tuple[float, float]
    path: Array
    length: float
    clearance: float
    kind: Kind
    frame: int


Guide = Callable[[DriveFrame], Array]
"""Returns the way on which a drive goes on from a frame: (n, 2) in the robot frame, meters, from the origin."""


class Situations:
    """Draws situations in one layout.

    Args:
        layout: many drives go to goal poses of its protocol.

    Raises:
        LabgymError: nothing can be drawn, because the robot fits nowhere.
    """

    def __init__(self, layout: Layout) -> None:
        self._layout = layout
        self._experts = ShortestPaths(layout, COMFORT_M), ShortestPaths(layout, PLANNING_RADIUS)
        self._space = self._experts[1].space
        poses = np.array([pose[:2] for pose in goal_poses(layout).values()]).reshape(-1, 2)
        self._places = poses[self._space.holds(poses)]

    def drive(self, rng: np.random.Generator, count: int, guide: Guide | None = None) -> list[DriveFrame]:
        """Return `count` frames of consecutive drives; a drive ends near its goal.

        A drive follows a way from its present place, with a heading that deviates from it.

        Args:
            rng: generator.
            count: number of frames.
            guide: says which way each frame goes on; None follows the expert's.
        """
        frames: list[DriveFrame] = []
        while len(frames) < count:
            frames += self._drive(rng, count - len(frames), guide)
        return frames

    def _drive(self, rng: np.random.Generator, most: int, guide: Guide | None) -> list[DriveFrame]:
        """Return the frames of one drive."""
        place, goal, kind = self._begin(rng)
        way = self._way(place, goal)
        yaw: float | None = None
        frames: list[DriveFrame] = []
        while way is not None and way.length > SHORTEST_DRIVE_M and len(frames) < most:
            if yaw is None:
                yaw = _heading(rng, resampled(way.points, PATH_POINTS) - place, way.length)
            frame = self._frame(place, yaw, goal, way, kind, len(frames))
            frames.append(frame)
            points = way.points if guide is None else to_world(guide(frame), frame.pose)
            place, yaw = self._next_pose(rng, place, yaw, points)
            way = self._way(place, goal)
        return frames

    def _begin(self, rng: np.random.Generator) -> tuple[Array, Array, Kind]:
        """Draw a place from which a goal can be reached, the goal, and the kind of the place."""
        names, weights = zip(*KINDS, strict=True)
        for _ in range(MOST_ATTEMPTS):
            route = self._way(self._end(rng), goal := self._end(rng))
            if route is None or route.length <= 2.0 * SHORTEST_DRIVE_M:
                continue
            kind: Kind = names[int(rng.choice(len(names), p=weights))]
            place = self._near(rng, route) if kind == "route" else self._free(rng, tight=kind == "tight")
            way = self._way(place, goal) if self._space.holds(place[None])[0] else None
            if way is not None and way.length > SHORTEST_DRIVE_M:
                return place, goal, kind
        raise LabgymError(f"layout {self._layout.id!r}: none of {MOST_ATTEMPTS} random drives is feasible")

    def _next_pose(self, rng: np.random.Generator, place: Array, yaw: float, points: Array) -> tuple[Array, float]:
        """Return the pose in the next frame: a little off a way (n, 2), or on it if that place is not free."""
        near = _along(points, 0.3) - place
        error = wrap_angle(math.atan2(near[1], near[0]) - yaw)
        turn = float(np.clip(error + rng.normal(0.0, HEADING_NOISE_RAD), -LARGEST_TURN_RAD, LARGEST_TURN_RAD))
        stride = float(rng.uniform(*STRIDES_M)) if abs(error) < TURN_IN_PLACE_RAD else 0.0
        heading = wrap_angle(yaw + turn)
        there = place + stride * np.array([math.cos(heading), math.sin(heading)])
        if self._space.holds(there[None])[0]:
            return there, heading
        there = _along(points, stride)
        if not self._space.holds(there[None])[0]:
            there = place
        return there, wrap_angle(yaw + float(np.clip(error, -LARGEST_TURN_RAD, LARGEST_TURN_RAD)))

    def _frame(self, place: Array, yaw: float, goal: Array, way: ShortestPath, kind: Kind, frame: int) -> DriveFrame:
        return DriveFrame(
            pose=(float(place[0]), float(place[1]), yaw),
            goal=rotate(float(goal[0] - place[0]), float(goal[1] - place[1]), -yaw),
            path=to_local(resampled(way.points, PATH_POINTS), (place[0], place[1], yaw)),
            length=way.length,
            clearance=self._space.barriers.line_clearance(way.points),
            kind=kind,
            frame=frame,
        )

    def _way(self, start: Array, goal: Array) -> ShortestPath | None:
        """Return the shortest way with the preferred clearance, or else with the planning radius."""
        ways = (expert.path(tuple(start), tuple(goal)) for expert in self._experts)
        return next((way for way in ways if way is not None), None)

    def _end(self, rng: np.random.Generator) -> Array:
        if len(self._places) and rng.random() < PLACES_SHARE:
            return np.asarray(self._places[int(rng.integers(len(self._places)))])
        return self._free(rng, tight=False)

    def _near(self, rng: np.random.Generator, route: ShortestPath) -> Array:
        """Return a point near a random place on a route; it may not be free."""
        along = resampled(route.points, PATH_POINTS)
        place = along[int(rng.integers(PATH_POINTS - 4))]
        return np.asarray(place + rng.normal(0.0, 0.12, 2))

    def _free(self, rng: np.random.Generator, tight: bool) -> Array:
        """Return a random free point, or the one with the least clearance of eight."""
        low, high = self._space.barriers.low, self._space.barriers.high
        for _ in range(MOST_ATTEMPTS):
            points = low + rng.random((64, 2)) * (high - low)
            free = points[self._space.holds(points)]
            if len(free):
                near = self._space.obstacles.nearest(free[:8])
                return np.asarray(free[int(np.argmin(near)) if tight else 0])
        raise LabgymError(f"layout {self._layout.id!r} has no space for a disc of {PLANNING_RADIUS} m")


def resampled(points: Array, count: int) -> Array:
    """Return `count` points at even distances along a polyline (n, 2), its ends included."""
    return points_at(points, np.linspace(0.0, lengths_along(points)[-1], count))


def _along(points: Array, distance: float) -> Array:
    """Return the point at a distance along a polyline (n, 2), at most its end."""
    return np.asarray(points_at(points, np.array([distance]))[0])


def _heading(rng: np.random.Generator, ahead: Array, length: float) -> float:
    """Return a random heading: mostly along the way, sometimes towards the goal, sometimes any.

    Args:
        rng: generator.
        ahead: (n, 2) points of the way relative to the robot, meters.
        length: length of the way, meters.
    """
    draw = rng.random()
    if draw < 0.6:
        near = min(PATH_POINTS - 1, max(1, round(0.5 / length * (PATH_POINTS - 1))))
        yaw = math.atan2(ahead[near, 1], ahead[near, 0]) + rng.normal(0.0, 0.35)
    elif draw < 0.85:
        yaw = math.atan2(ahead[-1, 1], ahead[-1, 0]) + rng.normal(0.0, 0.35)
    else:
        yaw = rng.uniform(-math.pi, math.pi)
    return wrap_angle(float(yaw))


class Leader(Protocol):
    """A learner that leads drives (DAgger, Ross, Gordon and Bagnell 2011). It is pickled and sent to workers."""

    @property
    def digest(self) -> str:
        """SHA-256 of everything that decides where it drives."""

    def guide(self, layout: Layout, seed: int) -> Guide:
        """Return the guide of drives in a layout; equal seeds give equal guides."""
