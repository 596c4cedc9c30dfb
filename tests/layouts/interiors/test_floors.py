"""Furnished floors of all families, checked by polygons: bounds, overlaps, doors, fronts, ways, and their variety."""

import math
from collections import Counter
from itertools import combinations

import pytest
from shapely import Point, Polygon, unary_union

from labgym.errors import InfeasibleError, OptionError
from labgym.geometry import OrientedBox
from labgym.layouts import Layout, generate, reasons
from labgym.layouts.batch import folder_layouts, generate_batch
from labgym.layouts.floor import Floor, Rectangle, Room, Space
from labgym.layouts.floors import draw_floor
from labgym.layouts.generate import resolve_request
from labgym.layouts.interiors import FloorProposer
from labgym.layouts.placement import FLOOR
from labgym.layouts.sites import FloorFile
from labgym.navigation import goal_poses
from labgym.protocols import protocols

FAMILIES = ("bay", "ell", "double", "suite", "refit")


def request(family, seed, protocol="sub_01"):
    return resolve_request(protocol, seed, None, "default", None, (), family=family)


def polygon(box: OrientedBox) -> Polygon:
    return Polygon(box.corners())


def furniture(layout: Layout) -> dict[str, Polygon]:
    return {p.id: polygon(layout.box(p.id)) for p in layout.placements if p.support == FLOOR}


def rooms(floor: Floor) -> Polygon:
    """The floor of the spaces, without columns and walls."""
    solid = [polygon(part.box) for part in floor.parts if part.kind in ("column", "leaf")]
    spaces = unary_union([polygon(box) for space in floor.spaces for box in space.boxes])
    return spaces.difference(unary_union([*solid, *(polygon(box) for box in floor.wall_boxes)]))


def ways(layout: Layout, radius: float) -> list[Polygon]:
    """The regions in which the center of a disc moves, through interior doors too."""
    floor = layout.floor
    spaces = unary_union([polygon(box) for space in floor.spaces for box in space.boxes])
    wedges = spaces.buffer(0.36, join_style="mitre")  # what a region of rectangles leaves along an oblique wall
    solid = [polygon(part.box) for part in floor.parts if part.kind != "lintel"]
    free = wedges.difference(unary_union([*furniture(layout).values(), *solid])).buffer(-radius)
    return list(getattr(free, "geoms", [free]))


@pytest.mark.cases(5)
@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("seed", [3, 11])
def test_furniture_overlaps_nothing_and_ways_lead_from_every_exit_to_every_goal(family, seed):
    asked = request(family, seed)
    layout = FloorProposer().propose(asked)
    shapes, inside = furniture(layout), rooms(layout.floor)
    assert {layout.asset(p.id).role for p in layout.placements} >= set(asked.protocol.locations)
    for name, shape in shapes.items():
        assert inside.buffer(0.01).covers(shape), name
    for (first, one), (second, other) in combinations(shapes.items(), 2):
        assert one.intersection(other).area < 1e-9, (first, second)
    corridors = [polygon(box) for space in layout.floor.spaces if space.use == "corridor" for box in space.boxes]
    assert all(shape.intersection(corridor).area < 1e-9 for shape in shapes.values() for corridor in corridors)
    for way in layout.floor.doorways:
        for space in way.spaces:
            if space != "outside":
                x, y, yaw = way.side(space)
                inner = OrientedBox(x - 0.44 * math.sin(yaw), y + 0.44 * math.cos(yaw), way.width, 0.88, yaw)
                assert all(shape.intersection(polygon(inner)).area < 1e-9 for shape in shapes.values())
    regions = ways(layout, 0.30)
    exits = [way for way in layout.floor.doorways if way.exit]
    starts = []
    for way in exits:
        x, y, yaw = way.side(way.spaces[0])
        starts.append(Point(x - 0.4 * math.sin(yaw), y + 0.4 * math.cos(yaw)))
    goals = [Point(x, y) for x, y, _ in goal_poses(layout, asked.protocol).values()]
    homes = [min(range(len(regions)), key=lambda k: regions[k].distance(point)) for point in (*starts, *goals)]
    assert all(regions[home].distance(point) < 0.03 for home, point in zip(homes, (*starts, *goals), strict=True))
    assert exits
    assert len(set(homes)) == 1


