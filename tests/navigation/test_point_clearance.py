"""The clearance of single points."""

from __future__ import annotations

import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.layouts import Layout, load_published
from labgym.layouts.places import layout_at
from labgym.navigation.barriers import Barriers, PointClearance

LAYOUTS = {
    "island": island_laboratory,
    "room": lambda: load_published("val", "val-con_01"),
    "floor": lambda: layout_at("floors-train", 1, first=900),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_it_is_the_clearance_of_the_barriers_to_the_bit(name: str) -> None:
    layout: Layout = LAYOUTS[name]()
    barriers = Barriers.of(layout)
    single = PointClearance(barriers)
    points = np.random.default_rng(0).uniform(barriers.low - 1.0, barriers.high + 1.0, (2000, 2))
    expected = barriers.clearance(points)
    assert [single.at(x, y) for x, y in points.tolist()] == expected.tolist()
    assert (expected == 0.0).any()
    assert (expected > 0.3).any()
