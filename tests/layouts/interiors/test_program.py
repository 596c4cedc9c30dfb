"""The constraint program of a space: what it finds, what it proves, and when it stops."""

import math
from itertools import combinations

import pytest
from shapely import Point, Polygon, box

from labgym.assets import Catalog
from labgym.geometry import OrientedBox
from labgym.layouts.brief import Demands, Proximity, Separation, Unit
from labgym.layouts.floor import Room
from labgym.layouts.ground import Ground
from labgym.layouts.interiors.program import Option, Stand, plan_walls
from labgym.layouts.interiors.standing import Standing

BENCH = Catalog.load().get("LabBench")
FLOOR = Room(width=6.0, depth=6.0).floor
GROUND = Ground.of(FLOOR, FLOOR.spaces[0])


def stands(units):
    standing = Standing(GROUND)
    return [
        Stand(unit, tuple(Option(s, tuple(standing.places(s, unit)), 1.0) for s in GROUND.segments)) for unit in units
    ]


@pytest.mark.cases(1)
@pytest.mark.parametrize("seed", range(3))
def test_units_keep_gaps_fronts_doors_and_distances(seed):
    units = [Unit(f"u{k}", BENCH, 0.8 + 0.1 * k, 0.6, 0.9) for k in range(8)]
    rules = (Separation("u0", "u1", 1.5, ""), Separation("u2", "u3", 2.0, ""))
    plan = plan_walls(stands(units), Demands(rules), seed, 1.0)
    assert plan.status == "solved"
    shapes = {name: Polygon(foot.corners()) for name, foot in plan.feet.items()}
    assert set(shapes) == {unit.id for unit in units}
    assert all(box(0, 0, 6, 6).covers(shape) for shape in shapes.values())
    assert all(first.distance(second) >= 0.02 - 1e-9 for first, second in combinations(shapes.values(), 2))
    assert all(shape.intersection(box(0.9, 0, 2.1, 1.2)).area < 1e-9 for shape in shapes.values())
    assert all(shapes[rule.first].distance(shapes[rule.second]) >= rule.distance - 1e-9 for rule in rules)
    for name, foot in plan.feet.items():
        fx, fy = foot.front
        reach = (foot.depth + 0.9) / 2.0
        zone = Polygon(OrientedBox(foot.x + reach * fx, foot.y + reach * fy, foot.width, 0.9, foot.yaw).corners())
        assert all(zone.intersection(shape).area < 1e-6 for other, shape in shapes.items() if other != name)


def test_a_proof_differs_from_a_search_that_was_stopped():
    wide = [Unit(f"u{k}", BENCH, 3.0, 0.75, 1.0) for k in range(9)]
    assert plan_walls(stands(wide), Demands(), 0, 1.0).status == "infeasible"
    narrow = [Unit(f"u{k}", BENCH, 0.8, 0.6, 0.9) for k in range(20)]
    assert plan_walls(stands(narrow), Demands(), 0, 1e-6).status == "stopped"


@pytest.mark.cases(1)
@pytest.mark.parametrize("seed", range(3))
def test_goal_poses_of_neighbors_are_near_and_their_footprints_apart(seed):
    units = [Unit(f"u{k}", BENCH, 0.9, 0.6, 0.9) for k in range(6)]
    apart, pairs = (Separation("u0", "u1", 1.2, ""),), (Proximity("u0", "u1", 2.3, ""), Proximity("u1", "u2", 1.5, ""))
    plan = plan_walls(stands(units), Demands(apart, (), pairs), seed, 1.0)
    assert plan.status == "solved"
    for pair in pairs:
        ends = []
        for foot in (plan.feet[pair.first], plan.feet[pair.second]):
            front = foot.depth / 2.0 + 0.60
            ends.append(Point(foot.x - math.sin(foot.yaw) * front, foot.y + math.cos(foot.yaw) * front))
        assert ends[0].distance(ends[1]) <= pair.distance + 1e-9
    assert Polygon(plan.feet["u0"].corners()).distance(Polygon(plan.feet["u1"].corners())) >= 1.2 - 1e-9


def test_neighbors_that_must_also_stay_apart_are_infeasible():
    units = [Unit(f"u{k}", BENCH, 0.9, 0.6, 0.9) for k in range(2)]
    far, near = (Separation("u0", "u1", 3.0, ""),), (Proximity("u0", "u1", 0.5, ""),)
    assert plan_walls(stands(units), Demands(far, (), near), 0, 1.0).status == "infeasible"
