"""An expert that knows what the lidar has seen so far: it plans through unseen floor as if it were free."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.panes import FRAMED, FRAMELESS
from labgym.envs.sensors import LIDAR_RAYS
from labgym.geometry import Array, rotate, to_local, wrap_angle
from labgym.layouts import Layout
from labgym.machine_code import entry
from labgym.navigation import Pose
from labgym.navigation.grid_search import followed
from labgym.navigation.search_kernel import search
from labgym.training.reflexes import nearest_safe

CELL_M = 0.1
"""Side of a cell, meters."""
MARGIN_M = 1.0
"""Width of the border around the floor, meters."""
SEEN_M = 8.0
"""Rays count up to this distance, meters."""
END_M = 0.15
"""Length before the end of a ray that may belong to what it met, meters."""
COMFORT_M, AVERSION = 0.6, 3.0
"""Clearance beyond which more has no benefit, meters, and the extra price where cells are blocked."""
CLEAR_M = 0.26
"""Distance of a cell from an occupied one at which it is blocked, meters."""
LEAVE_M, LEAVE_PRICE = 0.35, 6.0
"""Distance from the robot and from the goal within which the clearance alone blocks no cell, and its price there."""
STANDING = 6
"""Number of scans with a return in a cell after which a ray that passes it changes nothing: it saw through a pane."""
REPLAN_STEPS = 5
"""Control steps after which the way is planned again."""
LOOKAHEAD_M = 0.4
"""Distance of the point that the robot steers for, meters."""
TURN_GAIN, WIDE_TURN_RAD = 1.3, 0.9
"""Turn action per radian of bearing, and the bearing from which on the robot turns in place."""
FRONT_RAD = 0.4
"""Half of the angle in which what stands before the robot slows it down."""
SLOWEST, GAP_GAIN, BODY_M = 0.1, 1.3, 0.32
"""Least speed before an obstacle, as an action; its increase per meter of gap; and the robot's radius, meters."""
AROUND_M = 2.5
"""Distance up to which returns of the scan count for the next second, meters."""
PANE_M, PANE_ERROR_M, PANE_SPACING_M = 4.0, 0.25, 0.08
"""Distance up to which a return is that of a pane, error of its range, and spacing of the points of a seen pane."""
PEOPLE_M, PERSON_M = 5.0, 0.45
"""Distance up to which people count, and depth of a person along a ray, meters."""
REST_M = 0.15
"""Distance from the announced goal at which the robot rests, meters."""

UNSEEN, FREE, OCCUPIED = 0, 1, 2
ANGLES = -math.pi + 2.0 * math.pi / LIDAR_RAYS * np.arange(LIDAR_RAYS)
FRONT = np.abs(ANGLES) <= FRONT_RAD
REACH_CELLS = math.ceil(COMFORT_M / CELL_M)


