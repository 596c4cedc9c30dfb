"""Docking: measure by how much the station stands off its place in the map, and correct the goal by it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.geometry import Array, OrientedBox, compose, relative, to_local, to_world
from labgym.navigation import STAND_OFF, Pose
from labgym.policies.dwa import lidar_points
from labgym.policies.stack.old_map import OldMap, ray_lengths

LARGEST_SHIFT_M, LARGEST_TURN_RAD = 0.12, math.radians(7.0)
"""Greatest displacement and rotation of a station that are looked for, meters and radians."""
SCAN_RANGE_M = 3.0
"""Greatest distance from the goal at which scans are compared, meters."""
RANGE_CAP_M = 0.06
"""Differences between an expected and a measured range count up to this one, meters."""
MOST_SCANS = 12
"""Greatest number of scans that are compared at a time."""
SCAN_DISTANCE_M = 0.20
"""Distance between the places of two scans, meters."""
SHIFT_COST = 0.002
"""Cost of a displacement of 0.1 m, or of a rotation of 0.1 rad, as a share of the cap of the ranges."""
ASIDE_STEPS = 17
"""Number of displacements along the front that are tried again with each scan."""
FRONT_RANGE_M, FRONT_DEPTH_M, FRONT_HALF_WIDTH_M = 1.8, 0.30, 0.35
"""Distance from a docking pose within which its front is measured, and the region around the announced front whose
returns count, meters."""
LEAST_FRONT_RETURNS, MOST_FRONT_RETURNS, FRONT_SCALE_M = 40, 3000, 0.05
"""Numbers of returns that a line takes, and distance from it at which the weight of one has fallen to a quarter."""
LARGEST_FRONT_TURN_RAD = math.radians(15.0)
"""A line that is turned by more than this is not the front, radians."""
MIDDLE_BEHIND_FRONT_M = 0.35
"""Assumed distance of a station's middle, about which it turns, from its front, meters."""
HALVINGS = 7
"""Number of halvings of the step of the search: to 1 mm and 0.05 degrees."""


