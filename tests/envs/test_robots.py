"""Robots of other dimensions, holonomic ones and robots on wheels: motion against closed forms."""

from __future__ import annotations

import copy
import math
import pickle
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest

from labgym.envs import LabPointNavEnv
from labgym.envs.assembly import assembly_of, is_standard
from labgym.envs.mount import Mount, at_rest, on_floor
from labgym.envs.parts.protocols import Robot
from labgym.envs.parts.robots import DifferentialDrive, HolonomicDrive, WheeledDrive
from labgym.envs.physics import make_physics
from labgym.envs.robot import ROBOT
from labgym.envs.scene_simulation import SceneSimulation
from labgym.envs.simulation import Simulation
from labgym.envs.world import World
from labgym.errors import LabgymError, OptionError, UnknownNameError
from labgym.layouts import Layout

GRAVITY = 9.81
SMALL = {"chassis_radius": 0.18, "height": 0.3, "mass": 12.0, "yaw_inertia": 0.2, "v_max": 0.6}
ROBOTS: dict[str, Robot] = {
    "small": DifferentialDrive(SMALL),  # type: ignore[arg-type]
    "holonomic": HolonomicDrive(),
    "wheels": WheeledDrive(),
}


@pytest.fixture(scope="module")
def world(layout: Layout) -> World:
    return World(layout)


def on_plane(robot: Robot) -> SceneSimulation:
    return SceneSimulation(on_floor(robot), robot, 0.1)


def drive(simulation: Any, command: tuple[float, ...], steps: int) -> np.ndarray:
    """Return the poses after each control step, (steps, 3)."""
    poses = []
    for _ in range(steps):
        simulation.drive(*command)
        poses.append(simulation.pose)
    return np.array(poses)


def ramp(speed: float, acceleration: float, seconds: float) -> float:
    """The way of a robot that accelerates to a speed and keeps it, meters."""
    return speed * (seconds - speed / acceleration / 2.0)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_drives_as_far_as_its_limits_allow(name: str) -> None:
    robot = ROBOTS[name]
    speed = robot.size.v_max
    simulation = on_plane(robot)
    drive(simulation, (speed, *(0.0,) * (len(robot.axes) - 1)), 20)
    assert simulation.pose[0] == pytest.approx(ramp(speed, robot.size.acceleration, 2.0), rel=0.03)
    assert simulation.pose[1:] == pytest.approx((0.0, 0.0), abs=1e-3)
    assert simulation.velocity[0] == pytest.approx(speed, rel=0.01)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_turns_on_the_spot_by_its_limits(name: str) -> None:
    robot = ROBOTS[name]
    simulation = on_plane(robot)
    poses = drive(simulation, (*(0.0,) * (len(robot.axes) - 1), robot.size.w_max), 20)
    turned = np.unwrap(poses[:, 2])[-1]
    assert turned == pytest.approx(ramp(robot.size.w_max, robot.size.turn_acceleration, 2.0), rel=0.03)
    assert np.abs(poses[:, :2]).max() < 0.005


def test_a_holonomic_robot_moves_along_the_vector_of_its_command_in_its_frame() -> None:
    robot, yaw = HolonomicDrive(), 0.7
    simulation = on_plane(robot)
    simulation.place((1.0, 2.0, yaw))
    drive(simulation, robot.command([0.4, 0.8, 0.0]), 30)
    way = np.array(simulation.pose[:2]) - (1.0, 2.0)
    ahead, left = math.cos(yaw) * way[0] + math.sin(yaw) * way[1], math.cos(yaw) * way[1] - math.sin(yaw) * way[0]
    assert (ahead, left) == pytest.approx((ramp(0.4, 1.5, 3.0), ramp(0.4, 1.5, 3.0)), abs=0.015)
    assert (simulation.velocity[0], simulation.sideways) == pytest.approx((0.4, 0.4), abs=1e-3)


def test_commands_are_clipped_to_the_limits_of_each_axis() -> None:
    assert HolonomicDrive().command([7.0, -7.0, 7.0]) == (1.0, -0.5, 1.5)
    assert HolonomicDrive({"v_side": 0.2}).command([-1.0, 0.5, 0.0]) == (-0.3, 0.1, 0.0)  # type: ignore[arg-type]
    assert WheeledDrive().command([0.5, -0.5]) == (0.5, -0.75)


