"""Ways around people in space and time: dynamic programming on a grid of the floor, backwards from the goal."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array
from labgym.machine_code import entry
from labgym.policies.clairvoyant.smoothing import NODE_M, ClearanceField


@entry
def earlier_values(
    waited: Costs, entered: Costs, moves: NDArray[np.int64], inside: NDArray[np.bool_], free: NDArray[np.bool_]
) -> Costs:
    """Return the values one move earlier: the least cost of waiting in a cell and of every move out of it, seconds.

    Args:
        waited, entered: (rows, columns) costs of waiting in a cell, and of moving into it, and going on, seconds.
        moves: (m, 2) rows and columns of each move. inside: cells in which a way ends. free: cells that can be entered.
    """
    height, width = waited.shape
    values = waited.copy()
    for row in range(height):
        for k in range(len(moves)):
            dy, dx = moves[k, 0], moves[k, 1]
            if 0 <= row + dy < height:
                first, last = max(-dx, 0), width - max(dx, 0)
                moved = entered[row + dy, first + dx : last + dx]
                values[row, first:last] = np.minimum(values[row, first:last], moved)
        for column in range(width):
            if not free[row, column]:
                values[row, column] = np.inf
            elif inside[row, column]:
                values[row, column] = 0.0
    return values


Costs = NDArray[np.float32]

STRIDE = 2
"""Nodes of the clearance field for one cell."""

CELL_M = STRIDE * NODE_M

MOVE_S = 0.3
"""Duration of a move, seconds."""

REACH_CELLS = 3
"""Length of the longest move, cells: at 1 m/s."""

FREE_CLEARANCE_M, ROOMY_CLEARANCE_M = 0.30, 0.36
"""Least clearance of a cell on a way, and of a cell without a surcharge, meters."""

TIGHT_SURCHARGE = 0.2
"""Surcharge on the time in a cell with less clearance, as a share."""

MOVES = tuple(
    (dy, dx)
    for dy in range(-REACH_CELLS, REACH_CELLS + 1)
    for dx in range(-REACH_CELLS, REACH_CELLS + 1)
    if 0 < dx * dx + dy * dy <= REACH_CELLS * REACH_CELLS + 1e-9
)


class SpaceTime:
    """Ways to one goal on one floor.

    Args:
        field: of the floor. goal: (2,) meters. radius: of the disc around the goal in which a way ends, meters.
    """

    def __init__(self, field: ClearanceField, goal: Array, radius: float) -> None:
        self._low = field.low
        clearance = field.values[::STRIDE, ::STRIDE]
        rows, columns = clearance.shape
        y, x = self._low[1] + CELL_M * np.arange(rows), self._low[0] + CELL_M * np.arange(columns)
        inside = (x[None, :] - goal[0]) ** 2 + (y[:, None] - goal[1]) ** 2 <= max(radius, CELL_M) ** 2
        self._free = clearance >= FREE_CLEARANCE_M - 0.005
        self._inside = inside & self._free
        step = np.where(clearance < ROOMY_CLEARANCE_M, MOVE_S * (1.0 + TIGHT_SURCHARGE), MOVE_S).astype(np.float32)
        self._step = np.where(self._free, step, np.float32(np.inf))
        self._alone = self._settled()

    def seconds(self, point: Array) -> float:
        """Return the time from a point (2,) to the goal alone, seconds; inf if there is no way."""
        return float(self._alone[self._cell(point)])

    def way(self, start: Array, places: Array, apart: float, near: float, price: float) -> Array | None:
        """Return the cheapest way, (k, 2) meters at each move; None if the goal cannot be reached.

        Args:
            start: (2,) meters. places: (t, n, 2) centers of people at each move, the first at the start.
            apart, near, price: as `labgym.policies.clairvoyant.schedule.Crossing`.
        """
        here = self._cell(start)
        if not np.isfinite(self._alone[here]):
            return None
        values, stack = self._alone, []
        for people in places[:0:-1]:
            wait, enter = self._prices(people, apart, near, price)
            stack.append((values + wait, values + enter))
            values = self._before(*stack[-1])
        return self._followed(start, here, stack[::-1])

    def _prices(self, people: Array, apart: float, near: float, price: float) -> tuple[Costs, Costs]:
        """Return the costs of waiting in each cell among people and of a move into it, seconds."""
        wait, enter = np.full_like(self._step, MOVE_S), self._step.copy()
        near_people, blocked = np.zeros(wait.shape, dtype=bool), np.zeros(wait.shape, dtype=bool)
        for rows, columns, square in self._windows(people, max(apart, near)):
            near_people[rows, columns] |= square < near * near
            blocked[rows, columns] |= square < apart * apart
        wait[near_people] += np.float32(price * MOVE_S)
        enter[near_people] += np.float32(price * MOVE_S)
        enter[blocked] = np.inf
        return wait, enter

    def _before(self, waited: Costs, entered: Costs) -> Costs:
        """Return the values one move earlier, from what it costs to wait in a cell or to move into it and go on."""
        return earlier_values(waited, entered, np.array(MOVES), self._inside, self._free)

    def _settled(self) -> Costs:
        """Return the times to the goal without people."""
        values = np.where(self._inside, np.float32(0.0), np.float32(np.inf))
        for _ in range(400):
            earlier = self._before(values, values + self._step)  # waiting is free: the value stays
            if np.array_equal(earlier, values):
                break
            values = earlier
        return values

    def _followed(self, start: Array, here: tuple[int, int], stack: list[tuple[Costs, Costs]]) -> Array:
        """Return the way along the cheapest moves; the stack has the costs of waiting and of moving into each cell."""
        (row, column), way = here, [start]
        height, width = self._alone.shape
        alone = self._alone + np.float32(MOVE_S), self._alone + self._step
        for step in range(400):
            if self._inside[row, column]:
                break
            waited, entered = stack[step] if step < len(stack) else alone
            best, there = float(waited[row, column]), (row, column)
            for dy, dx in MOVES:
                y, x = row + dy, column + dx
                if 0 <= y < height and 0 <= x < width and entered[y, x] < best:
                    best, there = float(entered[y, x]), (y, x)
            row, column = there
            way.append(self._low + CELL_M * np.array([column, row]))
        return np.array(way)

    def _windows(self, people: Array, reach: float) -> list[tuple[slice, slice, Array]]:
        """Return the cells around each person and the squares of their distances, m2."""
        height, width = self._free.shape
        windows = []
        for x, y in people.tolist():
            left, right = ((x - self._low[0] + side * reach) / CELL_M for side in (-1.0, 1.0))
            below, above = ((y - self._low[1] + side * reach) / CELL_M for side in (-1.0, 1.0))
            rows = slice(max(math.ceil(below), 0), min(math.floor(above) + 1, height))
            columns = slice(max(math.ceil(left), 0), min(math.floor(right) + 1, width))
            if rows.start >= rows.stop or columns.start >= columns.stop:
                continue
            dy = self._low[1] + CELL_M * np.arange(rows.start, rows.stop) - y
            dx = self._low[0] + CELL_M * np.arange(columns.start, columns.stop) - x
            windows.append((rows, columns, dy[:, None] ** 2 + dx[None, :] ** 2))
        return windows

    def _cell(self, point: Array) -> tuple[int, int]:
        """Return the row and column of the nearest free cell within 0.3 m, or of the cell at a point."""
        column, row = (round(float(each)) for each in (point - self._low) / CELL_M)
        height, width = self._free.shape
        near = [
            (dy * dy + dx * dx, row + dy, column + dx)
            for dy in range(-3, 4)
            for dx in range(-3, 4)
            if 0 <= row + dy < height and 0 <= column + dx < width and self._free[row + dy, column + dx]
        ]
        return min(near)[1:] if near else (min(max(row, 0), height - 1), min(max(column, 0), width - 1))
