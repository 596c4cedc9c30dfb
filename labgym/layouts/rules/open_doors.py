"""Layouts in which people walk: interior doors do not stop them, or each of them does."""

from __future__ import annotations

from labgym.layouts.floor.changes import closed_doors, walls_with
from labgym.layouts.model import Layout


def with_open_doors(layout: Layout) -> Layout:
    """Return a layout in which passages take the place of closed interior doors."""
    closed = closed_doors(layout.floor)
    if not closed:
        return layout
    walls = walls_with(layout.floor, closed, kind="passage")
    return layout.replace(floor=layout.floor.model_copy(update={"walls": walls}))


def with_closed_doors(layout: Layout) -> Layout:
    """Return a layout in which every interior door is closed."""
    inner = ((way.wall, way.opening) for way in layout.floor.doorways if not way.exit)
    ajar = frozenset((wall, way) for wall, way in inner if way.kind == "door" and way.state == "open")
    if not ajar:
        return layout
    walls = walls_with(layout.floor, ajar, state="closed")
    return layout.replace(floor=layout.floor.model_copy(update={"walls": walls}))