@pytest.mark.parametrize("name", ["small", "holonomic"])
def test_the_robot_is_stepped_alone_with_the_motion_in_the_scene_to_the_bit(world: World, name: str) -> None:
    robot = ROBOTS[name]
    assembly = assembly_of(world, robot)
    quick = make_physics("mujoco", world, robot, 0.1)
    whole = Simulation(assembly.model, robot.size)
    assert isinstance(quick, Simulation)
    rng = np.random.default_rng(3)
    for simulation in (whole, quick):
        simulation.place((2.0, 2.0, 0.3))
    alone = touched = 0
    for k in range(150):
        if k % 15 == 0:
            command = robot.command(rng.uniform(-1.0, 1.0, len(robot.axes)))
        expected = whole.drive(*command)
        assert quick.drive(*command) == expected
        assert (quick.pose, quick.velocity, quick.sideways) == (whole.pose, whole.velocity, whole.sideways)
        alone += quick._now is not quick._scene
        touched += expected[1]
    assert alone > 20


def test_robots_share_compiled_scenes_and_only_the_standard_one_shares_its_own(world: World) -> None:
    assert assembly_of(world, DifferentialDrive()).model is world.model
    assert (
        assembly_of(world, DifferentialDrive(replace(ROBOT, control_dt=0.05, camera_height=0.6))).model is world.model
    )
    other = assembly_of(world, DifferentialDrive(SMALL))  # type: ignore[arg-type]
    assert other.model is not world.model
    assert assembly_of(world, copy.deepcopy(ROBOTS["small"])) is other
    assert not is_standard(ROBOTS["small"])


@pytest.mark.parametrize("name", ROBOTS)
def test_obstacles_stop_each_robot_at_its_own_radius(world: World, name: str) -> None:
    robot = ROBOTS[name]
    simulation = make_physics("mujoco", world, robot, 0.1)
    simulation.place((6.0, 1.0, -math.pi / 2.0))  # towards the front wall
    touched = [simulation.drive(0.5, *(0.0,) * (len(robot.axes) - 1))[1] for _ in range(30)]
    assert simulation.pose[1] == pytest.approx(robot.size.chassis_radius, abs=0.01)
    assert touched[-1]
    assert not touched[0]


@pytest.mark.parametrize("name", ROBOTS)
def test_copies_go_on_to_the_bit(world: World, name: str) -> None:
    robot = ROBOTS[name]
    simulation = make_physics("mujoco", world, robot, 0.1)
    simulation.place((2.0, 1.5, 0.2))
    command = robot.command([0.6] * len(robot.axes))
    drive(simulation, command, 4)
    for other in (copy.deepcopy(simulation), pickle.loads(pickle.dumps(simulation))):
        assert drive(other, command, 3).tolist() == drive(copy.deepcopy(simulation), command, 3).tolist()


def test_wheels_and_casters_carry_the_weight_in_the_stated_shares() -> None:
    robot = WheeledDrive()
    simulation = on_plane(robot)
    drive(simulation, (0.0, 0.0), 10)
    model, data = simulation.model, simulation.data
    loads: dict[str, float] = {}
    for index, contact in enumerate(data.contact):
        force = np.zeros(6)
        mujoco.mj_contactForce(model, data, index, force)
        loads[model.geom(contact.geom[1]).name.removeprefix("robot/")] = force[0]
    weight = robot.size.mass * GRAVITY
    assert set(loads) == {"left_wheel", "right_wheel", "front_caster", "rear_caster"}
    assert sum(loads.values()) == pytest.approx(weight, rel=0.002)
    assert loads["left_wheel"] == pytest.approx(loads["right_wheel"], rel=1e-3)
    for caster in ("front_caster", "rear_caster"):
        assert loads[caster] / weight == pytest.approx(robot.wheels.caster_load, abs=0.04)


def test_slippery_wheels_accelerate_no_faster_than_their_friction_allows() -> None:
    friction = 0.05
    slippery = WheeledDrive(wheels={"friction": friction, "caster_friction": 0.001})  # type: ignore[arg-type]
    simulation = on_plane(slippery)
    drive(simulation, (1.0, 0.0), 10)
    # After one second. The wheels carry about 70% of the weight, and never all of it.
    assert 0.65 * friction * GRAVITY < simulation.velocity[0] < friction * GRAVITY


def test_the_wheels_hold_the_base_sideways_on_a_tight_turn() -> None:
    simulation = on_plane(WheeledDrive())
    drive(simulation, (0.8, 1.0), 20)
    poses = drive(simulation, (0.8, 1.0), 63)[:, :2]
    center = (poses.min(axis=0) + poses.max(axis=0)) / 2.0
    assert np.linalg.norm(poses - center, axis=1) == pytest.approx(0.8, abs=0.02)
    assert abs(simulation.sideways) < 0.02


def test_driving_on_wheels_is_no_contact(world: World) -> None:
    simulation = make_physics("mujoco", world, WheeledDrive(), 0.1)
    simulation.place((2.0, 1.5, 0.0))
    assert not any(simulation.drive(0.3, 0.0)[1] for _ in range(10))


def test_a_robot_at_rest_stays_where_it_is() -> None:
    simulation = on_plane(WheeledDrive())
    simulation.place((1.0, 2.0, 0.5))
    drive(simulation, (0.0, 0.0), 20)
    assert simulation.pose == pytest.approx((1.0, 2.0, 0.5), abs=2e-4)


