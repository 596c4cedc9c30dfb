"""Room presets: four rooms in which the published layouts are made."""

from __future__ import annotations

from labgym.errors import OptionError, UnknownNameError
from labgym.layouts.model import Door, Room

PRESETS: dict[str, Room] = {
    room.name: room
    for room in (
        Room(name="tight", width=6.6, depth=7.2, doors=(Door(wall="front", offset=1.3),)),
        Room(name="default", width=8.0, depth=8.0, doors=(Door(wall="front", offset=1.5),)),
        Room(name="roomy", width=8.0, depth=10.0, doors=(Door(wall="front", offset=1.5),)),
        Room(
            name="two_exits",
            width=7.0,
            depth=13.0,
            doors=(Door(wall="front", offset=1.4), Door(wall="left", offset=6.5)),
        ),
    )
}
"""By name, smallest floor first. 6.6 m is the standard bay of parallel benches (JGJ 91); the rest are common sizes."""


def room_presets() -> dict[str, Room]:
    """Return the presets by name, smallest floor area first."""
    return dict(PRESETS)


def resolve_room(room: Room | str | None) -> Room:
    """Return a room: the default preset for None, a preset for its name, a room as it is.

    Raises:
        UnknownNameError: no preset of that name.
        OptionError: neither a room, a name nor None.
    """
    if room is None:
        return PRESETS["default"]
    if isinstance(room, Room):
        return room
    if not isinstance(room, str):
        raise OptionError(f"room must be a Room, a preset's name or None, got {type(room).__name__}")
    if room not in PRESETS:
        raise UnknownNameError("room preset", room, PRESETS)
    return PRESETS[room]
