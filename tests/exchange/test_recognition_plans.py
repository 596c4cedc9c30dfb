"""Rooms that answers draw, exits and doors of plans, pages of PDF files, and regions with oblique sides."""

from __future__ import annotations

import math

import numpy as np
import pytest
from PIL import Image, ImageDraw
from shapely import Polygon, box

from labgym.cli import main
from labgym.errors import DocumentError, OptionError
from labgym.exchange.recognition.proposal import PASSABLE, Answers, recognize
from labgym.exchange.regions import MOST, region_of
from labgym.exchange.structure import outline
from labgym.layouts.floor import Space

PIXEL = 0.02


def bars(exit_width=1.0, door_width=0.9):
    """Return the walls of two rooms in 9 x 6 m as rectangles x0, y0, x1, y1, meters."""
    door, way = 2.5 + door_width, 2.5 + exit_width
    outer = [(0, 0, 9, 0.2), (0, 5.8, 9, 6), (0, 0, 0.2, 6), (8.8, 0, 9, 2.5), (8.8, way, 9, 6)]
    return [*outer, (5, 0, 5.2, 2.5), (5, door, 5.2, 6)]


def drawn(path, **widths):
    image = Image.new("L", (490, 340), 255)
    for bar in bars(**widths):
        x0, y0, x1, y1 = (20 + round(value / PIXEL) for value in bar)
        ImageDraw.Draw(image).rectangle([x0, y0, x1 - 1, y1 - 1], fill=0)
    image.save(path)
    return path


def page(path, points_per_meter):
    """Write the walls as a PDF file by hand, with a corner at 36 points."""
    body = "".join(
        f"{36 + x0 * points_per_meter:.3f} {36 + y0 * points_per_meter:.3f} "
        f"{(x1 - x0) * points_per_meter:.3f} {(y1 - y0) * points_per_meter:.3f} re f\n"
        for x0, y0, x1, y1 in bars()
    )
    media = f"[0 0 {72 + 9 * points_per_meter:.0f} {72 + 6 * points_per_meter:.0f}]"
    objects = [
        "<< /Type /Catalog /Pages 2 0 R >>",
        "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
        f"<< /Type /Page /Parent 2 0 R /MediaBox {media} /Contents 4 0 R >>",
        f"<< /Length {len(body)} >>\nstream\n{body}endstream",
    ]
    text, places = "%PDF-1.4\n", []
    for number, content in enumerate(objects, start=1):
        places.append(len(text))
        text += f"{number} 0 obj\n{content}\nendobj\n"
    table = "".join(f"{place:010d} 00000 n \n" for place in places)
    start = len(text)
    text += f"xref\n0 5\n0000000000 65535 f \n{table}trailer << /Size 5 /Root 1 0 R >>\nstartxref\n{start}\n%%EOF\n"
    path.write_text(text)
    return path


def in_file(proposal):
    return [Polygon(proposal.picture.to_file(np.array(room.exterior.coords))) for room in proposal.rooms.values()]


def test_an_outline_replaces_the_rooms_in_it_and_bounds_the_others(tmp_path):
    path = drawn(tmp_path / "plan.png")
    corners = ((0.6, 0.6), (3.0, 0.6), (5.4, 3.0), (5.4, 6.2), (0.6, 6.2))
    rooms = in_file(recognize(path, Answers(scale=PIXEL, outlines=(corners,))))
    assert len(rooms) == 2
    stated = max(rooms, key=lambda room: room.intersection(Polygon(corners)).area)
    assert stated.symmetric_difference(Polygon(corners)).area < 0.1
    both = recognize(path, Answers(scale=PIXEL, outlines=(((0.6, 0.6), (9.2, 0.6), (9.2, 6.2), (0.6, 6.2)),)))
    assert in_file(both)[0].area == pytest.approx(8.6 * 5.6, rel=0.01)
    assert len(both.rooms) == 1


@pytest.mark.parametrize("text", ["1,1,2,2", "1,1,2,2,3", "1,1,3,3,3,1,1,3", "40,40,42,40,42,42"])
def test_an_outline_that_is_none_is_refused_in_one_line(tmp_path, capsys, text):
    path = drawn(tmp_path / "plan.png")
    out = str(tmp_path / "floor.json")
    assert main(["outline", str(path), "--scale", "0.02", f"--outline={text}", "--out", out]) == 2
    message = capsys.readouterr().err.strip()
    assert "--outline" in message
    assert "\n" not in message


@pytest.mark.parametrize("width", [0.8, 1.6, 2.4])
def test_an_opening_in_an_outer_wall_is_the_exit(tmp_path, width):
    proposal = recognize(drawn(tmp_path / "plan.png", exit_width=width), Answers(scale=PIXEL))
    assert not proposal.questions
    (way,) = [way for way in proposal.floor.doorways if way.exit]
    assert way.width == pytest.approx(width, abs=0.15)
    assert way.x + proposal.shift[0] == pytest.approx(9.3, abs=0.3)


