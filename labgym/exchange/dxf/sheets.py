"""The drawings of a sheet: a plan and elevations, separated by the empty space between them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import shapely

from labgym.errors import OptionError
from labgym.geometry.polygons import polygons, union

if TYPE_CHECKING:
    from ezdxf.entities.dxfentity import DXFEntity

APART = 1.0
"""Least empty space between two drawings of a sheet, meters."""
MOST = 5
"""Greatest number of drawings that a message names."""


@dataclass(frozen=True)
class Window:
    """A rectangle of a sheet, in the units of the drawing.

    Attributes:
        x0, y0, x1, y1: its lower left and its upper right corner.
    """

    x0: float
    y0: float
    x1: float
    y1: float

    @classmethod
    def parse(cls, numbers: Sequence[float]) -> Window:
        """Return the window of four numbers.

        Raises:
            OptionError: there are not four, or the window is empty.
        """
        if len(numbers) != 4 or not (numbers[0] < numbers[2] and numbers[1] < numbers[3]):
            text = ",".join(f"{number:g}" for number in numbers)
            raise OptionError(f"--crop {text}: expected X0,Y0,X1,Y1 with X0 < X1 and Y0 < Y1, in units of the drawing")
        return cls(*numbers)

    def contains(self, entity: DXFEntity) -> bool:
        """Whether the bounding box of an entity lies in the window; of a block its insertion point."""
        from ezdxf import bbox

        if entity.dxftype() == "INSERT":
            point = entity.dxf.insert
            return bool(self.x0 <= point.x <= self.x1 and self.y0 <= point.y <= self.y1)
        box = bbox.extents([entity], fast=True)
        if not box.has_data:
            return False
        low, high = box.extmin, box.extmax
        return bool(self.x0 <= low.x and high.x <= self.x1 and self.y0 <= low.y and high.y <= self.y1)

    @property
    def option(self) -> str:
        """The window as an option of the command line, rounded outwards by less than a unit."""
        low, high = (self.x0 - 0.5, self.y0 - 0.5), (self.x1 + 0.5, self.y1 + 0.5)
        return f"--crop={','.join(f'{number:.0f}' for number in (*low, *high))}"


def drawings(strokes: Iterable[Sequence[tuple[float, float]]], scale: float) -> list[Window]:
    """Return the windows of the separate drawings of a sheet, largest first.

    Args:
        strokes: points of lines, meters.
        scale: meters per unit of the drawing.
    """
    boxes = [shapely.MultiPoint(list(points)).envelope.buffer(APART / 2.0, cap_style="square") for points in strokes]
    parts = polygons(union(boxes))
    while True:  # the hull of a plan may enclose another part of it
        envelopes = polygons(union(part.envelope for part in parts))
        if len(envelopes) >= len(parts):
            break
        parts = envelopes
    windows = [shapely.box(*part.bounds).buffer(-APART / 2.0, join_style="mitre").bounds for part in parts]
    largest = sorted(windows, key=lambda w: -(w[2] - w[0]) * (w[3] - w[1]))
    return [Window(*(value / scale for value in window)) for window in largest]


def advice(windows: Sequence[Window]) -> str:
    """Return the end of a message that names the drawings of a sheet, empty for one drawing."""
    if len(windows) < 2:
        return ""
    names = " or ".join(window.option for window in windows[:MOST])
    return f"; the sheet has {len(windows)} separate drawings: choose the plan with labgym outline {names}"
