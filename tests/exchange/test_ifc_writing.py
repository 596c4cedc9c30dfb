"""Building models: the validator of IfcOpenShell finds no fault, and the model has the layout's places and sizes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import island_laboratory

from exchange.floors import suite
from labgym.cli import main
from labgym.exchange.formats import empty_layout
from labgym.exchange.ifc.writing import write_ifc
from labgym.exchange.schedule import demands
from labgym.geometry import to_world
from labgym.layouts.floor import Service

ifcopenshell = pytest.importorskip("ifcopenshell")
element = pytest.importorskip("ifcopenshell.util.element")
placing = pytest.importorskip("ifcopenshell.util.placement")
ORIGIN = (412.5, -73.25, 0.6)


def laboratory():
    layout = island_laboratory()
    points = (Service(kind="water", x=0.0, y=3.0, z=0.6), Service(kind="power", x=0.0, y=4.0))
    return layout.replace(floor=layout.floor.model_copy(update={"origin": ORIGIN, "services": points}))


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return ifcopenshell.open(str(write_ifc(laboratory(), tmp_path_factory.mktemp("ifc") / "lab.ifc")))


@pytest.mark.parametrize("layout", [laboratory(), empty_layout(suite())])
def test_the_validator_finds_no_fault(layout, tmp_path):
    from ifcopenshell.validate import json_logger, validate

    log = json_logger()
    validate(ifcopenshell.open(str(write_ifc(layout, tmp_path / "lab.ifc"))), log)
    assert log.statements == []


def test_every_object_stands_where_the_file_of_the_floor_has_it(model):
    layout = laboratory()
    by_name = {each.Name: each for each in model.by_type("IfcElement")}
    for placement in layout.placements:
        matrix = placing.get_local_placement(by_name[placement.id].ObjectPlacement)
        x, y = to_world([placement.position[:2]], ORIGIN)[0]
        assert np.allclose(matrix[:3, 3], (x, y, placement.position[2]), atol=1e-6)
        turn = math.atan2(matrix[1, 0], matrix[0, 0])
        assert math.cos(turn - placement.yaw - ORIGIN[2]) == pytest.approx(1.0)
        sizes = element.get_psets(by_name[placement.id])["Labgym_Object"]
        assert [sizes[name] for name in ("Width", "Depth", "Height")] == pytest.approx(
            list(layout.asset(placement.id).size.model_dump().values())
        )


def test_rooms_have_their_areas_and_contain_their_objects(model):
    layout = laboratory()
    (space,) = model.by_type("IfcSpace")
    area = element.get_psets(space)["Qto_SpaceBaseQuantities"]["NetFloorArea"]
    assert area == pytest.approx(sum(each.area for each in layout.floor.spaces))
    inside = {each.Name for relation in space.ContainsElements for each in relation.RelatedElements}
    assert {each.id for each in layout.placements} <= inside


def test_hazards_and_services_are_properties(model):
    layout = laboratory()
    by_name = {each.Name: element.get_psets(each) for each in model.by_type("IfcElement")}
    for placement in layout.placements:
        hazards = layout.asset(placement.id).hazards
        stated = by_name[placement.id].get("Labgym_Hazards", {})
        assert stated.get("Flammable", False) == hazards.flammable
        assert stated.get("HeatSource", False) == hazards.heat_source
    for demand in demands(layout):
        assert by_name[demand.id]["Labgym_Connections"][demand.service.capitalize()] == demand.status
    assert {each.is_a() for each in model.by_type("IfcFlowTerminal")} >= {"IfcOutlet"}
    assert len(model.by_type("IfcValve")) == 1


def test_doors_fill_openings_and_open_as_their_leaves_do(tmp_path):
    floor = suite()
    model = ifcopenshell.open(str(write_ifc(empty_layout(floor), tmp_path / "suite.ifc")))
    doors = [(wall, each) for wall in floor.walls for each in wall.openings if each.kind == "door"]
    drawn = model.by_type("IfcDoor")
    assert len(drawn) == len(doors)
    assert len(model.by_type("IfcOpeningElement")) == sum(len(wall.openings) for wall in floor.walls)
    for (wall, opening), door in zip(doors, drawn, strict=True):
        assert (door.OverallWidth, door.OverallHeight) == (opening.width, opening.height)
        matrix = placing.get_local_placement(door.ObjectPlacement)
        side = 1.0 if opening.swing == "left" else -1.0
        opens = side * np.array((-math.sin(wall.yaw), math.cos(wall.yaw)))
        assert np.allclose(matrix[:2, 1], opens, atol=1e-9)
        along = -1.0 if opening.hinge == "start" else 1.0
        hinge = along * np.array((math.cos(wall.yaw), math.sin(wall.yaw)))
        left = float(hinge @ -matrix[:2, 0]) > 0.0
        assert door.OperationType == ("SINGLE_SWING_LEFT" if left else "SINGLE_SWING_RIGHT")


def test_equal_layouts_give_equal_bytes(tmp_path):
    write_ifc(laboratory(), tmp_path / "lab.ifc")
    (tmp_path / "again").mkdir()
    write_ifc(laboratory(), tmp_path / "again" / "lab.ifc")
    assert (tmp_path / "lab.ifc").read_bytes() == (tmp_path / "again" / "lab.ifc").read_bytes()


def test_another_suffix_is_refused_in_one_line(tmp_path, capsys):
    assert main(["compile", "val-fgt_04", "--format", "ifc", "--out", str(tmp_path / "lab.txt")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
