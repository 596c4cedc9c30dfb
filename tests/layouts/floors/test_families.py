"""Every family of floors, on many seeds, against shapely and closed forms."""

from __future__ import annotations

import json
import math
from collections import Counter
from functools import cache
from itertools import combinations

import numpy as np
import pytest
import shapely
from shapely.geometry import Point, Polygon

from labgym.errors import InfeasibleError, OptionError, UnknownNameError
from labgym.layouts.floor import Floor
from labgym.layouts.floors import FAMILIES, SPLITS, draw_floor, population_of
from labgym.layouts.floors.building import SECOND_EXIT_AREA
from labgym.layouts.floors.fittings import HELD_OUT, TRAINED

SEEDS, SOME = 60, 20
"""Floors of a family, and how many of them are examined where it takes long."""
ROBOT, EGRESS = 0.30, 0.45
"""Radii of the planning disc and of a way 0.90 m wide, meters."""
AREAS = {"bay": (25.0, 400.0), "ell": (40.0, 200.0), "double": (60.0, 240.0), "suite": (80.0, 400.0)}
AREAS["refit"] = (80.0, 240.0)


@cache
def drawn(family):
    return [draw_floor(family, seed) for seed in range(SEEDS)]


def polygon(box):
    return Polygon(box.corners())


def region(space):
    return shapely.union_all([polygon(box) for box in space.boxes])


def exits(floor):
    return [doorway for doorway in floor.doorways if doorway.exit]


def reached(floor, radius):
    """Where a disc can be that starts inside each exit: one polygon per exit, None if it does not fit there."""
    low = [polygon(box) for box in floor.solids if box.z0 < 1.4]
    walls = shapely.union_all(low)
    outside = shapely.box(*floor.bounds).exterior.buffer(0.01)
    free = shapely.box(*floor.bounds).difference(shapely.union_all([walls, outside]).buffer(radius - 1e-6))
    parts = list(getattr(free, "geoms", [free]))
    areas = []
    for doorway in exits(floor):
        x, y, yaw = doorway.side(doorway.spaces[0])
        start = Point(x - math.sin(yaw) * (radius + 1e-3), y + math.cos(yaw) * (radius + 1e-3))
        areas.append(next((part for part in parts if part.distance(start) < 1e-6), None))
    return areas


@pytest.mark.parametrize("family", FAMILIES)
def test_exits_and_interior_doors_are_at_least_091_m_wide_with_their_leaf_open(family):
    for draw in drawn(family):
        for doorway in draw.floor.doorways:
            leaf = 0.05 if doorway.opening.kind == "door" and not doorway.exit else 0.0
            assert doorway.width - leaf >= 0.91, draw.floor.name


@pytest.mark.parametrize("family", FAMILIES)
def test_a_way_090_m_wide_leads_from_every_exit_into_every_space(family):
    for draw in drawn(family)[:SOME]:
        spaces = [region(space) for space in draw.floor.spaces]
        for area in reached(draw.floor, EGRESS):
            assert area is not None, draw.floor.name
            for space in spaces:
                assert area.intersection(space).area > 0.3 * space.area, draw.floor.name


@pytest.mark.parametrize("family", FAMILIES)
def test_the_robot_reaches_nearly_all_of_every_space(family):
    for draw in drawn(family)[:20]:
        for area in reached(draw.floor, ROBOT):
            for space in draw.floor.spaces:
                inner = region(space).buffer(0.1).buffer(-0.1 - ROBOT - 0.05)
                columns = [Point(c.x, c.y).buffer(c.width + ROBOT) for c in draw.floor.columns]
                leaves = [polygon(p.box).buffer(ROBOT + 0.05) for p in draw.floor.parts if p.kind == "leaf"]
                expected = inner.difference(shapely.union_all([*columns, *leaves]))
                assert expected.difference(area).area < 0.02 * expected.area, draw.floor.name


@pytest.mark.parametrize("family", FAMILIES)
def test_the_first_two_exits_are_more_than_half_the_diagonal_apart(family):
    for draw in drawn(family):
        ways = [(way.x, way.y) for way in exits(draw.floor)]
        rooms = shapely.union_all([region(space) for space in draw.floor.spaces])
        x0, y0, x1, y1 = rooms.bounds
        largest = max(region(space).area for space in draw.floor.spaces if space.use != "corridor")
        assert 1 <= len(ways) <= 3
        if len(ways) == 1:
            assert family in ("bay", "ell")
            assert largest <= SECOND_EXIT_AREA
        else:
            apart = max(math.dist(a, b) for a, b in combinations(ways, 2))
            assert apart > math.hypot(x1 - x0, y1 - y0) / 2.0 - 0.5


@pytest.mark.parametrize("family", FAMILIES)
def test_a_room_of_a_suite_or_an_annex_above_the_limit_has_two_ways_out(family):
    for draw in drawn(family):
        for space in draw.floor.spaces:
            if space.use != "corridor" and region(space).area > SECOND_EXIT_AREA and family in ("bay", "ell", "suite"):
                assert sum(space.id in way.spaces for way in draw.floor.doorways) >= 2, draw.floor.name


