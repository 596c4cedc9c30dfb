"""What stands on the work surfaces of a floor for one and for several protocols."""

import math
from collections import Counter

import numpy as np
import pytest

from labgym.layouts.generate import resolve_request
from labgym.layouts.interiors.needs import needs_of
from labgym.layouts.request import Holdings

SEVERAL = [
    ("sub_02", "cyc_03", "red_04", "pro_01", "con_03"),
    ("pro_05", "sub_04", "fgt_03", "alk_04", "red_02"),
    ("alk_02", "cyc_02"),
    ("sub_01",),
]


def needs(names, **options):
    request = resolve_request(names, 3, None, "default", None, (), family="double", **options)
    return request, needs_of(request, np.random.default_rng(3))


@pytest.fixture(scope="module", params=SEVERAL, ids="-".join)
def stocked(request):
    return needs(request.param)


def test_the_pieces_of_each_apparatus_stand_on_one_surface(stocked):
    request, furniture = stocked
    held = [{content.asset.name for content in contents} for contents in furniture.contents.values()]
    for protocol in request.protocols:
        homes = {rule.subject: rule.object for rule in protocol.spatial_constraints if rule.kind == "on"}
        for rule in protocol.spatial_constraints:
            if rule.kind == "near" and rule.subject not in protocol.locations:
                if homes.get(rule.subject) == homes.get(rule.object):
                    pair = {request.catalog.find(name).name for name in (rule.subject, rule.object)}
                    assert any(pair <= names for names in held), (protocol.id, pair)


def test_everything_that_a_protocol_puts_into_a_hood_stands_in_one(stocked):
    request, furniture = stocked
    hoods = {unit.id for unit in furniture.required if unit.asset.fume_hood}
    ventilated = {content.asset.name for hood in hoods for content in furniture.contents.get(hood, ())}
    for protocol in request.protocols:
        for rule in protocol.spatial_constraints:
            if rule.kind == "on" and rule.object == "FumeHood":
                assert request.catalog.find(rule.subject).name in ventilated


def test_every_required_instrument_stands_somewhere_and_one_protocol_gets_no_more(stocked):
    request, furniture = stocked
    placed = Counter(content.asset.name for contents in furniture.contents.values() for content in contents)
    wanted = Counter(request.catalog.find(name).name for name in request.protocol.instruments)
    wanted = Counter({name: n for name, n in wanted.items() if request.catalog.get(name).placing != "floor"})
    reagents = {use.name for use in request.protocol.reagents}
    instruments = Counter({name: n for name, n in placed.items() if name not in reagents})
    assert all(instruments[name] >= count for name, count in wanted.items())
    if len(request.protocols) == 1:
        assert instruments == wanted


def test_instruments_are_in_reach_of_an_arm_at_the_goal_pose(stocked):
    _, furniture = stocked
    units = {unit.id: unit for unit in furniture.required}
    far = total = 0
    for unit_id, contents in furniture.contents.items():
        asset = units[unit_id].asset
        if asset.fume_hood or asset.subtype == "workbench":
            for content in contents:
                surface = asset.surfaces[content.slot]
                across = asset.size.depth / 2.0 + 0.60 - (surface.y + content.spot.y)
                height = surface.z + content.asset.size.height / 2.0 - 0.87
                far += math.hypot(surface.x + content.spot.x, across, height) > 1.30
                total += 1
    assert far <= 0.05 * total


def test_with_an_inventory_no_instrument_is_added():
    names = SEVERAL[0]
    request, furniture = needs(names, holdings=Holdings(purchases="required"))
    placed = Counter(content.asset.name for contents in furniture.contents.values() for content in contents)
    wanted = Counter(request.catalog.find(name).name for name in request.protocol.instruments)
    assert all(placed[name] <= count for name, count in wanted.items())
    assert sum(unit.asset.fume_hood for unit in furniture.required) == 1


@pytest.mark.parametrize("seed", range(4))
def test_a_heat_source_without_a_place_stands_on_no_bench_where_flammables_are_handled(seed):
    names = ("alk_01", "alk_03", "con_04", "pro_05", "red_02")
    request = resolve_request(names, seed, None, "default", None, (), family="suite")
    furniture = needs_of(request, np.random.default_rng(seed))
    used = {name for protocol in request.protocols for step in protocol.steps for name in step.uses}
    ovens = [c.asset.name for c in furniture.contents.get("PreparationBench_1", ()) if c.asset.heat_class == "oven"]
    assert "DryingOven" in used
    assert not ovens