def test_a_door_that_may_be_wide_enough_for_the_robot_is_and_a_narrower_one_stays(tmp_path):
    proposal = recognize(drawn(tmp_path / "plan.png", door_width=0.70), Answers(scale=PIXEL))
    inner = next(way for way in proposal.floor.doorways if not way.exit)
    assert inner.width == pytest.approx(PASSABLE, abs=1e-3)
    assert any("0.72 m wide" in question for question in proposal.questions)
    narrow = recognize(drawn(tmp_path / "narrow.png", door_width=0.64), Answers(scale=PIXEL))
    assert next(way for way in narrow.floor.doorways if not way.exit).width < 0.66


def test_a_page_is_read_at_its_scale_or_by_its_area(tmp_path):
    path = page(tmp_path / "plan.pdf", 72.0 / 0.0254 / 50.0)
    for answers in (Answers(scale=0.0254 / 72.0 * 50.0), Answers(area=26.88 + 20.16)):
        proposal = recognize(path, answers)
        areas = sorted(room.area for room in proposal.rooms.values())
        assert areas == pytest.approx([20.16, 26.88], rel=0.03)
        assert proposal.floor.origin[:2] == pytest.approx((36 * 0.0254 / 72.0 * 50.0 + 0.2,) * 2, abs=0.05)
    with pytest.raises(OptionError, match="METERS_PER_POINT"):
        recognize(path)
    (tmp_path / "bad.pdf").write_bytes(path.read_bytes()[:200])
    with pytest.raises(DocumentError, match="PDF"):
        recognize(tmp_path / "bad.pdf", answers)


def test_a_region_with_many_oblique_sides_keeps_its_area():
    ring = [
        (8 * np.cos(t) * r, 8 * np.sin(t) * r) for t, r in zip(np.arange(12) * np.pi / 6, [1, 0.8] * 6, strict=True)
    ]
    star = Polygon(ring).union(box(0, -1.5, 14, 1.5))
    (x, y, yaw), rectangles = region_of(star)
    assert len(rectangles) <= MOST
    area = outline(Space(id="a", x=x, y=y, yaw=yaw, region=rectangles, ceiling=3.0))
    assert area.area > 0.95 * star.area
    assert area.difference(star.buffer(1e-3)).area < 1e-3


def faces(path, door, y=6.0):
    """Draw two rooms with both faces of their walls, 0.2 m apart, and a door 0.9 m wide between them."""
    ezdxf = pytest.importorskip("ezdxf")
    drawing = ezdxf.new("R2010", units=6)
    model = drawing.modelspace()
    for ring in (box(0, 0, 9, y), box(-0.2, -0.2, 9.2, y + 0.2)):
        model.add_lwpolyline(list(ring.exterior.coords), close=True, dxfattribs={"layer": "WALL"})
    for low, high in ((0.0, 0.7), (0.7, 1.6), (1.6, y)):  # with thresholds
        model.add_lwpolyline(list(box(5.0, low, 5.2, high).exterior.coords), close=True, dxfattribs={"layer": "WALL"})
    quarter = [(5.0 + 0.9 * math.sin(a), 0.7 + 0.9 * math.cos(a)) for a in np.linspace(0.0, math.pi / 2.0, 9)]
    if door == "spline":
        model.add_spline([(*point, 0.0) for point in quarter], dxfattribs={"layer": "Furniture"})
    elif door == "polyline with its leaf":
        model.add_lwpolyline([*quarter, (5.0, 0.7)], dxfattribs={"layer": "0"})
    elif door == "rectangle in a wall":
        ring = list(box(5.05, 0.7, 5.15, 1.6).exterior.coords)
        drawing.blocks.new("DOOR-SINGLE").add_lwpolyline(ring, close=True)
        model.add_blockref("DOOR-SINGLE", (0.0, 0.0))
    drawing.saveas(path)
    return path


@pytest.mark.parametrize("door", ["spline", "polyline with its leaf", "rectangle in a wall"])
def test_doors_are_found_however_they_are_drawn(tmp_path, door):
    proposal = recognize(faces(tmp_path / "plan.dxf", door))
    assert sorted(room.area for room in in_file(proposal)) == pytest.approx([3.8 * 6.0, 30.0], rel=0.03)
    (inner,) = [way for way in proposal.floor.doorways if not way.exit]
    x, y = proposal.floor.origin[0] + inner.x, proposal.floor.origin[1] + inner.y
    assert (x, y, inner.width) == pytest.approx((5.1, 1.15, 0.9), abs=0.1)


@pytest.mark.parametrize("y", [5.96, 5.97, 6.0])
def test_a_wall_of_lines_is_closed_wherever_the_cells_lie(tmp_path, y):
    proposal = recognize(faces(tmp_path / "plan.dxf", "spline", y))
    assert [way.width for way in proposal.floor.doorways if way.exit] == pytest.approx([1.0], abs=1e-3)
    assert sum("no exit" in question for question in proposal.questions) == 1
