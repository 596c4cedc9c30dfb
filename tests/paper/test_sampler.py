"""The sampler errs as its rates say, and only then: every kind of error bites, and none occurs at rate 0."""

from __future__ import annotations

import math
import os
import subprocess
import sys
from collections.abc import Callable
from functools import cache

import pytest
from shapely import Polygon

from labgym.layouts import Layout, Placement, generate
from labgym.layouts.generate import resolve_request
from labgym.layouts.method import Method
from labgym.layouts.placement import FLOOR
from labgym.layouts.request import Request
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.storage import in_own_class
from labgym.layouts.rules.whereabouts import resolved
from labgym.layouts.surroundings import door_areas
from labgym.paper.sampler import Rates, SamplerProposer
from labgym.paper.sampler.rates import GROUPS, calibration
from labgym.protocols import protocols

PROTOCOLS = ("alk_02", "pro_05", "con_04")
"""Protocols with many reagents, two of them with incompatible reagents of one storage class."""
PILLAR = Placement(id="pillar", asset="EquipmentRack", position=(4.0, 7.0, 0.0), yaw=math.pi)
SEED = 41


def request(protocol: str | list[str], seed: int = SEED, fixed: tuple[Placement, ...] = (), **site: str) -> Request:
    return resolve_request(
        protocol, seed, site.get("room"), "default", None, fixed, family=site.get("family"), floor=None
    )


@cache
def proposal(protocol: str, **rates: float) -> tuple[Layout, Assessment]:
    """A proposal in the preset `bay` with a fixed rack where the hood usually stands, and its assessment."""
    asked = request(protocol, fixed=(PILLAR,))
    layout = SamplerProposer(Rates(**rates)).propose(asked)
    return layout, evaluate_layout(layout, asked.protocol, navigation=True, rules="paper")


def outline(layout: Layout, each: str) -> Polygon:
    return Polygon(layout.box(each).corners())


def pieces(layout: Layout) -> list[str]:
    return [p.id for p in layout.placements if p.support == FLOOR]


def bench_items(layout: Layout) -> list[str]:
    """Ids of what stands on worktops and in hoods."""
    return [
        p.id for p in layout.placements if p.support in layout.by_id and layout.asset(p.support).storage_class is None
    ]


def overlapping(layout: Layout, ids: list[str]) -> int:
    """Number of pairs whose outlines share more than a square centimeter."""
    shapes = [outline(layout, each) for each in ids]
    return sum(a.intersection(b).area > 1e-4 for k, a in enumerate(shapes) for b in shapes[:k])


def items_overlap(layout: Layout, _: Assessment) -> bool:
    on = {layout.placement(each).support for each in bench_items(layout)}
    return any(overlapping(layout, [p.id for p in layout.children(unit) if p.slot == 0]) for unit in on)


def caused_by(cause: str) -> Callable[[Layout, Assessment], bool]:
    return lambda _, assessment: any(fault.cause == cause for fault in assessment.bounds)


def lacks(part: str) -> Callable[[Layout, Assessment], bool]:
    """Whether reagents or instruments (`things`), or locations (`places`), are missing."""

    def lacking(layout: Layout, assessment: Assessment) -> bool:
        protocol = layout.protocols[0]
        names = (
            protocol.locations if part == "places" else (*protocol.instruments, *(r.name for r in protocol.reagents))
        )
        return not set(resolved(tuple(names), layout.catalog)).isdisjoint(assessment.missing or ())

    return lacking


def in_doorway(layout: Layout, _: Assessment) -> bool:
    areas = [Polygon(area.corners()) for area in door_areas(layout.floor)]
    return any(outline(layout, each).intersection(area).area > 0.01 for each in pieces(layout) for area in areas)


def into_pillar(layout: Layout, _: Assessment) -> bool:
    pillar = outline(layout, PILLAR.id)
    return any(outline(layout, each).intersection(pillar).area > 0.01 for each in pieces(layout) if each != PILLAR.id)


