"""The view of a building that the rules have: how far things reach out of rooms, how near walls are, and doors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import BoxArray, OrientedBox
from labgym.geometry.frames import PlanarPose

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Entrance:
    """A door or a passage as seen from one of its spaces.

    Attributes:
        label: its name in messages.
        space: index of the space; 0 in a one-room floor.
        exit: whether it leads out of the floor.
        width: clear width, meters.
        area: the floor inside it that stays free.
        opening: the opening itself, as a thin box on the face of the wall.
        pose: (x, y, yaw) of its middle on the face of the wall, front toward the space.
        passage: whether it has no leaf.
    """

    label: str
    space: int
    exit: bool
    width: float
    area: OrientedBox
    opening: OrientedBox
    pose: PlanarPose
    passage: bool = False


@dataclass(frozen=True)
class Workplace:
    """A space in which people work: its index, where it is in messages, and its floor area in square meters."""

    space: int
    where: str
    area: float


class Building(Protocol):
    """A floor as the rules read it; points and boxes are in the floor's frame, lengths in meters."""

    @property
    def workplaces(self) -> tuple[Workplace, ...]:
        """The laboratories and instrument rooms."""
        ...

    @property
    def entrances(self) -> tuple[Entrance, ...]:
        """Doors and passages, once for each space into which they lead."""
        ...

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """Axis-aligned bounds (x0, y0, x1, y1) of the rooms."""
        ...

    def joined(self, space: int) -> frozenset[int]:
        """Return the spaces that doors and passages join with a space, itself included, without leaving the floor."""
        ...

    def clearance(self, xs: Array, ys: Array, reach: float) -> Array:
        """Return the distance of grid points from walls and columns, shape (ny, nx), at most `reach`.

        Every interior door stands wide open. Not positive in walls.
        """
        ...

    def spaces(self, boxes: BoxArray) -> NDArray[np.intp]:
        """Return the index of the space that each of n boxes is in, or nearest to, shape (n,)."""
        ...

    def outside(self, boxes: BoxArray) -> Array:
        """Return how far n boxes reach out of the rooms, floor and ceiling included, shape (n,); 0 inside."""
        ...

    def gaps(self, points: Array) -> Array:
        """Return the distances of points (..., 2) from the face of each of m walls, shape (m, ...).

        Negative inside a wall; inf beyond its ends.
        """
        ...

    def over_openings(self, boxes: BoxArray) -> Array:
        """Return how far n boxes at a wall reach over its openings, shape (n,); 0 off them."""
        ...

    def ahead(self, box: OrientedBox) -> float:
        """Return the free depth in front of a box up to a wall."""
        ...

    def covers(self, zones: Sequence[OrientedBox]) -> NDArray[np.bool_]:
        """Return which of n zones lie inside the rooms, shape (n,)."""
        ...

    def lined(self, footprints: BoxArray, gap: float) -> float:
        """Return the share of the walls' length, in [0, 1], before which n footprints stand within a gap."""
        ...

    def skew(self, boxes: BoxArray) -> Array:
        """Return the angle of n boxes to the walls, shape (n,), radians in [0, pi / 4]."""
        ...

    def inward(self, box: OrientedBox) -> tuple[float, float]:
        """Return a short displacement (x, y) that brings a box inside a room; zero if it is inside."""
        ...

    def roomy(self, x: float, y: float, radius: float) -> bool:
        """Whether a disc at a point reaches no wall."""
        ...

    def wall_poses(self, box: OrientedBox, gap: float, step: float) -> list[PlanarPose]:
        """Return poses of a box in its space with the back to a wall at a gap, every `step` along the walls."""
        ...

    def open_poses(self, box: OrientedBox, aisle: float, step: float) -> list[PlanarPose]:
        """Return poses of a box in its space, parallel to its frame, with an aisle to every wall, on a grid."""
        ...
