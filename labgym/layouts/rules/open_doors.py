"""Layouts in which people walk: interior doors do not stop them, or each of them does."""

from __future__ import annotations

from functools import lru_cache

from labgym.layouts.floor import Floor
from labgym.layouts.floor.changes import closed_doors, walls_with
from labgym.layouts.model import Layout


def with_open_doors(layout: Layout) -> Layout:
    """Return a layout in which passages take the place of closed interior doors."""
    floor = opened_floor(layout.floor)
    return layout if floor is layout.floor else layout.replace(floor=floor)


def with_closed_doors(layout: Layout) -> Layout:
    """Return a layout in which every interior door is closed."""
    floor = closed_floor(layout.floor)
    return layout if floor is layout.floor else layout.replace(floor=floor)


def opened_floor(floor: Floor) -> Floor:
    """Return a floor with its closed interior doors as passages; the floor itself without any."""
    return _opened(floor) or floor


def closed_floor(floor: Floor) -> Floor:
    """Return a floor with its open interior doors closed; the floor itself without any."""
    return _closed(floor) or floor


@lru_cache(maxsize=16)
def _opened(floor: Floor) -> Floor | None:
    closed = closed_doors(floor)
    return floor.model_copy(update={"walls": walls_with(floor, closed, kind="passage")}) if closed else None


@lru_cache(maxsize=16)
def _closed(floor: Floor) -> Floor | None:
    inner = ((way.wall, way.opening) for way in floor.doorways if not way.exit)
    ajar = frozenset((wall, way) for wall, way in inner if way.kind == "door" and way.state == "open")
    return floor.model_copy(update={"walls": walls_with(floor, ajar, state="closed")}) if ajar else None