class StationEstimate:
    """Estimates the pose of a station relative to the map.

    The scans near it are compared with those that the map predicts for a station that stands off by (dx, dy, turn)
    about the middle of its front: expected ranges are the lesser of those to the turned boxes of the station and to
    everything else. The displacement with the least mean absolute difference, capped, is searched on a grid first and
    then by halving steps around the best (correlative scan matching: E. Olson, ICRA 2009).

    Args:
        map: the old map. goal: the docking pose in it.

    Attributes:
        offset: (dx, dy, turn) of the station in the frame of the mapped goal, meters and radians.
        measured: whether any scan has been compared.
    """

    def __init__(self, map: OldMap, goal: Pose) -> None:  # noqa: A002
        self._goal = goal
        self._boxes = map.station(goal)
        near = [box for box in map.others(self._boxes) if math.dist((box.x, box.y), goal[:2]) < 12.0]
        self._others = near
        self._front = self._middle_of_front()
        self._scans: list[tuple[Pose, Array, Array, Array]] = []
        self.offset: Pose = (0.0, 0.0, 0.0)
        self.measured = False

    @property
    def exists(self) -> bool:
        """Whether the map has a station at the goal."""
        return bool(self._boxes)

    @property
    def goal(self) -> Pose:
        """The docking pose that follows from the station's estimated pose, in the map's frame."""
        return moved(self._goal, self._front, self.offset)

    def observe(self, pose: Pose, ranges: Array) -> None:
        """Take in a scan, (180,) meters, from a pose of the robot in the map's frame."""
        if not self._boxes or math.dist(pose[:2], self._goal[:2]) > SCAN_RANGE_M:
            return
        if self._scans and math.dist(pose[:2], self._scans[-1][0][:2]) < SCAN_DISTANCE_M:
            return
        scan = self._selected(pose, ranges)
        if scan is None:
            return
        self._scans = [*self._scans, scan]
        if len(self._scans) > MOST_SCANS:
            # Every other one: views from other places tell most.
            self._scans = self._scans[1::2]
        self._search()

    def _selected(self, pose: Pose, ranges: Array) -> tuple[Pose, Array, Array, Array] | None:
        """Return the rays that can meet the station, with what they measured and what they meet elsewhere."""
        angles = -math.pi + 2.0 * math.pi / LIDAR_RAYS * np.arange(LIDAR_RAYS) + pose[2]
        directions = np.column_stack([np.cos(angles), np.sin(angles)])
        larger = [
            OrientedBox(box.x, box.y, box.width + 2.4 * LARGEST_SHIFT_M, box.depth + 2.4 * LARGEST_SHIFT_M, box.yaw)
            for box in self._boxes
        ]
        origins = np.broadcast_to(np.array(pose[:2]), directions.shape)
        chosen = np.flatnonzero(np.isfinite(ray_lengths(origins, directions, larger)).any(axis=1) & (ranges < RANGE))
        if len(chosen) < 8:
            return None
        behind = ray_lengths(origins[chosen], directions[chosen], self._others).min(axis=1, initial=RANGE)
        return pose, directions[chosen], ranges[chosen], np.minimum(behind, RANGE)

    def _search(self) -> None:
        """Find the best displacement, from all over the range at first and around the last one later."""
        if self.measured:
            # Along its front a station shows itself only by its edges, which other scans may tell better.
            turn = self.offset[2]
            front = np.array([-math.sin(turn), math.cos(turn), 0.0])
            aside = np.concatenate(
                [[0.0], np.linspace(-LARGEST_SHIFT_M, LARGEST_SHIFT_M, ASIDE_STEPS) - self.offset[1]]
            )
            candidates = np.array(self.offset) + aside[:, None] * front
            best, step = candidates[int(np.argmin(self._differences(candidates)))], 0.25
        else:
            grid = np.linspace(-1.0, 1.0, 7)
            candidates = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1).reshape(-1, 3)
            candidates = candidates * (LARGEST_SHIFT_M, LARGEST_SHIFT_M, LARGEST_TURN_RAD)
            best, step = candidates[int(np.argmin(self._differences(candidates)))], 1.0 / 3.0
        cross = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        for _ in range(HALVINGS):
            step /= 2.0
            for _ in range(2):
                candidates = best + step * cross * (LARGEST_SHIFT_M, LARGEST_SHIFT_M, LARGEST_TURN_RAD)
                candidates = np.clip(
                    candidates,
                    (-LARGEST_SHIFT_M, -LARGEST_SHIFT_M, -LARGEST_TURN_RAD),
                    (LARGEST_SHIFT_M, LARGEST_SHIFT_M, LARGEST_TURN_RAD),
                )
                best = candidates[int(np.argmin(self._differences(candidates)))]
        self.offset = (float(best[0]), float(best[1]), float(best[2]))
        self.measured = True

    def _differences(self, candidates: Array) -> Array:
        """Return the mean capped difference of ranges for displacements (n, 3), (n,)."""
        total = SHIFT_COST * (np.abs(candidates) / 0.1).sum(axis=1)
        for pose, directions, measured, behind in self._scans:
            # The station turned by an offset meets the rays as the mapped one meets rays turned back.
            origins, turned = unmoved(pose, directions, self._front, candidates)
            count = len(candidates)
            met = ray_lengths(origins.reshape(-1, 2), turned.reshape(-1, 2), self._boxes).min(axis=1)
            expected = np.minimum(met.reshape(count, -1), behind)
            total += np.minimum(np.abs(expected - measured), RANGE_CAP_M).mean(axis=1) / RANGE_CAP_M / len(self._scans)
        return np.asarray(total)

    def _middle_of_front(self) -> Pose:
        """Return the frame in which the station turns: where the goal's heading meets it, with the goal's heading."""
        ray = np.array([[math.cos(self._goal[2]), math.sin(self._goal[2])]])
        away = float(ray_lengths(np.array([self._goal[:2]]), ray, self._boxes).min(initial=math.inf))
        return compose(self._goal, (away if math.isfinite(away) else 0.6, 0.0, 0.0))


