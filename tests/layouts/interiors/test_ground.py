"""What a space offers to furniture, checked by polygons."""

import math

import numpy as np
import pytest
from shapely import LineString, Point, Polygon, box, unary_union

from labgym.geometry import OrientedBox
from labgym.layouts.floor import Floor, Opening, Room, Wall
from labgym.layouts.floors import draw_floor
from labgym.layouts.ground import Ground, without
from labgym.layouts.ground.ground import Span, missing, outline
from labgym.layouts.interiors.lattice import Lattice
from labgym.layouts.interiors.standing import strips


def polygon(each: OrientedBox) -> Polygon:
    return Polygon(each.corners())


@pytest.mark.parametrize("seed", range(20))
def test_the_outline_of_a_union_is_its_boundary(seed):
    generator = np.random.default_rng(seed)
    corners = np.round(generator.uniform(0.0, 6.0, (6, 2)), 1)
    sides = np.round(generator.uniform(0.5, 5.0, (6, 2)), 1)
    spans = [Span(x, y, x + w, y + d) for (x, y), (w, d) in zip(corners.tolist(), sides.tolist(), strict=True)]
    union = unary_union([box(*span) for span in spans])
    edges = outline(spans)
    lines = [LineString([(e.x, e.y), (e.x + e.dx * e.length, e.y + e.dy * e.length)]) for e in edges]
    assert sum(line.length for line in lines) == pytest.approx(union.boundary.length)
    assert all(line.difference(union.boundary.buffer(1e-6)).is_empty for line in lines)
    for edge in edges:
        middle = (edge.x + edge.dx * edge.length / 2.0, edge.y + edge.dy * edge.length / 2.0)
        assert union.contains(Point(middle[0] - 0.02 * edge.dy, middle[1] + 0.02 * edge.dx))
    bounds = box(*union.bounds)
    holes = [box(*span) for span in missing(spans)]
    assert sum(hole.area for hole in holes) == pytest.approx(bounds.area - union.area)
    assert all(hole.intersection(union).area < 1e-9 for hole in holes)


def test_the_segments_of_a_room_are_its_four_walls_without_doors_and_high_objects_before_windows():
    floor = Room(width=6.0, depth=5.0).floor
    right = next(wall for wall in floor.walls if wall.start[0] > 6.0)
    window = Opening(kind="window", position=2.0, width=1.0, height=1.2, sill=0.9)
    walls = tuple(wall if wall is not right else Wall(**{**dict(right), "openings": (window,)}) for wall in floor.walls)
    ground = Ground.of(Floor(walls=walls, spaces=floor.spaces), floor.spaces[0])
    assert sorted(segment.length for segment in ground.segments) == [5.0, 5.0, 6.0, 6.0]
    by_yaw = {round(math.degrees(segment.yaw)): segment for segment in ground.segments}
    front, side = by_yaw[0], by_yaw[90]
    assert front.point(0.0) == (0.0, 0.0)
    taken = 6.0 - sum(high - low for low, high in front.free(0.9))
    assert 1.0 <= taken <= 1.2
    assert sum(high - low for low, high in side.free(0.9)) == pytest.approx(5.0)
    assert sum(high - low for low, high in side.free(1.8)) == pytest.approx(4.0)


@pytest.mark.parametrize("family", ["ell", "double", "suite", "refit"])
def test_furniture_against_a_segment_stands_in_its_space_with_its_back_to_a_wall(family):
    draw = draw_floor(family, 5)
    walls = unary_union([polygon(each) for each in draw.floor.wall_boxes])
    for space in draw.floor.spaces:
        ground = Ground.of(draw.floor, space)
        region = unary_union([polygon(each) for each in space.boxes])
        assert ground.area == pytest.approx(region.area)
        for segment in ground.segments:
            for low, high in segment.free(0.9):
                if high - low < 0.5:
                    continue
                foot = segment.box((low + high) / 2.0 - 0.1, 0.06, 0.2, 0.1)
                x, y, yaw = ground.to_floor((foot.x, foot.y, foot.yaw))
                placed = polygon(OrientedBox(x, y, foot.width, foot.depth, yaw))
                assert region.buffer(0.01).covers(placed)
                assert placed.intersection(walls).area < 1e-9
                assert placed.distance(walls) < 0.07


def test_an_interval_without_others_is_what_they_leave():
    assert without((0.0, 10.0), [(8.0, 12.0), (1.0, 3.0), (2.0, 4.0)]) == [(0.0, 1.0), (4.0, 8.0)]
    assert without((0.0, 1.0), [(-1.0, 2.0)]) == []


@pytest.mark.parametrize("yaw", [0.1, 0.7, 1.5, 2.9, -0.4])
def test_the_strips_of_an_oblique_box_cover_it_closely(yaw):
    each = OrientedBox(1.0, 2.0, 3.0, 0.7, yaw)
    cover = unary_union([box(*row) for row in strips([each]).tolist()])
    assert cover.buffer(1e-9).covers(polygon(each))
    assert cover.difference(polygon(each).buffer(0.35)).is_empty


@pytest.mark.parametrize("seed", range(10))
def test_a_rectangle_stands_in_the_open_only_where_its_gaps_are_free(seed):
    generator = np.random.default_rng(seed)
    lattice = Lattice(6.0, 5.0)
    corners = generator.uniform(0.0, 4.0, (4, 2))
    solid = np.hstack([corners, corners + generator.uniform(0.2, 1.0, (4, 2))])
    free = np.array([[2.0, 2.0, 3.5, 2.5]])
    lattice.add(solid, free)
    shapes, zone = [box(*row) for row in solid.tolist()], box(*free[0])
    places = lattice.corners(1.03, 0.6, (0.4, 0.7))
    for x, y in places[:: max(1, len(places) // 50)].tolist():
        foot, aisle = box(x, y, x + 1.03, y + 0.6), box(x - 0.4, y - 0.7, x + 1.43, y + 1.3)
        assert box(0, 0, 6, 5).buffer(1e-6).covers(aisle)
        assert all(aisle.intersection(shape).area < 1e-9 for shape in shapes)
        assert foot.intersection(zone).area < 1e-9
