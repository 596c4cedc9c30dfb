"""ROS maps: read as map_server reads them, they show the floor; the outline comes back within a cell."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest
from laboratories import island_laboratory
from PIL import Image
from shapely import Point, Polygon, hausdorff_distance, union_all
from shapely.affinity import translate

from exchange.floors import FLOORS, chamfered, ell, rectangle, region, turned
from labgym.errors import DocumentError, LabgymError, OptionError
from labgym.exchange.formats import empty_layout
from labgym.exchange.ros_files import RosMap
from labgym.exchange.ros_map import write_ros_map
from labgym.exchange.ros_outline import _walled, read_ros_map
from labgym.layouts import load_published, published
from labgym.layouts.floor import Door, Floor
from labgym.layouts.floors import draw_floor


def map_server(path):
    """Return occupancy (-1, 0, 100) as map_server's trinary mode does, row 0 at the bottom, resolution and origin."""
    text = path.read_text()
    field = {name: re.search(rf"^{name}: (.+)$", text, re.MULTILINE)[1] for name in ("image", "resolution", "origin")}
    number = {
        name: float(re.search(rf"^{name}: (.+)$", text, re.MULTILINE)[1])
        for name in ("negate", "occupied_thresh", "free_thresh")
    }
    pixels = np.asarray(Image.open(path.parent / field["image"]).convert("L")).astype(float)[::-1]
    occupancy = pixels / 255.0 if number["negate"] else (255.0 - pixels) / 255.0
    values = np.full(pixels.shape, -1)
    values[occupancy > number["occupied_thresh"]] = 100
    values[occupancy < number["free_thresh"]] = 0
    origin = [float(each) for each in field["origin"].strip("[]").split(",")]
    return values, float(field["resolution"]), origin


@pytest.mark.cases(4)
@pytest.mark.parametrize("name", FLOORS)
@pytest.mark.parametrize("resolution", [0.05, 0.02])
def test_the_map_shows_what_is_free_solid_and_unknown(tmp_path, name, resolution):
    floor = FLOORS[name]()
    values, cell, (x0, y0, yaw) = map_server(write_ros_map(empty_layout(floor), tmp_path / "ros", resolution))
    assert (cell, yaw) == (resolution, 0.0)
    ways = [wall.piece(*o.span, 0, 1) for wall in floor.walls for o in wall.openings if o.kind in ("door", "passage")]
    ways = union_all([Polygon(way.corners()) for way in ways])
    columns = [part.box for part in floor.parts if part.kind == "column"]
    solid = union_all([Polygon(each.corners()) for each in floor.wall_boxes]).difference(ways)
    solid = solid.union(union_all([Polygon(each.corners()) for each in columns]))
    free = union_all([region(space) for space in floor.spaces]).union(ways).difference(solid)
    rng = np.random.default_rng(7)
    bounds = free.union(solid).buffer(2.0 * resolution).bounds
    half = 1.42 * resolution  # beyond the diagonal of a cell
    areas = (free.buffer(-half), solid.buffer(-half), free.union(solid).buffer(half))
    for x, y in rng.uniform(bounds[:2], bounds[2:], (400, 2)):
        value = values[math.floor((y - y0) / cell), math.floor((x - x0) / cell)]
        point = Point(x, y)
        if areas[0].contains(point):
            assert value == 0
        elif areas[1].contains(point):
            assert value == 100
        elif not areas[2].contains(point):
            assert value == -1


def test_furniture_is_occupied_and_what_hangs_high_is_not(tmp_path):
    layout = island_laboratory()
    values, cell, (x0, y0, _) = map_server(write_ros_map(layout, tmp_path / "ros"))
    for placement in layout.placements:
        x, y, _ = placement.position
        assert values[math.floor((y - y0) / cell), math.floor((x - x0) / cell)] == 100
    values, *_ = map_server(write_ros_map(layout, tmp_path / "low", below=0.0))
    x, y, _ = layout.placement("IslandBench1800_1").position
    assert values[math.floor((y - y0) / cell), math.floor((x - x0) / cell)] == 0


