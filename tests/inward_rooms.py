"""Preset rooms with doors that open inward, for layouts of tests that belong to such rooms."""

from labgym.layouts import Room
from labgym.layouts.rooms import resolve_room


def inward(name: str) -> Room:
    """Return a preset with doors that open into the room."""
    room = resolve_room(name)
    doors = tuple(door.model_copy(update={"outward": False}) for door in room.doors)
    return room.model_copy(update={"doors": doors})
