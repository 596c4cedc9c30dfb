"""Clutter on published layouts and on floors of many rooms, checked with polygons."""

from __future__ import annotations

import math
import sys
from collections import Counter

import numpy as np
import pytest
import shapely
from scipy import ndimage
from shapely.geometry import Point, Polygon

from labgym.errors import OptionError, UnrepairedError
from labgym.geometry import OrientedBox
from labgym.layouts import Door, Layout, Placement, Room, generate, load_published, published
from labgym.layouts.clutter import LEVELS, add_clutter
from labgym.layouts.clutter.ways import NEAR, RADII, Ways
from labgym.layouts.floors import draw_floor
from labgym.layouts.moves import lifted
from labgym.layouts.rules.building import building_of
from labgym.layouts.rules.objective import evaluate_layout
from labgym.navigation import goal_pose

DISC = 0.30
TALL = 1.4
"""Radius of the planning disc, and the height below which boxes stop the robot, meters."""


def polygon(box):
    return Polygon(box.corners())


def bare_floor(family, seed):
    """A floor of a family with a bench in the middle of every large room."""
    floor = draw_floor(family, seed).floor
    benches = []
    for space in floor.spaces:
        box = max(space.boxes, key=lambda box: box.width * box.depth)
        if min(box.width, box.depth) > 4.0:
            bench = Placement(
                id=f"bench-{space.id}", asset="IslandBench1800", position=(box.x, box.y, 0.0), yaw=space.yaw
            )
            if not any(math.dist((c.x, c.y), (box.x, box.y)) < 2.0 for c in floor.columns):
                benches.append(bench)
    return Layout(id=f"{family}-{seed}", floor=floor, placements=tuple(benches))


LAYOUTS = {
    **{name: lambda name=name: load_published("test", name) for name in published("test")[:3]},
    **{f"{f}-{s}": lambda f=f, s=s: bare_floor(f, s) for f in ("bay", "ell", "double", "suite", "refit") for s in (4,)},
}


@pytest.fixture(scope="module", params=LAYOUTS)
def layout(request):
    return LAYOUTS[request.param]()


@pytest.fixture(scope="module", params=(1, pytest.param(2, marks=pytest.mark.slow), 3))
def cluttered(request, layout):
    return layout, add_clutter(layout, request.param, np.random.default_rng([request.param, 11])), request.param


def added(layout, cluttered):
    return cluttered.placements[len(layout.placements) :]


def closed(placements):
    """The placements with all drawers and doors closed."""
    return tuple(p.model_copy(update={"state": ()}) for p in placements)


def reachable(layout):
    """For each exit, the goals of the floor furniture that a disc reaches, by polygons."""
    obstacles = [*layout.floor.solids, *layout.obstacles(TALL)]
    blocked = shapely.union_all([polygon(box) for box in obstacles if box.z0 < TALL]).buffer(DISC - 1e-6)
    free = shapely.box(*layout.floor.bounds).difference(blocked)
    parts = [part for part in getattr(free, "geoms", [free]) if part.area > 0.0]
    goals = {
        p.id: Point(goal_pose(layout.box(p.id))[:2])
        for p in layout.placements
        if p.support == "floor" and layout.asset(p.id).clearance > 0.0 and layout.asset(p.id).size.height > 0.75
    }
    reached = []
    for way in layout.floor.doorways:
        if way.exit:
            x, y, yaw = way.side(way.spaces[0])
            start = Point(x - math.sin(yaw) * (DISC + 1e-3), y + math.cos(yaw) * (DISC + 1e-3))
            part = next((part for part in parts if part.distance(start) < 1e-6), None)
            reached.append({name for name, goal in goals.items() if part is not None and part.distance(goal) < 1e-6})
    return reached


def test_objects_overlap_nothing_and_stay_inside(cluttered):
    before, after, _ = cluttered
    floor = shapely.union_all([polygon(box) for space in after.floor.spaces for box in space.boxes]).buffer(0.061)
    standing = {p.id: after.box(p.id) for p in after.placements if p.support in ("floor", "wall")}
    for placement in added(before, after):
        box = after.box(placement.id)
        footprint = polygon(box)
        assert placement.support == "floor"
        assert floor.covers(footprint)
        others = [other for name, other in standing.items() if name != placement.id]
        for other in [*others, *after.floor.solids]:
            if other.z0 < box.z1:
                assert footprint.distance(polygon(other)) > 0.02


def test_open_parts_overlap_nothing_and_stay_inside_and_off_doors(cluttered):
    _, after, _ = cluttered
    floor = shapely.union_all([polygon(box) for space in after.floor.spaces for box in space.boxes]).buffer(0.061)
    parts = [(p.id, box) for p in after.placements for box in after.open_parts(p.id)]
    standing = [*parts, *((p.id, after.box(p.id)) for p in after.placements), *(("", s) for s in after.floor.solids)]
    doors = [Point(way.side(s)[:2]) for way in after.floor.doorways for s in way.spaces if s != "outside"]
    for owner, box in parts:
        outline = polygon(box)
        assert floor.covers(outline)
        assert all(outline.distance(door) > 0.45 for door in doors)
        for other, solid in standing:
            if other != owner and solid.z0 < box.z1 and box.z0 < solid.z1:
                assert outline.intersection(polygon(solid)).area < 1e-6


