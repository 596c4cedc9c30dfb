"""Chooses how a layout's building is read."""

from __future__ import annotations

from labgym.layouts.model import Layout
from labgym.layouts.rules.building.interface import Building
from labgym.layouts.rules.building.many_rooms import ManyRooms
from labgym.layouts.rules.building.one_room import OneRoom


def building_of(layout: Layout) -> Building:
    """Return the building of a layout: a rectangular room by its sides, any other floor by its walls and spaces."""
    return OneRoom(layout.room) if layout.floor.is_rectangle else ManyRooms(layout.floor)
