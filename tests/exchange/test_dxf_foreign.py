"""Drawings of other programs: several rooms, site coordinates, hidden layers, undefined blocks, unknown layers."""

import math
import random

import ezdxf
import pytest

from exchange.floors import differences
from labgym.assets import Catalog
from labgym.cli import main
from labgym.errors import DocumentError, UnrepairedError
from labgym.exchange.dxf.reading import read_dxf, read_furniture
from labgym.layouts import generate
from labgym.layouts.floor.changes import walls_with
from labgym.layouts.method import Method
from labgym.layouts.rules.objective import evaluate_layout
from labgym.protocols import protocols

FACES = [
    *(
        ((-0.2, -0.2), (1, -0.2)),
        ((2, -0.2), (10.35, -0.2)),
        ((10.35, -0.2), (10.35, 6.2)),
        ((10.35, 6.2), (-0.2, 6.2)),
    ),
    *(((-0.2, 6.2), (-0.2, -0.2)), ((0, 0), (1, 0)), ((2, 0), (7, 0)), ((7.15, 0), (10.15, 0)), ((0, 0), (0, 6))),
    *(((0, 6), (7, 6)), ((7.15, 6), (10.15, 6)), ((10.15, 6), (10.15, 0)), ((7, 0), (7, 3)), ((7, 4), (7, 6))),
    *(((7.15, 0), (7.15, 3)), ((7.15, 4), (7.15, 6)), ((1, 0), (1, -0.2)), ((2, 0), (2, -0.2)), ((7, 3), (7.15, 3))),
]
"""Faces of the walls of a laboratory of 7 x 6 m and a store of 3 x 6 m, with two gaps of 1 m for doors."""


def plan(path, faces=FACES, offset=(0.0, 0.0), layer="WALLS", change=None):
    """Write a drawing in millimeters whose lower left room corner is at an offset in meters."""
    drawing = ezdxf.new("R2010")
    drawing.header["$INSUNITS"] = 4
    model = drawing.modelspace()

    def at(x, y):
        return (x + offset[0]) * 1000.0, (y + offset[1]) * 1000.0

    for a, b in faces:
        model.add_line(at(*a), at(*b), {"layer": layer})
    for hinge, start in (((1, 0), 0), ((7, 3), 90)):
        model.add_arc(at(*hinge), 1000.0, start, start + 90, dxfattribs={"layer": "DOORS"})
    if change is not None:
        change(drawing, at)
    drawing.saveas(path)
    return path


def areas(floor):
    return [sum((r.x1 - r.x0) * (r.y1 - r.y0) for r in space.region) for space in floor.spaces]


@pytest.mark.parametrize("seed", range(6))
def test_both_rooms_are_read_whatever_the_order_and_direction_of_the_lines(seed, tmp_path):
    faces, generator = list(FACES), random.Random(seed)
    if seed:
        faces = [face if generator.random() < 0.5 else face[::-1] for face in generator.sample(faces, len(faces))]
    floor = read_dxf(plan(tmp_path / "plan.dxf", faces))
    assert areas(floor) == pytest.approx([42.0, 18.0], abs=1e-3)
    assert sum(opening.kind == "door" for wall in floor.walls for opening in wall.openings) == 2


@pytest.mark.parametrize("offset", [(5400.0, -3200.0), (432_107.25, 5_411_862.5)])
def test_a_drawing_in_coordinates_of_a_site_is_the_same_floor(offset, tmp_path):
    near = read_dxf(plan(tmp_path / "near.dxf"))
    far = read_dxf(plan(tmp_path / "far.dxf", offset=offset))
    assert differences(near, far) == []


def test_furniture_in_coordinates_of_a_site_stands_in_the_room(tmp_path):
    def hood(drawing, at):
        drawing.blocks.new("HOOD").add_line((0, 0), (1500, 0))
        insert = drawing.modelspace().add_blockref("HOOD", at(3, 5.5), {"layer": "FURNITURE", "rotation": 180})
        insert.add_attrib("ASSET", "FumeHood")

    path = plan(tmp_path / "far.dxf", offset=(5400.0, 3200.0), change=hood)
    (piece,) = read_furniture(path, Catalog.load())
    assert piece.position[:2] == pytest.approx((3.0, 5.5), abs=1e-3)
    assert abs(piece.yaw) == pytest.approx(math.pi)