class Explorer:
    """Gives an action at any pose of a drive, from the scans of this drive: a grid of them, A* and pure pursuit.

    Unlike a planner on the true floor, it does nothing that a network with the same scans could not learn.
    """

    def __init__(self) -> None:
        self._cells: NDArray[np.uint8] = np.empty((0, 0), np.uint8)
        self._path: Array = np.empty((0, 2))
        self._hidden: list[tuple[Array, Array, float]] = []
        self._glass: Array = np.empty((0, 2))
        self._steps = 0

    def restart(self) -> None:
        """Forget the floor: an episode begins."""
        self._cells, self._steps = np.empty((0, 0), np.uint8), 0

    def action(
        self,
        layout: Layout,
        pose: Pose,
        velocity: tuple[float, float],
        goal: Array,
        ranges: Array,
        people: Array | None = None,
    ) -> tuple[float, float]:
        """Return the action (forward, turn) at a pose, and remember a scan.

        Args:
            layout: of the drive; its extent is used, and a pane once the scan has a return of it.
            pose: (x, y, yaw) in the room frame. velocity: m/s and rad/s.
            goal: (distance, cosine and sine of the bearing) as the robot has it announced.
            ranges: (180,) meters.
            people: (n, 4) places and velocities in the room frame, meters and m/s; those in sight count.
        """
        if not self._cells.size:
            self._begin(layout)
        here = np.array(pose, dtype=np.float64)
        seen = np.asarray(ranges, dtype=np.float64)
        remember(self._cells, self._returns, self._origin, here, seen)
        self._see_panes(here, seen)
        announced = here[:2] + float(goal[0]) * np.array(rotate(float(goal[1]), float(goal[2]), pose[2]))
        if self._steps % REPLAN_STEPS == 0:
            self._path = self._planned(here[:2], announced)
        self._steps += 1
        nearest = int(np.argmin(((self._path - here[:2]) ** 2).sum(axis=1)))
        far = np.flatnonzero(((self._path[nearest:] - here[:2]) ** 2).sum(axis=1) >= LOOKAHEAD_M**2)
        x, y = self._path[nearest + int(far[0])] if len(far) else announced
        bearing = wrap_angle(math.atan2(y - pose[1], x - pose[0]) - pose[2])
        gap = max(0.0, float(seen[FRONT].min()) - BODY_M)
        left = max(0.0, float(goal[0]) - REST_M)
        if left == 0.0:
            return 0.0, 0.0
        forward = min(max(0.0, 1.0 - abs(bearing) / WIDE_TURN_RAD), SLOWEST + GAP_GAIN * gap, SLOWEST + left)
        turn = min(max(TURN_GAIN * bearing, -1.0), 1.0)
        near = seen < AROUND_M
        points = np.column_stack([seen * np.cos(ANGLES), seen * np.sin(ANGLES)])[near]
        glass = self._glass[((self._glass - here[:2]) ** 2).sum(axis=1) < AROUND_M**2]
        return nearest_safe(
            np.concatenate([points, to_local(glass, pose)]), in_sight(people, pose, seen), velocity, forward, turn
        )

    def _see_panes(self, pose: Array, ranges: Array) -> None:
        """Draw the panes of which the scan has a return: it comes along the normal."""
        for pane in list(self._hidden):
            middle, along, half = pane
            gap = pose[:2] - middle
            off = float(gap[0] * -along[1] + gap[1] * along[0])
            foot = middle + float(gap @ along) * along
            bearing = math.atan2(foot[1] - pose[1], foot[0] - pose[0]) - pose[2]
            met = ranges[round((bearing + math.pi) / (2.0 * math.pi) * LIDAR_RAYS) % LIDAR_RAYS]
            if abs(float(gap @ along)) < half and abs(off) < PANE_M and abs(float(met) - abs(off)) < PANE_ERROR_M:
                self._hidden.remove(pane)
                steps = np.arange(-half, half + PANE_SPACING_M, PANE_SPACING_M)
                points = middle + steps[:, None] * along
                self._glass = np.concatenate([self._glass, points])
                cells = ((points - self._origin) / CELL_M).astype(int)
                self._cells[cells[:, 1], cells[:, 0]] = OCCUPIED
                self._returns[cells[:, 1], cells[:, 0]] = STANDING
                self._steps = 0

    def _begin(self, layout: Layout) -> None:
        x0, y0, x1, y1 = layout.floor.bounds
        self._origin = np.array([x0, y0]) - MARGIN_M
        width, height = (math.ceil((side + 2.0 * MARGIN_M) / CELL_M) for side in (x1 - x0, y1 - y0))
        self._cells = np.full((height, width), UNSEEN, np.uint8)
        self._returns = np.zeros((height, width), np.uint8)
        self._glass = np.empty((0, 2))
        self._hidden = [
            (
                np.array(each.position[:2]),
                np.array([math.cos(each.yaw), math.sin(each.yaw)]),
                each.size.width / 2.0,
            )
            for each in layout.placements
            if each.asset in (FRAMED, FRAMELESS) and each.size is not None
        ]

    def _planned(self, here: Array, goal: Array) -> Array:
        """Return the way (n, 2), meters: straight to the goal if nothing leads there."""
        height, width = self._cells.shape
        cells = ((np.array([here, goal]) - self._origin) / CELL_M).astype(int)
        cells = np.clip(cells, 1, (width - 2, height - 2))
        source, target = (cells[:, 1] * width + cells[:, 0]).tolist()
        blocked, prices = priced(self._cells, source, target)
        way = followed(search(blocked, prices, width, source, target), target, source)
        if way is None:
            return np.array([here, goal])
        rows, columns = np.divmod(np.array(way[::-1]), width)
        return self._origin + (np.column_stack([columns, rows]) + 0.5) * CELL_M


