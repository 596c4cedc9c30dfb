"""Dimensioned plans: true scale, right lengths, all ids, equal bytes."""

from __future__ import annotations

import math
import re

import pytest
from laboratories import island_laboratory
from shapely import LineString, Polygon

from exchange.floors import FLOORS, ell, rectangle, suite
from labgym.errors import OptionError
from labgym.exchange.dimensions import aisles, sides, widths
from labgym.exchange.formats import empty_layout
from labgym.exchange.plan import draw_plan, write_plan
from labgym.exchange.plan_sheet import sheet_for
from labgym.layouts import load_published, published
from labgym.layouts.floors import draw_floor

POINTS_PER_METER = 72.0 / 0.0254


@pytest.mark.parametrize("name", FLOORS)
def test_a_meter_on_paper_has_the_scale_that_the_sheet_names(name):
    figure = draw_plan(empty_layout(FLOORS[name]()))
    axes = next(each for each in figure.axes if each.get_label() == "plan")
    texts = [text.get_text() for each in figure.axes for text in each.texts]
    scale, paper = next(re.match(r"1:(\d+) on (A\d)$", text) for text in texts if text.startswith("1:")).groups()
    x, y = axes.transData.transform([(0.0, 0.0), (1.0, 1.0)])[1] - axes.transData.transform((0.0, 0.0))
    expected = POINTS_PER_METER / int(scale) * figure.dpi / 72.0
    assert (x, y) == pytest.approx((expected, expected))
    sizes = {"A3": (420, 297), "A2": (594, 420), "A1": (841, 594), "A0": (1189, 841)}
    assert tuple(figure.get_size_inches() * 25.4) == pytest.approx(sizes[paper])


def test_a_floor_that_fits_no_paper_is_refused():
    with pytest.raises(OptionError, match="fits no sheet"):
        sheet_for(300.0, 20.0)


def test_outer_sides_are_measured_between_the_walls():
    assert sorted(round(side.length, 6) for side in sides(rectangle())) == [7.0, 13.0]
    assert sorted(round(side.length, 6) for side in sides(ell())) == [3.5, 3.5, 4.5, 5.5, 8.0, 9.0]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("family", ["suite", "refit", "double"])
def test_dimension_lines_of_outer_sides_cross_no_space(family, seed):
    floor = draw_floor(family, seed).floor
    spaces = [Polygon(box.corners()) for space in floor.spaces for box in space.boxes]
    lines = [LineString(side.line) for side in sides(floor)]
    assert lines
    assert all(line.intersection(space).length < 1e-6 for line in lines for space in spaces)


def test_every_opening_has_its_clear_width():
    floor = suite()
    expected = sorted(opening.width for wall in floor.walls for opening in wall.openings)
    assert sorted(round(each.length, 6) for each in widths(floor)) == expected


@pytest.mark.parametrize("name", published("test")[::6])
def test_an_aisle_is_free_and_ends_at_solids(name):
    layout = load_published("test", name)
    boxes = {
        placement.id: Polygon(layout.box(placement.id).corners())
        for placement in layout.placements
        if placement.support == "floor" and layout.asset(placement.id).subtype != "seat"
    }
    walls = [Polygon(wall.box.corners()) for wall in layout.floor.walls]
    for aisle in aisles(layout):
        line = LineString((aisle.start, aisle.end))
        assert all(line.intersection(area).length < 1e-6 for area in (*boxes.values(), *walls))
        for end in (aisle.start, aisle.end):
            point = Polygon([(end[0] + dx, end[1] + dy) for dx, dy in ((-1e-6, 0), (1e-6, 0), (0, 1e-6))])
            assert min(point.distance(area) for area in (*boxes.values(), *walls)) < 1e-5
        assert 0.5 <= aisle.length <= 3.0


def test_the_aisles_around_an_island_are_the_gaps_of_its_boxes():
    layout = island_laboratory()
    bounds = {placement.id: layout.box(placement.id).bounds() for placement in layout.placements}
    island = bounds["IslandBench1800_1"]
    gaps = {island[0] - bounds["PreparationBench_1"][2], bounds["ValidationPlatform_1"][0] - island[2], island[1]}
    lengths = [aisle.length for aisle in aisles(layout)]
    assert all(min(abs(length - gap) for length in lengths) < 1e-6 for gap in gaps if 0.5 <= gap < 3.0)


def test_every_piece_of_furniture_is_named(tmp_path):
    layout = load_published("test", published("test")[0])
    texts = [text.get_text() for axes in draw_plan(layout).axes for text in axes.texts]
    joined = {text.replace("\n", "") for text in texts}
    furniture = {placement.id for placement in layout.placements if placement.support == "floor"}
    assert furniture <= joined


def test_equal_layouts_give_equal_bytes(tmp_path):
    for suffix in ("pdf", "svg"):
        first, second = (write_plan(island_laboratory(), tmp_path / f"{name}.{suffix}") for name in "ab")
        assert first.read_bytes() == second.read_bytes()
    with pytest.raises(OptionError, match=r"\.pdf or \.svg"):
        write_plan(island_laboratory(), tmp_path / "plan.dwg")
    assert math.isclose(sheet_for(8.0, 8.0).length(1.0), 1000.0 / sheet_for(8.0, 8.0).scale)