def test_hoods_stand_on_every_wall_as_named_from_the_main_door():
    """On its own wall least often: hoods keep 3 m from doors where they can."""
    sides: Counter[str] = Counter()
    for seed in range(9):
        try:
            layout = FloorProposer().plan(request("bay", seed)).layout()
        except InfeasibleError:
            continue
        door = next(way for way in layout.floor.doorways if way.exit)
        _, _, yaw = door.side(door.spaces[0])
        for placement in layout.placements:
            if layout.asset(placement.id).fume_hood:
                quarter = round((placement.yaw - yaw) / (math.pi / 2.0)) % 4
                sides[("same", "right", "opposite", "left")[quarter]] += 1
    assert min(sides[side] for side in ("same", "right", "opposite", "left")) >= 0.05 * sides.total()


def test_a_hall_holds_as_many_times_the_furniture_as_it_is_larger():
    counts = []
    for side in (10.0, 40.0):
        asked = resolve_request("sub_01", 1, None, "default", None, (), floor=Room(width=side, depth=side).floor)
        plan = FloorProposer().plan(asked)
        counts.append(len(plan.brief.units))
        assert plan.brief.furnishing == "full"
    assert counts[1] > 100
    assert counts[1] > 3 * counts[0]


@pytest.mark.slow
def test_the_same_seed_furnishes_the_same_floor_and_another_seed_another():
    layouts = [FloorProposer().propose(request("ell", seed)) for seed in (4, 4, 5)]
    assert layouts[0].hash == layouts[1].hash
    assert layouts[0].hash != layouts[2].hash


def test_several_protocols_share_what_they_need_and_keep_all_their_constraints():
    names = ["sub_01", "red_02", "con_01"]
    asked = request("suite", 2, names)
    layout = generate(names, 2, family="suite")
    assert [protocol.id for protocol in layout.protocols] == names
    placed = Counter(layout.asset(placement.id).role for placement in layout.placements)
    catalog = layout.catalog
    for name in names:
        needed = Counter(catalog.find(asset).name for asset in protocols()[name].required_assets())
        assert all(placed[asset] >= count for asset, count in needed.items())
    alone = sum(len(protocols()[name].instruments) for name in names)
    assert len(asked.protocol.instruments) < alone


def test_what_cannot_be_is_refused_in_one_line():
    small = Room(width=3.0, depth=3.0).floor
    with pytest.raises(InfeasibleError, match="'custom'"):
        generate("sub_01", 0, floor=small)
    with pytest.raises(OptionError, match="exclude each other"):
        generate("sub_01", 0, room="bay", family="bay")
    with pytest.raises(OptionError, match="named twice"):
        generate(["sub_01", "sub_01"], 0)
    corridor = Floor(
        walls=Room(width=8.0, depth=8.0).floor.walls,
        spaces=(Space(use="corridor", region=(Rectangle(x1=8.0, y1=8.0),)),),
    )
    with pytest.raises(InfeasibleError, match="corridor"):
        generate("sub_01", 0, floor=corridor)


def test_a_floor_file_is_furnished_like_the_floor_and_what_is_fixed_stays(tmp_path):
    floor = draw_floor("ell", 3).floor
    path = FloorFile(**{name: getattr(floor, name) for name in Floor.model_fields}).save(tmp_path / "floor.json")
    layout = generate("sub_01", 3, floor=floor)
    assert generate("sub_01", 3, room=path).hash == layout.hash
    saved = Layout.load(layout.save(tmp_path / "layout.json"))
    assert saved.provenance == layout.provenance
    assert saved.hash == layout.hash
    assert set(reasons(resolve_request("sub_01", 3, floor=floor))) <= set(layout.by_id)
    sink = layout.find("SinkBench").model_copy(update={"id": "sink"})
    other = generate("sub_01", 4, floor=floor, fixed=[sink])
    assert other.placement("sink").position == sink.position
    assert sum(placement.asset == "SinkBench" for placement in other.placements) == 1


def test_a_batch_of_a_family_draws_a_floor_for_each_seed(tmp_path):
    batch = generate_batch(["sub_01"], 2, tmp_path / "batch", seed=8, family="ell", progress=False)
    layouts = list(folder_layouts(tmp_path / "batch"))
    assert batch.layouts == 2
    assert [layout.hash for layout in layouts] == [generate("sub_01", seed, family="ell").hash for seed in (8, 9)]
    assert layouts[0].floor != layouts[1].floor
