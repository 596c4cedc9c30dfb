"""The search of `grid_search.astar`."""

from __future__ import annotations

import heapq
import math

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry

DIAGONAL = math.sqrt(2.0)


@entry
def search(
    blocked: NDArray[np.bool_], prices: NDArray[np.float64], width: int, source: int, target: int
) -> NDArray[np.int64]:
    """Run A* on the flat cell numbers of a padded grid to a reachable target; return predecessors by cell."""
    rows, columns = target // width, target % width
    steps = np.array([1, -1, width, -width, width + 1, width - 1, 1 - width, -1 - width])
    beside = np.array([0, 0, 0, 0, width, width, -width, -width])
    along = np.array([0, 0, 0, 0, 1, -1, 1, -1])
    cost = np.full(len(blocked), np.inf)
    predecessors = np.full(len(blocked), -1)
    done = np.zeros(len(blocked), dtype=np.bool_)
    cost[source] = 0.0
    heap = [(0.0, source)]
    while len(heap) > 0:
        cell = heapq.heappop(heap)[1]
        if cell == target:
            break
        if done[cell]:
            continue
        done[cell] = True
        here, price = cost[cell], prices[cell]
        for k in range(8):
            near = cell + steps[k]
            if blocked[near]:
                continue
            if k < 4:
                there = here + (price + prices[near]) / 2.0
            else:
                if blocked[cell + beside[k]] or blocked[cell + along[k]]:
                    continue
                there = here + DIAGONAL * (price + prices[near]) / 2.0
            if there < cost[near]:
                cost[near] = there
                predecessors[near] = cell
                dy, dx = abs(near // width - rows), abs(near % width - columns)
                heapq.heappush(heap, (there + (dx + dy + (DIAGONAL - 2.0) * min(dx, dy)), near))
    return predecessors


def prepare() -> None:
    """Load the search, or compile it, which copies of this process then need not do."""
    blocked = np.array([[1, 1, 1, 1], [1, 0, 0, 1], [1, 1, 1, 1]], dtype=np.bool_)
    search(blocked.ravel(), np.ones(12), 4, 5, 6)