class FrontEstimate:
    """Estimates a docking pose without a map, from the front that the robot is to face.

    The place is `STAND_OFF` before the middle of the front (`labgym.navigation.goal_pose`). A line is fitted to the
    returns where the front should be, weighted as by Geman and McClure; it tells distance and heading. Along the front
    the station is assumed where it was announced, turned about its middle.

    Args:
        goal: the announced docking pose.
    """

    def __init__(self, goal: Pose) -> None:
        self._goal, self._offset = goal, (0.0, 0.0, 0.0)
        self._returns: Array = np.empty((0, 2))

    @property
    def goal(self) -> Pose:
        """The docking pose by the front, in the frame of the announced one."""
        return moved(self._goal, compose(self._goal, (STAND_OFF, 0.0, 0.0)), self._offset)

    def observe(self, pose: Pose, ranges: Array) -> None:
        """Take in a scan, (180,) meters, from a pose of the robot."""
        if math.dist(pose[:2], self._goal[:2]) > FRONT_RANGE_M or len(self._returns) > MOST_FRONT_RETURNS:
            return
        local = to_local(to_world(lidar_points(ranges), pose), self._goal)
        ahead = np.abs(local[:, 0] - STAND_OFF) < FRONT_DEPTH_M
        self._returns = np.concatenate([self._returns, local[ahead & (np.abs(local[:, 1]) < FRONT_HALF_WIDTH_M)]])
        if len(self._returns) < LEAST_FRONT_RETURNS:
            return
        x, y = self._returns.T
        terms, line = np.column_stack([np.ones_like(y), y]), np.array([STAND_OFF, 0.0])
        for scale in (4.0, 2.0, 1.0, 1.0, 1.0):
            weight = (1.0 + ((x - terms @ line) / (scale * FRONT_SCALE_M)) ** 2) ** -2
            line = np.linalg.lstsq(terms * np.sqrt(weight)[:, None], x * np.sqrt(weight), rcond=None)[0]
        turn = -math.atan(float(line[1]))
        if abs(turn) < LARGEST_FRONT_TURN_RAD:
            self._offset = (float(line[0]) - STAND_OFF, -MIDDLE_BEHIND_FRONT_M * math.sin(turn), turn)


def moved(pose: Pose, frame: Pose, offset: Sequence[float]) -> Pose:
    """Return where a pose goes with a body that is displaced by (dx, dy, turn) in a frame."""
    return compose(compose(frame, offset), relative(frame, pose))


def unmoved(pose: Pose, directions: Array, frame: Pose, offsets: Array) -> tuple[Array, Array]:
    """Return rays as seen from bodies that are displaced in a frame, brought back to their first place.

    Args:
        pose: of the origin of the rays. directions: (m, 2) unit vectors.
        frame: in which the bodies are displaced. offsets: (n, 3) dx, dy and turn.

    Returns:
        origins (n, m, 2) and directions (n, m, 2).
    """
    start = to_local([pose[:2]], frame)[0]
    local = to_local(directions, (0.0, 0.0, frame[2]))
    cosine, sine = np.cos(offsets[:, 2])[:, None], np.sin(offsets[:, 2])[:, None]
    place = start - offsets[:, :2]
    origins = np.column_stack(
        [cosine[:, 0] * place[:, 0] + sine[:, 0] * place[:, 1], cosine[:, 0] * place[:, 1] - sine[:, 0] * place[:, 0]]
    )
    turned = np.stack([cosine * local[:, 0] + sine * local[:, 1], cosine * local[:, 1] - sine * local[:, 0]], axis=-1)
    origins = to_world(origins, frame)
    rotated = to_world(turned.reshape(-1, 2), (0.0, 0.0, frame[2])).reshape(turned.shape)
    return np.repeat(origins[:, None, :], len(directions), axis=1), rotated