SHAPES = {
    "rectangle": rectangle,
    "ell": ell,
    "chamfered": chamfered,
    "oblique rectangle": lambda: turned(rectangle(), 0.4),
    "oblique ell": lambda: turned(ell(), -0.7),
}


@pytest.mark.cases(4)
@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("resolution", [0.05, 0.025])
def test_the_outline_comes_back_within_a_cell(tmp_path, name, resolution):
    floor = SHAPES[name]()
    again = read_ros_map(write_ros_map(empty_layout(floor), tmp_path / "ros", resolution))
    (before,), (after,) = floor.spaces, again.spaces
    one, other = region(before), region(after)
    # The lower left corner of what is read is the origin; shapes are compared with their middles on each other.
    shift = np.subtract(one.envelope.centroid.coords[0], other.envelope.centroid.coords[0])
    moved = translate(other, *shift)
    stairs = 0.09 if name == "chamfered" else 0.0
    assert hausdorff_distance(one, moved) <= math.sqrt(2.0) * resolution + stairs
    assert len(again.doorways) == len(floor.doorways)
    widths = [sorted(way.width for way in each.doorways) for each in (floor, again)]
    assert widths[0] == pytest.approx(widths[1], abs=2.0 * resolution)
    places = [[(way.x, way.y) for way in each.doorways] for each in (floor, again)]
    places[1] = [(x + shift[0], y + shift[1]) for x, y in places[1]]
    for place in places[0]:
        assert min(math.dist(place, other) for other in places[1]) <= 2.0 * resolution
    assert again.walls[0].thickness == pytest.approx(floor.walls[0].thickness, abs=1.01 * resolution)


@pytest.mark.parametrize(("family", "seed"), [("double", 1), ("double", 4), ("suite", 0), ("suite", 3), ("refit", 2)])
def test_rooms_and_passages_come_back_within_two_cells(tmp_path, family, seed):
    floor = draw_floor(family, seed).floor
    again = read_ros_map(write_ros_map(empty_layout(floor), tmp_path / "ros"))
    low = [np.min([region(space).bounds[:2] for space in each.spaces], axis=0) for each in (floor, again)]
    shift = low[0] - low[1]
    rooms = [translate(region(space), *shift) for space in again.spaces]
    assert len(rooms) == len(floor.spaces)
    for space in floor.spaces:
        own = region(space)
        other = max(rooms, key=lambda room: room.intersection(own).area)
        assert other.symmetric_difference(own).area < 2.0 * 0.05 * own.length
    ways = [np.array([(way.x, way.y) for way in each.doorways]) for each in (floor, again)]
    assert len(ways[0]) == len(ways[1])
    apart = np.linalg.norm(ways[0][:, None] - (ways[1] + shift)[None], axis=-1)
    assert apart.min(axis=1).max() < 0.2  # walls are up to two cells thicker than they were
    assert len(set(apart.argmin(axis=1))) == len(ways[0])


@pytest.mark.parametrize("name", published("test")[::5])
def test_furnished_rooms_have_no_inner_walls(tmp_path, name):
    layout = load_published("test", name)
    room = read_ros_map(write_ros_map(layout, tmp_path / "ros")).room
    assert (room.width, room.depth) == pytest.approx((layout.room.width, layout.room.depth), abs=0.051)
    assert len(room.doors) == len(layout.room.doors)


@pytest.mark.cases(10)
@pytest.mark.parametrize("name", published("floors-seen"))
def test_rows_of_furniture_between_inner_walls_do_not_prevent_reading(tmp_path, name):
    layout = load_published("floors-seen", name)
    again = read_ros_map(write_ros_map(layout, tmp_path / "ros"))
    area = sum(region(space).area for space in layout.floor.spaces)
    assert sum(region(space).area for space in again.spaces) == pytest.approx(area, rel=0.06)


def test_a_door_that_may_be_as_wide_as_the_robot_needs_is_so_wide(tmp_path):
    floor = Floor.rectangle(6.0, 5.0, doors=(Door(wall="front", offset=2.0, width=0.7),))
    (way,) = read_ros_map(write_ros_map(empty_layout(floor), tmp_path / "ros", 0.05)).doorways
    assert way.width == pytest.approx(0.72, abs=1e-3)