def test_a_drawing_with_the_wrong_unit_is_refused_with_its_size(tmp_path):
    def meters(drawing, at):
        drawing.header["$INSUNITS"] = 6
        for arc in list(drawing.modelspace().query("ARC")):
            drawing.modelspace().delete_entity(arc)

        corners = [at(0, 0), at(9, 0), at(9, 7), at(0, 7)]
        drawing.modelspace().add_lwpolyline(corners, close=True, dxfattribs={"layer": "ROOM"})

    path = plan(tmp_path / "plan.dxf", [], change=meters)
    with pytest.raises(DocumentError, match="check the unit"):
        read_dxf(path)


@pytest.mark.parametrize("hide", ["off", "freeze", "invisible"])
def test_hidden_parts_are_not_read(hide, tmp_path):
    def demolished(drawing, at):
        layer = drawing.layers.add("WALL-DEMOLISHED")
        for x in (3.0, 3.1):
            line = drawing.modelspace().add_line(at(x, 1), at(x, 5), {"layer": "WALL-DEMOLISHED"})
            if hide == "invisible":
                line.dxf.invisible = 1
        if hide != "invisible":
            getattr(layer, hide)()

    floor = read_dxf(plan(tmp_path / "plan.dxf", change=demolished))
    assert differences(floor, read_dxf(plan(tmp_path / "whole.dxf"))) == []


def test_a_frozen_layer_hides_a_block_and_a_layer_that_is_off_only_its_own_parts(tmp_path):
    def option(state):
        def draw(drawing, at):
            block = drawing.blocks.new("OPTION")
            for x in (3.0, 3.1):
                block.add_line(at(x, 1), at(x, 5), {"layer": "WALLS"})
            getattr(drawing.layers.add("OPTIONS"), state)()
            drawing.modelspace().add_blockref("OPTION", (0, 0), {"layer": "OPTIONS"})

        return draw

    whole = read_dxf(plan(tmp_path / "whole.dxf"))
    assert differences(read_dxf(plan(tmp_path / "frozen.dxf", change=option("freeze"))), whole) == []
    with pytest.raises(DocumentError, match="overlaps wall"):
        read_dxf(plan(tmp_path / "off.dxf", change=option("off")))


def test_a_block_without_definition_is_named_and_the_rest_recognized(tmp_path, capsys):
    def insert(drawing, at):
        drawing.modelspace().add_blockref("DOOR_900", at(3, 0))

    path = plan(tmp_path / "plan.dxf", change=insert)
    with pytest.raises(DocumentError, match="'DOOR_900'"):
        read_dxf(path)
    assert main(["outline", str(path), "--out", str(tmp_path / "floor.json")]) == 0
    assert "'DOOR_900'" in capsys.readouterr().err
    assert (tmp_path / "floor.json").exists()


def test_a_drawing_without_walls_is_refused_with_what_it_has(tmp_path):
    with pytest.raises(DocumentError, match=r"the layers are TABIQUES \(LINE\), DOORS \(ARC\)"):
        read_dxf(plan(tmp_path / "names.dxf", layer="TABIQUES"))

    def face(drawing, at):
        corners = [at(0, 0), at(9, 0), at(9, 0.2), at(0, 0.2)]
        drawing.modelspace().add_3dface(corners, dxfattribs={"layer": "A-WALL"})

    with pytest.raises(DocumentError, match=r"A-WALL \(3DFACE\)"):
        read_dxf(plan(tmp_path / "face.dxf", [], change=face))

    def shrunk(drawing, at):
        drawing.header["$INSUNITS"] = 6
        for line in drawing.modelspace().query("LINE"):
            line.scale(1e-6, 1e-6, 1.0)
        for arc in list(drawing.modelspace().query("ARC")):
            drawing.modelspace().delete_entity(arc)

    with pytest.raises(DocumentError, match=r"with its unit the drawing is 0.010. x 0.0064 m"):
        read_dxf(plan(tmp_path / "unit.dxf", change=shrunk))

    path = plan(tmp_path / "off.dxf", change=lambda drawing, at: drawing.layers.add("WALLS").off())
    with pytest.raises(DocumentError, match=r"WALLS \(LINE; off\)"):
        read_dxf(path)


