"""DXF: floors survive the round trip, the auditor accepts drawings, foreign drawings are read, hostile ones refused."""

from __future__ import annotations

import math
import re

import ezdxf
import pytest
from laboratories import island_laboratory, put
from shapely import Polygon

from exchange.floors import FLOORS, differences, rectangle, region
from labgym.cli import main
from labgym.errors import DocumentError, LabgymError, OptionError
from labgym.exchange.dxf.reading import read_dxf
from labgym.exchange.dxf.writing import write_dxf
from labgym.exchange.formats import empty_layout
from labgym.geometry import to_world
from labgym.layouts import Layout, load_published, published
from labgym.layouts.floors import FAMILIES, draw_floor


@pytest.mark.parametrize("name", FLOORS)
def test_a_floor_survives_the_round_trip_to_a_millimeter(name, tmp_path):
    floor = FLOORS[name]()
    path = write_dxf(empty_layout(floor), tmp_path / "plan.dxf")
    again = read_dxf(path)
    assert differences(floor, again) == []
    assert (again.as_room is None) == (floor.as_room is None)


@pytest.mark.cases(5)
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", [1, 5, 8])
def test_floors_of_every_family_survive_it(family, seed, tmp_path):
    floor = draw_floor(family, seed).floor
    assert differences(floor, read_dxf(write_dxf(empty_layout(floor), tmp_path / "plan.dxf"))) == []


@pytest.mark.parametrize("name", FLOORS)
def test_a_floor_from_a_file_is_drawn_in_the_frame_of_the_file_and_read_back(name, tmp_path):
    origin = (432_100.5, -73.25, 0.6)
    floor = FLOORS[name]().model_copy(update={"origin": origin})
    path = write_dxf(empty_layout(floor), tmp_path / "plan.dxf")
    again = read_dxf(path)
    assert differences(floor, again) == []
    assert again.origin == origin
    (first, *_) = ezdxf.readfile(path).modelspace().query("LWPOLYLINE[layer=='A-AREA']")
    corner = Polygon([to_world([point], origin)[0] for point in region(floor.spaces[0]).exterior.coords])
    assert corner.hausdorff_distance(Polygon([(x, y) for x, y, *_ in first.get_points()])) < 1e-3


@pytest.mark.parametrize("split", ["val", "test"])
def test_published_floors_come_back_exactly(split, tmp_path):
    for name in published(split)[::10]:
        layout = load_published(split, name)
        again = read_dxf(write_dxf(layout, tmp_path / "plan.dxf"))
        assert again.room == layout.room.model_copy(update={"name": "plan"})


@pytest.mark.parametrize("layout", [island_laboratory(), *(empty_layout(floor()) for floor in FLOORS.values())])
def test_the_auditor_of_ezdxf_finds_no_fault(layout, tmp_path):
    drawing = ezdxf.readfile(write_dxf(layout, tmp_path / "plan.dxf"))
    auditor = drawing.audit()
    assert [error.message for error in (*auditor.errors, *auditor.fixes)] == []
    assert drawing.header["$INSUNITS"] == 6


def test_every_visible_object_is_a_block_where_it_stands(tmp_path):
    layout = island_laboratory()
    surface = layout.surface("IslandBench1800_1", 0)
    flask = put("Beaker_1", "Beaker", surface.x + 0.3, surface.y, surface.z0, on="IslandBench1800_1", slot=0)
    layout = layout.replace(placements=(*layout.placements, flask))
    model = ezdxf.readfile(write_dxf(layout, tmp_path / "plan.dxf")).modelspace()
    inserts = model.query('INSERT[layer=="A-FURN" | layer=="A-EQPM"]')
    blocks = {insert.get_attrib_text("ID"): insert for insert in inserts}
    assert blocks.keys() == layout.by_id.keys()
    for name, insert in blocks.items():
        placement = layout.placement(name)
        assert insert.dxf.insert.isclose((*placement.position[:2], 0.0))
        assert math.radians(insert.dxf.rotation) == pytest.approx(placement.yaw)
        size, corners = layout.asset(name).size, [e for e in insert.virtual_entities() if e.dxftype() == "LWPOLYLINE"]
        xs, ys = zip(*((x, y) for x, y, *_ in corners[0].get_points()), strict=True)
        turned = abs(math.sin(placement.yaw)) > 0.5
        assert max(xs) - min(xs) == pytest.approx(size.depth if turned else size.width)
        assert max(ys) - min(ys) == pytest.approx(size.width if turned else size.depth)


