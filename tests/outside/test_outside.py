"""Generated floors are sound for code that shares nothing with the generator, and that code finds what is spoilt."""

from __future__ import annotations

import copy
import json
import math

import pytest
from outside.simulator import simulator_findings

from labgym.eval.outside import WrittenPlan, findings
from labgym.layouts import Layout, generate
from labgym.scenes import to_mjcf

FLOORS = {"ell": (41, 3), "refit": (42, 2)}
"""Seed and level of clutter by family."""


@pytest.fixture(scope="module", params=FLOORS)
def written(request):
    seed, clutter = FLOORS[request.param]
    return json.loads(json.dumps(generate("red_03", seed, family=request.param, clutter=clutter).to_json()))


def kinds(data):
    return {finding.kind for finding in findings(WrittenPlan(data))}


def simulated(data):
    model = to_mjcf(Layout.parse(data, "test"), visible=False).compile()
    return {finding.kind for finding in simulator_findings(WrittenPlan(data), model)}


def moved(data, chosen, dx=0.0, dy=0.0, dz=0.0):
    """A copy of a layout in which one object is moved along its own axes, with what stands on it."""
    spoilt = copy.deepcopy(data)
    carried = {chosen}
    yaw = next(p["yaw"] for p in spoilt["placements"] if p["id"] == chosen)
    for placement in spoilt["placements"]:
        if placement["id"] in carried or placement["support"] in carried:
            carried.add(placement["id"])
            x, y, z = placement["position"]
            x += dx * math.cos(yaw) - dy * math.sin(yaw)
            y += dx * math.sin(yaw) + dy * math.cos(yaw)
            placement["position"] = [x, y, z + dz]
    return spoilt


def added(data, asset, x, y, yaw=0.0):
    """A copy of a layout with one more object on the floor."""
    spoilt = copy.deepcopy(data)
    one = {"id": f"spoil-{len(spoilt['placements'])}", "asset": asset, "position": [x, y, 0.0], "yaw": yaw}
    spoilt["placements"].append({**one, "support": "floor", "slot": None, "fixed": False, "size": None})
    return spoilt


@pytest.mark.cases(1)
def test_generated_floors_have_nothing_that_is_wrong(written):
    assert not findings(WrittenPlan(written))
    assert not simulated(written)


def test_an_object_lifted_by_8_mm_is_found(written):
    plan = WrittenPlan(written)
    standing = (p for p in plan.items if p.support not in ("floor", "wall") and not plan.assembled(p.id, p.support))
    item = next(standing)
    spoilt = moved(written, item.id, dz=0.008)
    assert "support" in kinds(spoilt)
    assert "simulated support" in simulated(spoilt)


def test_a_cabinet_pushed_into_its_wall_is_found(written):
    plan = WrittenPlan(written)
    item = next(p for p in plan.items if p.support == "floor" and p.entry.get("cavity") and abs(p.yaw % 1.5708) < 1e-3)
    spoilt = moved(written, item.id, dy=-0.06)
    assert "overlap" in kinds(spoilt)
    assert "simulated overlap" in simulated(spoilt)


def test_a_pallet_truck_across_an_exit_is_found(written):
    exit_ = WrittenPlan(written).exits[0]
    at = exit_.inside(0.35)
    across = math.atan2(exit_.inward[1], exit_.inward[0])
    assert "goal" in kinds(added(written, "PalletTruck", at.x, at.y, across))


def test_a_goal_behind_cartons_is_found(written):
    goal = next(iter(WrittenPlan(written).goals().values()))
    spoilt = written
    for turn in range(12):
        angle = turn * math.pi / 6.0
        x, y = goal.x + 0.8 * math.cos(angle), goal.y + 0.8 * math.sin(angle)
        spoilt = added(spoilt, "Carton", x, y, angle + math.pi / 2.0)
    assert "goal" in kinds(spoilt)


def test_a_rack_in_a_way_out_is_found(written):
    exit_ = WrittenPlan(written).exits[0]
    at = exit_.inside(0.75)
    across = math.atan2(exit_.inward[1], exit_.inward[0]) - math.pi / 2.0
    assert "way out" in kinds(added(written, "EquipmentRack", at.x, at.y, across))
