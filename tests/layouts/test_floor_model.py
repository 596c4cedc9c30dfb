"""Floors of several spaces, checked by polygons: solids, joints, doorways, the inside, and what is refused."""

from __future__ import annotations

import json
import math
import pickle

import numpy as np
import pytest
from floor_shapes import polygon_walls, two_rooms
from pydantic import ValidationError
from shapely import Point, Polygon, box
from shapely.affinity import rotate, translate
from shapely.ops import unary_union

from labgym.errors import DocumentError, LabgymError, UnknownNameError
from labgym.layouts import Layout, Room
from labgym.layouts.floor import Column, Door, Floor, KeepOut, Opening, Rectangle, Service, Space, Wall
from labgym.layouts.floors import draw_floor


def replaced(record, **changes):
    """A validated copy of a record with some fields changed."""
    return type(record)(**{name: getattr(record, name) for name in type(record).model_fields} | changes)


def outline(solid) -> Polygon:
    return Polygon(solid.corners())


def plan(floor: Floor, low: float = 0.0, high: float = 5.0):
    """What is solid somewhere between two heights."""
    return unary_union([outline(solid) for solid in floor.solids if solid.z1 > low and solid.z0 < high])


# Solids


def test_wall_solids_have_the_area_of_the_walls_without_their_openings():
    floor = two_rooms(kind="passage")
    ring = box(-0.2, -0.2, 9.3, 5.2).difference(box(0.0, 0.0, 9.1, 5.0))
    inner = box(6.0, 0.0, 6.1, 5.0).difference(box(6.0, 1.5, 6.1, 2.5))
    expected = ring.union(inner)
    low = plan(floor, 0.0, 0.9)  # exits are filled, the sill of the window is below
    assert low.symmetric_difference(expected).area < 1e-9
    high = plan(floor, 2.5, 2.9)  # above the lintels
    assert high.symmetric_difference(ring.union(box(6.0, 0.0, 6.1, 5.0))).area < 1e-9
    pane = plan(floor, 1.1, 2.0)  # the wall stands open but for the pane; position 2 from the start at x = 9.2
    hole = box(9.2 - 2.75, 5.0, 9.2 - 1.25, 5.2)
    assert pane.intersection(hole).area == pytest.approx(1.5 * 0.03)


@pytest.mark.parametrize("hinge", ["start", "end"])
@pytest.mark.parametrize("swing", ["left", "right"])
@pytest.mark.parametrize("angle", [0.3, math.pi / 2, 2.5])
def test_an_open_leaf_turns_about_its_hinge_to_its_side(hinge, swing, angle):
    floor = two_rooms(hinge=hinge, swing=swing, angle=angle)
    (leaf,) = [outline(part.box) for part in floor.parts if part.kind == "leaf"]
    edge = 1.5 if hinge == "start" else 2.5  # the wall runs along y; its left is toward -x
    face = 6.0 if swing == "left" else 6.1
    closed = box(face, 1.5, face + 0.05, 2.5) if swing == "left" else box(face - 0.05, 1.5, face, 2.5)
    sense = (1.0 if hinge == "start" else -1.0) * (1.0 if swing == "left" else -1.0)
    expected = rotate(closed, sense * angle, origin=(face, edge), use_radians=True)
    assert leaf.symmetric_difference(expected).area < 1e-9
    centroid = leaf.centroid.x
    assert centroid < face if swing == "left" else centroid > face


def test_a_closed_leaf_fills_its_doorway():
    floor = two_rooms(state="closed")
    gap = box(6.0, 1.5, 6.1, 2.5)
    assert plan(floor, 0.0, 1.0).intersection(gap).area == pytest.approx(0.05 * 1.0)
    path = box(5.0, 1.9, 7.0, 2.1)
    assert path.difference(plan(floor, 0.0, 1.0)).geom_type == "MultiPolygon"