def test_equal_layouts_give_equal_bytes(tmp_path):
    paths = [write_dxf(island_laboratory(), tmp_path / f"{name}.dxf") for name in "ab"]
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_dimensions_measure_the_room_and_the_door(tmp_path):
    model = ezdxf.readfile(write_dxf(empty_layout(rectangle()), tmp_path / "plan.dxf")).modelspace()
    lengths = sorted(round(dimension.get_measurement(), 6) for dimension in model.query("DIMENSION"))
    assert lengths == [1.0, 1.0, 1.2, 7.0, 13.0]


# Drawings of others


def foreign(path, unit=4, scale=1000.0, layer="WAENDE", draw=None):
    """A room of 6 x 4 m with walls of 0.2 m as pairs of lines, far from the origin, and a door of 1 m."""
    drawing = ezdxf.new("R2000")
    drawing.header["$INSUNITS"] = unit
    model = drawing.modelspace()

    def at(x, y):
        return (x + 50.0) * scale, (y - 20.0) * scale

    def line(a, b):
        model.add_line(at(*a), at(*b), {"layer": layer})

    if draw is not None:
        draw(model, at, scale)
    else:
        for a, b in (((6, 0), (6, 4)), ((6, 4), (0, 4)), ((0, 4), (0, 0)), ((0, 0), (2, 0)), ((3, 0), (6, 0))):
            line(a, b)
        line((6.2, -0.2), (6.2, 4.2))
        line((6.2, 4.2), (-0.2, 4.2))
        line((-0.2, 4.2), (-0.2, -0.2))
        line((-0.2, -0.2), (2, -0.2))
        line((2, -0.2), (2, 0))
        line((3, -0.2), (6.2, -0.2))
        line((3, -0.2), (3, 0))
    # The symbol of a door whose leaf turns about (3, 0) into the room, in a block with another name and size.
    block = drawing.blocks.new("Tür einflüglig")
    block.add_line((0, 0), (0, 0.5))
    block.add_arc((0, 0), 0.5, 90, 180)
    model.add_blockref("Tür einflüglig", at(3, 0), {"layer": "TUEREN", "xscale": 2 * scale, "yscale": 2 * scale})
    drawing.saveas(path)
    return path


@pytest.mark.parametrize(("unit", "scale"), [(4, 1000.0), (5, 100.0), (6, 1.0), (1, 1 / 0.0254), (2, 1 / 0.3048)])
def test_faces_of_walls_and_a_door_block_in_any_unit_are_a_room(tmp_path, unit, scale):
    room = read_dxf(foreign(tmp_path / "Grundriss.dxf", unit, scale)).room
    assert (room.width, room.depth, room.wall_thickness) == pytest.approx((6.0, 4.0, 0.2), abs=1e-4)
    (door,) = room.doors
    assert (door.wall, door.width, door.offset) == ("front", pytest.approx(1.0, abs=1e-4), pytest.approx(2.5, abs=1e-4))


def test_walls_as_wide_polylines_along_middle_lines_are_a_room(tmp_path):
    def draw(model, at, scale):
        width = {"layer": "Murs", "const_width": 0.2 * scale}
        middle = [at(*point) for point in ((2, -0.1), (-0.1, -0.1), (-0.1, 4.1), (6.1, 4.1), (6.1, -0.1), (3, -0.1))]
        model.add_lwpolyline(middle, dxfattribs=width)

    room = read_dxf(foreign(tmp_path / "plan.dxf", draw=draw)).room
    assert (room.width, room.depth, room.doors[0].width) == pytest.approx((6.0, 4.0, 1.0), abs=1e-4)


def test_an_outline_alone_gets_walls(tmp_path):
    def draw(model, at, scale):
        corners = ((0, 0), (6, 0), (6, 4), (3.5, 4), (3.5, 7), (0, 7))
        model.add_lwpolyline([at(*corner) for corner in corners], close=True, dxfattribs={"layer": "Room outlines"})

    floor = read_dxf(foreign(tmp_path / "plan.dxf", draw=draw), thickness=0.15)
    (space,) = floor.spaces
    assert sum((r.x1 - r.x0) * (r.y1 - r.y0) for r in space.region) == pytest.approx(6 * 4 + 3.5 * 3)
    assert len(floor.walls) == 6
    assert {wall.thickness for wall in floor.walls} == {0.15}


