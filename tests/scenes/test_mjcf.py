"""The compiled model has the bodies, poses and solids of the layout."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from labgym.assets import Catalog
from labgym.assets.shapes import MATERIALS, build
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout, Placement, Room
from labgym.scenes import to_mjcf, views
from labgym.scenes.building import building_patches
from labgym.scenes.mjcf import COLLISION_GROUP, VISUAL_GROUP, SpecBuilder, looks_of


@pytest.fixture(scope="module")
def model(laboratory: Layout) -> mujoco.MjModel:
    return to_mjcf(laboratory).compile()


def geoms(model: mujoco.MjModel, body: str, group: int) -> np.ndarray:
    return np.flatnonzero((model.geom_bodyid == model.body(body).id) & (model.geom_group == group))


def test_there_is_one_body_for_each_placement_named_by_its_id(model: mujoco.MjModel, laboratory: Layout) -> None:
    names = [model.body(index).name for index in range(1, model.nbody)]
    assert names == [placement.id for placement in laboratory.placements]


def test_bodies_stand_where_the_layout_puts_them(model: mujoco.MjModel, laboratory: Layout) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for placement in laboratory.placements:
        body = data.body(placement.id)
        front = body.xmat.reshape(3, 3)[:, 1]
        assert body.xpos == pytest.approx(placement.position, abs=1e-12)
        assert front == pytest.approx([-math.sin(placement.yaw), math.cos(placement.yaw), 0.0], abs=1e-12)


def test_nothing_moves_by_itself(model: mujoco.MjModel) -> None:
    assert model.nv == 0
    assert model.nu == 0


def test_visible_parts_collide_with_nothing_and_are_as_many_as_the_shape_has(
    model: mujoco.MjModel, laboratory: Layout
) -> None:
    for placement in laboratory.placements:
        visible = geoms(model, placement.id, VISUAL_GROUP)
        assert len(visible) == len(build(laboratory.asset(placement.id)))
        assert not model.geom_contype[visible].any()
        assert not model.geom_conaffinity[visible].any()


def test_solids_have_the_volume_and_bounds_of_the_assets_solids(model: mujoco.MjModel, laboratory: Layout) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for placement in laboratory.placements:
        solid = geoms(model, placement.id, COLLISION_GROUP)
        boxes = laboratory.solids(placement.id)
        expected = sum(box.width * box.depth * (box.z1 - box.z0) for box in boxes)
        assert (8.0 * model.geom_size[solid].prod(axis=1)).sum() == pytest.approx(expected, rel=1e-9)
        for geom, box in zip(solid, boxes, strict=True):
            middle = [box.x, box.y, (box.z0 + box.z1) / 2.0]
            assert data.geom_xpos[geom] == pytest.approx(middle, abs=1e-9)
            turned = data.geom_xmat[geom].reshape(3, 3)[:, 0]
            assert turned == pytest.approx([math.cos(box.yaw), math.sin(box.yaw), 0.0], abs=1e-9)


def test_a_hollow_asset_is_hollow_to_the_physics(model: mujoco.MjModel) -> None:
    """Looking down from inside the hood one meets its worktop; the hood's roof is above."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    only_solids = np.array([0, 0, 0, 1, 0, 0], dtype=np.uint8)
    hit, inside = np.zeros(1, dtype=np.int32), np.array([2.35, 4.55, 1.5])
    down = mujoco.mj_ray(model, data, inside, np.array([0.0, 0.0, -1.0]), only_solids, 1, -1, hit)
    assert down == pytest.approx(0.6, abs=1e-6)
    up = mujoco.mj_ray(model, data, inside, np.array([0.0, 0.0, 1.0]), only_solids, 1, -1, hit)
    assert up == pytest.approx(0.6, abs=1e-6)


def test_a_ball_dropped_in_the_room_comes_to_rest_on_the_floor(laboratory: Layout) -> None:
    spec = to_mjcf(laboratory)
    ball = spec.worldbody.add_body(name="ball", pos=[3.2, 3.4, 0.6])
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0.0, 0.0])
    model = spec.compile()
    data = mujoco.MjData(model)
    for _ in range(1500):
        mujoco.mj_step(model, data)
    assert data.body("ball").xpos[2] == pytest.approx(0.1, abs=2e-3)