def without_shower(layout: Layout, _: Assessment) -> bool:
    return not any(layout.asset(each).subtype == "shower" for each in pieces(layout))


def faces_wall(layout: Layout, _: Assessment) -> bool:
    """Whether a piece has less than 0.3 m between its front and the wall that it faces."""
    room = layout.room
    for each in pieces(layout):
        box = layout.box(each)
        x, y = (box.x + box.front[0] * (box.depth / 2.0 + 0.3), box.y + box.front[1] * (box.depth / 2.0 + 0.3))
        if not (0.0 < x < room.width and 0.0 < y < room.depth):
            return True
    return False


def fronts_taken(_: Layout, assessment: Assessment) -> bool:
    return any(issue.rule == "front_clearance" for issue in assessment.errors)


def round_positions(layout: Layout, _: Assessment) -> bool:
    """Whether the middles of all pieces along their walls are multiples of a quarter of a meter."""
    room, rest = layout.room, []
    for each in pieces(layout):
        if each != PILLAR.id:
            box = layout.box(each)
            along = (box.x, room.width - box.x) if abs(box.front[1]) > 0.5 else (box.y, room.depth - box.y)
            rest.append(min(abs(math.remainder(value, 0.25)) for value in along))
    return max(rest) < 1e-6


def near_hazards(_: Layout, assessment: Assessment) -> bool:
    return any(i.satisfaction < 1.0 for i in (*assessment.of("flammable"), *assessment.of("incompatible")))


def left_out(layout: Layout, _: Assessment) -> bool:
    return any(layout.asset(each).kind == "reagent" for each in bench_items(layout))


def wrong_cabinet(layout: Layout, assessment: Assessment) -> bool:
    return (in_own_class(assessment.arrangement) or 0.0) < 1.0


def dangerous_glass(_: Layout, assessment: Assessment) -> bool:
    return any(instance.satisfaction < 0.5 for instance in assessment.of("glass"))


FAULTS: dict[str, Callable[[Layout, Assessment], bool]] = {
    "thing_forgotten": lacks("things"),
    "place_forgotten": lacks("places"),
    "safety_forgotten": without_shower,
    "position_rounded": round_positions,
    "width_misjudged": lambda layout, _: overlapping(layout, pieces(layout)) > 0,
    "neighbors_overlooked": lambda layout, _: overlapping(layout, pieces(layout)) > 0,
    "fixed_overlooked": into_pillar,
    "depth_misjudged": caused_by("room"),
    "door_overlooked": in_doorway,
    "clearance_forgotten": fronts_taken,
    "opposite": lambda _, assessment: any(not move.feasible for move in assessment.transitions or ()),
    "turned": faces_wall,
    "distance_forgotten": near_hazards,
    "classes_mixed": wrong_cabinet,
    "reagent_left_out": left_out,
    "cabinet_confused": wrong_cabinet,
    "item_misjudged": items_overlap,
    "over_edge": caused_by("surface"),
    "height_misjudged": caused_by("height"),
    "glass_at_edge": dangerous_glass,
}
"""Whether a proposal has the fault of a kind of error. `space_confused` needs a floor of several spaces."""


def test_every_kind_of_error_has_a_test() -> None:
    assert {*FAULTS, "space_confused"} == set(Rates.model_fields)


@pytest.mark.parametrize("protocol", sorted(protocols()))
def test_without_errors_the_layout_of_every_protocol_is_flawless(protocol: str) -> None:
    asked = request(protocol)
    assessment = evaluate_layout(
        SamplerProposer(Rates()).propose(asked), asked.protocol, navigation=True, rules="paper"
    )
    assert assessment.v == 0
    assert assessment.missing == ()


@pytest.mark.parametrize("kind", FAULTS)
def test_an_error_occurs_at_rate_1_and_not_at_rate_0(kind: str) -> None:
    assert not any(FAULTS[kind](*proposal(protocol)) for protocol in PROTOCOLS)
    assert any(FAULTS[kind](*proposal(protocol, **{kind: 1.0})) for protocol in PROTOCOLS)


