"""What the rules read of a building: two readings of one room agree, and polygons check floors of many spaces."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from floor_shapes import doorway, polygon_walls, two_rooms
from laboratories import put
from shapely import LineString, Point, Polygon, box, unary_union
from shapely.affinity import rotate, translate

from labgym.geometry import BoxArray, OrientedBox, pairwise_distance, pairwise_penetration
from labgym.layouts import Door, Layout, Room
from labgym.layouts.floor import Column, Floor, KeepOut, Rectangle, Space
from labgym.layouts.floors import FAMILIES, draw_floor
from labgym.layouts.relocation import free_places
from labgym.layouts.repair import fast_repair
from labgym.layouts.rules import facility, rule_set
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import bounds_faults
from labgym.layouts.rules.building import WEDGE, Building
from labgym.layouts.rules.egress import narrow_ways
from labgym.layouts.rules.facility.backs import back_distances
from labgym.layouts.rules.facility.fronts import blocked_front
from labgym.layouts.rules.facility.showers import shower_walks
from labgym.layouts.rules.site import Site
from labgym.layouts.rules.thresholds import profile
from labgym.layouts.rules.zones import INTRUSION, door_area, front_zone
from labgym.navigation import goal_pose

ROOM = Room(width=8.0, depth=6.0, doors=(Door(wall="front", offset=1.5), Door(wall="right", offset=3.0, width=1.2)))


class Sides:
    """A rectangular room by its four sides: the reference for floors, which are read from their walls."""

    def __init__(self, room: Room) -> None:
        self.room = room

    def clearance(self, xs, ys, reach):
        across, along = np.minimum(xs, self.room.width - xs), np.minimum(ys, self.room.depth - ys)
        return np.minimum(np.minimum(across[None, :], along[:, None]), reach)

    def outside(self, boxes: BoxArray):
        corners = boxes.corners()
        low, high = corners.min(axis=1), corners.max(axis=1)
        sides = np.maximum(-low, high - (self.room.width, self.room.depth)).max(axis=1)
        ends = np.maximum(-boxes.z[:, 0], boxes.z[:, 1] - self.room.height)
        return np.asarray(np.maximum(np.maximum(sides, ends), 0.0))

    def gaps(self, points):
        x, y = points[..., 0], points[..., 1]
        return np.stack([x, y, self.room.width - x, self.room.depth - y])

    def ahead(self, box: OrientedBox):
        room, (fx, fy) = self.room, box.front
        reaches = []
        for x, y in box.corners()[2:]:
            along_x = ((room.width if fx > 0 else 0.0) - x) / fx if abs(fx) > 1e-9 else math.inf
            along_y = ((room.depth if fy > 0 else 0.0) - y) / fy if abs(fy) > 1e-9 else math.inf
            reaches.append(min(along_x, along_y))
        return float(max(min(reaches), 0.0))

    def covers(self, zones):
        return np.array([penetrates(self.room, zone) <= INTRUSION for zone in zones])

    def lined(self, footprints: BoxArray, gap: float):
        room, corners = self.room, footprints.corners()
        length = 0.0
        for along, across, side, far in ((0, 1, room.width, room.depth), (1, 0, room.depth, room.width)):
            for near_wall in (corners[..., across], far - corners[..., across]):
                close = near_wall.min(axis=1) <= gap if len(footprints) else np.zeros(0, dtype=bool)
                spans = [(float(c[:, along].min()), float(c[:, along].max())) for c in corners[close]]
                length += covered(spans, side)
        return length / (2.0 * (room.width + room.depth))

    def skew(self, boxes: BoxArray):
        return np.array([abs(math.remainder(yaw, math.pi / 2.0)) for yaw in boxes.yaw.tolist()])


def penetrates(room: Room, zone: OrientedBox) -> float:
    x0, y0, x1, y1 = zone.bounds()
    return max(-x0, -y0, x1 - room.width, y1 - room.depth)


def covered(spans: list[tuple[float, float]], length: float) -> float:
    """Return the length of [0, length] that a union of intervals covers."""
    covered, reached = 0.0, 0.0
    for start, end in sorted(spans):
        start, end = max(start, reached), min(end, length)
        if end > start:
            covered += end - start
            reached = end
    return covered


ONE, MANY = Sides(ROOM), Building(ROOM.floor)


def outline(solid: OrientedBox) -> Polygon:
    return Polygon(solid.corners())


def random_boxes(seed: int, count: int, right_angles: bool = False) -> list[OrientedBox]:
    generator = np.random.default_rng(seed)
    x, y = generator.uniform(0.1, 7.9, count), generator.uniform(0.1, 5.9, count)
    width, depth = generator.uniform(0.3, 2.0, count), generator.uniform(0.3, 1.2, count)
    yaw = generator.integers(0, 4, count) * math.pi / 2 if right_angles else generator.uniform(-3.0, 3.0, count)
    rows = zip(x, y, width, depth, yaw, generator.uniform(-0.1, 2.0, count), strict=True)
    return [OrientedBox(*map(float, row[:5]), float(row[5]), float(row[5]) + 1.2) for row in rows]


def lab(floor: Floor, *placements) -> Arrangement:
    return Arrangement.of(Layout(id="lab", floor=floor, placements=placements))


# A room by its walls and by its sides


def test_boxes_reach_as_far_out_of_a_room_as_into_its_walls():
    boxes = BoxArray.of(random_boxes(1, 400))
    np.testing.assert_allclose(MANY.outside(boxes), ONE.outside(boxes), atol=1e-9)
    assert (ONE.outside(boxes) > 0.01).sum() > 100
    assert (ONE.outside(boxes) == 0.0).sum() > 30


def test_the_distances_from_walls_agree():
    points = np.random.default_rng(2).uniform((0.0, 0.0), (8.0, 6.0), (200, 4, 2))
    one, many = ONE.gaps(points), MANY.gaps(points)
    assert one.shape == many.shape == (4, 200, 4)
    np.testing.assert_allclose(np.sort(many, axis=0), np.sort(one, axis=0), atol=1e-9)


def test_the_free_depth_in_front_and_the_clear_zones_agree():
    checked = 0
    for solid in [*random_boxes(3, 300, right_angles=True), *random_boxes(4, 300)]:
        if ONE.outside(BoxArray.of([solid]))[0] > 0.01:
            continue  # a box in a wall has no free depth
        if math.isclose(math.remainder(solid.yaw, math.pi / 2), 0.0, abs_tol=1e-6):
            assert MANY.ahead(solid) == pytest.approx(ONE.ahead(solid), abs=1e-6)
        else:  # a turned front meets a wall with its corner or, at a corner of the room, before its corners do
            strip = Polygon([solid.to_world(x, y) for x, y in strip_of(solid)])
            walls = unary_union([outline(wall) for wall in ROOM.floor.solids])
            touched = strip.intersection(walls)
            turned = rotate(touched, -solid.yaw, origin=(solid.x, solid.y), use_radians=True)
            assert MANY.ahead(solid) == pytest.approx(max(turned.bounds[1] - solid.y - solid.depth / 2, 0.0), abs=1e-6)
        zone = front_zone(solid, 0.9)
        assert MANY.covers([zone]).tolist() == ONE.covers([zone]).tolist()
        checked += 1
    assert checked > 100


@pytest.mark.parametrize("family", FAMILIES)
def test_depths_and_spaces_by_neighborhood_are_those_of_all_walls_and_regions_to_the_bit(family):
    floor = draw_floor(family, 5).floor
    x0, y0, x1, y1 = floor.bounds
    generator = np.random.default_rng(6)
    count = 600
    centers = generator.uniform((x0 - 1.0, y0 - 1.0), (x1 + 1.0, y1 + 1.0), (count, 2))
    edges = [corner for space in floor.spaces for box in space.boxes for corner in box.corners()]
    centers[: len(edges)] = edges[:count]
    yaw = generator.choice([0.0, math.pi / 2, 0.3], count)
    boxes = BoxArray(
        centers, generator.uniform(0.0, 0.8, (count, 2)), yaw, np.sort(generator.uniform(-0.1, 3.5, (count, 2)))
    )
    plan = np.tile((-1000.0, 1000.0), (count, 1))
    building, regions = Building(floor), [(k, box) for k, space in enumerate(floor.spaces) for box in space.boxes]
    tall = BoxArray.of([replace(box, z0=-1000.0, z1=1000.0) for _, box in regions])
    distances = pairwise_distance(BoxArray(centers, np.zeros((count, 2)), yaw, plan), tall)
    nearest = np.array([k for k, _ in regions])[distances.argmin(axis=1)]
    assert building.spaces(boxes).tolist() == nearest.tolist()

    fixed = [part.box for part in floor.parts if part.kind in ("column", "leaf")]
    solids = BoxArray.of([replace(box, z0=-1000.0, z1=1000.0) for box in (*floor.wall_boxes, *fixed)])
    depths = pairwise_penetration(BoxArray(centers, boxes.half, yaw, plan), solids).max(axis=1)
    ceilings = np.array([space.ceiling for space in floor.spaces])[nearest]
    ends = np.maximum(-boxes.z[:, 0], boxes.z[:, 1] - ceilings)
    inner = distances.min(axis=1) == 0.0
    expected = np.maximum(np.maximum(depths, ends), 0.0)
    outside = building.outside(boxes)
    assert outside[inner].tolist() == expected[inner].tolist()
    far = distances.min(axis=1) > WEDGE
    assert outside[far].tolist() == np.maximum(expected, distances.min(axis=1))[far].tolist()
    assert inner.sum() > 50
    assert far.any()

    zones = [OrientedBox(*c, 2 * w, 2 * d, a) for c, (w, d), a in zip(centers, boxes.half, yaw, strict=True)]
    free = (pairwise_penetration(BoxArray(centers, boxes.half, yaw, plan), solids) <= INTRUSION).all(axis=1)
    assert building.covers(zones).tolist() == (free & (distances.min(axis=1) <= WEDGE)).tolist()


def strip_of(solid: OrientedBox):
    half, front = solid.width / 2 - 0.01, solid.depth / 2
    return (-half, front), (half, front), (half, front + 20), (-half, front + 20)


def test_the_clearance_of_grid_points_agrees():
    xs, ys = np.arange(321) * 0.025, np.arange(241) * 0.025
    np.testing.assert_allclose(MANY.clearance(xs, ys, 0.6), ONE.clearance(xs, ys, 0.6), atol=1e-9)


def test_the_angles_to_the_walls_and_the_lined_share_agree():
    boxes = BoxArray.of(random_boxes(5, 100))
    np.testing.assert_allclose(MANY.skew(boxes), ONE.skew(boxes), atol=1e-9)
    wall_units = BoxArray.of([OrientedBox(2.0, 0.4, 1.5, 0.7), OrientedBox(6.0, 5.6, 3.0, 0.7, math.pi)])
    assert ONE.lined(wall_units, 0.15) == pytest.approx(4.5 / 28.0)
    assert MANY.lined(wall_units, 0.15) == pytest.approx(4.5 / 28.0, abs=0.02)


def test_the_entrances_are_the_doors():
    for door, entrance in zip(ROOM.doors, MANY.entrances, strict=True):
        opening = doorway(ROOM, door)
        assert (entrance.exit, entrance.width, entrance.space) == (True, door.width, 0)
        assert entrance.pose == pytest.approx((opening.x, opening.y, opening.yaw))
        assert outline(entrance.area).symmetric_difference(outline(door_area(ROOM, door))).area < 1e-9
    assert MANY.workplaces[0].area == pytest.approx(ROOM.width * ROOM.depth)
    empty = Layout(id="empty", floor=ROOM.floor, placements=())
    assert facility.issues(facility.EXITS, Site(Arrangement.of(empty))) == []


# Many rooms


def test_an_object_in_a_wall_in_a_doorway_behind_a_wall_or_outside_is_out_of_bounds():
    floor = two_rooms()
    cases = {
        "free": (put("x", "LabBench", 3.0, 2.0), 0.0),
        "other room": (put("x", "LabBench", 7.6, 2.0), 0.0),
        "1 cm in the wall": (put("x", "LabBench", 6.0 - 0.75 + 0.01, 3.5), 0.0),
        "2 cm in the wall": (put("x", "LabBench", 6.0 - 0.75 + 0.02, 3.5), 0.02),
        "doorway": (put("x", "WasteBin", 6.05, 2.0), 0.05 + 0.15),
        "outside": (put("x", "WasteBin", 4.0, -1.0), 1.0),
    }
    for name, (placement, amount) in cases.items():
        faults = bounds_faults(lab(floor, placement))
        if amount:
            assert [fault.cause for fault in faults] == ["room"], name
            assert faults[0].amount == pytest.approx(amount, abs=1e-6), name
        else:
            assert faults == (), name


@pytest.mark.parametrize(
    ("x", "z"), [(5.5, 1.3), (6.6, 1.3), (8.42, 1.3), (7.2, 1.3), (7.2, 2.25), (7.2, 0.3), (8.2, 1.9)]
)
def test_an_object_on_a_wall_hangs_beside_windows(x, z):
    window = box(6.45, 1.0, 7.95, 2.2)  # in the plane of the back wall
    board = put("board", "NoticeBoard", x, 5.0 - 0.0125, z, yaw=math.pi, on="wall")
    covered = window.intersection(box(x - 0.45, z, x + 0.45, z + 0.6))
    faults = bounds_faults(lab(two_rooms(), board))
    assert [fault.cause for fault in faults] == ([] if covered.area < 1e-6 else ["surface"])


def test_an_object_in_a_column_or_in_an_open_leaf_is_out_of_bounds():
    rooms = two_rooms()
    column = Column(id="c", x=3.0, y=2.5, width=0.4, depth=0.4, yaw=0.5)
    floor = Floor(walls=rooms.walls, spaces=rooms.spaces, columns=(column,))
    bin_at = {"beside": (3.6, 2.5), "in": (3.2, 2.5), "leaf": (5.5, 1.5)}
    faulty = {name for name, (x, y) in bin_at.items() if bounds_faults(lab(floor, put("x", "WasteBin", x, y)))}
    assert faulty == {"in", "leaf"}


def oblique_floor() -> Floor:
    """A room of six walls, none at a right angle, with a region of steps."""
    turn, shift = 0.4, (2.0, -1.0)
    inner = Polygon([(0, 0), (8, 0), (8, 3), (4, 3.5), (3.5, 8), (0, 8)])
    room = translate(rotate(inner, turn, origin=(0, 0), use_radians=True), *shift)
    wedge = [Rectangle(x0=3.5 + k / 2, x1=4 + k / 2, y1=3.5 - k / 16) for k in range(9)]
    steps = [Rectangle(x1=4.0 - (k + 1) * 0.05, y1=3.5 + (k + 1) * 0.45) for k in range(10)] + wedge
    space = Space(x=shift[0], y=shift[1], yaw=turn, region=tuple(steps))
    return Floor(walls=polygon_walls(list(room.exterior.coords)[:-1]), spaces=(space,))


FLOORS = {"oblique": oblique_floor} | {
    f"{family} {seed}": partial(lambda family, seed: draw_floor(family, seed).floor, family, seed)
    for family in FAMILIES
    for seed in (1, 2)
}


@pytest.mark.parametrize("name", FLOORS)
def test_bounds_by_polygons(name):
    """Walls enclose the spaces, and furniture is out of bounds where its outline leaves the rooms between the walls."""
    floor = FLOORS[name]()
    walls = unary_union([outline(wall) for wall in floor.wall_boxes])
    holes = [Polygon(ring) for part in getattr(walls, "geoms", [walls]) for ring in part.interiors]
    fixed = unary_union([outline(part.box) for part in floor.parts if part.kind in ("column", "leaf")])
    rooms = []
    for space in floor.spaces:
        region = unary_union([outline(part) for part in space.boxes])
        (host,) = [hole for hole in holes if hole.buffer(0.011).covers(region)]
        rooms.append(host.difference(fixed))
    x0, y0, x1, y1 = floor.bounds
    low, high = (x0 - 1, y0 - 1, 0.2, 0.2, -3), (x1 + 1, y1 + 1, 1.5, 0.9, 3)
    rows = np.random.default_rng(0).uniform(low, high, (250, 5)).tolist()
    boxes = [OrientedBox(*row, 0.0, 1.0) for row in rows]
    amounts = Building(floor).outside(BoxArray.of(boxes)).tolist()
    for solid, amount in zip(boxes, amounts, strict=True):
        footprint = outline(solid)
        if any(room.buffer(1e-6).covers(footprint) for room in rooms):
            assert amount < 1e-5
        elif not any(room.buffer(0.02).covers(footprint) for room in rooms):
            assert amount > 0.01


def test_the_rules_of_a_space_look_at_that_space_only():
    floor = two_rooms()
    bench = put("bench", "LabBench", 5.62, 3.8, yaw=math.pi / 2)  # its back to the inner wall, used from the left
    rack = put("rack", "EquipmentRack", 6.6, 3.8)  # behind the wall
    arrangement = lab(floor, bench, rack)
    assert arrangement.spaces == [0, 1]
    assert back_distances(arrangement, [0])[0] == pytest.approx(6.0 - 5.62 - 0.375)
    turned = lab(floor, put("bench", "LabBench", 5.3, 3.8, yaw=-math.pi / 2), rack)  # its front faces the wall
    free, blockers = blocked_front(turned, 0, 1.2) or (None, None)
    assert (free, blockers) == (pytest.approx(6.0 - 5.3 - 0.375), ())


def test_both_sides_of_a_door_stay_free_and_the_leaf_has_its_swing():
    floor = two_rooms()  # the leaf opens into the laboratory
    areas = {(entrance.label.split(" at ")[0], entrance.space): entrance for entrance in Building(floor).entrances}
    lab_side = areas["the door between 'lab' and 'store'", 0].area
    store_side = areas["the door between 'lab' and 'store'", 1].area
    assert outline(lab_side).symmetric_difference(box(4.8, 1.4, 6.0, 2.6)).area < 1e-9
    assert outline(store_side).symmetric_difference(box(6.1, 1.5, 7.0, 2.5)).area < 1e-9
    for x, y, blocked in ((5.2, 2.0, "lab"), (6.6, 2.0, "store"), (7.3, 2.0, None), (6.6, 3.0, None)):
        rules = [
            issue.rule for issue in facility.issues(facility.PLACING, Site(lab(floor, put("x", "WasteBin", x, y))))
        ]
        assert ("door_area" in rules) == (blocked is not None), (x, y)


def test_furniture_in_a_keep_out_is_an_error():
    rooms = two_rooms()
    area = KeepOut(id="hatch", x=2.0, y=4.0, width=1.0, depth=1.0, yaw=0.3, reason="floor hatch")
    floor = Floor(walls=rooms.walls, spaces=rooms.spaces, keep_outs=(area,))
    (issue,) = facility.issues(facility.PLACING, Site(lab(floor, put("bin", "WasteBin", 2.3, 4.2))))
    assert (issue.rule, issue.severity, issue.ids) == ("keep_out", "error", ("bin",))
    assert issue.message == "bin in the keep-out 'hatch' (floor hatch): move it out"
    assert facility.issues(facility.PLACING, Site(lab(floor, put("bin", "WasteBin", 3.0, 4.2)))) == []


@pytest.mark.parametrize("width", [0.7, 0.8, 1.0])
@pytest.mark.parametrize("state", ["open", "closed"])
def test_the_way_out_leads_through_interior_doors(width, state):
    floor = two_rooms(width=width, state=state)
    bench = put("bench", "LabBench", 9.1 - 0.375, 1.5, yaw=math.pi / 2)  # in the store, used from the left
    ways = narrow_ways(lab(floor, bench))
    if width >= 0.9:
        assert ways == []
    else:  # the store has its own exit, so only the laboratory's leads through the narrow door
        (way,) = ways
        assert way.entrance.startswith("the exit of 'lab'")
        assert way.width == pytest.approx(width, abs=0.03)


@pytest.mark.parametrize("state", ["open", "closed"])
def test_people_walk_through_doors_to_the_emergency_shower(state):
    floor = two_rooms(state=state, angle=math.pi)
    hood = put("hood", "FumeHood", 3.0, 5.0 - 0.425, yaw=math.pi)
    shower = put("shower", "EmergencyShower", 7.6, 0.6)
    (walk,) = shower_walks(lab(floor, hood, shower)).values()
    corner = [(3.0, 5.0 - 0.85 - 0.6), (6.0, 2.2), (6.1, 2.2), goal_pose(lab(floor, shower).layout.box("shower"))[:2]]
    assert LineString(corner).length * 0.98 < walk < 1.09 * LineString(corner).length


def test_a_column_narrows_the_way_as_polygons_say():
    rooms = two_rooms(width=1.2)
    columns = tuple(
        Column(id=f"c{k}", x=4.5, y=y, width=0.5, depth=d, yaw=0.0) for k, (y, d) in enumerate(((0.9, 1.8), (3.8, 2.4)))
    )
    floor = Floor(walls=rooms.walls, spaces=rooms.spaces, columns=columns)
    bench = put("bench", "LabBench", 0.375, 2.2, yaw=-math.pi / 2)
    clear = LineString([(4.5, 1.8), (4.5, 2.6)]).length
    ways = {way.entrance: way.width for way in narrow_ways(lab(floor, bench))}
    (store,) = [value for name, value in ways.items() if "store" in name]
    assert store == pytest.approx(clear, abs=0.03)
    assert Point(4.5, 2.2).distance(unary_union([outline(part) for part in floor.solids])) == pytest.approx(clear / 2)


def test_repair_brings_furniture_back_into_its_room():
    floor = two_rooms()
    placements = (
        put("bench", "LabBench", 5.6, 3.6),  # 35 cm in the inner wall
        put("rack", "EquipmentRack", 8.8, 4.7),  # over the corner of the store
        put("bin", "WasteBin", 6.05, 2.0),  # in the doorway
        put("out", "WasteBin", 4.0, -1.0),
    )
    before = Layout(id="lab", floor=floor, placements=placements)
    assert len(bounds_faults(Arrangement.of(before))) == 4
    after = fast_repair(before)
    assert bounds_faults(Arrangement.of(after)) == ()
    moved = {item.id: math.dist(item.position, before.placement(item.id).position) for item in after.placements}
    assert moved["bench"] == pytest.approx(0.35, abs=0.01)
    assert moved["bin"] == pytest.approx(0.05 + 0.15, abs=0.15)
    assert floor.space_at(*after.placement("bench").position[:2]).id == "lab"


def test_free_places_are_in_the_same_room_at_its_walls():
    floor = two_rooms()
    layout = Layout(id="lab", floor=floor, placements=(put("rack", "EquipmentRack", 7.6, 2.5),))
    places = free_places(layout, "rack", 100)
    assert len(places) > 10
    store = box(6.1, 0.0, 9.1, 5.0)
    kept_free = unary_union([outline(entrance.area) for entrance in Building(floor).entrances if entrance.space == 1])
    size = layout.asset("rack").size
    for place in places:
        footprint = OrientedBox(place.x, place.y, size.width, size.depth, place.yaw)
        assert store.covers(outline(footprint))
        assert outline(footprint).intersection(kept_free).area < 0.05 * 1.2
        back = LineString(footprint.corners()[:2])
        assert store.exterior.distance(back) == pytest.approx(0.01, abs=1e-6)
        assert back.hausdorff_distance(store.exterior.intersection(back.buffer(0.011))) < 0.02


def test_exits_are_counted_for_each_laboratory():
    floor = two_rooms(width=0.8)
    walls = tuple(wall.model_copy(update={"openings": ()}) if k == 4 else wall for k, wall in enumerate(floor.walls))
    apart = Floor(walls=walls, spaces=floor.spaces)

    def rules(floor: Floor):
        site = Site(lab(floor), None, profile("code"))
        return [(issue.rule, issue.message) for issue in facility.issues(rule_set("paper").facility, site)]

    assert [rule for rule, _ in rules(floor)] == ["exit_width"]
    assert "the door between 'lab' and 'store' at (6.05, 2.00) is 0.80 m wide" in rules(floor)[0][1]
    ((rule, message),) = rules(apart)
    assert rule == "second_exit"
    assert message.startswith("only one exit for 30 m² in 'lab'; above 18.6 m² two are required")


def test_a_room_without_a_door_is_an_error_of_its_score():
    empty = Layout(id="empty", floor=Room(width=4.0, depth=4.0, doors=()).floor, placements=())
    (issue,) = facility.issues(facility.EXITS, Site(Arrangement.of(empty)))
    assert (issue.rule, issue.severity, issue.message) == ("no_exit", "error", "no exit for 16 m²: add a door")
