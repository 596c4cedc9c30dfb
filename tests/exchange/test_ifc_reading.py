"""Reading building models: those of labgym exactly, others in their units; odd ones are recognized or refused."""

from __future__ import annotations

import math

import pytest

from exchange.floors import FLOORS, differences, rectangle
from labgym.cli import main
from labgym.errors import DocumentError, LabgymError, OptionError, UnknownNameError
from labgym.exchange.formats import empty_layout, read_floor
from labgym.exchange.ifc.writing import write_ifc
from labgym.exchange.recognition.proposal import Answers, recognize
from labgym.layouts import Layout

ifcopenshell = pytest.importorskip("ifcopenshell")
MM = 1000.0


class Building:
    """A building model in millimeters as another program writes it: IFC2X3, spaces of faces."""

    def __init__(self, storeys=("Ground", "Upper")):
        self.model = ifcopenshell.file(schema="IFC2X3")
        self.new = self.model.create_entity
        unit = self.new("IfcSIUnit", UnitType="LENGTHUNIT", Prefix="MILLI", Name="METRE")
        project = self.root("IfcProject", "house", UnitsInContext=self.new("IfcUnitAssignment", [unit]))
        self.storeys = [
            self.root(
                "IfcBuildingStorey", name, Elevation=3.0 * MM * level, ObjectPlacement=self.place(0, 0, 3 * level)
            )
            for level, name in enumerate(storeys)
        ]
        for storey in self.storeys:
            self.new("IfcRelAggregates", ifcopenshell.guid.new(), RelatingObject=project, RelatedObjects=[storey])

    def root(self, kind, name, **fields):
        return self.new(kind, GlobalId=ifcopenshell.guid.new(), Name=name, **fields)

    def point(self, *values):
        return self.new("IfcCartesianPoint", tuple(float(value) * MM for value in values))

    def place(self, x, y, z=0.0, yaw=0.0, parent=None):
        directions = [self.new("IfcDirection", v) for v in ((0.0, 0.0, 1.0), (math.cos(yaw), math.sin(yaw), 0.0))]
        axes = self.new("IfcAxis2Placement3D", self.point(x, y, z), *directions)
        return self.new("IfcLocalPlacement", parent.ObjectPlacement if parent else None, axes)

    def body(self, product, points, height, z=0.0, faces=False):
        if faces:
            loops = [[(x, y, z) for x, y in points], [(x, y, z + height) for x, y in points]]
            sides = list(zip(points, [*points[1:], points[0]], strict=True))
            loops += [[(*a, z), (*b, z), (*b, z + height), (*a, z + height)] for a, b in sides]
            bounds = [
                self.new("IfcFaceOuterBound", self.new("IfcPolyLoop", [self.point(*p) for p in loop]), True)
                for loop in loops
            ]
            shell = self.new("IfcClosedShell", [self.new("IfcFace", [bound]) for bound in bounds])
            solid, kind = self.new("IfcFacetedBrep", shell), "Brep"
        else:
            ring = [self.point(*point) for point in points]
            profile = self.new("IfcArbitraryClosedProfileDef", "AREA", None, self.new("IfcPolyline", [*ring, ring[0]]))
            axes = self.new("IfcAxis2Placement3D", self.point(0, 0, z))
            up = self.new("IfcDirection", (0.0, 0.0, 1.0))
            solid, kind = self.new("IfcExtrudedAreaSolid", profile, axes, up, height * MM), "SweptSolid"
        shape = self.new("IfcShapeRepresentation", None, "Body", kind, [solid])
        product.Representation = self.new("IfcProductDefinitionShape", None, None, [shape])

    def wall(self, storey, start, end, thickness=0.2, doors=(), height=3.0):
        length, yaw = math.dist(start, end), math.atan2(end[1] - start[1], end[0] - start[0])
        wall = self.root("IfcWallStandardCase", "wall", ObjectPlacement=self.place(*start, 0.0, yaw, storey))
        t = thickness / 2.0
        self.body(wall, [(-t, -t), (length + t, -t), (length + t, t), (-t, t)], height)
        parts = [wall]
        for at in doors:
            void = self.root("IfcOpeningElement", "opening", ObjectPlacement=self.place(at, 0.0, parent=wall))
            self.body(void, [(-0.5, -0.3), (0.5, -0.3), (0.5, 0.3), (-0.5, 0.3)], 2.1)
            self.relate("IfcRelVoidsElement", RelatingBuildingElement=wall, RelatedOpeningElement=void)
            door = self.root("IfcDoor", "door", ObjectPlacement=self.place(0.0, 0.0, parent=void))
            self.relate("IfcRelFillsElement", RelatingOpeningElement=void, RelatedBuildingElement=door)
            style = self.root("IfcDoorStyle", "style", OperationType="SINGLE_SWING_RIGHT")
            self.relate("IfcRelDefinesByType", RelatedObjects=[door], RelatingType=style)
            parts.append(door)
        self.relate("IfcRelContainedInSpatialStructure", RelatedElements=parts, RelatingStructure=storey)

    def space(self, storey, points, name):
        space = self.root("IfcSpace", name, LongName="Office", ObjectPlacement=self.place(0, 0, 0, 0, storey))
        self.body(space, points, 2.7, faces=True)
        self.relate("IfcRelAggregates", RelatingObject=storey, RelatedObjects=[space])

    def relate(self, kind, **fields):
        self.new(kind, ifcopenshell.guid.new(), **fields)

    def save(self, path):
        path.write_text("\ufeff" + self.model.to_string(), encoding="utf-8")  # with a byte order mark
        return path


