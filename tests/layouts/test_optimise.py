"""What a user gets back from `optimise` after moving furniture by hand."""

import math

import pytest
from inward_rooms import inward
from shapely import Polygon

from labgym.errors import InfeasibleError
from labgym.layouts import Layout, Placement, generate, optimise, refine
from labgym.layouts.moves import Move, Place, Rotate, apply, replaced
from labgym.layouts.repair import fast_repair
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.protocols import protocols

PROTOCOL = protocols()["sub_01"]


@pytest.fixture(scope="module")
def layout() -> Layout:
    return generate("sub_01", 3, "roomy")


def assess(layout: Layout) -> Assessment:
    return evaluate_layout(layout, PROTOCOL, navigation=True, rules="paper")


def moved_alone(layout: Layout, placement: str, dx: float, dy: float) -> Layout:
    """Move furniture as an edit of the JSON does: what stands on it stays where it was."""
    item = layout.placement(placement)
    x, y, z = item.position
    return replaced(layout, {placement: item.model_copy(update={"position": (x + dx, y + dy, z)})})


def distance_to_wall(layout: Layout, placement: str) -> float:
    """Farther end of the back edge to the nearest wall."""
    box = layout.box(placement)
    ends = [box.to_world(side * box.width / 2.0, -box.depth / 2.0) for side in (-1.0, 1.0)]
    room = layout.room
    return min(
        max(abs(value) for value in values)
        for values in (
            [x for x, _ in ends],
            [y for _, y in ends],
            [room.width - x for x, _ in ends],
            [room.depth - y for _, y in ends],
        )
    )


@pytest.mark.parametrize("bench", ["SinkBench_1", "PreparationBench_1", "FumeHood_1", "FlammableCabinet_1"])
def test_objects_left_behind_by_their_furniture_return_to_it(layout: Layout, bench: str) -> None:
    children = {child.id for child in layout.children(bench)}
    assert children
    forward = layout.box(bench).front
    edited = moved_alone(layout, bench, 0.9 * forward[0], 0.9 * forward[1])
    before = assess(edited)
    assert before.v >= len(children)
    after = optimise(edited, PROTOCOL, rules="paper")
    assert assess(after).v == 0
    surface_of = Polygon(after.box(bench).corners()).buffer(0.01)
    # Glassware that the apparatus on it held may come to stand on the furniture itself.
    assert {child.id for child in after.children(bench)} >= children
    assert all(surface_of.covers(Polygon(after.box(child).corners())) for child in children)


@pytest.mark.parametrize("turn", [0.0, 0.7, math.pi])
def test_a_cabinet_left_in_the_middle_of_the_room_returns_to_a_wall(layout: Layout, turn: float) -> None:
    cabinet = next(item for item in layout.placements if layout.asset(item.id).storage_class == "General")
    island = next(item for item in layout.placements if item.asset.startswith(("Island", "Peninsula")))
    box = layout.box(island.id)
    x, y = box.x, box.y - box.depth / 2.0 - 0.3
    parked = apply(layout, Place(cabinet.id, x, y, turn))
    assert distance_to_wall(parked, cabinet.id) > 0.15
    after = optimise(parked, PROTOCOL, rules="paper")
    assert assess(after).cost == 0
    assert distance_to_wall(after, cabinet.id) <= 0.15


def test_a_stool_left_in_a_doorway_is_put_aside(layout: Layout) -> None:
    door = layout.room.doors[0]
    assert door.wall == "front"
    stool = next(item for item in layout.placements if item.asset == "LabStool")
    x, y, _ = stool.position
    edited = moved_alone(layout, stool.id, door.offset - x, 0.35 - y)
    assert [issue.rule for issue in assess(edited).errors] == ["door_area"]
    after = optimise(edited, PROTOCOL, rules="paper")
    assert (assess(after).v, assess(after).errors) == (0, ())
    x, y, _ = after.placement(stool.id).position
    assert abs(x - door.offset) > 0.6 or y > 1.2


def test_a_cabinet_that_faces_its_wall_is_turned_round(layout: Layout) -> None:
    cabinet = next(item for item in layout.placements if layout.asset(item.id).storage_class == "Flammable")
    edited = apply(layout, Rotate(cabinet.id, cabinet.yaw + math.pi))
    assert evaluate_layout(edited, PROTOCOL, rules="paper").v == 0
    after = optimise(edited, PROTOCOL, rules="paper")
    assert assess(after).cost == 0
    box = after.box(cabinet.id)
    x, y = box.to_world(0.0, box.depth / 2.0 + 0.5)
    assert 0.0 < x < after.room.width
    assert 0.0 < y < after.room.depth


def pinned(layout: Layout, *ids: str) -> Layout:
    return replaced(layout, {item: layout.placement(item).model_copy(update={"fixed": True}) for item in ids})


