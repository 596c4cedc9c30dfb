"""A layout unrolled once into arrays, so that every rule can look at all objects together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset, Catalog
from labgym.errors import LabgymError, UnknownNameError
from labgym.geometry import BoxArray, OrientedBox, rotate
from labgym.layouts.model import FLOOR, WALL, Layout, Placement, placed_box

BUILDING = frozenset({"opening", "robot"})
"""Categories that are no objects of the layout: doors and windows belong to the room, the robot to the episode."""


@dataclass(frozen=True)
class Arrangement:
    """The objects of a layout: its placements without doors, windows and robots, in the layout's order.

    Attributes:
        placements, assets: of the n objects.
        boxes: bounding boxes, n rows.
    """

    layout: Layout
    placements: tuple[Placement, ...]
    assets: tuple[Asset, ...]
    boxes: BoxArray

    @classmethod
    def of(cls, layout: Layout) -> Arrangement:
        """Unroll a layout.

        Raises:
            UnknownNameError: a placement's asset does not exist.
        """
        catalog = Catalog.load()
        pairs = [(placement, catalog.get(placement.asset)) for placement in layout.placements]
        objects = [(placement, asset) for placement, asset in pairs if asset.category not in BUILDING]
        boxes = BoxArray.of([placed_box(placement, asset) for placement, asset in objects])
        return cls(layout, tuple(p for p, _ in objects), tuple(a for _, a in objects), boxes)

    def __len__(self) -> int:
        return len(self.placements)

    @cached_property
    def index(self) -> dict[str, int]:
        """Row of each placement id."""
        return {placement.id: row for row, placement in enumerate(self.placements)}

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Corners of the footprints in the room frame, shape (n, 4, 2)."""
        return self.boxes.corners()

    @cached_property
    def solids(self) -> tuple[BoxArray, NDArray[np.intp]]:
        """Solid boxes of all objects, m rows in the objects' order, and how many each object has, shape (n,)."""
        parts: list[OrientedBox] = []
        counts: list[int] = []
        for placement, asset in zip(self.placements, self.assets, strict=True):
            own = (placed_box(placement, asset),) if asset.cavity is None else self.layout.solids(placement.id)
            parts.extend(own)
            counts.append(len(own))
        return BoxArray.of(parts), np.array(counts, dtype=np.intp)

    @cached_property
    def supported(self) -> list[int]:
        """Rows of the objects that stand on or in another object."""
        return [row for row, placement in enumerate(self.placements) if placement.support not in (FLOOR, WALL)]

    @cached_property
    def reagents(self) -> list[int]:
        """Rows of the reagents."""
        return [row for row, asset in enumerate(self.assets) if asset.kind == "reagent"]

    def surface(self, row: int) -> OrientedBox:
        """Return the surface that a supported object stands on, as a flat box at its height.

        Raises:
            UnknownNameError: the support does not exist.
            LabgymError: the support has no such slot.
        """
        placement = self.placements[row]
        carrier = self.row(placement.support)
        surfaces = self.assets[carrier].surfaces
        if placement.slot is None or placement.slot >= len(surfaces):
            raise LabgymError(
                f"{placement.id!r} names slot {placement.slot} of {placement.support!r}, which has {len(surfaces)}"
            )
        surface, base = surfaces[placement.slot], self.placements[carrier]
        dx, dy = rotate(surface.x, surface.y, base.yaw)
        x, y, z = base.position
        return OrientedBox(x + dx, y + dy, surface.width, surface.depth, base.yaw, z + surface.z, z + surface.z)

    def take(self, rows: list[int]) -> BoxArray:
        """Return the bounding boxes of some objects."""
        boxes = self.boxes
        return BoxArray(boxes.centre[rows], boxes.half[rows], boxes.yaw[rows], boxes.z[rows])

    def row(self, placement_id: str) -> int:
        """Return the row of a placement.

        Raises:
            UnknownNameError: no object has that id.
        """
        if placement_id not in self.index:
            raise UnknownNameError("placement", placement_id, self.index)
        return self.index[placement_id]