def test_the_robot_still_reaches_every_goal_from_every_exit(cluttered):
    before, after, _ = cluttered
    for old, new in zip(reachable(before), reachable(after), strict=True):
        assert old
        assert old <= new


def test_doors_and_the_area_inside_them_stay_free(cluttered):
    before, after, _ = cluttered
    for way in after.floor.doorways:
        for space in way.spaces:
            if space != "outside":
                x, y, _ = way.side(space)
                for placement in added(before, after):
                    assert polygon(after.box(placement.id)).distance(Point(x, y)) > 0.45


def test_no_rule_is_broken_and_ways_out_are_judged_without_loose_objects(cluttered):
    before, after, _ = cluttered
    old, new = (evaluate_layout(each, each.protocol, navigation=True, rules="paper") for each in (before, after))
    assert new.v == old.v
    assert {issue.message for issue in new.errors} <= {issue.message for issue in old.errors}


def test_what_was_there_stays_and_the_level_is_recorded(cluttered, tmp_path):
    before, after, level = cluttered
    assert closed(after.placements[: len(before.placements)]) == before.placements
    assert after.provenance.options["clutter"] == level
    again = add_clutter(before, level, np.random.default_rng([level, 11]))
    assert again.hash == after.hash
    after.save(tmp_path / "layout.json")
    assert Layout.load(tmp_path / "layout.json").hash == after.hash


def test_higher_levels_have_more_objects_of_more_kinds():
    layouts = [load_published("test", name) for name in published("test")[:6]]
    counts, kinds = [], []
    for level in LEVELS:
        objects = Counter()
        for index, each in enumerate(layouts):
            objects.update(
                p.asset for p in added(each, add_clutter(each, level, np.random.default_rng([index, level])))
            )
        counts.append(sum(objects.values()))
        kinds.append(len(objects))
    assert counts[0] == 0
    assert counts[0] < counts[1] < counts[2] < counts[3]
    assert kinds[3] >= 7


def test_higher_levels_have_more_drawers_and_doors_open():
    layouts = [load_published("test", name) for name in published("test")[:6]]
    counts = []
    for level in LEVELS:
        each = [add_clutter(layout, level, np.random.default_rng([k, level])) for k, layout in enumerate(layouts)]
        counts.append(sum(len(p.state) for layout in each for p in layout.placements))
    assert counts[0] == 0
    assert counts[1] < counts[3]
    assert min(counts[1:]) > 0
    assert counts[3] > len(layouts)


def test_level_0_changes_nothing_and_other_levels_are_refused():
    layout = load_published("test", published("test")[0])
    generator = np.random.default_rng(0)
    assert add_clutter(layout, 0, generator) is layout
    for level in (-1, 4, True, 1.5):
        with pytest.raises(OptionError, match="0 to 3"):
            add_clutter(layout, level, generator)


def test_crowded_floors_have_necks_that_bare_ones_do_not():
    narrower = 0
    for name in published("test")[:10]:
        layout = load_published("test", name)
        after = add_clutter(layout, 3, np.random.default_rng(5))
        boxes = [polygon(after.box(p.id)) for p in added(layout, after)]
        others = shapely.union_all([polygon(layout.box(p.id)) for p in layout.placements if p.support == "floor"])
        gaps = [box.distance(others) for box in boxes]
        narrower += any(0.6 <= gap < 0.9 for gap in gaps)
    assert narrower >= 2


@pytest.mark.parametrize("site", [{"room": "bay"}, {"family": "ell"}])
def test_generate_adds_clutter_last_and_its_provenance_makes_the_layout_again(site):
    bare, used = (generate("sub_01", 3, **site, clutter=level) for level in (0, 3))
    assert generate("sub_01", 3, **site).hash == bare.hash
    assert "clutter" not in bare.provenance.options
    assert closed(used.placements[: len(bare.placements)]) == bare.placements
    assert len(used.placements) > len(bare.placements)
    made = used.provenance
    assert generate(used.protocols, made.seed, **site, clutter=made.options["clutter"]).hash == used.hash