def house(round_wall=False):
    """Two rooms on the ground floor, 5.8 x 3.8 m and 3.7 x 3.8 m, and one on the upper floor."""
    building = Building()
    ground, upper = building.storeys
    corners = ((0, 0), (9.7, 0), (9.7, 4), (0, 4))
    for index, (start, end) in enumerate(zip(corners, [*corners[1:], corners[0]], strict=True)):
        building.wall(ground, start, end, doors=(2.0,) if index == 0 else ())
        building.wall(upper, start, end)
    building.wall(ground, (5.95, 0), (5.95, 4), 0.1, doors=(2.0,))
    building.space(ground, [(0.1, 0.1), (5.9, 0.1), (5.9, 3.9), (0.1, 3.9)], "0.1 Lab")
    building.space(ground, [(6.0, 0.1), (9.6, 0.1), (9.6, 3.9), (6.0, 3.9)], "0.2")
    building.space(upper, [(0.1, 0.1), (9.6, 0.1), (9.6, 3.9), (0.1, 3.9)], "1.1")
    if round_wall:
        arc = [(1.0 + r * math.cos(a), 2.0 + r * math.sin(a)) for r, a in
               [*((0.8, k / 5.0) for k in range(12)), *((0.9, k / 5.0) for k in reversed(range(12)))]]  # fmt: skip
        curved = building.root("IfcWall", "round", ObjectPlacement=building.place(0, 0, 0, 0, ground))
        building.body(curved, arc, 3.0)
        building.relate("IfcRelContainedInSpatialStructure", RelatedElements=[curved], RelatingStructure=ground)
    return building


@pytest.mark.parametrize("name", FLOORS)
def test_own_models_come_back_with_their_frame(name, tmp_path):
    floor = FLOORS[name]().model_copy(update={"origin": (412.5, -73.25, 0.6)})
    again = read_floor(write_ifc(empty_layout(floor), tmp_path / "plan.ifc"))
    assert again.origin[2] == pytest.approx(0.6)
    areas = [sorted(space.area for space in each.spaces) for each in (floor, again)]
    assert areas[1] == pytest.approx(areas[0], rel=0.02)
    assert len(again.doorways) == len(floor.doorways)


def test_an_own_rectangular_room_comes_back_exactly(tmp_path):
    again = read_floor(write_ifc(empty_layout(rectangle()), tmp_path / "plan.ifc"))
    assert differences(rectangle(), again) == []
    assert again.origin == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_a_foreign_model_in_millimeters_is_read_with_names_uses_and_doors(tmp_path):
    floor = read_floor(house().save(tmp_path / "house.ifc"))
    assert {space.id: round(space.area, 3) for space in floor.spaces} == {"0.1_Lab": 22.04, "0.2": 13.68}
    assert {space.use for space in floor.spaces} == {"write-up"}
    assert [way.exit for way in floor.doorways].count(True) == 1
    assert floor.origin == pytest.approx((0.1, 0.1, 0.0))
    assert floor.label == "house-Ground"  # a part of the ids of layouts
    (exit_,) = (way for way in floor.doorways if way.exit)
    assert (exit_.x, exit_.y, exit_.width) == pytest.approx((1.9, -0.1, 1.0), abs=1e-3)