@pytest.mark.parametrize("family", FAMILIES)
def test_areas_and_sizes_are_within_the_limits(family):
    low, high = AREAS[family]
    for draw in drawn(family):
        area = sum(region(space).area for space in draw.floor.spaces)
        assert low - 1.0 <= area <= high + 1.0, draw.floor.name
        assert draw.parameters["area"] == pytest.approx(area, abs=1.5)
        if family == "bay":
            box = draw.floor.spaces[0].region[0]
            assert 5.0 <= box.x1 <= 20.0
            assert 5.0 <= box.y1 <= 20.0


@pytest.mark.parametrize("family", FAMILIES)
def test_walls_overlap_only_where_they_join_and_never_a_space(family):
    for draw in drawn(family):
        walls = [polygon(wall.box) for wall in draw.floor.walls]
        tree = shapely.STRtree(walls)
        for first, second in tree.query(walls, predicate="intersects").T:
            if first < second:
                a, b = draw.floor.walls[first], draw.floor.walls[second]
                limit = 1.2 * a.thickness * b.thickness
                assert walls[first].intersection(walls[second]).area <= limit, draw.floor.name
        rooms = shapely.union_all([region(space) for space in draw.floor.spaces])
        assert rooms.intersection(shapely.union_all(walls)).area < 1e-3, draw.floor.name


@pytest.mark.parametrize("family", FAMILIES)
def test_columns_stand_in_a_space_and_clear_of_doors(family):
    for draw in drawn(family):
        for column in draw.floor.columns:
            box = polygon(next(p.box for p in draw.floor.parts if p.kind == "column" and p.box.x == column.x))
            assert box.area == pytest.approx(column.width * column.depth)
            for way in draw.floor.doorways:
                assert Point(way.x, way.y).distance(Point(column.x, column.y)) > 0.9


@pytest.mark.parametrize("family", FAMILIES)
def test_hood_walls_border_a_laboratory_and_have_room_for_a_hood(family):
    found = 0
    for draw in drawn(family):
        laboratories = {space.id: region(space) for space in draw.floor.spaces if space.use == "laboratory"}
        for hood in draw.style.hood_walls:
            wall = draw.floor.walls[hood.wall]
            assert polygon(wall.box).distance(laboratories[hood.space]) < 0.1
            assert wall.length >= 2.4
        found += bool(draw.style.hood_walls)
    assert found >= 0.98 * SEEDS


@pytest.mark.parametrize("family", FAMILIES)
def test_styles_are_drawn_from_the_ranges(family):
    ranges = FAMILIES[family].ranges
    for draw in drawn(family):
        assert ranges.aisle[0] <= draw.style.aisle <= ranges.aisle[1]
        assert 0.75 <= draw.style.maintenance_aisle <= 0.90
        assert sorted(draw.style.islands) == sorted(ranges.islands)
        assert (draw.style.oblique > 0.0) == ("oblique" in ranges.islands)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_floor_and_its_parameters_are_plain_json_and_the_same_for_the_same_seed(family):
    for seed in range(0, SEEDS, 30):
        first, second = drawn(family)[seed], draw_floor(family, seed)
        assert first == second
        assert json.loads(json.dumps(first.parameters)) == first.parameters
        assert Floor.model_validate(json.loads(first.floor.model_dump_json())) == first.floor
        assert first.parameters["family"] == family
        assert first.parameters["seed"] == seed
        json.dumps(first.style.to_json())


@pytest.mark.parametrize("family", FAMILIES)
def test_floors_of_one_family_differ(family):
    outlines = []
    for draw in drawn(family)[:SOME]:
        rooms = shapely.union_all([region(space) for space in draw.floor.spaces])
        outlines.append(shapely.affinity.translate(rooms, -rooms.bounds[0], -rooms.bounds[1]))
    pairs = list(combinations(range(SOME), 2))
    overlap = [outlines[a].intersection(outlines[b]).area / outlines[a].union(outlines[b]).area for a, b in pairs]
    assert np.mean(np.array(overlap) > 0.95) < 0.02
    assert np.std([outline.area for outline in outlines]) > 0.15 * np.mean([outline.area for outline in outlines])


def quarter(yaw, reference):
    return round((yaw - reference) / (math.pi / 2.0)) % 4


@pytest.mark.parametrize("family", FAMILIES)
def test_doors_and_hoods_are_on_all_four_sides(family):
    doors, hoods = Counter(), Counter()
    for draw in drawn(family):
        main = exits(draw.floor)[0]
        doors.update(quarter(way.yaw, 0.0) for way in exits(draw.floor))
        if draw.style.hood_walls:
            wall = draw.floor.walls[draw.style.hood_walls[0].wall]
            hoods[quarter(wall.yaw, main.yaw)] += 1
    for counts in (doors, hoods):
        assert min(counts[k] for k in range(4)) >= 0.1 * sum(counts.values()), (family, counts)


