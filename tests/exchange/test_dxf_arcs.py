"""Curved walls of drawings: chords near the arcs, rooms of the right area, and refusals in one line."""

import math
from itertools import pairwise

import ezdxf
import pytest
from shapely import Point, Polygon, unary_union

from labgym.errors import DocumentError
from labgym.exchange.dxf.arcs import Arc, flattened
from labgym.exchange.formats import read_floor


def drawing(tmp_path, draw):
    document = ezdxf.new("R2010", units=6)
    draw(document.modelspace())
    path = tmp_path / "plan.dxf"
    document.saveas(path)
    return path


def door(model, x, y):
    """A door of 1 m in the wall below y = 0, hinged at x."""
    model.add_arc((x, y), 1.0, 0.0, 90.0, dxfattribs={"layer": "A-DOOR"})


def shell(model, curved: str) -> None:
    """A room of 8 x 5 m whose right side is half of a circle of 2.5 m; walls of 0.2 m outside."""
    wall, r = {"layer": "A-WALL"}, 2.5
    for a, b in (((-0.2, -0.1), (2.0, -0.1)), ((3.0, -0.1), (8.0, -0.1)), ((8.0, 5.1), (-0.2, 5.1))):
        model.add_lwpolyline([a, b], dxfattribs={**wall, "const_width": 0.2})
    model.add_lwpolyline([(-0.1, 5.2), (-0.1, -0.2)], dxfattribs={**wall, "const_width": 0.2})
    if curved == "arcs":
        for radius in (r, r + 0.2):
            model.add_arc((8.0, 2.5), radius, -90.0, 90.0, dxfattribs=wall)
    elif curved == "wide":
        model.add_lwpolyline([(8.0, -0.1, 1.0), (8.0, 5.1, 0.0)], format="xyb", dxfattribs={**wall, "const_width": 0.2})
    elif curved == "outline":
        outline = [(8.0, 0.0, 1.0), (8.0, 5.0, 0.0), (8.0, 5.2, -1.0), (8.0, -0.2, 0.0)]
        model.add_lwpolyline(outline, format="xyb", close=True, dxfattribs=wall)
    else:
        model.add_arc((8.0, 2.5), r, -90.0, 90.0, dxfattribs=wall)
    door(model, 2.0, 0.0)


@pytest.mark.parametrize("curved", ["arcs", "wide", "outline"])
def test_a_room_with_a_round_end_has_the_area_of_the_circle(tmp_path, curved):
    floor = read_floor(drawing(tmp_path, lambda model: shell(model, curved)))
    (space,) = floor.spaces
    exact = Polygon([(0, 0), (8, 0), (8, 5), (0, 5)]).union(Point(8.0, 2.5).buffer(2.5, quad_segs=200))
    region = unary_union([Polygon(box.corners()) for box in space.boxes])
    assert region.difference(exact.buffer(0.02)).area < 1e-6
    assert region.area > 0.97 * exact.area
    assert [way.exit for way in floor.doorways] == [True]
    ring = Point(8.0, 2.5).buffer(2.7, quad_segs=200).difference(Point(8.0, 2.5).buffer(2.5, quad_segs=200))
    curve = [wall for wall in floor.walls if abs(math.sin(2.0 * wall.yaw)) > 1e-3]
    assert 5 < len(curve) < 60
    for wall in curve:
        faces = [wall.point(share * wall.length, side) for share in (0.0, 0.5, 1.0) for side in (-0.1, 0.1)]
        assert all(ring.buffer(0.011).covers(Point(point)) for point in faces)


def test_a_single_arc_of_a_wall_is_refused_in_one_line(tmp_path):
    with pytest.raises(DocumentError, match=r"no concentric arc within 0.6 m: draw both faces") as caught:
        read_floor(drawing(tmp_path, lambda model: shell(model, "single")))
    assert "\n" not in str(caught.value)


def test_the_rounding_of_a_corner_is_left_out(tmp_path):
    def draw(model):
        shell(model, "arcs")
        model.add_arc((0.3, 0.3), 0.3, 180.0, 270.0, dxfattribs={"layer": "A-WALL"})

    assert len(read_floor(drawing(tmp_path, draw)).spaces) == 1


@pytest.mark.parametrize("bulge", [0.1, -0.3, 1.0, -2.5])
def test_chords_lie_within_a_centimeter_of_the_arc_that_ezdxf_draws(bulge):
    from ezdxf.math import bulge_center, bulge_radius

    a, b = (1.0, 2.0), (3.0, 1.0)
    arc = Arc.of_bulge(a, b, bulge)
    assert arc.center == pytest.approx(tuple(bulge_center(a, b, bulge))[:2])
    assert arc.radius == pytest.approx(bulge_radius(a, b, bulge))
    points = flattened([a, b], [bulge, 0.0], closed=False)
    assert (points[0], points[-1]) == (a, b)
    for one, other in pairwise(points):
        middle = ((one[0] + other[0]) / 2.0, (one[1] + other[1]) / 2.0)
        assert 0.0 <= arc.radius - math.dist(middle, arc.center) <= 0.01 + 1e-9
        assert math.dist(one, arc.center) == pytest.approx(arc.radius)
