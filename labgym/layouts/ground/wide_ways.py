"""Whether wide ways join the gates of a space with every place of work while the space is being furnished.

The clearance is exact at the points of a lattice, and the margin covers what lies between them.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array, OrientedBox
from labgym.layouts.ground.ground import Ground, grounds
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.clearance import cells_to, lower_to_boxes
from labgym.layouts.rules.thresholds import EGRESS_WIDTH, MOVABLE
from labgym.navigation import goal_pose

FINE, COARSE = 0.025, 0.05
"""Spacing of the lattice, meters; the coarse one above `LARGE`."""
LARGE = 150.0
"""Bounds above which a space is large, square meters."""
NICHE = 0.30
"""A way leads to furniture narrower than itself if it passes this near to the place in front, meters."""
EMERGENCY_PLACE = 0.5
"""Distance from emergency equipment of the place that a way passes, meters: from the way, an arm reaches it (0.8 m)."""
REACH = 0.6
"""Clearances are measured up to this value, meters."""


class WideWays:
    """The clearance of a space's floor, which falls as furniture is added."""

    def __init__(self, ground: Ground, solid: Sequence[OrientedBox]) -> None:
        """Start with the building alone."""
        self.step = FINE if ground.width * ground.depth <= LARGE else COARSE
        self.radius = EGRESS_WIDTH / 2.0 + self.step / 2.0
        self.xs: Array = np.arange(math.floor(ground.width / self.step) + 1, dtype=np.float64) * self.step
        self.ys: Array = np.arange(math.floor(ground.depth / self.step) + 1, dtype=np.float64) * self.step
        self.clearance: Array = np.full((len(self.ys), len(self.xs)), REACH)
        inside = self.radius + self.step
        self.entries = [self._node(*_inside(gate.x, gate.y, gate.yaw, inside)) for gate in ground.gates]
        self.places: list[tuple[int, int, float]] = []
        lower_to_boxes(self.clearance, self.xs, self.ys, solid, REACH)
        self.entries = self._largest_group()

    def add(
        self,
        boxes: Sequence[OrientedBox],
        places: Sequence[OrientedBox],
        check: bool = True,
        emergency: Sequence[OrientedBox] = (),
    ) -> bool:
        """Add furniture if all gates and places of work stay joined, and return whether it was added.

        Args:
            boxes: footprints of the furniture.
            places: those of them that someone works in front of.
            check: whether ways matter.
            emergency: those of them that people run to: a way passes the place in front, not only near it.
        """
        before = self.clearance.copy(), list(self.places)
        lower_to_boxes(self.clearance, self.xs, self.ys, boxes, REACH)
        for box in places:
            x, y, _ = goal_pose(box)
            self.places.append((*self._node(x, y), NICHE if box.width < EGRESS_WIDTH else 0.0))
        for box in emergency:
            x, y = box.to_world(0.0, box.depth / 2.0 + EMERGENCY_PLACE)
            self.places.append((*self._node(x, y), 0.0))
        if not check or self.joined:
            return True
        self.clearance, self.places = before
        return False

    @property
    def joined(self) -> bool:
        """Whether a disc as wide as a way out moves between all gates and places of work."""
        labels = self._components()
        entries = {self._label(labels, row, column) for row, column in self.entries}
        if len(entries) > 1 or 0 in entries:
            return False
        reached = entries or range(1, int(labels.max(initial=0)) + 1)
        return all(
            self.clearance[row, column] > 0.0 and self._near(labels, reached, row, column, niche)
            for row, column, niche in self.places
        )

    def _near(self, labels: NDArray[np.int32], reached: Collection[int], row: int, column: int, niche: float) -> bool:
        """Whether the disc, somewhere in the regions `reached`, covers a point or passes within its niche."""
        play = max(niche - self.step, self.step / 2.0)
        cells = cells_to(labels, reached, row, column, (play + self.radius) / self.step + 1.0)
        return bool(cells * self.step - self.radius <= play)

    def _largest_group(self) -> list[tuple[int, int]]:
        """The gates that the empty space joins; in a narrow building it may not join all."""
        labels = self._components()
        groups: dict[int, list[tuple[int, int]]] = {}
        for entry in self.entries:
            groups.setdefault(self._label(labels, *entry), []).append(entry)
        groups.pop(0, None)
        return max(groups.values(), key=len, default=[])

    def _components(self) -> NDArray[np.int32]:
        """Labels of the regions in which a disc as wide as a way out moves, 0 where it does not fit."""
        wide = (self.clearance >= self.radius - 1e-9).astype(np.uint8)
        _, labels = cv2.connectedComponents(wide, connectivity=4, ltype=cv2.CV_32S)
        return np.asarray(labels, dtype=np.int32)

    def _label(self, labels: NDArray[np.int32], row: int, column: int) -> int:
        """The label at a point, or the nearest one within two steps."""
        near = labels[max(row - 2, 0) : row + 3, max(column - 2, 0) : column + 3]
        here = int(labels[row, column])
        return here or int(near.max(initial=0))

    def _node(self, x: float, y: float) -> tuple[int, int]:
        rows, columns = self.clearance.shape
        return min(max(round(y / self.step), 0), rows - 1), min(max(round(x / self.step), 0), columns - 1)


def _inside(x: float, y: float, yaw: float, depth: float) -> tuple[float, float]:
    return x - math.sin(yaw) * depth, y + math.cos(yaw) * depth


class Passages:
    """The ways of each space between its doors and its places of work; built for a space when it is first asked for."""

    def __init__(self, layout: Layout) -> None:
        """Start with the furniture of a layout."""
        self._layout = layout
        self._grounds = {ground.space: ground for ground in grounds(layout.floor)}
        self._ways: dict[str, WideWays | None] = {}

    def add(self, space: str, box: OrientedBox, emergency: bool = False) -> bool:
        """Add an object unless it cuts a door or a place of work off from a way out; return whether it was added.

        In a space whose furniture already does so, every object is added.

        Args:
            emergency: whether a way has to lead to the object too, and to remain.
        """
        if space not in self._ways:
            self._ways[space] = self._furnished(space)
        ways, foot = self._ways[space], self._grounds[space].to_ground(box)
        return ways is None or ways.add([foot], [], emergency=[foot] if emergency else [])

    def _furnished(self, space: str) -> WideWays | None:
        ground, layout = self._grounds[space], self._layout
        ways = WideWays(ground, [*ground.outside, *ground.solid, *ground.leaves])
        feet, places, hung = [], [], []
        for placement in layout.placements:
            asset, at = layout.asset(placement.id), layout.floor.space_at(*placement.position[:2])
            if at is None or at.id != space:
                continue
            if asset.subtype == "fire":
                hung.append(ground.to_ground(layout.box(placement.id)))
            elif placement.support == FLOOR and asset.subtype not in MOVABLE:
                feet.append(ground.to_ground(layout.box(placement.id)))
                places += [feet[-1]] if asset.clearance > 0.0 else []
        ways.add(feet, places, check=False)
        if not ways.joined:
            return None
        for extinguisher in hung:
            ways.add([extinguisher], [], emergency=[extinguisher])
        return ways
