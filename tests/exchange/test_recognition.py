"""Floors that are recognized in maps with beams and furniture, and in drawings without layers, against their shapes."""

from __future__ import annotations

import json
import math
import runpy
from itertools import pairwise
from pathlib import Path

import ezdxf
import numpy as np
import pytest
import shapely
from PIL import Image, ImageDraw
from shapely import LineString, Polygon, box
from shapely.affinity import rotate

from labgym.cli import main
from labgym.errors import DocumentError, OptionError
from labgym.exchange.formats import read_floor
from labgym.exchange.recognition.overlay import overlay_png
from labgym.exchange.recognition.picture import Picture, closed, main_direction, opened
from labgym.exchange.recognition.proposal import Answers, recognize
from labgym.exchange.recognition.rooms import rooms_of
from labgym.exchange.ros_files import open_ros_map
from labgym.layouts import Layout

ROOMS = (box(0.0, 0.0, 5.0, 6.0), box(5.15, 0.0, 9.0, 6.0))
DOOR, EXIT = box(4.9, 2.5, 5.25, 3.4), box(1.5, -0.3, 2.5, 0.1)
CELL = 0.05


def scan(folder, degrees=0.0, door=DOOR, furniture=(), beams=True, image="map.pgm", gray=(0, 205, 254), rooms=ROOMS):
    """Write the map of rooms as a robot records it, turned about the origin; return map.yaml."""
    free = shapely.union_all([*rooms, door, EXIT])
    walls = free.buffer(0.12, join_style="mitre").difference(free.union(EXIT.buffer(0.5)))
    if beams:  # through a window in the upper wall
        rays = [LineString([(3.0, 5.0), (2.4 + 0.25 * k, 9.0)]).buffer(0.03) for k in range(8)]
        free = shapely.union_all([free, *rays])
        walls = walls.difference(shapely.union_all(rays))
    blocked = shapely.union_all(furniture)
    hidden = blocked.buffer(-0.06)
    free, walls, hidden = (
        rotate(each, degrees, (0.0, 0.0)) for each in (free.difference(blocked), walls.union(blocked), hidden)
    )
    x0, y0, x1, y1 = free.buffer(1.0).bounds
    x, y = np.meshgrid(np.arange(x0, x1, CELL) + CELL / 2.0, np.arange(y0, y1, CELL) + CELL / 2.0)
    values = np.full(x.shape, gray[1], dtype=np.uint8)
    values[shapely.contains_xy(free, x, y)] = gray[2]
    values[shapely.contains_xy(walls, x, y)] = gray[0]
    values[shapely.contains_xy(hidden, x, y)] = gray[1]
    folder.mkdir(exist_ok=True)
    Image.fromarray(values[::-1]).save(folder / "map.pgm")
    fields = f"image: {image}\nresolution: {CELL}\norigin: [{x0}, {y0}, 0.0]\nnegate: 0\n"
    (folder / "map.yaml").write_text(f"{fields}occupied_thresh: 0.65\nfree_thresh: 0.25\n")
    return folder / "map.yaml"


def in_file(proposal):
    """Return the rooms of a proposal in the frame of the file."""
    to_file = proposal.picture.to_file
    return [Polygon(to_file(np.array(room.exterior.coords))) for room in proposal.rooms.values()]


def overlap(first, second):
    return first.intersection(second).area / first.union(second).area


def lines(path, scale=1000.0, units=0, doors=True):
    """Write a drawing of two rooms by single lines on layer 0, with doors as leaf and arc; return its path."""
    drawing = ezdxf.new("R2010", units=units)
    model = drawing.modelspace()

    def line(*points):
        for a, b in pairwise(points):
            model.add_line([scale * value for value in a], [scale * value for value in b])

    line((1.5, 0), (0, 0), (0, 6), (9, 6), (9, 0), (2.4, 0))
    line((5, 0), (5, 2.5))
    line((5, 3.4), (5, 6))
    if doors:
        line((1.5, 0), (1.5, 0.9))
        model.add_arc((1.5 * scale, 0), 0.9 * scale, 0, 90)
        line((5, 2.5), (5.9, 2.5))
        model.add_arc((5 * scale, 2.5 * scale), 0.9 * scale, 0, 90)
    drawing.saveas(path)
    return path


