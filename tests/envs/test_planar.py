"""The planar kernel against MuJoCo: free motion, contacts and lidar; and what it refuses."""

from __future__ import annotations

import math
import subprocess
import sys

import mujoco
import numpy as np
import pytest
from laboratories import island_laboratory
from shapely import LineString, Polygon

from labgym.envs.robot import PREFIX, ROBOT, attach_robot
from labgym.envs.simulation import Simulation
from labgym.envs.world import World
from labgym.errors import OptionError
from labgym.layouts import Layout, load_published
from labgym.layouts.places import layout_at

pytest.importorskip("numba")

from planar_agreement import MujocoMotion, commands, contacts, differing_rays, free_motion, free_poses

from labgym.envs.planar.body import TIMESTEP, body_of
from labgym.envs.planar.plan import Solid, plan_of, solids_of
from labgym.envs.planar.simulation import PlanarSimulation

LAYOUTS = {
    "island": island_laboratory,
    "room": lambda: load_published("test", "test-sub_01"),
    "floor": lambda: layout_at("floors-test", 1, first=901),
}


@pytest.fixture(scope="module", params=LAYOUTS)
def layout(request) -> Layout:
    return LAYOUTS[request.param]()


def simulation_of(model: mujoco.MjModel) -> PlanarSimulation:
    return PlanarSimulation(plan_of(model), body_of(model))


def scene_of(**geoms) -> mujoco.MjModel:
    """Compile the robot with static geoms by name: dictionaries of their fields."""
    spec = mujoco.MjSpec()
    for name, fields in geoms.items():
        spec.worldbody.add_geom(name=name, **fields)
    attach_robot(spec)
    spec.compiler.discardvisual = True
    return spec.compile()


