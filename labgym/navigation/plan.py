"""What navigation needs to know of a laboratory: the room's size, what stands in the way, and where things are."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol

from labgym import protocols
from labgym.geometry import OrientedBox

PLANNING_RADIUS = 0.30
"""Radius of the disc that paths are planned for, metres: the chassis (0.27 m) and 3 cm to steer with."""

STAND_OFF = 2.0 * PLANNING_RADIUS
"""Distance from a device's front to the robot's centre when it works there, metres."""

OBSTACLE_HEIGHT = 1.40
"""What begins below this height above the floor is in the robot's way, metres: its column and arm are that tall."""


class Extent(Protocol):
    """The room's interior: x in [0, width], y in [0, depth], metres."""

    @property
    def width(self) -> float:
        """Along x, metres."""
        ...

    @property
    def depth(self) -> float:
        """Along y, metres."""
        ...


class Placed(Protocol):
    """Something that has been placed: its id and the asset that it is."""

    @property
    def id(self) -> str:
        """Unique in the plan."""
        ...

    @property
    def asset(self) -> str:
        """Name in the catalogue."""
        ...


class FloorPlan(Protocol):
    """The part of a layout that navigation reads; `labgym.layouts.Layout` is one."""

    @property
    def room(self) -> Extent:
        """The room's interior."""
        ...

    @property
    def protocol(self) -> protocols.Protocol | None:
        """The protocol that navigation takes by default."""
        ...

    def obstacles(self, below: float) -> Iterable[OrientedBox]:
        """Yield the boxes of what stands on the floor or hangs on a wall and begins below a height."""
        ...

    def find(self, asset: str) -> Placed | None:
        """Return the first placement of an asset."""
        ...

    def root(self, placement_id: str) -> Placed:
        """Return the floor or wall object that finally carries a placement."""
        ...

    def box(self, placement_id: str) -> OrientedBox:
        """Return a placement's bounding box in the room frame."""
        ...