@pytest.mark.parametrize("degrees", [0.0, 12.0, -33.0])
def test_a_turned_map_with_beams_and_furniture_is_two_rooms_with_a_door(tmp_path, degrees):
    furniture = (box(1.0, 1.0, 2.6, 1.8), box(7.0, 3.0, 8.0, 4.5))
    proposal = recognize(scan(tmp_path / "m", degrees, furniture=furniture))
    rooms = in_file(proposal)
    assert len(rooms) == 2
    for true in ROOMS:
        turned = rotate(true, degrees, (0.0, 0.0))
        assert max(overlap(turned, room) for room in rooms) > 0.95
    ways = {way.spaces for way in proposal.floor.doorways}
    assert any(set(spaces) == {"room_1", "room_2"} for spaces in ways)
    assert any(way.exit for way in proposal.floor.doorways)
    assert overlay_png(proposal).startswith(b"\x89PNG")


@pytest.mark.parametrize("degrees", [0.0, 12.0])
def test_a_partition_with_furniture_on_both_sides_is_a_wall_and_the_furniture_is_floor(tmp_path, degrees):
    furniture = (box(4.3, 0.0, 5.0, 2.2), box(4.4, 3.7, 5.0, 5.3), box(5.15, 0.3, 5.8, 1.9), box(5.15, 4.2, 5.7, 6.0))
    rooms = in_file(recognize(scan(tmp_path / "m", degrees, furniture=furniture)))
    assert len(rooms) == 2
    for true in ROOMS:
        assert max(overlap(rotate(true, degrees, (0.0, 0.0)), room) for room in rooms) > 0.93


@pytest.mark.parametrize("degrees", [0.0, 20.0])
def test_a_room_of_a_map_keeps_short_oblique_walls(tmp_path, degrees):
    octagon = box(0.0, 0.0, 6.0, 6.0)
    for x, y in ((0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0)):
        corner = Polygon([(x, y), (x + 0.8 * (1 if x < 3 else -1), y), (x, y + 0.8 * (1 if y < 3 else -1))])
        octagon = octagon.difference(corner)
    rooms = in_file(recognize(scan(tmp_path / "m", degrees, door=EXIT, beams=False, rooms=(octagon,))))
    assert [overlap(room, rotate(octagon, degrees, (0.0, 0.0))) > 0.96 for room in rooms] == [True]


def test_a_straight_wall_within_a_room_stays_and_a_row_of_seats_is_floor(tmp_path):
    angles = np.radians(np.arange(30.0, 151.0, 5.0))
    seats = LineString(np.column_stack([4.0 + 3.0 * np.cos(angles), 3.0 + 3.0 * np.sin(angles)])).buffer(0.08)
    wall = box(3.1, 2.0, 5.5, 2.2)
    path = scan(tmp_path / "m", door=EXIT, furniture=(seats, wall), beams=False, rooms=(box(0.0, 0.0, 8.0, 8.0),))
    (room,) = recognize(path).rooms.values()
    assert [overlap(Polygon(hole), wall) > 0.4 for hole in room.interiors] == [True]


def test_a_room_goes_on_behind_a_cupboard_that_hides_the_outer_wall():
    free, solid = np.zeros((2, 120, 120), dtype=bool)
    cupboard = np.s_[20:30, 50:65]
    solid[18:102, 18:102] = free[20:100, 20:100] = True
    solid[free] = free[cupboard] = False
    solid[20:30, [50, 64]] = solid[29, 50:65] = True  # its sides and front
    solid[18:20, 50:65] = False
    labels, _ = rooms_of(Picture(free, solid, np.zeros_like(free), CELL, 0.0, 0.0))
    assert (labels[20:100, 20:100] == 1).all()


def test_a_long_corridor_of_a_bent_map_is_slanted_and_not_drawn_along_the_main_direction(tmp_path):
    bent = rotate(box(0.0, -12.0, 1.8, 0.5), -3.0, (0.0, 0.0))
    corridor = box(0.0, 0.0, 14.0, 1.8).union(bent)
    path = scan(tmp_path / "m", door=box(1.5, 1.7, 2.5, 2.1), beams=False, rooms=(corridor,))
    assert [overlap(each, corridor) > 0.95 for each in in_file(recognize(path))] == [True]


def test_an_exit_that_is_seen_no_farther_than_the_wall_is_a_door(tmp_path):
    doors = recognize(scan(tmp_path / "m", beams=False)).floor.doorways
    assert [way.width for way in doors if way.exit] == pytest.approx([1.0], abs=0.15)