def test_a_drawing_without_unit_asks_for_one(tmp_path):
    path = foreign(tmp_path / "plan.dxf", unit=0)
    with pytest.raises(DocumentError, match="--unit"):
        read_dxf(path)
    assert read_dxf(path, unit="mm").room.width == pytest.approx(6.0, abs=1e-4)
    with pytest.raises(OptionError, match="must be one of"):
        read_dxf(path, unit="furlong")


def test_a_reference_to_another_file_is_refused(tmp_path):
    drawing = ezdxf.readfile(foreign(tmp_path / "plan.dxf"))
    drawing.add_xref_def("../secret.dxf", "elsewhere")
    drawing.modelspace().add_blockref("elsewhere", (0, 0))
    drawing.saveas(tmp_path / "xref.dxf")
    with pytest.raises(DocumentError, match="XREF"):
        read_dxf(tmp_path / "xref.dxf")


def test_a_bomb_of_nested_blocks_is_refused(tmp_path):
    drawing = ezdxf.readfile(foreign(tmp_path / "plan.dxf"))
    name = ""
    for depth in range(6):
        block = drawing.blocks.new(f"B{depth}")
        for _ in range(30):
            if name:
                block.add_blockref(name, (0, 0))
            else:
                block.add_line((0, 0), (1, 0), {"layer": "WALL"})
        name = block.name
    drawing.modelspace().add_blockref(name, (0, 0))
    drawing.saveas(tmp_path / "bomb.dxf")
    with pytest.raises(DocumentError, match="more than 50000 entities"):
        read_dxf(tmp_path / "bomb.dxf")


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not a readable DXF"),
        (b"hello\n" * 100, "DXF"),
        (b"AutoCAD Binary DXF\r\n\x1a\x00" + b"\0" * 100, "binary"),
        (b"0\n" * 1_100_000, "lines"),
        (b" " * (16 * 1024 * 1024 + 1), "larger"),
    ],
)
def test_a_file_that_is_no_drawing_is_one_line(tmp_path, content, words):
    (tmp_path / "evil.dxf").write_bytes(content)
    with pytest.raises(LabgymError, match=words) as caught:
        read_dxf(tmp_path / "evil.dxf")
    assert "\n" not in str(caught.value)


def test_a_door_beside_the_walls_and_a_gap_are_refused(tmp_path):
    def open_room(model, at, scale):
        for a, b in (((0, 0), (6, 0)), ((6, 0), (6, 4)), ((6, 4), (0, 4))):
            model.add_lwpolyline([at(*a), at(*b)], dxfattribs={"layer": "WALL", "const_width": 0.2 * scale})

    with pytest.raises(DocumentError, match="enclose no space"):
        read_dxf(foreign(tmp_path / "gap.dxf", draw=open_room))

    def far(model, at, scale):
        model.add_lwpolyline([at(0, 9), at(5, 9)], dxfattribs={"layer": "WALL", "const_width": 0.2 * scale})

    with pytest.raises(DocumentError, match="lies in no wall"):
        read_dxf(foreign(tmp_path / "door.dxf", draw=far))


def test_a_plan_beside_an_elevation_is_named_with_its_window_and_read_with_it(tmp_path):
    path = foreign(tmp_path / "sheet.dxf")
    plan = read_dxf(path)
    drawing = ezdxf.readfile(path)
    model = drawing.modelspace()
    for k in range(5):  # storeys of a facade 5 m to the right of the plan, and the arch of its door
        model.add_line((62_000, 1000 * k - 20_000), (68_000, 1000 * k - 20_000), {"layer": "WAENDE"})
    model.add_arc((65_000, -18_000), 900, 0, 90, dxfattribs={"layer": "TUEREN"})
    drawing.saveas(path)
    with pytest.raises(DocumentError, match="2 separate drawings") as caught:
        read_dxf(path)
    assert "\n" not in str(caught.value)
    crop = re.findall(r"--crop=([-0-9.,]+)", str(caught.value))[0]
    window = [float(number) for number in crop.split(",")]
    assert window == pytest.approx([49_800, -20_200, 56_200, -15_800], abs=1.0)
    layout = tmp_path / "plan.json"
    assert main(["outline", str(path), f"--crop={crop}", "--out", str(layout)]) == 0
    assert differences(Layout.load(layout).floor, plan) == []


@pytest.mark.parametrize("crop", ["1,2,3", "0,0,0,5", "a,b,c,d"])
def test_a_window_that_is_none_is_refused_in_one_line(tmp_path, crop, capsys):
    path = foreign(tmp_path / "room.dxf")
    assert main(["outline", str(path), f"--crop={crop}", "--out", str(tmp_path / "room.json")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
