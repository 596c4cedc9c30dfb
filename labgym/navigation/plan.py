"""The part of a layout that navigation reads: the floor, the obstacles and the placements."""

from __future__ import annotations

import typing
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import OrientedBox
from labgym.protocols import Protocol

PLANNING_RADIUS = 0.30
"""Radius of the disc that paths are planned for, meters: the chassis (0.27 m) and 3 cm for tracking errors."""

STAND_OFF = 2.0 * PLANNING_RADIUS
"""Distance from the front of a device to the center of the robot that works there, meters."""

OBSTACLE_HEIGHT = 1.40
"""Objects whose bottom is below this height are obstacles, meters: the robot (1.32 m, `RobotSpec.height`) and 8 cm."""


class FloorShape(typing.Protocol):
    """Where a robot can be on a floor without furniture; `labgym.layouts.floor.Floor` is one."""

    @property
    def solids(self) -> Sequence[OrientedBox]:
        """Walls, columns, panes and closed leaves: they enclose the floor."""
        ...

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Axis-aligned bounds (x0, y0, x1, y1) of everything, meters."""
        ...

    def inside(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return whether points (n, 2) lie in a space or in an opening between spaces, (n,)."""
        ...


class Placed(typing.Protocol):
    """A placed object: its id and its asset."""

    @property
    def id(self) -> str:
        """Unique in the plan."""
        ...

    @property
    def asset(self) -> str:
        """Name in the catalog."""
        ...


class FloorPlan(typing.Protocol):
    """The part of a layout that navigation reads; `labgym.layouts.Layout` is one."""

    @property
    def floor(self) -> FloorShape:
        """Walls and spaces."""
        ...

    @property
    def protocols(self) -> tuple[Protocol, ...]:
        """The protocols that are carried out there."""
        ...

    @property
    def protocol(self) -> Protocol | None:
        """The protocol that navigation takes by default."""
        ...

    def obstacles(self, below: float) -> Iterable[OrientedBox]:
        """Yield the boxes of floor and wall objects whose bottom is below a height."""
        ...

    def find(self, asset: str) -> Placed | None:
        """Return the first placement of an asset."""
        ...

    def root(self, placement_id: str) -> Placed:
        """Return the floor or wall object that carries a placement, directly or indirectly."""
        ...

    def box(self, placement_id: str) -> OrientedBox:
        """Return a placement's bounding box in the floor's frame."""
        ...