def plan(path, scale=0.02):
    """Draw a plan of two rooms of 26.88 and 20.16 m2 with thick walls, letters and a door's arc; return its path."""
    image = Image.new("L", (int(10.0 / scale), int(6.8 / scale)), 255)
    draw = ImageDraw.Draw(image)

    def filled(x0, y0, x1, y1):
        low = [round((value + 0.4) / scale) for value in (x0, y0)]
        draw.rectangle(low + [round((value + 0.4) / scale) - 1 for value in (x1, y1)], fill=0)

    for wall in ((0, 0, 9, 0.2), (0, 5.8, 9, 6), (0, 0, 0.2, 6), (8.8, 0, 9, 2.5), (8.8, 3.5, 9, 6), (5, 0, 5.2, 2.5)):
        filled(*wall)
    filled(5, 3.4, 5.2, 6)
    draw.text((100, 150), "Laboratory 1", fill=0)
    draw.arc([215, 145, 305, 235], 270, 360, fill=0)
    image.save(path)
    return path


def test_an_image_of_a_plan_is_read_with_a_scale_or_an_area(tmp_path):
    path = plan(tmp_path / "plan.png")
    for answers in (Answers(scale=0.02), Answers(area=26.88 + 20.16)):
        proposal = recognize(path, answers)
        areas = sorted(room.area for room in proposal.rooms.values())
        assert areas == pytest.approx([20.16, 26.88], rel=0.02)
        assert sorted(way.exit for way in proposal.floor.doorways) == [False, True]
    with pytest.raises(OptionError, match="--scale METERS_PER_PIXEL"):
        recognize(path)


def test_the_picture_of_a_proposal_does_not_replace_the_plan(tmp_path, capsys):
    path = plan(tmp_path / "plan.png")
    content = path.read_bytes()
    assert main(["outline", str(path), "--scale", "0.02", "--out", str(tmp_path / "plan.json"), "--overwrite"]) == 2
    assert "would replace plan.png: name another --out" in capsys.readouterr().err
    assert path.read_bytes() == content


def test_areas_of_furniture_and_rooms_that_are_none_are_answers(tmp_path):
    path = plan(tmp_path / "plan.png")
    answers = Answers(scale=0.02, furniture=((5.3, 0.5, 5.7, 6.2),))
    assert [room.area for room in recognize(path, answers).rooms.values()] == pytest.approx([48.2], rel=0.02)
    assert len(recognize(path, Answers(scale=0.02, merges=((0, 2),))).rooms) == 1


def test_furniture_tells_the_unit_of_a_drawing_that_names_another(tmp_path):
    lines(tmp_path / "a.dxf", scale=100.0, units=4, doors=False)  # centimeters that claim to be millimeters
    drawing = ezdxf.readfile(tmp_path / "a.dxf")
    for x in (150, 300, 600, 750):
        chair = [(x, 400), (x + 45, 400), (x + 45, 445), (x, 445)]
        drawing.modelspace().add_lwpolyline(chair, close=True, dxfattribs={"layer": "Chairs"})
    drawing.saveas(tmp_path / "a.dxf")
    areas = [room.area for room in recognize(tmp_path / "a.dxf").rooms.values()]
    assert sum(areas) == pytest.approx(54.0, rel=0.05)


def test_walls_and_windows_on_layers_of_their_own_are_read_together(tmp_path):
    lines(tmp_path / "a.dxf")
    drawing = ezdxf.readfile(tmp_path / "a.dxf")
    for line in drawing.modelspace().query("LINE"):
        line.dxf.layer = "WALL"
    window = [(6000, 5950), (7000, 5950), (7000, 6050), (6000, 6050)]
    drawing.modelspace().add_lwpolyline(window, close=True, dxfattribs={"layer": "GLAZ"})
    drawing.saveas(tmp_path / "a.dxf")
    assert len(recognize(tmp_path / "a.dxf").rooms) == 2