def test_a_storey_is_chosen_by_number_or_name(tmp_path, capsys):
    path = house().save(tmp_path / "house.ifc")
    for storey in ("2", "Upper"):
        proposal = recognize(path, Answers(storey=storey))
        assert [round(space.area) for space in proposal.floor.spaces] == [36]
        assert any("exit" in question for question in proposal.questions)
    with pytest.raises(UnknownNameError, match=r"1 \(Ground\)"):
        read_floor(path, storey="3")
    assert main(["outline", str(path), "--storey", "2", "--out", str(tmp_path / "upper.json")]) == 0
    assert len(Layout.load(tmp_path / "upper.json").floor.spaces) == 1
    capsys.readouterr()


def test_a_model_with_a_round_wall_is_recognized(tmp_path):
    path = house(round_wall=True).save(tmp_path / "house.ifc")
    with pytest.raises(DocumentError, match="not straight"):
        read_floor(path)
    proposal = recognize(path)
    assert len(proposal.floor.spaces) == 2
    assert any("--storey" in question for question in proposal.questions)
    assert proposal.floor.origin[:2] == pytest.approx((0.1, 0.1), abs=0.05)


def test_a_screen_of_glass_divides_no_space(tmp_path):
    building = house()
    building.wall(building.storeys[0], (1.0, 0.1), (1.0, 3.9), 0.01)
    floor = read_floor(building.save(tmp_path / "house.ifc"))
    assert {space.id: round(space.area, 3) for space in floor.spaces} == {"0.1_Lab": 22.04, "0.2": 13.68}


def test_an_exit_next_to_the_corner_of_another_room_is_recognized(tmp_path):
    building = Building()
    ground = building.storeys[0]
    corners = ((0, 0), (4, 0), (4, 4), (9, 4), (9, 8), (0, 8))
    for index, (start, end) in enumerate(zip(corners, [*corners[1:], corners[0]], strict=True)):
        building.wall(ground, start, end, doors=(1.2,) if index == 1 else ())
    building.wall(ground, (0, 4), (4, 4), doors=(2.0,))
    building.space(ground, [(0.1, 0.1), (3.9, 0.1), (3.9, 3.9), (0.1, 3.9)], "a")
    building.space(ground, [(0.1, 4.1), (8.9, 4.1), (8.9, 7.9), (0.1, 7.9)], "b")
    (exit_,) = (way for way in recognize(building.save(tmp_path / "house.ifc")).floor.doorways if way.exit)
    assert (exit_.x, exit_.y) == pytest.approx((3.9, 1.1), abs=0.1)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not an IFC file"),
        (b"PK\x03\x04", "not an IFC file"),
        (b"ISO-10303-21;\nHEADER;\nENDSEC;\n", "IFC"),
        (b"ISO-10303-21;\nDATA;\n#1=IFCWALL(\n", "IFC"),
        (
            b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('IFC2X_FINAL'));\nENDSEC;\n",
            "IFC2X_FINAL is not read: save .* as IFC4",
        ),
    ],
)
def test_a_file_that_is_no_building_model_is_one_line(tmp_path, content, words):
    (tmp_path / "a.ifc").write_bytes(content)
    with pytest.raises(LabgymError, match=words) as caught:
        recognize(tmp_path / "a.ifc")
    assert "\n" not in str(caught.value)


def test_answers_that_do_not_fit_are_named(tmp_path):
    path = house().save(tmp_path / "house.ifc")
    with pytest.raises(OptionError, match="building model"):
        read_floor(path, unit="mm")
    with pytest.raises(OptionError, match="states its unit"):
        recognize(path, Answers(scale=2.0))
    with pytest.raises(OptionError, match="--storey is for building models"):
        read_floor(tmp_path / "a.dxf", storey="1")
    with pytest.raises(OptionError, match="save it as DXF"):
        read_floor(tmp_path / "a.dwg")