def test_furniture_does_not_disturb_the_outline(tmp_path):
    layout = island_laboratory()
    room = read_ros_map(write_ros_map(layout, tmp_path / "ros")).room
    assert (room.width, room.depth) == pytest.approx((layout.room.width, layout.room.depth), abs=0.05)
    assert room.doors[0].offset == pytest.approx(layout.room.doors[0].offset, abs=0.05)


def test_a_map_as_a_robot_records_it_is_read(tmp_path):
    """Walls one cell thick, gray noise in the unknown, a PGM, an origin elsewhere, turned."""
    pixels = np.full((140, 180), 205, np.uint8)
    pixels[20:120, 20:160] = 254
    for rows, columns in ((slice(19, 20), slice(19, 161)), (slice(120, 121), slice(19, 161))):
        pixels[rows, columns] = 0
    pixels[19:121, 19] = pixels[19:121, 160] = 0
    pixels[120, 40:60] = 254
    pixels[60:63, 165:168] = 0
    Image.fromarray(pixels[::-1]).save(tmp_path / "office.pgm")
    lines = ("image: office.pgm", "resolution: 0.05", "origin: [-3.5, 12.0, 0.5]", "negate: 0")
    (tmp_path / "office.yaml").write_text("\n".join((*lines, "occupied_thresh: 0.65", "free_thresh: 0.196")))
    floor = read_ros_map(tmp_path / "office.yaml")
    (space,) = floor.spaces
    size = sorted((space.region[0].x1, space.region[0].y1))
    assert size == pytest.approx([5.0, 7.0], abs=0.05)
    assert [way.width for way in floor.doorways] == pytest.approx([1.0], abs=0.1)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"image": "../map.png"}, "outside the folder"),
        ({"image": "/etc/passwd"}, "outside the folder"),
        ({"image": "none.png"}, "No such file"),
        ({"resolution": "nan"}, "number"),
        ({"resolution": "-0.05"}, "must be"),
        ({"resolution": "100"}, "must be"),
        ({"origin": "[0, 0]"}, "origin"),
        ({"mode": "raw"}, "mode"),
        ({"free_thresh": "0.9"}, "free_thresh"),
        ({"image": "*a"}, "has an alias"),
        ({"image": "[a"}, "not valid YAML"),
    ],
)
def test_a_damaged_description_is_one_line(tmp_path, change, words):
    path = write_ros_map(empty_layout(rectangle()), tmp_path / "ros")
    fields = dict(line.split(": ", 1) for line in path.read_text().splitlines()) | change
    path.write_text("\n".join(f"{name}: {value}" for name, value in fields.items()))
    with pytest.raises(DocumentError, match=words) as caught:
        read_ros_map(path)
    assert "\n" not in str(caught.value)


def test_maps_without_floor_or_door_are_refused(tmp_path):
    for name, gray in (("unknown", 205), ("free", 254)):
        (tmp_path / name).mkdir()
        path = write_ros_map(empty_layout(rectangle()), tmp_path / name / "ros")
        Image.fromarray(np.full((60, 60), gray, np.uint8)).save(path.parent / "map.png")
        with pytest.raises(LabgymError):
            read_ros_map(path)


def test_a_resolution_that_fills_the_memory_is_refused(tmp_path):
    with pytest.raises(OptionError, match="cells"):
        write_ros_map(empty_layout(rectangle()), tmp_path / "ros", resolution=1e-4)


def test_the_share_of_walls_of_rooms_that_hang_together_by_two_cells_is_counted():
    """The boundary falls into two parts where walls are looked for. Oracle: all cells are occupied, or none is."""
    from shapely import box

    neck = box(0.0, 0.0, 2.0, 2.0) | box(2.0, 0.95, 3.0, 1.05) | box(3.0, 0.0, 5.0, 2.0)
    for value in (True, False):
        cells = np.full((40, 100), value)
        assert _walled(RosMap(cells, ~cells, 0.05, (0.0, 0.0, 0.0)), neck) == value
    assert _walled(RosMap(cells, ~cells, 0.05, (0.0, 0.0, 0.0)), box(0.0, 0.0, 2.0, 0.04)) == 0.0
