"""Interactive scenes against closed forms: joints, sashes, castors, and that nothing moves by itself."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest
from furnished_floors import furnished

from labgym.assets.articulation import FOOTINGS, joints
from labgym.envs.robot import PREFIX, attach_robot
from labgym.errors import OptionError
from labgym.layouts import Layout, Placement, Room, load_published, published
from labgym.layouts.clutter import add_clutter
from labgym.scenes import to_mjcf, write_mjcf

GRAVITY = 9.81


def layout_of(*placements):
    return Layout(id="moving", floor=Room(width=6.0, depth=5.0).floor, placements=placements)


def simulation(layout, **options):
    model = to_mjcf(layout, visible=False, interactive=True, **options).compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def run(model, data, seconds):
    for _ in range(round(seconds / model.opt.timestep)):
        mujoco.mj_step(model, data)


BENCH = Placement(id="bench", asset="LabBench", position=(3.0, 0.5, 0.0))


def test_a_pulled_drawer_follows_the_solution_of_its_equation_of_motion():
    layout = layout_of(BENCH)
    joint = joints(layout.asset("bench"))["drawer_1"]
    model, data = simulation(layout)
    dof = model.joint("bench/drawer_1").dofadr[0]
    pull, seconds = 22.0, 0.5
    data.qfrc_applied[dof] = pull
    run(model, data, seconds)
    # m x'' + c x' = F - f from rest.
    mass, final = joint.mass + model.dof_armature[dof], (pull - joint.friction) / joint.damping
    lag = mass / joint.damping
    assert data.joint("bench/drawer_1").qpos[0] == pytest.approx(
        final * (seconds - lag * (1.0 - math.exp(-seconds / lag))), rel=0.02
    )
    assert data.joint("bench/drawer_1").qvel[0] == pytest.approx(final * (1.0 - math.exp(-seconds / lag)), rel=0.02)


def test_a_drawer_resists_a_pull_below_its_friction_and_stops_at_its_travel():
    layout = layout_of(BENCH)
    joint = joints(layout.asset("bench"))["drawer_1"]
    model, data = simulation(layout)
    dof = model.joint("bench/drawer_1").dofadr[0]
    data.qfrc_applied[dof] = 0.9 * joint.friction
    run(model, data, 1.0)
    assert abs(data.joint("bench/drawer_1").qpos[0]) < 0.002
    data.qfrc_applied[dof] = 3.0 * joint.friction
    run(model, data, 2.0)
    assert data.joint("bench/drawer_1").qpos[0] == pytest.approx(joint.travel, abs=0.005)


def test_doors_open_outward_up_to_their_travel_and_close_again():
    layout = layout_of(Placement(id="cabinet", asset="FlammableCabinet", position=(3.0, 2.0, 0.0)))
    model, data = simulation(layout)
    travel = joints(layout.asset("cabinet"))["door_1"].travel
    for name in ("cabinet/door_1", "cabinet/door_2"):
        dof = model.joint(name).dofadr[0]
        closed = data.body(name).xipos.copy()
        data.qfrc_applied[dof] = 12.0
        run(model, data, 3.0)
        assert data.joint(name).qpos[0] == pytest.approx(travel, abs=math.radians(1.0))
        assert data.body(name).xipos[1] > closed[1] + 0.2  # the front looks along +y
        data.qfrc_applied[dof] = -12.0
        run(model, data, 3.0)
        assert data.joint(name).qpos[0] == pytest.approx(0.0, abs=math.radians(1.0))
        data.qfrc_applied[dof] = 0.0


def test_a_counterbalanced_sash_stays_where_it_is_and_falls_without_its_counterweight():
    hood = Placement(id="hood", asset="FumeHood", position=(3.0, 2.0, 0.0), state={"sash": 0.5})
    layout = layout_of(hood)
    travel = joints(layout.asset("hood"))["sash"].travel
    model, data = simulation(layout)
    assert data.joint("hood/sash").qpos[0] == pytest.approx(0.5 * travel)
    run(model, data, 2.0)
    assert data.joint("hood/sash").qpos[0] == pytest.approx(0.5 * travel, abs=1e-4)
    model.body_gravcomp[model.body("hood/sash").id] = 0.0
    run(model, data, 2.0)
    assert data.joint("hood/sash").qpos[0] == pytest.approx(0.0, abs=0.005)


@pytest.mark.parametrize("asset", ["LabStool", "ServiceTrolley", "CylinderTrolley", "Carton"])
def test_a_push_moves_things_on_the_floor_as_coulomb_friction_says(asset):
    layout = layout_of(Placement(id="thing", asset=asset, position=(3.0, 2.0, 0.0), yaw=0.4))
    entry = layout.asset("thing")
    weight = FOOTINGS[entry.shape.name].friction * entry.mass * GRAVITY
    seconds = 1.0
    distances = []
    for force in (0.8 * weight, 1.5 * weight):
        model, data = simulation(layout)
        run(model, data, 0.2)
        start = data.body("thing").xipos.copy()
        data.xfrc_applied[model.body("thing").id, :2] = force * math.cos(0.4), force * math.sin(0.4)
        # At the height of the floor, so that the push does not tip it.
        height = start[2]
        data.xfrc_applied[model.body("thing").id, 3:5] = (
            force * math.sin(0.4) * height,
            -force * math.cos(0.4) * height,
        )
        run(model, data, seconds)
        distances.append(math.dist(start[:2], data.body("thing").xipos[:2]))
    assert distances[0] < 0.005
    expected = 0.5 * (0.5 * weight / entry.mass) * seconds**2
    assert distances[1] == pytest.approx(expected, rel=0.05)


def test_masses_are_those_of_the_catalog_and_what_is_in_the_drawers():
    layout = layout_of(BENCH, Placement(id="stool", asset="LabStool", position=(1.0, 3.0, 0.0)))
    model, _ = simulation(layout)
    contents = 2.0 * sum("drawer" in name for name in joints(layout.asset("bench")))
    assert model.body("bench").subtreemass[0] == pytest.approx(layout.asset("bench").mass + contents)
    assert model.body("stool").subtreemass[0] == pytest.approx(layout.asset("stool").mass)


def geoms(model, data, name):
    """Sorted positions of the geoms of a body and its children."""
    bodies = [b for b in range(model.nbody) if model.body(b).name.split("/")[0] == name]
    rows = [data.geom_xpos[g] for g in range(model.ngeom) if model.geom_bodyid[g] in bodies]
    return np.array(sorted(tuple(np.round(row, 5)) for row in rows))


def test_an_interactive_scene_looks_like_the_static_one_in_the_same_state():
    state = {"drawer_1": 0.7, "door_1": 0.4}
    layout = layout_of(BENCH.model_copy(update={"state": tuple(sorted(state.items())), "yaw": 0.3}))
    places = []
    for interactive in (False, True):
        model = to_mjcf(layout, interactive=interactive).compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        places.append(geoms(model, data, "bench"))
    assert places[1] == pytest.approx(places[0], abs=1e-5)


def test_interior_doors_turn_about_their_hinges():
    layout = furnished("suite")
    static, moving = (to_mjcf(layout, visible=False, interactive=each).compile() for each in (False, True))
    leaves = [name for name in (moving.joint(k).name for k in range(moving.njnt)) if "/leaf_" in name]
    assert len(leaves) == sum(part.kind == "leaf" for part in layout.floor.parts) == 4
    data, still = mujoco.MjData(moving), mujoco.MjData(static)
    mujoco.mj_forward(moving, data)
    mujoco.mj_forward(static, still)
    opened = 0
    for name in leaves:
        solid = data.geom(f"{name}/solid")
        assert solid.xpos == pytest.approx(still.geom(f"{name}/solid").xpos, abs=1e-9)
        joint, index = moving.joint(name), int(name.split("/")[0].removeprefix("wall_"))
        wall = layout.floor.walls[index]
        angle = float(data.joint(name).qpos[0])
        opened += angle > 0.0
        # Closed, the leaf lies along its wall; the hinge stays.
        data.joint(name).qpos[0] = 0.0
        anchor = data.joint(name).xanchor.copy()
        mujoco.mj_forward(moving, data)
        along = data.geom(f"{name}/solid").xmat.reshape(3, 3)[:2, 0]
        assert abs(along @ [math.cos(wall.yaw), math.sin(wall.yaw)]) == pytest.approx(1.0, abs=1e-9)
        assert data.joint(name).xanchor == pytest.approx(anchor, abs=1e-9)
        assert joint.range[1] >= math.pi / 2.0
    assert opened == 2


def test_the_robot_pushes_a_stool_away():
    layout = layout_of(Placement(id="stool", asset="LabStool", position=(3.0, 2.0, 0.0)))
    spec = to_mjcf(layout, visible=False, interactive=True)
    attach_robot(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    data.joint(f"{PREFIX}x").qpos[0], data.joint(f"{PREFIX}y").qpos[0] = 1.5, 2.0
    mujoco.mj_forward(model, data)
    data.actuator(f"{PREFIX}forward").ctrl[0] = 0.4
    run(model, data, 4.0)
    assert data.joint(f"{PREFIX}x").qpos[0] > 2.8  # where it would stop at a stool that is fixed: 3.0 - 0.5
    assert data.body("stool").xpos[0] > 3.3
    assert data.body("stool").xmat[8] > math.cos(math.radians(5.0))


def moved(layout, **options):
    """Greatest motion (m) and tilt (rad) of a body in two seconds."""
    model, data = simulation(layout, **options)
    places, frames = data.xipos.copy(), data.xmat.reshape(-1, 3, 3).copy()
    run(model, data, 2.0)
    shift = np.linalg.norm(data.xipos - places, axis=1).max()
    up = np.einsum("nij,nj->ni", data.xmat.reshape(-1, 3, 3), frames[:, 2])
    return float(shift), float(np.arccos(np.clip(up[:, 2], -1.0, 1.0)).max())


@pytest.mark.parametrize("loose", [False, True])
@pytest.mark.parametrize("name", ["ell", "oblique", published("test")[0]])
def test_nothing_moves_by_itself(name, loose):
    bare = furnished(name) if name in ("ell", "oblique") else load_published("test", name)
    layout = add_clutter(bare, 3, np.random.default_rng(2))
    shift, tilt = moved(layout, loose=loose)
    assert shift < 0.005
    assert tilt < math.radians(2.0)


def test_a_static_scene_has_nothing_that_moves_and_loose_objects_need_an_interactive_one():
    layout = furnished("suite")
    assert to_mjcf(layout, visible=False).compile().nv == 0
    with pytest.raises(OptionError, match="interactive"):
        to_mjcf(layout, loose=True)


def test_an_interactive_scene_on_disk_loads_with_its_joints(tmp_path):
    layout = furnished("oblique")
    path = write_mjcf(layout, tmp_path / "scene", interactive=True)
    model, spec = mujoco.MjModel.from_xml_path(str(path)), to_mjcf(layout, interactive=True).compile()
    assert (model.nv, model.nexclude) == (spec.nv, spec.nexclude)
    assert model.qpos0 == pytest.approx(spec.qpos0, abs=1e-5)
    assert model.dof_frictionloss == pytest.approx(spec.dof_frictionloss, rel=1e-4)
    assert model.body_gravcomp == pytest.approx(spec.body_gravcomp)