def test_wings_of_refits_are_turned_by_3_to_15_degrees():
    angles = []
    for draw in drawn("refit"):
        (wing,) = [space for space in draw.floor.spaces if space.id == "wing"]
        angles.append(math.degrees(abs(wing.yaw)))
        oblique = [wall for wall in draw.floor.walls if abs(math.sin(2.0 * wall.yaw)) > 0.99]
        assert 1 <= len(oblique) <= 3, "chamfers run at 45 degrees"
    assert min(angles) >= 3.0
    assert max(angles) <= 15.0
    assert np.ptp(angles) > 9.0
    assert sum(bool(draw.floor.columns) for draw in drawn("refit")) > 0.9 * SEEDS


def test_bays_have_one_to_three_doors_and_sizes_from_small_to_large():
    counts = Counter(len(exits(draw.floor)) for draw in drawn("bay"))
    assert set(counts) == {1, 2, 3}
    areas = sorted(draw.parameters["area"] for draw in drawn("bay"))
    assert areas[SEEDS // 10] < 60.0
    assert areas[-SEEDS // 10] > 160.0


def test_ells_have_six_corners_and_every_orientation():
    notches = Counter()
    for draw in drawn("ell"):
        assert len(draw.floor.walls) == 6
        rooms = region(draw.floor.spaces[0])
        missing = rooms.envelope.difference(rooms).centroid
        notches[missing.x > rooms.envelope.centroid.x, missing.y > rooms.envelope.centroid.y] += 1
    assert min(notches.values()) >= 0.1 * SEEDS
    assert len(notches) == 4


def test_suites_have_two_to_eight_rooms_of_different_use_and_a_main_laboratory():
    counts, uses = Counter(), Counter()
    for draw in drawn("suite"):
        rooms = [space for space in draw.floor.spaces if space.use != "corridor"]
        counts[len(rooms)] += 1
        uses.update(space.use for space in rooms)
        areas = [(region(space).area, space.use == "laboratory") for space in rooms]
        assert max(area for area, main in areas if main) > max(areas)[0] - 1e-6
        for space in rooms:
            assert any({space.id, "corridor"} == set(way.spaces) for way in draw.floor.doorways)
    assert set(counts) == set(range(2, 9))
    assert set(uses) == {"laboratory", "instrument", "store", "write-up"}


def test_doubles_are_joined_by_doors_and_passages_with_and_without_glass():
    kinds, glazed = Counter(), Counter()
    for draw in drawn("double"):
        kinds.update(way.opening.kind for way in draw.floor.doorways if not way.exit)
        glazed[any(o.kind == "glazing" for wall in draw.floor.walls for o in wall.openings)] += 1
    assert min(kinds["door"], kinds["passage"]) > 0.3 * SEEDS
    assert min(glazed[True], glazed[False]) > 0.3 * SEEDS


def test_train_and_test_share_neither_families_nor_finishes():
    held_out = {"floors-test", "floors-sealed", "floors-fresh"}
    assert set(SPLITS) == {"floors-train", "floors-val", "floors-seen"} | held_out
    rooms = {split: (4, 8) if split in held_out else (2, 3) for split in SPLITS}
    finishes = {split: HELD_OUT if split in held_out else TRAINED for split in SPLITS}
    for split, populations in SPLITS.items():
        families = {"double", "refit"} if split in held_out else {"bay", "ell"}
        assert {population.family for population in populations} - {"suite"} == families
    absent = {None, "none"}
    for name in ("floor", "walls", "accent", "worktop", "fronts", "doors", "blinds"):
        assert not (set(TRAINED[name]) & set(HELD_OUT[name])) - absent
    for split in SPLITS:
        for seed in range(10):
            population = population_of(split, seed)
            draw = population.draw(seed)
            for space in draw.floor.spaces:
                for name, words in finishes[split].items():
                    assert getattr(space.finishes, name) in words
            if population.family == "suite":
                assert rooms[split][0] <= draw.parameters["rooms"] <= rooms[split][1]


def test_finishes_vary_from_seed_to_seed():
    for name, words in TRAINED.items():
        seen = {getattr(draw.floor.spaces[0].finishes, name) for draw in drawn("bay")}
        assert seen == set(words)


def test_ranges_can_be_replaced_and_what_is_no_range_is_refused_in_one_line():
    draw = draw_floor("bay", 5, width=7.0, depth=(8.0, 9.0))
    box = draw.floor.spaces[0].region[0]
    assert box.x1 == 7.0
    assert 8.0 <= box.y1 <= 9.0
    assert draw.parameters["ranges"] == {"depth": [8.0, 9.0], "width": [7.0, 7.0]}
    cases = [
        (("barn", 0), {}, UnknownNameError, "suite"),
        (("bay", -1), {}, OptionError, "seed"),
        (("bay", 0), {"wide": 3}, UnknownNameError, "width"),
        (("bay", 0), {"width": (9.0, 7.0)}, OptionError, "least"),
        (("bay", 0), {"width": "broad"}, OptionError, "width"),
        (("bay", 0), {"islands": ("fjord",)}, OptionError, "fjord"),
        (("suite", 0), {"floor_area": (1.0, 2.0)}, InfeasibleError, "widen the ranges"),
    ]
    for arguments, ranges, error, message in cases:
        with pytest.raises(error, match=message) as caught:
            draw_floor(*arguments, **ranges)
        assert "\n" not in str(caught.value)