SHAPES = {
    "square": [(0, 0), (5, 0), (5, 4), (0, 4)],
    "acute": [(0, 0), (8, 0), (0, 5)],
    "obtuse": [(0, 0), (6, -1.0), (8, 3), (4, 7), (-1, 4)],
    "reflex": [(0, 0), (8, 0), (8, 3), (4, 3.5), (3.5, 8), (0, 8)],
    "nearly straight": [(0, 0), (4, 0), (8, 0.21), (8, 5), (0, 5)],
}


@pytest.mark.parametrize("style", ["middle", "corner"])
@pytest.mark.parametrize("turn", [0.0, 0.37, 2.0])
@pytest.mark.parametrize("name", sorted(SHAPES))
def test_walls_that_meet_at_any_angle_leave_no_gap(name, turn, style):
    inner = translate(rotate(Polygon(SHAPES[name]), turn, origin=(0, 0), use_radians=True), 1.7, -0.4)
    walls = polygon_walls(list(inner.exterior.coords)[:-1], style=style, doors=())
    middle = inner.representative_point()
    space = Space(x=middle.x, y=middle.y, region=(Rectangle(x0=-0.1, y0=-0.1, x1=0.1, y1=0.1),))
    floor = Floor.model_construct(walls=walls, spaces=(space,), columns=(), name="bare")
    solid = unary_union([outline(part) for part in floor.solids])
    # The walls form one ring whose hole is the room: nothing protrudes into it, and no ray finds a slit.
    assert solid.intersection(inner.buffer(-1e-6)).area < 1e-9
    eroded = unary_union([outline(part).buffer(-2e-4, join_style="mitre") for part in floor.solids])
    assert eroded.geom_type == "Polygon"
    assert len(eroded.interiors) == 1
    assert Polygon(eroded.interiors[0]).symmetric_difference(inner).area < 1e-3 * inner.length


@pytest.mark.parametrize("gap", [0.0, 0.004, -0.1])
def test_a_wall_that_ends_at_another_is_joined_with_it(gap):
    """The inner wall ends at the face of the outer one, 4 mm before it, or in its middle."""
    rooms = two_rooms()
    *outer, inner = rooms.walls
    moved = inner.model_copy(update={"start": (6.05, gap), "end": (6.05, 5.0 - gap)})
    floor = Floor(walls=(*outer, moved), spaces=rooms.spaces)
    assert plan(floor, 2.5, 2.9).symmetric_difference(plan(rooms, 2.5, 2.9)).area < 1e-9


def test_a_wall_never_runs_through_another_into_the_space_behind():
    floor = two_rooms()
    free = box(0.0, 0.0, 6.0, 5.0).union(box(6.1, 0.0, 9.1, 5.0))
    solids = unary_union([outline(part.box) for part in floor.parts if part.kind != "leaf"])
    assert solids.intersection(free.buffer(-1e-6)).area < 1e-9


# Spaces and doorways


def test_inside_is_the_union_of_the_spaces_and_the_inner_doorways():
    floor = two_rooms()
    union = unary_union([box(0, 0, 6, 5), box(6.1, 0, 9.1, 5), box(6, 1.5, 6.1, 2.5)])
    points = np.random.default_rng(1).uniform((-0.5, -0.5), (9.7, 5.5), (4000, 2))
    points[:500] = np.random.default_rng(2).uniform((5.9, 1.3), (6.2, 2.7), (500, 2))
    assert floor.inside(points).tolist() == [union.covers(Point(point)) for point in points]
    assert floor.inside(np.zeros((0, 2))).shape == (0,)


def test_a_grid_is_looked_up_as_its_points_are_and_a_point_as_in_an_array():
    floor = draw_floor("suite", 3).floor
    x0, y0, x1, y1 = floor.bounds
    points = np.stack(np.meshgrid(np.arange(x0, x1, 0.05), np.arange(y0, y1, 0.05)), axis=-1).reshape(-1, 2)
    chosen = np.random.default_rng(0).choice(len(points), 300, replace=False)
    assert floor.inside(points)[chosen].tolist() == [floor.inside(points[k])[0] for k in chosen]
    for space in floor.spaces:
        edges = np.concatenate([box.corners() for box in space.boxes])
        near = np.concatenate([points[chosen], edges])
        assert [space.holds(x, y) for x, y in near.tolist()] == space.contains(near).tolist()


