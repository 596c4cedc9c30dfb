"""Doorways: the doors and passages of a floor, and the spaces that each joins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from labgym.geometry import OrientedBox
from labgym.geometry.frames import PlanarPose
from labgym.layouts.floor.spaces import OUTSIDE, Space
from labgym.layouts.floor.walls import WAYS, Opening, Wall

REACH = 0.35
"""A space within this distance of the face of a wall lies behind it, meters: a region of rectangles leaves wedges
along an oblique wall."""
STEP = 0.01
"""Spacing of the points at which the two sides of a wall are looked up, meters."""
OVERLAP = 0.05
"""How far the floor of an interior doorway reaches into the spaces on its sides, meters."""


@dataclass(frozen=True)
class Doorway:
    """A door or a passage.

    Attributes:
        wall: index of its wall in the floor.
        opening: the opening of that wall.
        x, y, yaw: its middle on the wall's middle line; the front is toward the first of its spaces.
        spaces: ids of the spaces before and behind it; "outside", always the second, for an exit.
        gaps: distances of those spaces from the faces of the wall, meters; 0 for the outside.
        thickness: thickness of the wall, meters.
        opens_forward: whether the leaf of a door opens toward the first of its spaces.
    """

    wall: int
    opening: Opening
    x: float
    y: float
    yaw: float
    spaces: tuple[str, str]
    gaps: tuple[float, float]
    thickness: float
    opens_forward: bool

    @property
    def exit(self) -> bool:
        """Whether it leads out of the floor."""
        return OUTSIDE in self.spaces

    @property
    def width(self) -> float:
        """Clear width, meters."""
        return self.opening.width

    @property
    def pose(self) -> PlanarPose:
        """(x, y, yaw)."""
        return self.x, self.y, self.yaw

    @property
    def label(self) -> str:
        """Name of the doorway in messages."""
        first, second = self.spaces
        kind = "exit" if self.exit else self.opening.kind
        joins = f"of {first!r}" if self.exit else f"between {first!r} and {second!r}"
        return f"the {kind} {joins} at ({self.x:.2f}, {self.y:.2f})"

    def side(self, space: str) -> PlanarPose:
        """Return the pose of its middle on the face of the wall in a space, with the front toward that space.

        Raises:
            ValueError: the doorway does not lead into that space.
        """
        turn = math.pi * self.spaces.index(space)
        yaw, offset = self.yaw + turn, self.thickness / 2.0
        return self.x - math.sin(yaw) * offset, self.y + math.cos(yaw) * offset, yaw

    def opens_into(self, space: str) -> bool:
        """Return whether the leaf opens into a space; a passage has none."""
        return self.opening.kind == "door" and self.spaces[0 if self.opens_forward else 1] == space

    @property
    def floor(self) -> OrientedBox:
        """The floor of the opening, through the wall and as far as the spaces on both sides, as a box."""
        before, behind = (gap + OVERLAP for gap in self.gaps)
        shift = (before - behind) / 2.0
        x, y = self.x - math.sin(self.yaw) * shift, self.y + math.cos(self.yaw) * shift
        depth = self.thickness + before + behind
        return OrientedBox(x, y, self.width, depth, self.yaw, 0.0, self.opening.height)


def doorways_of(walls: Sequence[Wall], spaces: Sequence[Space]) -> tuple[Doorway, ...]:
    """Return the doors and passages of all walls, in their order.

    Raises:
        ValueError: no space lies on either side of an opening.
    """
    ways = [
        (index, wall, opening) for index, wall in enumerate(walls) for opening in wall.openings if opening.kind in WAYS
    ]
    if not ways:
        return ()
    sides = _sides([(wall, opening) for _, wall, opening in ways], spaces)
    return tuple(_doorway(*way, left, right) for way, (left, right) in zip(ways, sides, strict=True))


Neighbor = tuple[str, float]
"""Id of the space behind a face of a wall and its distance from the face, meters."""


def _doorway(index: int, wall: Wall, opening: Opening, left: Neighbor | None, right: Neighbor | None) -> Doorway:
    if left is None and right is None:
        raise ValueError(
            f"{opening.label} of wall {index} leads nowhere: no space lies within {REACH:g} m of the wall; move it"
        )
    x, y, yaw = wall.pose(opening.position, "right" if left is None else "left")
    first, second = (right, left) if left is None else (left, right)
    (before, near), (behind, far) = first or (OUTSIDE, 0.0), second or (OUTSIDE, 0.0)
    forward = opening.swing == ("right" if left is None else "left")
    return Doorway(index, opening, x, y, yaw, (before, behind), (near, far), wall.thickness, forward)


def _sides(
    ways: Sequence[tuple[Wall, Opening]], spaces: Sequence[Space]
) -> list[tuple[Neighbor | None, Neighbor | None]]:
    """Return the spaces nearest to the middle of each opening on the left and on the right of its wall."""
    distances = np.arange(0.0, REACH + STEP, STEP)
    points = np.array(
        [
            [[wall.point(opening.position, sign * (wall.thickness / 2.0 + d)) for d in distances] for sign in (1, -1)]
            for wall, opening in ways
        ]
    )
    least = np.full(points.shape[:2], len(distances))
    owner = np.full(points.shape[:2], -1)
    for index, space in enumerate(spaces):
        hits = space.contains(points.reshape(-1, 2), STEP).reshape(points.shape[:3])
        first = np.where(hits.any(axis=2), hits.argmax(axis=2), len(distances))
        nearer = first < least
        least, owner = np.where(nearer, first, least), np.where(nearer, index, owner)

    def neighbor(way: int, side: int) -> Neighbor | None:
        space = int(owner[way, side])
        return None if space < 0 else (spaces[space].id, float(distances[least[way, side]]))

    return [(neighbor(way, 0), neighbor(way, 1)) for way in range(len(ways))]