@pytest.mark.parametrize(
    ("direction", "limit"), [((-1.0, 0.0), 0.0), ((1.0, 0.0), 6.0), ((0.0, -1.0), 0.0), ((0.0, 1.0), 5.0)]
)
def test_walls_and_closed_doors_stop_a_ball_that_is_pushed_against_them(
    direction: tuple[float, float], limit: float
) -> None:
    empty = Layout(id="empty", floor=Room(width=6.0, depth=5.0).floor, placements=())
    spec = to_mjcf(empty)
    spec.option.gravity = [4.0 * direction[0], 4.0 * direction[1], 0.0]
    ball = spec.worldbody.add_body(name="ball", pos=[1.5, 2.5, 0.5])
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.1, 0.0, 0.0])
    model = spec.compile()
    data = mujoco.MjData(model)
    for _ in range(2500):
        mujoco.mj_step(model, data)
    along = 0 if direction[0] else 1
    assert data.body("ball").xpos[along] == pytest.approx(limit - 0.1 * direction[along], abs=5e-3)


def test_every_asset_of_the_catalogue_compiles() -> None:
    assets = Catalog.load().assets
    room = Room(width=50.0, depth=50.0)
    placements = tuple(
        Placement(id=f"thing_{k}", asset=asset.name, position=(2.0 + 2.5 * (k % 19), 2.0 + 2.5 * (k // 19), 0.0))
        for k, asset in enumerate(assets)
    )
    model = to_mjcf(Layout(id="all", floor=room.floor, placements=placements)).compile()
    assert model.nbody == len(assets) + 1


def test_without_visible_parts_the_solids_are_the_same(model: mujoco.MjModel, laboratory: Layout) -> None:
    bare = to_mjcf(laboratory, visible=False).compile()
    solid = model.geom_group == COLLISION_GROUP
    assert bare.nmesh == 0
    assert bare.ngeom == solid.sum()
    names = [model.geom(index).name for index in np.flatnonzero(solid)]
    assert [bare.geom(index).name for index in range(bare.ngeom)] == names
    assert bare.geom_size == pytest.approx(model.geom_size[solid])
    assert bare.geom_pos == pytest.approx(model.geom_pos[solid])


@pytest.mark.parametrize("moving", [{}, {"interactive": True}, {"interactive": True, "loose": True}])
@pytest.mark.parametrize("branch", [1, 7])
def test_branches_of_any_size_give_the_scene_whose_bodies_are_added_one_by_one(
    laboratory: Layout, moving: dict[str, bool], branch: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def add_directly(scene: SpecBuilder, name: str, position: tuple[float, ...], yaw: float) -> mujoco.MjsBody:
        turn = [math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)]
        return scene.spec.worldbody.add_body(name=name, pos=position, quat=turn)

    def compiled() -> tuple[str, bytes]:
        spec = to_mjcf(laboratory, **moving)
        model = spec.compile()
        content = np.zeros(mujoco.mj_sizeModel(model), dtype=np.uint8)
        mujoco.mj_saveModel(model, None, content)
        return spec.to_xml(), content.tobytes()

    with monkeypatch.context() as patch:
        patch.setattr(SpecBuilder, "add_body", add_directly)
        expected = compiled()
    monkeypatch.setattr("labgym.scenes.mjcf.BRANCH_BODIES", branch)
    assert compiled() == expected


def test_equal_parts_share_one_mesh(laboratory: Layout) -> None:
    model = to_mjcf(laboratory).compile()
    first, second = (
        {int(model.geom_dataid[geom]) for geom in geoms(model, name, VISUAL_GROUP)} for name in ("acetone", "acetone_2")
    )
    assert first == second


def test_cameras_are_the_views_and_look_at_their_targets(model: mujoco.MjModel, laboratory: Layout) -> None:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    cameras = views(laboratory)
    assert {"overview", "topdown", "door", "hood", "bench", "cabinet"} <= set(cameras)
    assert "clock" not in cameras
    for name, view in cameras.items():
        camera = data.camera(name)
        towards = np.array(view.target) - np.array(view.position)
        assert -camera.xmat.reshape(3, 3)[:, 2] == pytest.approx(towards / np.linalg.norm(towards), abs=1e-9)
        assert model.camera(name).fovy[0] == pytest.approx(view.fovy)


@pytest.mark.parametrize("size", [(8.0, 8.0), (6.6, 7.2), (7.0, 13.0), (12.0, 4.0)])
def test_the_overview_holds_the_whole_floor(size: tuple[float, float]) -> None:
    width, depth = size
    view = views(Layout(id="empty", floor=Room(width=width, depth=depth).floor, placements=()))["overview"]
    corners = np.array([(x, y, 0.0) for x in (0.0, width) for y in (0.0, depth)])
    local = (corners - np.array(view.position)) @ view.axes().T
    tall = math.tan(math.radians(view.fovy / 2.0))
    assert (local[:, 2] < 0.0).all()
    assert (np.abs(local[:, 1] / local[:, 2]) < tall).all()
    assert (np.abs(local[:, 0] / local[:, 2]) < tall * 16.0 / 9.0).all()


def test_materials_of_the_model_are_the_materials_of_the_shapes(model: mujoco.MjModel) -> None:
    for index in range(model.nmat):
        name = model.material(index).name
        look, textured = MATERIALS[looks_of(name)], model.mat_texid[index].max() >= 0
        expected = (1.0, 1.0, 1.0, look.rgba[3]) if textured else look.rgba
        assert model.mat_rgba[index] == pytest.approx(expected, abs=1e-6)


def test_walls_show_only_their_inner_faces_and_their_tops() -> None:
    room = Room(width=6.0, depth=5.0)
    for patch in building_patches(room.floor):
        corners = patch.vertices[patch.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        outward = {"wall_0": (1, -1.0), "wall_1": (1, 1.0), "wall_2": (0, -1.0), "wall_3": (0, 1.0)}[patch.wall[:6]]
        assert (normal[:, outward[0]] * outward[1] <= 1e-9).all()


@pytest.mark.parametrize("thickness", [0.02, 0.2, 1.0])
def test_wall_faces_lie_in_the_wall_and_never_in_the_room(thickness: float) -> None:
    room = Room(width=6.0, depth=5.0, wall_thickness=thickness)
    for patch in building_patches(room.floor):
        gap = {
            "wall_0": -patch.vertices[:, 1],
            "wall_1": patch.vertices[:, 1] - room.depth,
            "wall_2": -patch.vertices[:, 0],
            "wall_3": patch.vertices[:, 0] - room.width,
        }[patch.wall[:6]]
        assert gap.min() > -1e-9
        assert gap.max() < room.wall_thickness + 1e-9


def test_a_robot_can_be_attached(laboratory: Layout) -> None:
    robot = mujoco.MjSpec()
    base = robot.worldbody.add_body(name="base")
    base.add_joint(name="x", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[1.0, 0.0, 0.0])
    base.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[0.27, 0.6, 0.0])
    scene = to_mjcf(laboratory)
    scene.attach(robot, frame=scene.worldbody.add_frame(pos=[3.0, 3.0, 0.6]), prefix="robot/")
    model = scene.compile()
    assert model.body("robot/base").id > 0
    assert model.nv == 1


def test_unknown_assets_and_reserved_ids_are_refused() -> None:
    room = Room(width=6.0, depth=5.0)
    unknown = Layout(
        id="x", floor=room.floor, placements=(Placement(id="a", asset="FumeHod", position=(1.0, 1.0, 0.0)),)
    )
    with pytest.raises(UnknownNameError, match="FumeHood"):
        to_mjcf(unknown)
    world = Layout(
        id="x", floor=room.floor, placements=(Placement(id="world", asset="LabStool", position=(1.0, 1.0, 0.0)),)
    )
    with pytest.raises(OptionError, match="rename"):
        to_mjcf(world)