def test_inside_follows_turned_frames():
    region = (Rectangle(x1=4.0, y1=3.0), Rectangle(x0=3.0, y0=-2.0, x1=4.0, y1=0.5))
    space = Space(x=1.0, y=2.0, yaw=0.6, region=region)
    union = rotate(box(0, 0, 4, 3).union(box(3, -2, 4, 0.5)), 0.6, origin=(0, 0), use_radians=True)
    union = translate(union, 1.0, 2.0)
    points = np.random.default_rng(3).uniform((-2, -2), (7, 7), (3000, 2))
    assert space.contains(points).tolist() == [union.covers(Point(point)) for point in points]
    assert unary_union([outline(part) for part in space.boxes]).symmetric_difference(union).area < 1e-9
    assert space.area == pytest.approx(union.area)


def test_doorways_name_the_spaces_on_their_sides():
    floor = two_rooms()
    lab, store, inner = floor.doorways
    assert [(way.spaces, way.exit) for way in floor.doorways] == [
        (("lab", "outside"), True),
        (("store", "outside"), True),
        (("lab", "store"), False),
    ]
    for way in floor.doorways:
        for name, point in zip(way.spaces, (0.4, -0.4), strict=True):
            x, y = way.x - math.sin(way.yaw) * point, way.y + math.cos(way.yaw) * point
            space = floor.space_at(x, y)
            assert (space.id if space else "outside") == name
    assert (lab.x, lab.y, lab.width) == pytest.approx((1.4, -0.1, 1.0))
    assert (store.x, store.y) == pytest.approx((9.2, 2.9))
    assert inner.side("store")[:2] == pytest.approx((6.1, 2.0))
    assert inner.side("lab")[:2] == pytest.approx((6.0, 2.0))
    assert [inner.opens_into(name) for name in inner.spaces] == [True, False]  # to the left of a wall toward +y
    assert inner.label == "the door between 'lab' and 'store' at (6.05, 2.00)"
    assert lab.label == "the exit of 'lab' at (1.40, -0.10)"


def test_bounds_are_those_of_everything():
    assert two_rooms().bounds == pytest.approx((-0.2, -0.2, 9.3, 5.2))
    assert Floor.rectangle(8.0, 6.0).bounds == pytest.approx((-0.2, -0.2, 8.2, 6.2))


def test_a_space_is_looked_up_by_place_and_by_id():
    floor = two_rooms()
    assert floor.space_at(7.0, 1.0) is floor.space("store") is floor.spaces[1]
    assert floor.space_at(6.05, 2.0) is None
    with pytest.raises(UnknownNameError, match="available: lab, store"):
        floor.space("bath")


def test_an_oblique_wall_bounds_a_region_of_steps():
    """A room whose back wall is oblique: its region is a staircase, yet the doorway and the enclosure are found."""
    slope = math.tan(0.15)
    walls = polygon_walls([(0, 0), (6, 0), (6, 4 + 6 * slope), (0, 4)], doors=(0, 2))
    steps = tuple(Rectangle(x0=k * 0.3, x1=(k + 1) * 0.3, y1=4.0 + k * 0.3 * slope) for k in range(20))
    floor = Floor(walls=walls, spaces=(Space(region=steps),))
    assert [way.spaces for way in floor.doorways] == [("laboratory", "outside")] * 2
    assert floor.doorways[1].gaps[0] < 0.05
    free = unary_union([outline(part) for part in floor.spaces[0].boxes])
    assert plan(floor).intersection(free).area < 1e-9


# One-room floors


