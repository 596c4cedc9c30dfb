"""OB and CN against shapely, MuJoCo and closed forms."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from laboratories import put
from shapely.geometry import Polygon
from shapely.geometry import box as rectangle

from labgym.assets import Catalog
from labgym.layouts import Door, Layout, Placement, Room
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.bounds import bounds_faults
from labgym.layouts.rules.collisions import Collision, collisions

ROOM = Room(width=8.0, depth=6.0, height=3.0, doors=(Door(wall="front", offset=1.2),))


def faults(*placements: Placement) -> dict[tuple[str, str], float]:
    found = bounds_faults(Arrangement.of(Layout(id="test", floor=ROOM.floor, placements=placements)))
    return {(fault.id, fault.cause): fault.amount for fault in found}


def colliding(*placements: Placement) -> tuple[Collision, ...]:
    return collisions(Arrangement.of(Layout(id="test", floor=ROOM.floor, placements=placements)))


BENCH = put("bench", "LabBench", 4.0, 3.0)  # 1.5 x 0.75 x 0.9 m


@pytest.mark.parametrize(
    ("x", "beyond"), [(0.75, None), (0.741, None), (0.739, 0.011), (0.5, 0.25), (7.25, None), (7.30, 0.05)]
)
def test_an_object_may_reach_a_centimetre_out_of_the_room(x: float, beyond: float | None) -> None:
    found = faults(put("bench", "LabBench", x, 3.0))
    assert found == ({} if beyond is None else {("bench", "room"): pytest.approx(beyond)})


def test_a_turned_footprint_is_out_of_the_room_where_its_polygon_is() -> None:
    rng = np.random.default_rng(0)
    interior = rectangle(0.0, 0.0, ROOM.width, ROOM.depth).buffer(0.010, join_style="mitre")
    seen = set()
    for _ in range(200):
        bench = put("bench", "LabBench", *rng.uniform(0.3, 5.7, 2), yaw=rng.uniform(-3.1, 3.1))
        layout = Layout(id="test", floor=ROOM.floor, placements=(bench,))
        outside = not interior.contains(Polygon(layout.box("bench").corners()))
        assert (("bench", "room") in faults(bench)) == outside
        seen.add(outside)
    assert seen == {True, False}


def test_a_cabinet_taller_than_the_room_is_out_of_it() -> None:
    low = ROOM.model_copy(update={"height": 2.3})
    layout = Layout(id="test", floor=low.floor, placements=(put("hood", "FumeHood", 4.0, 5.5, yaw=math.pi),))
    assert [(fault.id, fault.cause) for fault in bounds_faults(Arrangement.of(layout))] == [("hood", "room")]


@pytest.mark.parametrize(("over", "cause"), [(0.0, None), (0.0049, None), (0.0051, 0.0051), (0.30, 0.30)])
@pytest.mark.parametrize("yaw", [0.0, math.pi / 2, 2.0])
def test_an_item_may_hang_half_a_centimetre_over_the_edge(over: float, cause: float | None, yaw: float) -> None:
    bench = BENCH.model_copy(update={"yaw": yaw})
    along = 0.75 - 0.07 / 2 + over  # beaker 0.07 m wide, at the end of a bench 1.5 m long
    x, y = 4.0 + along * math.cos(yaw), 3.0 + along * math.sin(yaw)
    found = faults(bench, put("beaker", "Beaker", x, y, 0.9, yaw, "bench", 0))
    assert found == ({} if cause is None else {("beaker", "surface"): pytest.approx(cause)})


@pytest.mark.parametrize(("lift", "cause"), [(0.0049, None), (-0.0049, None), (0.0051, 0.0051), (-0.02, 0.02)])
def test_an_item_may_float_or_sink_half_a_centimetre(lift: float, cause: float | None) -> None:
    found = faults(BENCH, put("beaker", "Beaker", 4.0, 3.0, 0.9 + lift, on="bench", slot=0))
    assert found == ({} if cause is None else {("beaker", "height"): pytest.approx(cause)})


def test_floor_objects_stand_on_the_floor() -> None:
    assert faults(put("bench", "LabBench", 4.0, 3.0, 0.006)) == {("bench", "height"): pytest.approx(0.006)}


def test_shelves_are_told_apart_by_their_slot() -> None:
    cabinet = put("cabinet", "FlammableCabinet", 4.0, 3.0)
    second = Catalog.load().get("FlammableCabinet").surfaces[1].z
    assert faults(cabinet, put("bottle", "Acetone", 4.0, 3.0, second, on="cabinet", slot=1)) == {}
    wrong = faults(cabinet, put("bottle", "Acetone", 4.0, 3.0, second, on="cabinet", slot=0))
    assert set(wrong) == {("bottle", "height")}


@pytest.mark.parametrize(
    ("x", "y", "yaw", "causes"),
    [
        (4.0, 0.165, 0.0, set()),  # back flush with the front wall; the wall cabinet is 0.33 m deep
        (7.835, 3.0, math.pi / 2, set()),
        (4.0, 0.184, 0.0, set()),
        (4.0, 0.186, 0.0, {"surface"}),
        (4.0, 3.0, 0.0, {"surface"}),
        (4.0, 0.14, 0.0, {"room"}),
        (4.0, 0.37, 0.5, {"surface"}),  # only a corner near the wall
    ],
)
def test_a_wall_object_hangs_at_any_height_with_a_side_along_a_wall(
    x: float, y: float, yaw: float, causes: set[str]
) -> None:
    found = faults(put("shelf", "WallCabinet", x, y, 1.4, yaw, "wall"))
    assert {cause for _, cause in found} == causes


@pytest.mark.parametrize(("gap", "collides"), [(0.0, False), (-0.0009, False), (-0.0011, True), (0.2, False)])
def test_objects_collide_when_they_interpenetrate_by_more_than_a_millimetre(gap: float, collides: bool) -> None:
    found = colliding(BENCH, put("other", "LabBench", 5.5 + gap, 3.0))
    assert bool(found) == collides
    if collides:
        assert found[0].ids == ("bench", "other")
        assert found[0].depth == pytest.approx(-gap)
        assert found[0].volume == pytest.approx(-gap * 0.75 * 0.9)


def test_standing_on_a_surface_is_no_collision_and_sinking_into_it_is() -> None:
    assert colliding(BENCH, put("beaker", "Beaker", 4.0, 3.0, 0.9, on="bench", slot=0)) == ()
    assert len(colliding(BENCH, put("beaker", "Beaker", 4.0, 3.0, 0.89, on="bench", slot=0))) == 1


HOOD = put("hood", "FumeHood", 4.0, 3.0)  # inside 1.3 x 0.7 m, 25 mm to the front; 0.9 to 2.1 m high


@pytest.mark.parametrize(
    ("x", "y", "z", "collides"),
    [
        (4.0, 3.0, 0.9, False),
        (4.0 + 0.65 - 0.035, 3.0, 0.9, False),  # beaker flush with the side wall
        (4.0 + 0.65 - 0.033, 3.0, 0.9, True),
        (4.0, 3.0 + 0.425 - 0.05, 0.9, True),  # in the sash
        (4.0, 3.0, 0.85, True),  # in the worktop
        (4.0, 3.0, 2.05, True),  # in the top
        (4.0, 3.0, 0.0, True),  # in the base
    ],
)
def test_an_item_in_a_hood_collides_with_its_shell_and_not_with_its_hollow(
    x: float, y: float, z: float, collides: bool
) -> None:
    assert bool(colliding(HOOD, put("beaker", "Beaker", x, y, z, on="hood", slot=0))) == collides


def test_a_shelf_is_solid() -> None:
    cabinet = put("cabinet", "FlammableCabinet", 4.0, 3.0)
    second = Catalog.load().get("FlammableCabinet").surfaces[1].z
    assert len(colliding(cabinet, put("bottle", "Acetone", 4.0, 3.0, second - 0.1, on="cabinet", slot=0))) == 1


def test_a_pair_counts_once_however_many_solids_meet() -> None:
    found = colliding(HOOD, put("other", "FumeHood", 4.4, 3.1, yaw=0.3))
    assert [collision.ids for collision in found] == [("hood", "other")]


def test_doors_windows_and_the_robot_are_no_objects() -> None:
    placements = (put("door", "LabDoor", 1.0, 0.0, on="wall"), put("robot", "MobileManipulator", 1.0, 1.0))
    layout = Layout(id="test", floor=ROOM.floor, placements=placements)
    assert len(Arrangement.of(layout)) == 0
    assert bounds_faults(Arrangement.of(layout)) == ()
    assert collisions(Arrangement.of(layout)) == ()


def test_unrolled_solids_are_the_layouts_own() -> None:
    layout = Layout(id="test", floor=ROOM.floor, placements=scattered(0))
    solids = Arrangement.of(layout).solids(range(len(layout.placements)))
    for row, placement in enumerate(layout.placements):
        first, count = solids.starts[row], solids.counts[row]
        own = layout.solids(placement.id)
        assert count == len(own)
        boxes = solids.boxes
        expected = [
            (solid.x, solid.y, solid.width / 2, solid.depth / 2, solid.yaw, solid.z0, solid.z1) for solid in own
        ]
        unrolled = np.column_stack([boxes.centre, boxes.half, boxes.yaw, boxes.z])[first : first + count]
        np.testing.assert_allclose(unrolled, expected, atol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_collisions_are_the_pairs_that_mujoco_finds_in_contact(seed: int) -> None:
    placements = scattered(seed)
    layout = Layout(id="test", floor=ROOM.floor, placements=placements)
    depths = {collision.ids: collision.depth for collision in collisions(Arrangement.of(layout))}
    contacts = mujoco_pairs(layout)
    assert {pair for pair, depth in depths.items() if depth > 0.002} <= contacts.keys()
    assert {pair for pair, depth in contacts.items() if depth > 0.002} <= depths.keys()
    assert len(depths) > 5


def scattered(seed: int) -> tuple[Placement, ...]:
    rng = np.random.default_rng(seed)
    names = ("LabBench", "FlammableCabinet", "FumeHood", "Beaker", "Centrifuge", "DryingOven")
    found = []
    for k in range(40):
        x, y = rng.uniform(1.0, 5.0, 2)
        yaw = float(rng.choice([0.0, math.pi / 2, rng.uniform(-3.0, 3.0)]))
        found.append(put(f"p{k:02}", str(rng.choice(names)), x, y, float(rng.choice([0.0, 0.9, 1.2])), yaw))
    return tuple(found)


def mujoco_pairs(layout: Layout) -> dict[tuple[str, str], float]:
    """Deepest MuJoCo contact of each pair of placements, each placement a mocap body of box geoms."""
    spec = mujoco.MjSpec()
    for placement in layout.placements:
        body = spec.worldbody.add_body(name=placement.id, mocap=True)
        for solid in layout.solids(placement.id):
            half = [solid.width / 2, solid.depth / 2, (solid.z1 - solid.z0) / 2]
            turn = [math.cos(solid.yaw / 2), 0.0, 0.0, math.sin(solid.yaw / 2)]
            centre = [solid.x, solid.y, (solid.z0 + solid.z1) / 2]
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=half, pos=centre, quat=turn)
    spec.worldbody.add_body(pos=[0, 0, 50]).add_freejoint()
    spec.bodies[-1].add_geom(size=[0.01, 0, 0])
    model = spec.compile()
    data = mujoco.MjData(model)
    pairs: dict[tuple[str, str], float] = {}
    fromto = np.zeros(6)
    for i, first in enumerate(layout.placements):
        for second in layout.placements[i + 1 :]:
            mujoco.mj_kinematics(model, data)
            depth = max(
                -mujoco.mj_geomDistance(model, data, a, b, 0.1, fromto)
                for a in geoms(model, first.id)
                for b in geoms(model, second.id)
            )
            if depth > 0.0:
                pairs[first.id, second.id] = depth
    return pairs


def geoms(model: mujoco.MjModel, body: str) -> range:
    row = model.body(body).id
    return range(model.body_geomadr[row], model.body_geomadr[row] + model.body_geomnum[row])