def test_a_floor_equals_its_own_gold_and_misses_the_area_of_another(tmp_path):
    path = plan(tmp_path / "plan.png")
    assert main(["outline", str(path), "--scale", "0.02", "--out", str(tmp_path / "floor.json")]) == 0
    rings = [[(0.6, 0.6), (5.4, 0.6), (5.4, 6.2), (0.6, 6.2)], [(5.6, 0.6), (9.2, 0.6), (9.2, 6.2), (5.6, 6.2)]]
    gold = {"rooms": [{"outer": ring} for ring in rings], "doors": [(5.5, 3.45), (0.5, 1.0)], "ignore": []}
    (tmp_path / "gold.json").write_text(json.dumps(gold))
    script = Path(__file__).parents[2] / "examples" / "floor_gold.py"
    score = runpy.run_path(str(script))["score"]
    result = score(tmp_path / "floor.json", tmp_path / "gold.json")
    assert min(result["outline"], *result["rooms"]) > 0.97
    assert (result["recognized"], result["doors"]) == (2, "1/2")
    gold["rooms"] = gold["rooms"][:1]
    (tmp_path / "gold.json").write_text(json.dumps(gold))
    assert score(tmp_path / "floor.json", tmp_path / "gold.json")["outline"] == pytest.approx(4.8 / 8.6, abs=0.03)


def test_a_wide_opening_between_walls_on_one_line_divides_rooms(tmp_path):
    proposal = recognize(scan(tmp_path / "m", door=box(4.9, 1.5, 5.25, 4.5)))
    assert len(proposal.rooms) == 2
    inner = [way for way in proposal.floor.doorways if not way.exit]
    assert [way.width for way in inner] == pytest.approx([3.0], abs=0.2)


def test_an_absolute_image_path_and_unknown_cells_below_the_threshold_are_read(tmp_path):
    path = scan(tmp_path / "m", image="/home/robot/maps/map.pgm")
    assert open_ros_map(path).free.mean() > 0.9, "map_server takes unknown cells for free with this threshold"
    grid = open_ros_map(path, lenient=True)
    assert 0.2 < grid.free.mean() < 0.8
    assert len(recognize(path).rooms) == 2


@pytest.mark.parametrize(("scale", "units"), [(1000.0, 0), (100.0, 0), (1.0, 6), (1000.0 / 25.4, 1)])
def test_single_lines_without_layers_are_rooms_in_the_unit_of_the_vote(tmp_path, scale, units):
    proposal = recognize(lines(tmp_path / "a.dxf", scale, units))
    rooms = in_file(proposal)
    assert len(rooms) == 2
    for true in (box(0, 0, 5, 6), box(5, 0, 9, 6)):
        assert max(overlap(true, room) for room in rooms) > 0.94
    doors = sorted((way.width, way.exit) for way in proposal.floor.doorways)
    assert [exits for _, exits in doors] in ([False, True], [True, False])
    assert [width for width, _ in doors] == pytest.approx([0.9, 0.9], abs=0.05)
    assert not any("door" in question for question in proposal.questions)


def test_doors_that_are_not_seen_are_proposed_and_answered(tmp_path):
    drawing = ezdxf.new("R2010", units=6)
    for room in ROOMS:
        drawing.modelspace().add_lwpolyline(list(room.exterior.coords), close=True)
    drawing.saveas(tmp_path / "a.dxf")
    proposal = recognize(tmp_path / "a.dxf")
    assert sum("--door" in question for question in proposal.questions) == 2
    answered = recognize(tmp_path / "a.dxf", Answers(doors=((2.0, 0.0), (5.05, 4.0))))
    assert not any("--door" in question for question in answered.questions)
    inner = next(way for way in answered.floor.doorways if not way.exit)
    x, y = answered.picture.to_file(np.array([(inner.x + answered.shift[0], inner.y + answered.shift[1])]))[0]
    assert math.dist((x, y), (5.075, 4.0)) < 0.1
    with pytest.raises(OptionError, match="--door 50,50"):
        recognize(tmp_path / "a.dxf", Answers(doors=((50.0, 50.0),)))


def test_rooms_are_split_merged_and_scaled_by_answers(tmp_path):
    path = lines(tmp_path / "a.dxf")
    assert len(recognize(path, Answers(splits=((0.0, 3.0, 5.0, 3.0),))).rooms) == 3
    merged = recognize(path, Answers(merges=((1, 2),)))
    assert len(merged.rooms) == 1
    assert next(iter(merged.rooms.values())).area == pytest.approx(54.0, rel=0.05)
    half = recognize(path, Answers(scale=0.0005, splits=()))
    assert sum(room.area for room in half.rooms.values()) == pytest.approx(54.0 / 4.0, rel=0.1)
    area = recognize(path, Answers(area=100.0))
    assert sum(room.area for room in area.rooms.values()) == pytest.approx(100.0, rel=0.05)


