"""Sources of training layouts for tests, which processes of a pool can import."""

from __future__ import annotations

import multiprocessing
import os
import time

from laboratories import island_laboratory

from labgym.errors import InfeasibleError
from labgym.layouts import Layout


def shifted(number: int) -> Layout:
    """The laboratory made by hand, its island shifted by `number` millimeters, up to 0.4 m."""
    laboratory = island_laboratory()
    *others, island = laboratory.placements
    x, y, z = island.position
    moved = island.model_copy(update={"position": (x + (number % 400) / 1000.0, y, z)})
    return laboratory.replace(id=f"shifted-{number}", placements=(*others, moved))


def refused(number: int) -> Layout:
    raise InfeasibleError(f"layout {number}", ["nothing fits"], None)


def deadly(number: int) -> Layout:
    """Kill a worker that makes the layout; in any other process, make it."""
    if multiprocessing.parent_process() is not None:
        os._exit(3)
    return shifted(number)


def slow(number: int) -> Layout:
    """Take a minute in a worker."""
    if multiprocessing.parent_process() is not None:
        time.sleep(60.0)
    return shifted(number)