class Falling:
    """A robot of a user that stands on its head: a rod on a free joint."""

    size = ROBOT
    axes = actuators = ("forward", "turn")

    def command(self, action: Any) -> tuple[float, ...]:
        return self.size.twist(*action)

    def controls(self, command: tuple[float, ...]) -> tuple[float, ...]:
        return command

    def spec(self) -> mujoco.MjSpec:
        spec = mujoco.MjSpec()
        base = spec.worldbody.add_body(name="base")
        base.add_freejoint(name="base")
        base.add_geom(type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[0.02, 0.3, 0.0], pos=[0.0, 0.0, 0.32], mass=1.0)
        base.add_site(name="site")
        for name in self.actuators:
            spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_SITE, target="site", gear=[0.0] * 6)
        return spec


def test_a_robot_that_falls_is_refused() -> None:
    with pytest.raises(OptionError, match="does not stand still"):
        at_rest(_leaning())


def _leaning() -> Robot:
    class Leaning(Falling):
        def spec(self) -> mujoco.MjSpec:
            spec = super().spec()
            spec.body("base").geoms[0].quat = [math.cos(0.1), math.sin(0.1), 0.0, 0.0]
            return spec

    return Leaning()  # type: ignore[return-value]


def test_the_mount_tells_the_robot_from_the_scene(world: World) -> None:
    assembly = assembly_of(world, WheeledDrive())
    mount = Mount.of(assembly.model)
    names = {assembly.model.geom(index).name for index in np.flatnonzero(mount.geoms)}
    assert {"robot/chassis", "robot/column", "robot/left_wheel", "robot/rear_caster"} <= names
    assert all(name.startswith("robot/") or not name for name in names)
    assert [assembly.model.geom(index).name for index in np.flatnonzero(mount.floor)] == ["floor/solid"]
    assert not mount.planar
    assert Mount.of(world.model).alone


@pytest.mark.parametrize("name", ROBOTS)
def test_an_environment_takes_the_robot_by_its_kind(layout: Layout, name: str) -> None:
    kind = {"small": {"kind": "differential", "size": SMALL}, "holonomic": "holonomic", "wheels": "wheels"}[name]
    env = LabPointNavEnv(layout=layout, robot=kind)
    start = {"start": (4.0, 4.8, 0.0), "goal": (5.5, 4.8)}
    first, _ = env.reset(seed=0, options=start)
    assert env.observation_space.contains(first)
    action = np.zeros(env.action_space.shape, dtype=np.float32)
    action[0] = 1.0
    infos = [env.step(action)[4] for _ in range(8)]
    acceleration = ROBOT.acceleration
    if name == "wheels":  # the casters resist, and the wheels turn: each has half of its mass at its rim
        wheels = WheeledDrive().wheels
        drag = wheels.caster_friction * 2.0 * wheels.caster_load * GRAVITY
        acceleration = (acceleration - drag) / (1.0 + wheels.mass / ROBOT.mass)
    assert infos[-1]["pose"][0] == pytest.approx(4.0 + ramp(env.config.robot.size.v_max, acceleration, 0.8), abs=0.03)
    assert env.observation_space["velocity"].shape == env.action_space.shape
    env.close()


@pytest.mark.parametrize(
    ("robot", "error"),
    [
        ({"kind": "differential", "size": {"chassis_radius": 0.4}}, OptionError),
        ({"kind": "differential", "size": {"height": 1.8}}, OptionError),
        ({"kind": "differential", "size": {"mass": 0.0}}, OptionError),
        ({"kind": "differential", "size": {"mass": "heavy"}}, OptionError),
        ({"kind": "differential", "size": {"timestep": 0.004}}, OptionError),
        ({"kind": "differential", "size": {"v_side": 0.5}}, OptionError),
        ({"kind": "differential", "size": {"wings": 2}}, UnknownNameError),
        ({"kind": "holonomic", "size": {"v_side": 0.0}}, OptionError),
        ({"kind": "wheels", "wheels": {"track": 0.9}}, OptionError),
        ({"kind": "wheels", "wheels": {"spokes": 9}}, UnknownNameError),
        ({"kind": "wheels", "wheels": {"caster_load": 0.6}}, OptionError),
    ],
)
def test_robots_that_do_not_fit_are_refused_in_one_line(robot: Any, error: type[LabgymError]) -> None:
    with pytest.raises(error) as caught:
        LabPointNavEnv(robot=robot)
    assert "\n" not in str(caught.value)


def test_the_planar_kernel_refuses_other_robots() -> None:
    pytest.importorskip("numba")
    with pytest.raises(OptionError, match="planar kernel"):
        LabPointNavEnv(robot="holonomic", physics="planar")