@pytest.mark.parametrize(
    "room", [Room(width=8.0, depth=6.0), Room(width=5.0, depth=9.0, doors=(Door(wall="left", offset=3),))]
)
def test_a_rectangle_has_the_solids_of_its_four_walls(room):
    floor = room.floor
    assert floor.as_room is not None
    ring = box(-0.2, -0.2, room.width + 0.2, room.depth + 0.2).difference(box(0, 0, room.width, room.depth))
    assert plan(floor, 0.0, 0.1).symmetric_difference(ring).area < 1e-9
    assert [(way.spaces, way.exit) for way in floor.doorways] == [(("laboratory", "outside"), True)]


def test_a_floor_with_fixed_parts_is_no_plain_room():
    floor = Floor.rectangle(8.0, 6.0)
    column = replaced(floor, columns=(Column(id="c", x=4.0, y=3.0, width=0.4, depth=0.4),))
    assert column.as_room is None
    with pytest.raises(LabgymError, match="without columns; got 1 columns"):
        _ = column.room
    assert plan(column).contains(box(3.8, 2.8, 4.2, 3.2).buffer(-1e-9))
    served = replaced(floor, services=(Service(kind="water", x=0.0, y=3.0, z=1.0),))
    assert served.room == floor.room


def test_a_document_without_the_added_fields_keeps_its_bytes_and_its_hash():
    floor = Floor.rectangle(8.0, 6.0)
    wall = floor.model_dump(mode="json")["walls"][0]
    assert list(wall["openings"][0]) == ["kind", "position", "width", "height", "hinge", "swing"]
    assert list(floor.model_dump(mode="json")) == ["name", "walls", "spaces"]
    assert list(floor.model_dump(mode="json")["spaces"][0]) == ["id", "use", "x", "y", "yaw", "region", "ceiling"]


def test_a_floor_of_two_rooms_is_saved_hashed_and_pickled(tmp_path):
    floor = two_rooms()
    extra = {
        "columns": (Column(id="c1", x=3.0, y=2.5, width=0.3, depth=0.3, yaw=0.1),),
        "keep_outs": (KeepOut(id="k1", x=1.0, y=4.0, width=1.0, depth=1.0, reason="hatch"),),
        "services": (Service(kind="exhaust", x=2.0, y=5.0, z=3.0),),
    }
    layout = Layout(id="two", floor=replaced(floor, **extra), placements=())
    again = Layout.load(layout.save(tmp_path / "two.json"))
    assert (again.floor, again.hash) == (layout.floor, layout.hash)
    assert pickle.loads(pickle.dumps(again)).hash == layout.hash
    hashes = {layout.replace(floor=replaced(floor, **{name: value})).hash for name, value in extra.items()}
    plain = layout.replace(floor=floor).hash
    shut = layout.replace(floor=two_rooms(state="closed")).hash
    assert len({*hashes, plain, shut, layout.hash}) == 6
    with pytest.raises(LabgymError, match="one rectangular space; got 2 spaces"):
        _ = layout.room


# Refusals


def with_wall(index: int, **changes) -> Floor:
    floor = two_rooms()
    walls = list(floor.walls)
    walls[index] = replaced(walls[index], **changes)
    return replaced(floor, walls=tuple(walls))


def with_space(index: int, **changes) -> Floor:
    floor = two_rooms()
    spaces = list(floor.spaces)
    spaces[index] = replaced(spaces[index], **changes)
    return replaced(floor, spaces=tuple(spaces))


def without_doors(*walls: int) -> Floor:
    floor = two_rooms()
    kept = tuple(replaced(wall, openings=()) if k in walls else wall for k, wall in enumerate(floor.walls))
    return replaced(floor, walls=kept)