@pytest.mark.parametrize("spoilt_draws", [0, 2, 99])
def test_generate_draws_clutter_again_that_breaks_a_rule(monkeypatch, spoilt_draws):
    draws = []

    def drawn(layout, level, generator):
        draws.append(generator.bit_generator.seed_seq.entropy)
        after = add_clutter(layout, level, generator)
        shower = next(piece.id for piece in after.placements if piece.asset == "EmergencyShower")
        return lifted(after, shower, 0.3) if len(draws) <= spoilt_draws else after

    monkeypatch.setattr(sys.modules["labgym.layouts.generate"], "add_clutter", drawn)
    if spoilt_draws > 8:
        with pytest.raises(UnrepairedError, match=r"clutter of level 1 on floor .* breaks a rule in each of 8 draws"):
            generate("sub_01", 3, room="bay", clutter=1)
        assert len(draws) == 8
        return
    layout = generate("sub_01", 3, room="bay", clutter=1)
    assert draws == [[3, 0xC1], [3, 0xC1, 1], [3, 0xC1, 2]][: spoilt_draws + 1]
    assert evaluate_layout(layout, layout.protocol, navigation=True).v == 0


def test_generate_refuses_other_levels():
    with pytest.raises(OptionError, match="0 to 3"):
        generate("sub_01", clutter=4)


def test_goals_stay_joined_where_one_exit_is_blocked_already():
    room = Room(width=10.0, depth=4.0, doors=(Door(wall="left", offset=2.0), Door(wall="right", offset=2.0)))
    rack = Placement(id="rack", asset="EquipmentRack", position=(0.35, 2.0, 0.0), yaw=-math.pi / 2.0)
    building = building_of(Layout(id="room", floor=room.floor, placements=(rack,)))
    box = OrientedBox(0.35, 2.0, 1.2, 0.7, -math.pi / 2.0, 0.0, 2.0)
    ways = Ways(room.floor, building.entrances, [box], [(3.0, 2.0), (7.0, 2.0)])
    right, near, far = 1, 2, 3
    assert pairs(ways.joined(RADII[0])) == {(right, near), (right, far), (near, far)}
    barrier = OrientedBox(5.0, 2.0, 0.5, 3.6, 0.0, 0.0, 1.0)
    assert not ways.add([barrier])
    divided = Ways(room.floor, building.entrances, [box, barrier], [(3.0, 2.0), (7.0, 2.0)])
    assert pairs(divided.joined(RADII[0])) == {(right, far)}


def pairs(joined):
    return {(first, second) for first, second in np.argwhere(joined).tolist() if first < second}


def test_places_are_joined_if_their_points_share_a_component():
    room = Room(width=8.0, depth=6.0, doors=(Door(wall="left", offset=2.0), Door(wall="right", offset=2.0)))
    entrances = building_of(Layout(id="room", floor=room.floor, placements=())).entrances
    generator = np.random.default_rng(3)
    divided = 0
    for _ in range(20):
        goals = [tuple(goal) for goal in generator.uniform((0.3, 0.3), (7.7, 5.7), (12, 2))]
        sides = generator.uniform((0.2, 2.0), (0.4, 5.0), (6, 2))
        turns = generator.choice([0.0, math.pi / 2.0], 6)
        walls = [
            OrientedBox(*generator.uniform((0.5, 0.5), (7.5, 5.5)), *side, turn, 0.0, 1.0)
            for side, turn in zip(sides, turns, strict=True)
        ]
        ways = Ways(room.floor, entrances, walls, goals)
        for radius in RADII:
            components, _ = ndimage.label(ways.values >= radius)
            near = [np.hypot(*(ways.points - goal).transpose(2, 0, 1)) <= NEAR for goal in goals]
            reached = [set(components[points].tolist()) - {0} for points in near]
            expected = [[a is not b and not a.isdisjoint(b) for b in reached] for a in reached]
            assert ways.joined(radius)[2:, 2:].tolist() == expected
            divided += not all(map(any, expected))
    assert divided > 5


def test_an_object_is_added_if_the_whole_floor_keeps_the_ways_that_existed_at_first():
    room = Room(width=6.0, depth=5.0, doors=(Door(wall="left", offset=2.0), Door(wall="right", offset=2.0)))
    entrances = building_of(Layout(id="room", floor=room.floor, placements=())).entrances
    generator = np.random.default_rng(8)
    goals = [tuple(goal) for goal in generator.uniform((0.5, 0.5), (5.5, 4.5), (6, 2))]
    boxes: list[OrientedBox] = []
    ways, refused = Ways(room.floor, entrances, boxes, goals), 0
    first = {radius: ways.joined(radius) for radius in RADII}
    for _ in range(60):
        x, y, width, depth, yaw = generator.uniform((0.5, 0.5, 0.2, 0.2, 0.0), (5.5, 4.5, 1.2, 0.8, 3.0))
        box = OrientedBox(x, y, width, depth, yaw, 0.0, 1.0)
        other = Ways(room.floor, entrances, [*boxes, box], goals)
        keeps = all((other.joined(radius) >= joined).all() for radius, joined in first.items())
        assert ways.add([box]) == keeps
        boxes += [box] if keeps else []
        refused += not keeps
    assert ways.values.tobytes() == Ways(room.floor, entrances, boxes, goals).values.tobytes()
    assert len(boxes) > 5
    assert refused > 5
