"""Stepping the robot alone: the same bits as in the scene, and never where something can be touched."""

from __future__ import annotations

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from laboratories import island_laboratory

from labgym.envs.reach import TRAVEL, OutOfReach, robot_alone
from labgym.envs.robot import ROBOT, attach_robot
from labgym.envs.simulation import CHECK_STEPS, Simulation
from labgym.envs.static_simulation import StaticSimulation
from labgym.envs.world import World
from labgym.layouts import Layout, load_published
from labgym.layouts.places import layout_at
from labgym.scenes import to_mjcf


def oblique_floor() -> Layout:
    """A floor of several rooms with oblique walls, columns and clutter."""
    return layout_at("floors-test", 1, first=900)


LAYOUTS = {"island": island_laboratory, "room": lambda: load_published("test", "test-sub_01"), "floor": oblique_floor}


@pytest.fixture(scope="module", params=LAYOUTS)
def world(request) -> World:
    return World(LAYOUTS[request.param]())


def free_start(world: World, rng: np.random.Generator) -> tuple[float, float, float]:
    low, high = world._barriers.low, world._barriers.high
    while True:
        x, y = rng.uniform(low, high).tolist()
        if world._barriers.inside(np.array([[x, y]]))[0] and world.clearance(x, y) > 0.05:
            return x, y, float(rng.uniform(-math.pi, math.pi))


def test_the_motion_is_that_in_the_scene_to_the_bit(world):
    """Straight drives into furniture and turns off it: 600 control steps, some in contact, most out of reach."""
    rng = np.random.default_rng(5)
    whole, quick = Simulation(world.model), StaticSimulation(world.model, world.out_of_reach)
    touched = alone = among = 0
    for _ in range(6):
        start = free_start(world, rng)
        whole.place(start)
        quick.place(start)
        for k in range(100):
            if k % 12 == 0:
                v, w = float(rng.uniform(-0.3, 1.0)), float(rng.uniform(-1.5, 1.5) if k % 24 else 0.0)
            expected = whole.drive(v, w)
            assert quick.drive(v, w) == expected
            assert (quick.pose, quick.velocity) == (whole.pose, whole.velocity)
            touched += expected[1]
            alone += quick._now is quick._alone
            among += expected[1] and quick._now is quick._around
    assert touched > 20
    assert alone > 100
    assert among > 10


def test_the_data_of_the_scene_are_those_of_the_motion(world):
    simulation = StaticSimulation(world.model, world.out_of_reach)
    simulation.place(free_start(world, np.random.default_rng(1)))
    for _ in range(5):
        simulation.drive(0.5, 0.5)
    assert simulation.data.qpos[:2].tolist() == list(simulation.pose[:2])
    assert simulation.data.time == pytest.approx(5 * ROBOT.control_dt)


def test_out_of_reach_nothing_is_within_the_chassis_and_the_travel_of_a_check(world):
    """Checked with MuJoCo: a larger robot touches nothing at random places out of reach, and things elsewhere."""
    rng = np.random.default_rng(2)
    reach = OutOfReach(world.model)
    scene = to_mjcf(world._layout, visible=False)
    attach_robot(scene, replace(ROBOT, chassis_radius=ROBOT.chassis_radius + TRAVEL))
    simulation = Simulation(scene.compile())
    low, high = world._barriers.low, world._barriers.high
    touching = {True: 0, False: 0}
    far = 0
    for x, y in rng.uniform(low, high, (800, 2)).tolist():
        simulation.place((x, y, 0.0))
        touching[reach.at(x, y)] += simulation.data.ncon > 0
        far += reach.at(x, y)
    assert far > 60
    assert touching[True] == 0
    assert touching[False] > 100
    assert not reach.at(low[0] - 5.0, low[1])
    assert 1.5 * CHECK_STEPS * ROBOT.timestep <= TRAVEL


def test_the_robot_alone_has_the_options_of_the_scene(world):
    alone, scene = robot_alone().opt, world.model.opt
    for name in ("timestep", "integrator", "cone", "jacobian", "solver", "iterations", "tolerance", "impratio"):
        assert getattr(alone, name) == getattr(scene, name)
    assert alone.gravity.tolist() == scene.gravity.tolist()
    assert (alone.disableflags, alone.enableflags) == (scene.disableflags, scene.enableflags)


def test_data_of_earlier_simulations_leave_no_trace(world):
    """The data of a simulation that has ended, in contact and at speed, are taken by the next one."""
    rng = np.random.default_rng(8)
    first, second = free_start(world, rng), free_start(world, rng)

    def trace(start: tuple[float, float, float]) -> list[object]:
        simulation = StaticSimulation(world.model, world.out_of_reach)
        simulation.place(start)
        return [(simulation.drive(0.8, 0.1), simulation.pose, simulation.velocity) for _ in range(60)]

    expected = trace(second)
    assert trace(first) != expected
    assert trace(second) == expected


def test_among_many_boxes_the_whole_scene_is_stepped():
    """Three times three columns of boxes within reach are more than a model without the scene holds."""
    scene = mujoco.MjSpec()
    for row in range(-1, 2):
        for column in range(-10, 11):
            pos, size = [0.8 + 0.01 * row, 0.05 * column, 0.5], [0.004, 0.02, 0.5]
            scene.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=pos, size=size)
    attach_robot(scene)
    model = scene.compile()
    whole, quick = Simulation(model), StaticSimulation(model, OutOfReach(model))
    crowded = touched = 0
    for _ in range(25):
        expected = whole.drive(0.6, 0.05)
        assert quick.drive(0.6, 0.05) == expected
        assert quick.pose == whole.pose
        crowded += quick._now is quick._scene
        touched += expected[1]
    assert crowded > 5
    assert touched > 5


def test_scenes_with_other_solids_than_boxes_are_stepped_as_a_whole_near_them():
    scene = mujoco.MjSpec()
    scene.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[1.0, 0.0, 0.5], size=[0.1, 0.5, 0.0])
    attach_robot(scene)
    model = scene.compile()
    reach = OutOfReach(model)
    assert reach.solids is None
    whole, quick = Simulation(model), StaticSimulation(model, reach)
    for _ in range(20):
        assert quick.drive(0.8, 0.0) == whole.drive(0.8, 0.0)
    assert quick._now is quick._scene