def test_confused_spaces_have_furniture_of_another_use() -> None:
    asked = request("alk_02", seed=3, family="refit")

    def uses(rates: Rates) -> set[str]:
        layout = SamplerProposer(rates).propose(asked)
        hoods = [layout.box(p.id) for p in layout.placements if layout.asset(p.id).fume_hood]
        return {space.use for hood in hoods if (space := layout.floor.space_at(hood.x, hood.y)) is not None}

    assert uses(Rates()) == {"laboratory"}
    assert uses(Rates(space_confused=1.0)) == {"write-up"}


def test_floors_and_several_protocols_get_proposals() -> None:
    for asked in (
        request("red_02", seed=4, family="refit"),
        request(["sub_01", "red_02"], seed=4, room="roomy"),
        request(["sub_01", "red_02", "con_01"], seed=5, family="double"),
    ):
        layout = SamplerProposer().propose(asked)
        layout.check_references()
        assert {p.id for p in layout.protocols} == {p.id for p in asked.protocols}
        inside = [p for p in layout.placements if layout.floor.space_at(*p.position[:2]) is not None]
        assert len(inside) >= 0.9 * len(layout.placements)


def test_fixed_pieces_stay_and_take_the_role_of_their_asset() -> None:
    sink = Placement(id="sink", asset="SinkBench", position=(0.4, 4.0, 0.0), yaw=-1.5708)
    layout = SamplerProposer(Rates(**dict.fromkeys(Rates.model_fields, 1.0))).propose(request("sub_01", fixed=(sink,)))
    assert layout.placement("sink") == sink.model_copy(update={"fixed": True})
    assert sum(p.asset == "SinkBench" for p in layout.placements) == 1


def test_a_higher_rate_keeps_the_errors_of_a_lower_one() -> None:
    asked = request("alk_02")
    several = [SamplerProposer(Rates(turned=rate)).propose(asked) for rate in (0.0, 0.2, 0.6, 1.0)]
    flawless = {p.id: p.yaw for p in several[0].placements}
    turned = [{p.id for p in each.placements if p.support == FLOOR and p.yaw != flawless[p.id]} for each in several]
    assert turned[0] < turned[1] < turned[2] < turned[3]


def test_a_proposal_is_the_same_in_another_process() -> None:
    code = (
        "from labgym.layouts.generate import resolve_request\n"
        "from labgym.paper.sampler import SamplerProposer\n"
        "asked = resolve_request('red_02', 9, 'roomy', 'default', None, ())\n"
        "print(SamplerProposer().propose(asked).hash)"
    )
    environment = {**os.environ, "PYTHONHASHSEED": "123"}
    other = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    here = SamplerProposer().propose(request("red_02", seed=9, room="roomy"))
    assert other.stdout.strip() == here.hash


def test_provenance_lists_the_errors() -> None:
    layout, _ = proposal("alk_02", turned=1.0)
    assert layout.provenance.options["errors"] == {"turned": len(pieces(layout)) - 1}


def test_the_published_rates_are_the_assumed_ones_times_the_factors() -> None:
    published = calibration()
    assert published.rates == published.assumed.scaled(published.factors)
    assert set(published.factors) == set(GROUPS)


def test_under_touchstone_the_safety_equipment_is_added_that_a_proposal_lacks() -> None:
    assert missing_kinds(generate("red_02", 0, rules="paper", method=Method(proposer="sampler")))
    assert not missing_kinds(generate("red_02", 0, method=Method(proposer="sampler")))


def missing_kinds(layout: Layout) -> list[str]:
    """Return what of the equipment that any laboratory with hazardous liquids needs a layout lacks."""
    assets = {placement.asset for placement in layout.placements}
    return [asset for asset in ("FireExtinguisher", "SpillKit") if asset not in assets]