def test_a_spanish_layer_of_walls_is_read(tmp_path):
    assert areas(read_dxf(plan(tmp_path / "plan.dxf", layer="ARQ-PAREDES"))) == pytest.approx([42.0, 18.0], abs=1e-3)


def test_a_door_between_rooms_is_open_as_drawn_so_that_a_laboratory_fits_both_rooms(tmp_path):
    floor = read_dxf(plan(tmp_path / "plan.dxf"))
    assert {way.exit: way.opening.state for way in floor.doorways} == {True: "closed", False: "open"}
    layout = generate("sub_01", seed=1, floor=floor)
    assert evaluate_layout(layout, protocols()["sub_01"], navigation=True, rules="paper").cost == 0


def test_closed_doors_between_rooms_are_named_if_no_laboratory_fits(tmp_path):
    floor = read_dxf(plan(tmp_path / "plan.dxf"))
    shut = floor.model_copy(update={"walls": walls_with(floor, inner_doors(floor), state="closed")})
    with pytest.raises(UnrepairedError, match=r"cannot pass the closed doors between spaces \(1\): open them"):
        generate("sub_01", seed=1, floor=shut, method=Method(optimise=False, refine=False))


def inner_doors(floor):
    return [(way.wall, way.opening) for way in floor.doorways if not way.exit]


SOLID = [
    *((-0.2, -0.2, 1, 0), (2, -0.2, 10.35, 0), (-0.2, 0, 0, 6.2), (0, 6, 10.35, 6.2), (10.15, 0, 10.35, 6)),
    *((7, 0, 7.15, 3), (7, 4, 7.15, 6)),
]
"""The walls of `FACES` as rectangles: x0, y0, x1, y1."""


@pytest.mark.parametrize("edges", [False, True])
def test_walls_that_are_only_hatched_are_read(edges, tmp_path):
    def hatched(drawing, at):
        paths = drawing.modelspace().add_hatch(dxfattribs={"layer": "A-WALL-PATT"}).paths
        for x0, y0, x1, y1 in SOLID:
            corners = [at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)]
            if edges:
                path = paths.add_edge_path()
                for k in range(4):
                    path.add_line(corners[k], corners[(k + 1) % 4])
            else:
                paths.add_polyline_path(corners, is_closed=True)

    floor = read_dxf(plan(tmp_path / "plan.dxf", [], change=hatched))
    assert areas(floor) == pytest.approx([42.0, 18.0], abs=1e-3)
    assert len(floor.doorways) == 2


def test_hatches_do_not_count_if_walls_are_drawn(tmp_path):
    def pattern(drawing, at):
        path = drawing.modelspace().add_hatch(dxfattribs={"layer": "WALLS"}).paths
        path.add_polyline_path([at(3, 1), at(3.1, 1), at(3.1, 5), at(3, 5)], is_closed=True)

    whole = read_dxf(plan(tmp_path / "whole.dxf"))
    assert differences(read_dxf(plan(tmp_path / "plan.dxf", change=pattern)), whole) == []


def test_multilines_are_walls(tmp_path):
    def double(drawing, at):
        for points in ([(2, -0.1), (10.25, -0.1), (10.25, 6.1), (-0.1, 6.1), (-0.1, -0.1), (1, -0.1)],):
            attributes = {"layer": "WALLS", "scale_factor": 200.0, "justification": 1}
            drawing.modelspace().add_mline([at(*point) for point in points], dxfattribs=attributes)
        for points in ([(7.075, 0), (7.075, 3)], [(7.075, 4), (7.075, 6)]):
            attributes = {"layer": "WALLS", "scale_factor": 150.0, "justification": 1}
            drawing.modelspace().add_mline([at(*point) for point in points], dxfattribs=attributes)

    floor = read_dxf(plan(tmp_path / "plan.dxf", [], change=double))
    assert areas(floor) == pytest.approx([42.0, 18.0], abs=1e-3)
    assert {wall.thickness for wall in floor.walls} == {0.2, 0.15}