def box(x, y, z=0.5, half=(0.5, 0.5, 0.5), yaw=0.0) -> dict:
    quat = [math.cos(yaw / 2.0), 0.0, 0.0, math.sin(yaw / 2.0)]
    return {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": half, "pos": [x, y, z], "quat": quat}


def test_free_motion_is_that_of_mujoco_at_a_millisecond():
    """Bars: 1 mm over 1 s and 6 mm over 10 s. MuJoCo at 5 ms, as in the environment, is 2 and 4 mm away."""
    assert max(free_motion(10, 1.0)) < 1e-9
    assert max(free_motion(2, 10.0)) < 1e-9
    assert 0.001 < max(free_motion(10, 1.0, timestep=0.005)) < 0.003
    assert max(free_motion(4, 10.0, timestep=0.005)) < 0.006


def test_contact_states_are_mujocos_in_furnished_laboratories(layout):
    """Without MuJoCo's wrong normals at edges (one contact point of each solid) the positions agree, too."""
    single = contacts(layout, 12, single=True)
    assert single.touching > 80
    assert single.states <= 0.004 * single.steps
    assert single.deepest < 1e-6
    assert single.reported <= 0.03 * single.steps
    assert np.quantile(single.positions, 0.9) < 1e-4
    assert single.positions[-1] < 0.005
    default = contacts(layout, 12, timestep=ROBOT.timestep)
    assert default.touching > 80
    assert default.states <= 0.004 * default.steps
    assert default.deepest < 1e-6
    assert np.median(default.positions) < 1e-4


@pytest.mark.parametrize("yaw", [0.0, 0.4, -1.1])
def test_a_wall_at_any_angle_stops_and_turns_aside_the_robot_as_in_mujoco(yaw):
    """Drive obliquely against a long wall, slide along it, and drive frontally against it."""
    model = scene_of(wall=box(0.0, 0.0, half=(0.1, 6.0, 0.5), yaw=yaw))
    reference, kernel = MujocoMotion(model, TIMESTEP), simulation_of(model)
    for heading in (0.0, 0.5, -1.0):
        start = (-math.cos(yaw), -math.sin(yaw), yaw + heading)
        reference.place(start)
        kernel.place(start)
        touched = 0
        for _ in range(40):
            expected = reference.drive(0.8, 0.0)
            touched += expected
            assert kernel.drive(0.8, 0.0)[1] == expected
            assert reference.distance(kernel.pose) < 1e-4
        assert touched > 20


def test_edges_push_along_the_line_from_the_edge_to_the_axis():
    """The force of a frictionless static contact: the robot moves straight away from the edge."""
    model = scene_of(box=box(0.5, 0.5))
    model.geom(PREFIX + "chassis").friction[:] = 1e-9
    kernel = simulation_of(model)
    for degrees in range(185, 270, 7):
        angle = math.radians(degrees)
        kernel.place((0.268 * math.cos(angle), 0.268 * math.sin(angle), angle))
        kernel.drive(0.0, 0.0)
        moved = np.array(kernel.pose[:2]) - 0.268 * np.array([math.cos(angle), math.sin(angle)])
        assert np.linalg.norm(moved) > 5e-4
        assert moved / np.linalg.norm(moved) == pytest.approx([math.cos(angle), math.sin(angle)], abs=1e-6)


def test_a_board_above_the_chassis_stops_the_column():
    model = scene_of(shelf=box(1.0, 0.0, z=0.8, half=(0.3, 2.0, 0.02)))
    reference, kernel = MujocoMotion(model, TIMESTEP), simulation_of(model)
    for _ in range(30):
        assert kernel.drive(0.6, 0.0)[1] == reference.drive(0.6, 0.0)
    assert kernel.pose[0] == pytest.approx(0.7 - 0.21, abs=0.002)
    assert kernel.pose == pytest.approx(reference.pose, abs=1e-4)


def test_the_length_driven_and_the_velocity_are_those_of_the_simulation_in_mujoco():
    """At the same physics step, over 300 control steps."""
    model = scene_of()
    reference, kernel = Simulation(model), PlanarSimulation(plan_of(model), body_of(model, ROBOT.timestep))
    for v, w in commands(np.random.default_rng(3), 300):
        (driven, _), (driven_too, touched) = reference.drive(v, w), kernel.drive(v, w)
        assert kernel.pose == pytest.approx(reference.pose, abs=1e-10)
        assert kernel.velocity == pytest.approx(reference.velocity, abs=1e-10)
        assert driven_too == pytest.approx(driven, abs=1e-10)
        assert not touched


def test_the_lidar_sees_the_solids_of_the_scene(layout):
    differing, rays = differing_rays(layout, 100)
    assert rays == 100 * 180
    assert differing <= 0.001 * rays


def test_lidar_ranges_are_distances_to_outlines_of_the_plan(layout):
    """Checked with shapely, ray by ray."""
    world = World(layout)
    kernel = simulation_of(world.model)
    shapes = [Polygon(shape) for solid in solids_of(world.model) if len(shape := solid.at(ROBOT.lidar_height))]
    for x, y, yaw in free_poses(layout, np.random.default_rng(8), 2):
        kernel.place((x, y, yaw))
        ranges = kernel.scan()
        for ray in range(0, 180, 9):
            angle = yaw - math.pi + math.radians(2.0 * ray)
            line = LineString([(x, y), (x + 10.0 * math.cos(angle), y + 10.0 * math.sin(angle))])
            hits = [line.intersection(shape) for shape in shapes if line.intersects(shape)]
            nearest = min((hit.distance(LineString([(x, y), (x, y)])) for hit in hits), default=10.0)
            assert ranges[ray] == pytest.approx(nearest, abs=1e-5)


def test_a_mesh_is_cut_at_the_heights_of_the_robot():
    """A pyramid over the square of side 2: at height z its section has the side 2 - z."""
    points = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 2]], dtype=float)
    pyramid = Solid(points, 0.0, 2.0, upright=False)
    assert Polygon(pyramid.at(0.5)).area == pytest.approx(1.5**2)
    assert Polygon(pyramid.between(0.4, 1.3)).area == pytest.approx(1.6**2)
    assert len(pyramid.at(2.5)) == len(pyramid.between(2.0, 3.0)) == 0
    spec = mujoco.MjSpec()
    faces = [[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]
    spec.add_mesh(name="pyramid", uservert=points.ravel(), userface=np.array(faces).ravel())
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="pyramid", pos=[3.0, 1.0, 0.0])
    attach_robot(spec)
    (solid,) = solids_of(spec.compile())
    outline = Polygon(solid.at(0.5))
    assert outline.equals_exact(
        Polygon([(2.25, 0.25), (3.75, 0.25), (3.75, 1.75), (2.25, 1.75)]).normalize(), 1e-6
    ) or (outline.bounds == pytest.approx((2.25, 0.25, 3.75, 1.75), abs=1e-6))


def test_scenes_that_the_plane_cannot_show_are_refused():
    ball = {"type": mujoco.mjtGeom.mjGEOM_SPHERE, "size": [0.3, 0, 0], "pos": [2.0, 0.0, 0.3]}
    with pytest.raises(OptionError, match="'ball' is neither a box nor a mesh"):
        plan_of(scene_of(ball=ball))
    spec = mujoco.MjSpec()
    cart = spec.worldbody.add_body(name="cart", pos=[2.0, 0.0, 0.5])
    cart.add_freejoint()
    cart.add_geom(name="load", type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.2, 0.2, 0.2])
    attach_robot(spec)
    with pytest.raises(OptionError, match=r"'load' moves.*physics='mujoco'"):
        plan_of(spec.compile())


def test_the_environment_works_without_numba_and_the_kernel_names_the_extra_in_one_line():
    code = (
        "import sys, labgym.envs.point_nav\n"
        "assert 'numba' not in sys.modules\n"
        "sys.modules['numba'] = None\n"
        "try:\n    import labgym.envs.planar.simulation\n"
        "except ImportError as error:\n    print(error)\n"
    )
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert printed.count("\n") == 1
    assert "pip install 'labgym-nav[fast]'" in printed
