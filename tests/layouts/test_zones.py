"""Functional zones and the assignment of steps to them."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laboratories import PROTOCOL, island_laboratory, put

from labgym.errors import DocumentError, UnknownNameError
from labgym.layouts import Layout
from labgym.layouts.moves import Assign, apply
from labgym.layouts.records import Zone, ZoneAssignment
from labgym.layouts.refinement import refine_assessed
from labgym.layouts.rules.objective import evaluate_layout
from labgym.layouts.trace import Recorder
from labgym.layouts.zoning import zoned
from labgym.navigation import goal_pairs, goal_pose
from labgym.protocols import get

SECOND = put("FumeHood_2", "FumeHood", 4.0, 6.0 - 0.43, yaw=math.pi)


@pytest.fixture(scope="module")
def two_hoods() -> Layout:
    layout = island_laboratory()
    return layout.replace(placements=(*layout.placements, SECOND))


@pytest.fixture(scope="module")
def layout(two_hoods: Layout) -> Layout:
    return zoned(two_hoods, get(PROTOCOL))


def hood(layout: Layout) -> str:
    placement = layout.find("FumeHood")
    assert placement is not None
    return placement.id


def zone_of(layout: Layout, item: str) -> str:
    return next(zone.name for zone in layout.zones if item in zone.furniture)


def test_every_piece_of_furniture_is_in_one_zone_and_each_hood_in_its_own(layout: Layout) -> None:
    members = [item for zone in layout.zones for item in zone.furniture]
    assert sorted(members) == sorted(item.id for item in layout.placements)
    assert zone_of(layout, "FumeHood_1") != zone_of(layout, "FumeHood_2")
    assert {one.location for one in layout.assignment} == set(get(PROTOCOL).locations)


def test_of_equal_hoods_the_one_with_the_shorter_way_is_assigned(layout: Layout) -> None:
    lengths = {}
    for name in ("FumeHood_1", "FumeHood_2"):
        poses = []
        for location in get(PROTOCOL).route:
            item = name if location == "FumeHood" else str(getattr(layout.find(location), "id", ""))
            poses.append(goal_pose(layout.box(item))[:2])
        lengths[name] = float(np.linalg.norm(np.diff(np.array(poses), axis=0), axis=1).sum())
    assert hood(layout) == min(lengths, key=lambda name: lengths[name])


@pytest.mark.parametrize("name", ["FumeHood_1", "FumeHood_2"])
def test_goal_pairs_lead_to_the_assigned_hood(layout: Layout, name: str) -> None:
    assigned = apply(layout, Assign("FumeHood", zone_of(layout, name)))
    expected = goal_pose(assigned.box(name))
    poses = [pair.goal for pair in goal_pairs(assigned, PROTOCOL) if pair.goal_location == "FumeHood"]
    assert poses
    assert all(pose == pytest.approx(expected) for pose in poses)


def test_what_stands_on_the_furniture_of_a_zone_belongs_to_it(two_hoods: Layout) -> None:
    tops = [
        put("scale_1", "ElectronicScale", 2.0, 5.57, 0.9, on="FumeHood_1", slot=0),
        put("scale_2", "ElectronicScale", 4.0, 5.57, 0.9, on="FumeHood_2", slot=0),
    ]
    layout = two_hoods.replace(
        placements=(*two_hoods.placements, *tops),
        zones=(Zone(name="second", role="reaction", furniture=("FumeHood_2",)),),
        assignment=(ZoneAssignment(location="ElectronicScale", zone="second"),),
    )
    assert layout.find("ElectronicScale") == tops[1]


def test_the_refinement_sends_the_robot_to_the_other_hood_if_the_first_is_blocked_for_good(layout: Layout) -> None:
    first = apply(layout, Assign("FumeHood", zone_of(layout, "FumeHood_1")))
    crate = put("crate", "EquipmentRack", *goal_pose(first.box("FumeHood_1"))[:2])
    pieces = tuple(item.model_copy(update={"fixed": True}) for item in (*first.placements, crate))
    blocked = first.replace(placements=pieces)
    protocol, recorder = get(PROTOCOL), Recorder()
    before = evaluate_layout(blocked, protocol, navigation=True, rules="paper")
    assert not all(move.feasible for move in before.transitions or ())
    after, assessment = refine_assessed(blocked, before, protocol, trace=recorder)
    assert all(move.feasible for move in assessment.transitions or ())
    assert hood(after) == "FumeHood_2"
    assert after.placements == blocked.placements
    trace = recorder.trace()
    assert trace.final() == after
    assert "Assign" in {
        command.kind for each in trace.iterations for trial in each.trials for command in trial.commands
    }


def test_a_layout_without_zones_keeps_its_bytes_and_its_hash(layout: Layout, two_hoods: Layout) -> None:
    assert not {"zones", "assignment"} & two_hoods.to_json().keys()
    bare = layout.replace(zones=(), assignment=())
    assert bare.hash == two_hoods.hash
    assert bare.to_json() == two_hoods.to_json()
    assert layout.hash != two_hoods.hash
    other = apply(layout, Assign("FumeHood", zone_of(layout, "FumeHood_1")))
    assert len({layout.hash, other.hash}) == 2


def test_zones_are_read_as_they_were_written(layout: Layout, tmp_path: Path) -> None:
    assert Layout.load(layout.save(tmp_path / "lab.json")) == layout


def test_zones_lose_the_furniture_that_is_removed(layout: Layout) -> None:
    fewer = layout.replace(placements=tuple(item for item in layout.placements if item.id != hood(layout)))
    fewer.check_references()
    assert hood(layout) not in {item for zone in fewer.zones for item in zone.furniture}
    assert hood(fewer) != hood(layout)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"zones": [{"name": "a", "role": "work", "furniture": ["nothing"]}]}, "nothing"),
        ({"zones": [{"name": "a", "role": "work", "furniture": ["FumeHood_1"]}] * 2}, "twice"),
        ({"zones": [{"name": "a", "role": "magic", "furniture": ["FumeHood_1"]}]}, "role"),
        ({"zones": [], "assignment": [{"location": "FumeHood", "zone": "b"}]}, "'b'"),
        ({"assignment": [{"location": "FumeHood", "zone": "reaction_1"}] * 2}, "twice"),
    ],
)
def test_zones_of_a_file_that_do_not_fit_are_refused_in_one_line(
    layout: Layout, change: dict[str, Any], words: str
) -> None:
    data = json.loads(json.dumps(layout.to_json())) | change
    with pytest.raises(DocumentError, match=words) as caught:
        Layout.parse(data)
    assert "\n" not in str(caught.value)


def test_an_unknown_zone_cannot_be_assigned(layout: Layout) -> None:
    with pytest.raises(UnknownNameError, match="reaction_1"):
        apply(layout, Assign("FumeHood", "cellar"))
