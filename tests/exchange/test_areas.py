"""Outlines that touch or split each other are read and drawn as polygons."""

from __future__ import annotations

import numpy as np
import pytest
from shapely import Polygon, box

from labgym.exchange.assembly import corners, nested
from labgym.exchange.ros_outline import _walled
from labgym.exchange.structure import outline
from labgym.layouts.floor import Rectangle, Space


def ring(x0, y0, x1, y1):
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def test_a_ring_that_splits_its_outline_leaves_both_parts():
    areas = nested([ring(0, 0, 10, 4), ring(4, 0, 6, 4)])
    assert sorted(area.area for area in areas) == pytest.approx([16.0, 16.0])
    assert all(len(corners(area)) == 4 for area in areas)


def test_a_ring_that_crosses_itself_is_two_areas():
    areas = nested([((0, 0), (6, 3), (6, 0), (0, 3))])
    assert [area.area for area in areas] == pytest.approx([4.5, 4.5])


def test_rectangles_of_a_region_that_touch_but_for_rounding_have_one_outline():
    region = (Rectangle(x0=0.0, y0=0.0, x1=4.0, y1=3.0), Rectangle(x0=4.0005, y0=0.0, x1=8.0, y1=3.0))
    area = outline(Space(id="laboratory", use="laboratory", region=region))
    assert area.geom_type == "Polygon"
    assert area.area == pytest.approx(24.0, abs=0.01)


DUMBBELL = [
    (0, 0), (4, 0), (4, 1.95), (6, 1.95), (6, 0), (10, 0), (10, 4), (6, 4), (6, 2.05), (4, 2.05), (4, 4), (0, 4),
]  # fmt: skip
"""Two rooms of 4 x 4 m joined by a neck 0.1 m wide."""


class Walls:
    """A map in which every cell but those right of x = 8 m is occupied."""

    resolution, occupied = 0.05, None

    @staticmethod
    def sampled(_, points):
        return np.asarray(points)[:, 0] < 8.0


def test_the_walls_around_a_boundary_with_a_neck_narrower_than_they_are_measured():
    """Inward the boundary splits in two at its neck."""
    neck = Polygon(DUMBBELL)
    left = neck.exterior.intersection(box(-1, -1, 8, 5)).length
    assert _walled(Walls(), neck) == pytest.approx(left / neck.exterior.length, abs=0.1)
