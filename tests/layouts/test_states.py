"""Open drawers and doors of placements: the document, and everything that reads solids."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from shapely.geometry import Point, Polygon

from labgym.assets.articulation import joints
from labgym.assets.meshes.normals import corner_normals
from labgym.errors import DocumentError
from labgym.layouts import Door, Layout, Placement, Room, load_published, published
from labgym.layouts.rules.objective import evaluate_layout
from labgym.navigation import PLANNING_RADIUS, occupancy
from labgym.navigation.barriers import Barriers
from labgym.scenes import RayScene, contacts, scene_mesh, to_mjcf, write_glb
from labgym.scenes.mesh import smooth_normals

BENCH = Placement(id="bench", asset="LabBench", position=(3.0, 0.5, 0.0))
CABINET = Placement(id="cabinet", asset="FlammableCabinet", position=(1.2, 0.4, 0.0))


def layout_of(*placements):
    room = Room(width=6.0, depth=5.0, doors=(Door(wall="back", offset=4.0),))
    return Layout(id="states", floor=room.floor, placements=placements)


def opened(placement, **state):
    return placement.model_copy(update={"state": tuple(sorted(state.items()))})


def test_a_state_is_a_mapping_in_the_file_and_absent_without_one(tmp_path):
    plain, open_ = layout_of(BENCH), layout_of(opened(BENCH, drawer_1=0.5, door_1=0.25))
    assert "state" not in plain.to_json()["placements"][0]
    assert open_.to_json()["placements"][0]["state"] == {"door_1": 0.25, "drawer_1": 0.5}
    again = Layout.load(open_.save(tmp_path / "open.json"))
    assert again.placements == open_.placements
    assert again.hash == open_.hash != plain.hash
    swapped = Placement(**{**BENCH.model_dump(), "state": {"drawer_1": 0.5, "door_1": 0.25}})
    assert swapped == open_.placements[0]
    assert hash(swapped) == hash(open_.placements[0])


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ({"drawer_9": 0.5}, "drawer_9"),
        ({"drawer_1": 1.5}, "less than or equal to 1"),
        ({"drawer_1": "wide"}, "number"),
        ({"Drawer": 0.5}, "pattern"),
        ([["door_1", 0.5], ["door_1", 0.6]], "twice"),
    ],
)
def test_a_wrong_state_is_refused_in_one_line(state, message):
    data = layout_of(BENCH).to_json()
    data["placements"][0]["state"] = state
    with pytest.raises(DocumentError, match=message) as caught:
        Layout.parse(data, "lab.json")
    assert "placements.0.state" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_state_changes_the_hash():
    layout = load_published("test", published("test")[0])
    bench = next(p for p in layout.placements if joints(layout.asset(p.id)))
    name = next(iter(joints(layout.asset(bench.id))))
    changed = layout.replace(
        placements=tuple(opened(p, **{name: 0.5}) if p.id == bench.id else p for p in layout.placements)
    )
    assert changed.hash != layout.replace(seed_hash=None).hash


def test_an_open_drawer_is_as_far_in_front_of_the_bench_as_its_travel():
    layout = layout_of(opened(BENCH, drawer_1=1.0))
    joint = joints(layout.asset("bench"))["drawer_1"]
    (part,) = layout.open_parts("bench")
    front = joint.solid.y + joint.solid.depth / 2.0
    assert part.y + part.depth / 2.0 == pytest.approx(0.5 + front + joint.travel)
    assert part in list(layout.obstacles(1.4))
    assert part not in list(layout.obstacles(0.1))
    assert layout.open_parts("bench") == tuple(box for box in layout.solids("bench") if box == part)


@pytest.mark.parametrize("geometry", ["solid", "visual"])
def test_rays_meet_open_drawers_and_doors(geometry):
    state = {"drawer_1": 1.0}
    shut, wide = layout_of(BENCH, CABINET), layout_of(opened(BENCH, **state), opened(CABINET, door_1=0.8, door_2=0.8))
    joint = joints(wide.asset("bench"))["drawer_1"]
    x, z = 3.0 + joint.solid.x + 0.2, (joint.solid.z0 + joint.solid.z1) / 2.0
    origins = np.array([[x, 3.0, z], [1.35, 3.0, 0.7]])
    toward = np.array([[0.0, -1.0, 0.0], [0.0, -1.0, 0.0]])
    before, _ = RayScene(shut, geometry).cast(origins, toward)
    after, _ = RayScene(wide, geometry).cast(origins, toward)
    # The drawer comes closer by its travel; the bounding box of the bench stands in front of its closed drawers.
    margin = 0.001 if geometry == "visual" else 0.06
    assert before[0] - after[0] == pytest.approx(joint.travel, abs=margin)
    assert after[1] - before[1] > 0.3  # the ray now ends at the back of the cabinet


def test_the_normals_of_open_parts_are_those_of_their_faces():
    layout = layout_of(opened(BENCH, drawer_1=0.7, door_1=0.3), CABINET)
    mesh = scene_mesh(layout)
    expected = corner_normals(mesh.vertices, mesh.faces)
    assert smooth_normals(mesh, layout) == pytest.approx(expected, abs=1e-4)


def test_the_mujoco_scene_has_the_solids_of_the_layout():
    layout = layout_of(opened(BENCH, drawer_1=0.7, door_1=0.3), opened(CABINET, door_2=0.6))
    model = to_mjcf(layout).compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for placement in layout.placements:
        for k, box in enumerate(layout.solids(placement.id)):
            geom = model.geom(f"{placement.id}/solid/{k}").id
            assert data.geom_xpos[geom] == pytest.approx([box.x, box.y, (box.z0 + box.z1) / 2.0], abs=1e-9)
            assert model.geom_size[geom] * 2.0 == pytest.approx([box.width, box.depth, box.z1 - box.z0])
            axis = data.geom_xmat[geom].reshape(3, 3)[:2, 0]
            assert axis == pytest.approx([math.cos(box.yaw), math.sin(box.yaw)], abs=1e-9)


def test_navigation_keeps_its_distance_from_open_parts():
    shut, wide = layout_of(CABINET), layout_of(opened(CABINET, door_1=0.8))
    (leaf,) = wide.open_parts("cabinet")
    polygon = Polygon(leaf.corners())
    tip = max(leaf.corners(), key=lambda corner: corner[1])
    probe = tip + np.array([0.0, 0.1])
    assert not occupancy(shut).dilated(PLANNING_RADIUS - 0.1).occupied.all()
    assert occupancy(shut).free(*tip)
    assert not occupancy(wide).free(*(tip - np.array([0.0, 0.02])))
    clearance = Barriers.of(wide).clearance(np.array([probe]))[0]
    assert clearance == pytest.approx(polygon.distance(Point(probe)), abs=1e-6)
    assert Barriers.of(shut).clearance(np.array([probe]))[0] > clearance + 0.2


def test_rules_and_contacts_find_what_an_open_part_touches():
    stool = Placement(id="stool", asset="LabStool", position=(3.0, 1.2, 0.0))
    shut = layout_of(BENCH, stool)
    wide = layout_of(opened(BENCH, drawer_2=1.0), stool)
    for layout, pairs in ((shut, []), (wide, [{"bench", "stool"}])):
        assert [{c.a, c.b} for c in contacts(layout)] == pairs
        violations = evaluate_layout(layout, None, navigation=False, rules="paper").violations.of("collision")
        assert [set(v.ids) for v in violations] == pairs


def test_an_open_part_in_the_area_of_a_door_is_an_error():
    base = Placement(id="base", asset="LabBench1200", position=(2.85, 4.3, 0.0), yaw=-math.pi / 2.0)
    rules = []
    for placement in (base, opened(base, drawer_1=1.0, drawer_2=1.0)):
        issues = evaluate_layout(layout_of(placement), None, navigation=False, rules="paper").errors
        rules.append([issue for issue in issues if issue.rule == "door_area"])
    assert len(rules[1]) == len(rules[0]) + 1


def test_a_glb_scene_shows_open_parts(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    places = []
    for name, placement in (("shut", BENCH), ("open", opened(BENCH, drawer_1=1.0))):
        scene = trimesh.load(write_glb(layout_of(placement), tmp_path / f"{name}.glb"))
        bench = [n for n in scene.graph.nodes_geometry if n.startswith("bench/")]
        reach = []
        for node in bench:
            matrix, geometry = scene.graph[node]
            reach.append(trimesh.transform_points(scene.geometry[geometry].vertices, matrix)[:, 2].min())
        places.append(min(reach))
    shut, wide = places  # y of the room is -z of glTF
    assert shut - wide == pytest.approx(joints(layout_of(BENCH).asset("bench"))["drawer_1"].travel - 0.018, abs=0.02)


def test_usd_assets_show_open_parts():
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    from labgym.assets.usd.stages import asset_layer

    depths = []
    for state in ((), (("drawer_1", 1.0),)):
        stage = Usd.Stage.Open(asset_layer(layout_of(BENCH).asset("bench"), state))
        cache = UsdGeom.BBoxCache(Usd.TimeCode.Default(), ["default", "render"])
        depths.append(cache.ComputeWorldBound(stage.GetDefaultPrim()).ComputeAlignedRange().GetMax()[1])
    assert depths[1] - depths[0] == pytest.approx(0.4, abs=0.02)