def test_layers_of_walls_are_an_answer_and_unknown_ones_are_listed(tmp_path):
    lines(tmp_path / "a.dxf")
    drawing = ezdxf.readfile(tmp_path / "a.dxf")
    drawing.modelspace().add_line((2500, 0), (2500, 6000), {"layer": "SHELF"})
    drawing.saveas(tmp_path / "a.dxf")
    assert len(recognize(tmp_path / "a.dxf", Answers(layers=("0",))).rooms) == 2
    with pytest.raises(DocumentError, match="SHELF"):
        recognize(tmp_path / "a.dxf", Answers(layers=("WALLS",)))


def test_a_run_with_saved_answers_gives_the_same_files(tmp_path, capsys):
    path = lines(tmp_path / "a.dxf")
    words = ["outline", str(path), "--split=0,3,5,3", "--door=1,3", "--out"]
    assert main([*words, str(tmp_path / "one.json")]) == 0
    again = ["--answers", str(tmp_path / "one.answers.json"), "--out", str(tmp_path / "two.json")]
    assert main(["outline", str(path), *again]) == 0
    for suffix in (".json", ".png", ".answers.json"):
        assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()
    assert len(Layout.load(tmp_path / "two.json").floor.spaces) == 3
    capsys.readouterr()
    assert main([*words, str(tmp_path / "one.json"), "--merge=1,2"]) == 2
    assert "--overwrite" in capsys.readouterr().err


def test_a_file_that_is_read_exactly_is_not_recognized(tmp_path, capsys):
    drawing = ezdxf.new("R2010", units=6)
    drawing.layers.add("A-AREA")
    drawing.modelspace().add_lwpolyline([(0, 0), (8, 0), (8, 6), (0, 6)], close=True, dxfattribs={"layer": "A-AREA"})
    drawing.layers.add("A-DOOR")
    drawing.modelspace().add_arc((2, 0), 1.0, 0, 90, {"layer": "A-DOOR"})
    drawing.saveas(tmp_path / "a.dxf")
    assert main(["outline", str(tmp_path / "a.dxf"), "--out", str(tmp_path / "o.json")]) == 0
    assert "recognized" not in capsys.readouterr().err
    assert not (tmp_path / "o.png").exists()


@pytest.mark.parametrize("options", [[], ["--scale", "0.02"]])
@pytest.mark.parametrize("name", ["none.png", "none.dxf"])
def test_a_missing_file_is_named(tmp_path, capsys, name, options):
    assert main(["outline", str(tmp_path / name), *options, "--out", str(tmp_path / "o.json")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"{name}: no such file" in error


@pytest.mark.parametrize("kind", ["empty", "noise", "text"])
def test_a_file_without_rooms_is_one_line(tmp_path, capsys, kind):
    if kind == "text":
        path = tmp_path / "a.dxf"
        path.write_text("no drawing")
    else:
        path = scan(tmp_path / "m")
        shape = (80, 90)
        noise = np.random.default_rng(1).choice(np.array([0, 205, 254], dtype=np.uint8), shape)
        Image.fromarray(noise if kind == "noise" else np.full(shape, 205, np.uint8)).save(tmp_path / "m" / "map.pgm")
    assert main(["outline", str(path), "--out", str(tmp_path / "o.json")]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_dwg_is_to_be_saved_as_dxf(tmp_path):
    with pytest.raises(OptionError, match="save it as DXF"):
        read_floor(tmp_path / "plan.dwg")


@pytest.mark.parametrize("degrees", [0.0, 3.0, -20.0, 44.0])
def test_the_main_direction_is_that_of_a_turned_rectangle(degrees):
    ring = rotate(box(0, 0, 9, 5), degrees, (0, 0)).exterior
    points = shapely.get_coordinates(shapely.line_interpolate_point(ring, np.arange(0.0, ring.length, 0.05)))
    cells = np.floor(points / 0.05) * 0.05  # steps of cells
    assert math.degrees(main_direction(cells, 0.05)) == pytest.approx(degrees, abs=0.25)


@pytest.mark.parametrize("size", [2, 3, 4])
def test_opening_covers_what_squares_within_cover(size):
    mask = np.random.default_rng(0).random((40, 50)) < 0.8
    covered = np.zeros_like(mask)
    for row in range(41 - size):
        for column in range(51 - size):
            if mask[row : row + size, column : column + size].all():
                covered[row : row + size, column : column + size] = True
    assert (opened(mask, size) == covered).all()
    assert not (mask & ~closed(mask, size)).any()
