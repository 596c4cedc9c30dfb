"""Furniture of any floor returns to the walls of its space: overlaps, backs and fixed pieces checked by polygons."""

import math
from itertools import combinations

import numpy as np
import pytest
from furnished_floors import ell, oblique, suite
from shapely import Polygon

from labgym.layouts import Layout, optimise
from labgym.layouts.generate import resolve_request
from labgym.layouts.interiors import FloorProposer
from labgym.layouts.interiors.rearranging import rearrangements
from labgym.layouts.moves import Place, apply
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules import evaluate_layout
from labgym.layouts.rules.facility.backs import one_sided
from labgym.layouts.rules.thresholds import BACK_GAP, MOVABLE

FLOORS = {"ell": ell, "suite": suite, "oblique": oblique}


def polygon(layout: Layout, item: str) -> Polygon:
    return Polygon(layout.box(item).corners())


def furnished(name: str) -> Layout:
    request = resolve_request("sub_01", 3, None, "default", None, (), floor=FLOORS[name]())
    return FloorProposer().propose(request)


def at_walls(layout: Layout) -> list[str]:
    assessment = evaluate_layout(layout, rules="paper")
    rows = range(len(assessment.arrangement))
    return [layout.placements[row].id for row in rows if one_sided(assessment.arrangement, row)]


def back_gap(layout: Layout, item: str) -> float:
    """Distance of the farther rear corner from the nearest wall, by polygons."""
    walls = [Polygon(box.corners()) for box in layout.floor.wall_boxes]
    box = layout.box(item)
    rear = [box.to_world(side * box.width / 2.0, -box.depth / 2.0) for side in (-1.0, 1.0)]
    from shapely import Point

    return min(max(wall.distance(Point(corner)) for corner in rear) for wall in walls)


@pytest.mark.parametrize("name", FLOORS)
def test_wall_units_that_stand_in_the_open_return_to_walls_of_their_space(name):
    layout = furnished(name)
    generator = np.random.default_rng(5)
    backed = [item for item in at_walls(layout) if back_gap(layout, item) <= BACK_GAP]
    shaken = generator.permutation(backed)[:3].tolist()
    pinned = next(item for item in backed if item not in shaken)
    placements = [p.model_copy(update={"fixed": p.id == pinned}) for p in layout.placements]
    layout = layout.replace(placements=tuple(placements))
    damaged = layout
    for item in shaken:
        box = layout.box(item)
        x, y = box.to_world(0.0, 0.6)
        damaged = apply(damaged, Place(item, x, y, box.yaw + 0.5))
    mended = next(rearrangements(damaged, None, shaken))
    for item in shaken:
        assert back_gap(mended, item) <= BACK_GAP + 1e-6
        before, after = damaged.box(item), mended.box(item)
        spaces = [mended.floor.space_at(box.x, box.y) for box in (before, after)]
        assert spaces[0] is None or spaces[1] is None or spaces[0].id == spaces[1].id
        assert math.dist((before.x, before.y), (after.x, after.y)) < 4.5
    standing = [p.id for p in mended.placements if p.support == FLOOR and mended.asset(p.id).subtype not in MOVABLE]
    for one, other in combinations(standing, 2):
        if one in shaken or other in shaken:
            assert polygon(mended, one).intersection(polygon(mended, other)).area < 1e-6
    assert mended.placement(pinned) == layout.placement(pinned)


def test_optimise_repairs_shaken_furniture_of_a_suite():
    layout = furnished("suite")
    damaged = layout
    for item in [item for item in at_walls(layout) if back_gap(layout, item) <= BACK_GAP][:2]:
        box = layout.box(item)
        damaged = apply(damaged, Place(item, *box.to_world(0.3, 0.7), box.yaw + 0.7))
    before, after = (
        evaluate_layout(each, layout.protocol, rules="paper")
        for each in (damaged, optimise(damaged, layout.protocol, rules="paper"))
    )
    assert before.cost > 0
    assert after.cost == 0