def in_sight(people: Array | None, pose: Pose, ranges: Array) -> Array:
    """Return the people (n, 4) whom the scan shows, in the robot frame."""
    if people is None or not len(people):
        return np.empty((0, 4))
    places = to_local(people[:, :2], pose)
    away = np.hypot(places[:, 0], places[:, 1])
    rays = np.round((np.arctan2(places[:, 1], places[:, 0]) + math.pi) / (2.0 * math.pi) * LIDAR_RAYS).astype(int)
    shown = (away < PEOPLE_M) & (ranges[rays % LIDAR_RAYS] > away - PERSON_M)
    cosine, sine = math.cos(pose[2]), math.sin(pose[2])
    speeds = people[:, 2:] @ np.array([[cosine, -sine], [sine, cosine]])
    seen: Array = np.concatenate([places, speeds], axis=1)[shown]
    return seen


@entry
def remember(cells: NDArray[np.uint8], returns: NDArray[np.uint8], origin: Array, pose: Array, ranges: Array) -> None:
    """Draw a scan into the grid: free along the rays, occupied at their ends. What stands there stays."""
    rows, columns = cells.shape
    for ray in range(len(ranges)):
        angle = pose[2] - math.pi + 2.0 * math.pi / len(ranges) * ray
        dx, dy = math.cos(angle), math.sin(angle)
        clear = min(ranges[ray] - END_M, SEEN_M)
        for k in range(int(clear / (0.7 * CELL_M)) + 1):
            length = 0.7 * CELL_M * k
            column = int((pose[0] + length * dx - origin[0]) / CELL_M)
            row = int((pose[1] + length * dy - origin[1]) / CELL_M)
            if 0 <= row < rows and 0 <= column < columns and returns[row, column] < STANDING:
                cells[row, column] = FREE
    for ray in range(len(ranges)):
        if ranges[ray] < SEEN_M:
            angle = pose[2] - math.pi + 2.0 * math.pi / len(ranges) * ray
            column = int((pose[0] + ranges[ray] * math.cos(angle) - origin[0]) / CELL_M)
            row = int((pose[1] + ranges[ray] * math.sin(angle) - origin[1]) / CELL_M)
            if 0 <= row < rows and 0 <= column < columns:
                cells[row, column] = OCCUPIED
                returns[row, column] = min(returns[row, column] + 1, STANDING)


@entry
def priced(cells: NDArray[np.uint8], source: int, target: int) -> tuple[NDArray[np.bool_], Array]:
    """Return which cells are blocked, and the price of a meter through each, both flat; the border is blocked."""
    rows, columns = cells.shape
    blocked = np.zeros((rows, columns), dtype=np.bool_)
    prices = np.ones((rows, columns))
    for row in range(rows):
        for column in range(columns):
            if cells[row, column] != OCCUPIED:
                continue
            for i in range(max(row - REACH_CELLS, 0), min(row + REACH_CELLS + 1, rows)):
                for j in range(max(column - REACH_CELLS, 0), min(column + REACH_CELLS + 1, columns)):
                    distance = CELL_M * math.hypot(float(i - row), float(j - column))
                    if distance < CLEAR_M:
                        blocked[i, j] = True
                    elif distance < COMFORT_M:
                        lack = (COMFORT_M - distance) / (COMFORT_M - CLEAR_M)
                        prices[i, j] = max(prices[i, j], 1.0 + AVERSION * lack * lack)
    reach = int(LEAVE_M / CELL_M)
    for end in (source, target):
        for i in range(max(end // columns - reach, 0), min(end // columns + reach + 1, rows)):
            for j in range(max(end % columns - reach, 0), min(end % columns + reach + 1, columns)):
                if blocked[i, j] and cells[i, j] != OCCUPIED:
                    blocked[i, j], prices[i, j] = False, LEAVE_PRICE
    blocked[0], blocked[-1], blocked[:, 0], blocked[:, -1] = True, True, True, True
    return blocked.ravel(), prices.ravel()