@pytest.mark.parametrize("repair", [fast_repair, optimise, lambda spoilt: refine(spoilt, PROTOCOL, rules="paper")])
def test_fixed_objects_never_move(layout: Layout, repair) -> None:
    fixed = ("SinkBench_1", "IslandBench_1" if "IslandBench_1" in layout.by_id else "FumeHood_1")
    sink = layout.box(fixed[0])
    spoilt = pinned(layout, *fixed)
    for other in ("GlasswareCabinet_1", "PreparationBench_1"):
        item = spoilt.placement(other)
        spoilt = apply(spoilt, Move(other, sink.x + 0.2 - item.position[0], sink.y - item.position[1]))
    assert evaluate_layout(spoilt, PROTOCOL, rules="paper").v > 0
    after = repair(spoilt)
    for item in fixed:
        assert after.placement(item) == spoilt.placement(item)
    assert evaluate_layout(after, PROTOCOL, rules="paper").v < evaluate_layout(spoilt, PROTOCOL, rules="paper").v


def test_two_fixed_objects_that_collide_are_reported_and_stay(layout: Layout) -> None:
    sink = layout.placement("SinkBench_1")
    item = layout.placement("GlasswareCabinet_1")
    spoilt = apply(layout, Move(item.id, sink.position[0] - item.position[0], sink.position[1] - item.position[1]))
    spoilt = pinned(spoilt, sink.id, item.id)
    after = optimise(spoilt, PROTOCOL, rules="paper")
    assert after.placement(sink.id) == spoilt.placement(sink.id)
    assert after.placement(item.id) == spoilt.placement(item.id)
    assert any(set(collision.ids) == {sink.id, item.id} for collision in assess(after).collisions)


def test_a_fixed_object_in_a_door_area_is_named_at_once() -> None:
    sink = Placement(id="old_sink", asset="SinkBench", position=(1.5, 0.4, 0.0))
    with pytest.raises(InfeasibleError, match=r"old_sink in the 1\.00 x 0\.90 m area inside the exit of 'laboratory'"):
        generate("sub_01", 4, "bay", fixed=(sink,))


def test_generate_keeps_fixed_objects_and_lets_them_take_their_role() -> None:
    sink = Placement(id="old_sink", asset="SinkBench", position=(7.6, 6.0, 0.0), yaw=math.pi / 2.0)
    pillar = Placement(id="pillar", asset="EquipmentRack", position=(3.0, 9.7, 0.0), yaw=math.pi)
    shelf = Placement(id="high", asset="WallShelf", position=(0.125, 5.0, 1.4), yaw=-math.pi / 2.0, support="wall")
    layout = generate("sub_01", 4, "bay_large", fixed=(sink, pillar, shelf))
    for placement in (sink, pillar, shelf):
        kept = layout.placement(placement.id)
        assert (kept.position, kept.yaw, kept.support, kept.fixed) == (
            placement.position, placement.yaw, placement.support, True,
        )  # fmt: skip
    assert [item.id for item in layout.placements if item.asset == "SinkBench"] == ["old_sink"]
    assert assess(layout).cost == 0
    assert assess(layout).missing == ()


DAMAGES = {
    "an island pushed into the hood": (
        "sub_03", 9110, {"IslandBench_1": (6.64, 6.6, 0.0), "GlasswareCabinet_1": (7.12, 7.16, -math.pi / 2.0)},
    ),
    "a cabinet in the doorway": ("cyc_04", 9120, {"GlasswareCabinet_1": (1.5, 0.6, -math.pi / 2.0)}),
    "five pieces moved at once": (
        "pro_05", 9128,
        {
            "FumeHood_1": (3.71, 7.23, math.pi), "SinkBench_1": (-0.38, 5.31, -math.pi / 2.0),
            "EyewashStation_1": (4.03, 7.96, math.pi), "IslandBench_1": (3.68, 2.95, 0.0),
            "EquipmentRack_1": (-0.37, 8.6, -math.pi / 2.0),
        },
    ),
}  # fmt: skip
"""Protocol, seed, and where furniture is put: x, y in meters and yaw. Single moves do not repair these layouts."""


@pytest.mark.parametrize("damage", DAMAGES)
def test_furniture_is_rearranged_where_single_moves_do_not_help(damage: str) -> None:
    name, seed, edits = DAMAGES[damage]
    spoilt = generate(name, seed, inward("bay"))
    for item, (x, y, yaw) in edits.items():
        spoilt = apply(spoilt, Place(item, x, y, yaw))
    protocol = protocols()[name]
    assert evaluate_layout(spoilt, protocol, navigation=True, rules="paper").cost > 0
    after = optimise(spoilt, protocol, rules="paper")
    assert evaluate_layout(after, protocol, navigation=True, rules="paper").cost == 0
    assert {item.id for item in after.placements} == {item.id for item in spoilt.placements}
    for item in edits:
        if not item.startswith("IslandBench"):
            assert distance_to_wall(after, item) <= 0.15


def test_a_board_behind_tall_furniture_moves_and_fixed_furniture_stays(layout: Layout) -> None:
    tall = next(
        item for item in layout.placements if item.support == "floor" and layout.asset(item.id).size.height >= 1.9
    )
    board = next(item for item in layout.placements if item.asset == "NoticeBoard")
    box = layout.box(tall.id)
    x, y = box.to_world(0.0, -box.depth / 2.0 + 0.02)
    spoilt = apply(layout, Place(board.id, x, y, tall.yaw))
    spoilt = pinned(spoilt, *(item.id for item in layout.placements if item.support == "floor"))
    assert assess(spoilt).v > 0
    after = optimise(spoilt, PROTOCOL, rules="paper")
    assert assess(after).v == 0
    assert all(after.placement(item.id) == item for item in spoilt.placements if item.support == "floor")
