"""Layouts without objects, for floors that were read from a file."""

from __future__ import annotations

import re

from labgym.layouts import Layout
from labgym.layouts.floor import Floor


def empty_layout(floor: Floor) -> Layout:
    """Return a layout of a floor without objects and protocols; its id is the floor's name."""
    name = re.sub(r"[^A-Za-z0-9_.-]+", "-", floor.name).strip("-._")
    return Layout(id=name[:80] or "floor", floor=floor, placements=())
