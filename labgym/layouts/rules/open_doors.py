"""Layouts in which people walk: interior doors do not stop them."""

from __future__ import annotations

from labgym.layouts.floor.closed_doors import closed_doors, walls_with
from labgym.layouts.model import Layout


def with_open_doors(layout: Layout) -> Layout:
    """Return a layout in which passages take the place of closed interior doors."""
    if layout.floor.is_rectangle:
        return layout
    closed = closed_doors(layout.floor)
    if not closed:
        return layout
    walls = walls_with(layout.floor, closed, kind="passage")
    return layout.replace(floor=layout.floor.model_copy(update={"walls": walls}))