REFUSALS = {
    "door beyond the wall": (
        lambda: with_wall(4, openings=(Opening(position=4.8),)),
        r"the door at position 4\.8 m does not fit the 5 m wall: .* must be 0\.5 to 4\.5 m",
    ),
    "overlapping openings": (
        lambda: with_wall(4, openings=(Opening(position=2.0), Opening(position=2.7, kind="passage"))),
        r"position 2 m and the passage at position 2\.7 m overlap by 0\.30 m: move one",
    ),
    "opening above the wall": (
        lambda: with_wall(2, openings=(Opening(kind="window", position=2.0, sill=2.0, height=1.5),)),
        r"reaches 3\.5 m, above the wall's top at 3 m: lower it",
    ),
    "door with a sill": (lambda: Opening(position=1.0, sill=0.3), "has a sill of 0.3 m: set it to 0"),
    "narrow door": (lambda: Opening(position=1.0, width=0.4), r"width of the door .* must be 0\.6 to 4 m, got 0\.4 m"),
    "wall without length": (lambda: Wall(start=(1.0, 1.0), end=(1.0, 1.0)), "0 m long; at least 0.05 m"),
    "empty rectangle": (lambda: Rectangle(x0=2.0, x1=1.0, y1=1.0), "x1 = 1 m must exceed x0 = 2 m"),
    "two parts": (
        lambda: Space(region=(Rectangle(x1=1.0, y1=1.0), Rectangle(x0=2.0, x1=3.0, y1=1.0))),
        "rectangle 1 of space 'laboratory' does not touch the others",
    ),
    "overlapping spaces": (lambda: with_space(1, region=(Rectangle(x0=-1.0, x1=3.0, y1=5.0),)), "overlap by 0.90 m"),
    "space in a wall": (lambda: with_space(0, region=(Rectangle(x1=6.02, y1=5.0),)), r"overlaps wall 4 by 0\.02 m"),
    "same id": (lambda: with_space(1, id="lab"), "'lab' occurs twice"),
    "outside": (lambda: with_space(1, id="outside"), "beyond an exit: choose another"),
    "no door": (
        lambda: without_doors(1, 4),
        "space 'store' has no door: add a door or a passage",
    ),
    "no exit": (
        lambda: without_doors(0, 1),
        "the floor has no exit: add a door to the outside",
    ),
    "no wall": (lambda: replaced(two_rooms(), walls=two_rooms().walls[:3] + two_rooms().walls[4:]),
                r"space 'lab' has no wall within 1 m along 5\.00 m of its edge near \(0\.00, 2\.50\)"),
    "touching spaces": (
        lambda: replaced(two_rooms(), walls=two_rooms().walls[:4],
                        spaces=(Space(id="lab", region=(Rectangle(x1=6.0, y1=5.0),)),
                                Space(id="store", x=6.0, region=(Rectangle(x1=3.1, y1=5.0),)))),
        "touches another space along 5.00 m",
    ),
    "column in a doorway": (
        lambda: replaced(two_rooms(), columns=(Column(id="c", x=6.05, y=2.0, width=0.3, depth=0.3),)),
        "the door at position 2 m of wall 4 is blocked by column 0: move one of them",
    ),
    "door to nowhere": (
        lambda: replaced(two_rooms(), walls=(
            *two_rooms().walls, Wall(start=(12.0, 0.0), end=(14.0, 0.0), openings=(Opening(position=1.0),)))),
        "leads nowhere: no space lies within 0.35 m",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(REFUSALS))
def test_impossible_floors_are_refused_with_numbers_and_remedy(name):
    make, message = REFUSALS[name]
    with pytest.raises(ValidationError, match=message):
        make()


def test_the_file_of_an_impossible_floor_is_refused_in_one_line():
    data = json.loads(json.dumps(Layout(id="two", floor=two_rooms(), placements=()).to_json()))
    data["floor"]["spaces"][1]["x"] = 5.0
    with pytest.raises(DocumentError, match=r"field floor: spaces 'lab' and 'store' overlap by 1\.00 m") as caught:
        Layout.parse(data)
    assert "\n" not in str(caught.value)
