"""Things that the robot pushes: closed forms of friction and of pushing, the bits of the robot, what sensors see."""

from __future__ import annotations

import copy
import math
import pickle

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from laboratories import island_laboratory, put

import labgym  # noqa: F401 -- registers the ids
from labgym.envs.assembly import Moving, assembly_of
from labgym.envs.parts.robots import DifferentialDrive, HolonomicDrive
from labgym.envs.physics import make_physics
from labgym.envs.tasks import Task
from labgym.envs.world import World, world_of
from labgym.errors import OptionError
from labgym.navigation import GoalPair
from labgym.scenes.castors import GRAVITY

ROBOT = DifferentialDrive()
TROLLEY, STOOL, CARTON = "trolley", "stool", "carton"
MASSES = {TROLLEY: 30.0, STOOL: 8.0, CARTON: 4.0}
START = (1.5, 1.0, 0.0)


def laboratory():
    base = island_laboratory()
    things = (
        put(TROLLEY, "ServiceTrolley", 2.6, 1.0, yaw=0.4),
        put(STOOL, "LabStool", 6.5, 4.2),
        put(CARTON, "SmallCarton", 3.0, 4.0),
    )
    return base.replace(placements=(*base.placements, *things))


LAYOUT = laboratory()
WORLD = World(LAYOUT)


def simulation(robot=ROBOT, layout=LAYOUT, masses=MASSES):
    assembly = assembly_of(world_of(layout), robot, Moving(pushable=tuple(masses.items())))
    return make_physics("mujoco", world_of(layout), robot, 0.1, assembly)


def launch(thing, velocity, seconds):
    """Return the displacement (3,) of a thing that starts with a velocity (3,) and slides until it rests."""
    physics = simulation()
    physics.place((1.0, 4.3, 0.0))
    index = physics._index(thing)
    physics._scene.qvel[physics._rates[index]] = velocity
    physics._locate()
    before = physics.poses[index].copy()
    for _ in range(round(seconds / 0.1)):
        physics.drive(0.0, 0.0)
    return physics.poses[index] - before, physics


@pytest.mark.parametrize("degrees", [0.0, 11.25, 30.0, 100.0])
@pytest.mark.parametrize(("thing", "friction"), [(STOOL, 0.06), (CARTON, 0.4)])
def test_friction_stops_a_thing_after_v2_over_2_mu_g(thing, friction, degrees):
    speed, angle = math.sqrt(2.0 * friction * GRAVITY * 0.2), math.radians(degrees)
    moved, physics = launch(thing, (speed * math.cos(angle), speed * math.sin(angle), 0.0), 1.0)
    assert math.hypot(*moved[:2]) == pytest.approx(0.2, rel=0.03)
    assert physics.ways[physics._index(thing)] == pytest.approx(math.hypot(*moved[:2]), rel=0.01)
    assert not physics._moving


def test_friction_stops_a_turn_after_its_energy_is_spent():
    moved, _ = launch(STOOL, (0.0, 0.0, 2.0), 2.0)
    size = LAYOUT.asset(STOOL).size
    inertia = (size.width**2 + size.depth**2) / 12.0
    torque = 0.06 * GRAVITY * math.hypot(size.width, size.depth) / 4.0
    assert moved[2] == pytest.approx(2.0**2 * inertia / 2.0 / torque, rel=0.03)


def test_a_thing_pushed_at_a_steady_speed_moves_with_the_robot_and_rolls_on_when_it_stops():
    base = island_laboratory()
    straight = base.replace(placements=(*base.placements, put(TROLLEY, "ServiceTrolley", 2.6, 1.0)))
    physics = simulation(layout=straight, masses={TROLLEY: 30.0})
    physics.place(START)
    for _ in range(45):
        physics.drive(0.4, 0.0)
    before, robot = physics.poses[0].copy(), physics.pose
    for _ in range(10):
        _, touched = physics.drive(0.4, 0.0)
        assert not touched
    assert physics.poses[0, 0] - before[0] == pytest.approx(0.4, abs=0.005)
    assert physics.pose[0] - robot[0] == pytest.approx(0.4, abs=0.005)
    gap = physics.poses[0, 0] - 0.4 - (physics.pose[0] + 0.27)
    assert abs(gap) < 0.003
    assert physics.touched == {TROLLEY}
    way = physics.ways[0]
    for _ in range(40):
        physics.drive(0.0, 0.0)
    assert physics.ways[0] - way == pytest.approx(0.4**2 / 2.0 / 0.03 / GRAVITY, rel=0.05)
    assert np.array_equal(physics._scene.qvel[physics._rates[0]], np.zeros(3))


def test_momentum_is_kept_in_a_collision_of_two_things():
    """A stool rolls into another one: their momentum falls by friction alone."""
    base = island_laboratory()
    pair = (put("a", "LabStool", 3.0, 4.0), put("b", "LabStool", 3.5, 4.0))
    physics = simulation(layout=base.replace(placements=(*base.placements, *pair)), masses={"a": 8.0, "b": 24.0})
    physics.place((1.0, 4.3, 0.0))
    physics._scene.qvel[physics._rates[0]] = (1.0, 0.0, 0.0)
    physics._locate()
    elapsed = 0
    while physics._scene.qvel[physics._rates[1, 0]] == 0.0:
        physics.substep(0.0, 0.0)
        elapsed += 1
    for _ in range(3):
        physics.substep(0.0, 0.0)
    momentum = 8.0 * physics._scene.qvel[physics._rates[0, 0]] + 24.0 * physics._scene.qvel[physics._rates[1, 0]]
    lost = 0.06 * GRAVITY * 8.0 * elapsed * 0.005
    assert momentum == pytest.approx(8.0 - lost, abs=0.06 * GRAVITY * 32.0 * 4 * 0.005)


def test_the_robot_moves_as_in_the_whole_scene():
    """Drives among the things, pushing some: to the bit until the first contact with static things, then to 1 um."""
    quick, whole = simulation(), simulation()
    whole._out_of_reach = None
    rng = np.random.default_rng(3)
    alone = pushed = 0
    for start in (START, (5.5, 4.2, 0.0), (2.0, 4.2, -0.3)):
        quick.place(start)
        whole.place(start)
        touched = False
        for k in range(48):
            if k % 12 == 0:
                v, w = float(rng.uniform(0.2, 1.0)), float(rng.uniform(-1.0, 1.0) if k % 24 else 0.0)
            expected, driven = whole.drive(v, w), quick.drive(v, w)
            touched = touched or expected[1]
            if not touched:
                assert driven == expected
                assert (quick.pose, quick.velocity) == (whole.pose, whole.velocity)
                assert np.array_equal(quick.poses, whole.poses)
            assert driven == pytest.approx(expected, abs=1e-6)
            np.testing.assert_allclose(quick.pose, whole.pose, atol=1e-6)
            np.testing.assert_allclose(quick.poses, whole.poses, atol=1e-6)
            alone += quick._now is not quick._scene
        pushed += int((quick.ways > 0.05).sum())
    assert pushed >= 2
    assert alone > 20


def test_out_of_reach_of_the_things_the_robot_moves_as_without_them_to_the_bit():
    """Against the wall and along it, contacts included."""
    physics = simulation()
    static = make_physics("mujoco", world_of(island_laboratory()), ROBOT, 0.1)
    for each in (physics, static):
        each.place((1.3, 3.9, 2.4))
    touches = 0
    for k in range(60):
        command = (0.7, 0.0 if k < 25 else 0.9)
        expected = static.drive(*command)
        assert physics.drive(*command) == expected
        assert (physics.pose, physics.velocity) == (static.pose, static.velocity)
        touches += expected[1]
    assert touches > 10
    assert physics._now is not physics._scene


def test_without_things_the_scene_is_that_of_before():
    assert assembly_of(WORLD, ROBOT) is not None
    static = island_laboratory()
    model = assembly_of(world_of(static), ROBOT).model
    assert np.array_equal(mujoco.MjModel.__getstate__(model), mujoco.MjModel.__getstate__(World(static).model))


def test_single_steps_are_the_drive_to_the_bit():
    whole, steps = simulation(), simulation()
    for physics in (whole, steps):
        physics.place(START)
    for _ in range(30):
        whole.drive(0.6, 0.1)
        for _ in range(20):
            steps.substep(0.6, 0.1)
        assert whole.pose == steps.pose
        assert np.array_equal(whole.poses, steps.poses)
    assert whole.ways[0] > 0.3


@pytest.mark.parametrize("make", [copy.deepcopy, lambda each: pickle.loads(pickle.dumps(each))])
@pytest.mark.parametrize("steps", [5, 14, 20])
def test_a_copy_goes_on_to_the_bit(make, steps):
    physics = simulation()
    physics.place(START)
    for _ in range(steps):
        physics.drive(0.6, 0.0)
    other = make(physics)
    for _ in range(12):
        assert other.drive(-0.3, 0.4) == physics.drive(-0.3, 0.4)
        assert other.pose == physics.pose
        assert np.array_equal(other.poses, physics.poses)
    assert np.array_equal(other.ways, physics.ways)
    assert other.touched == physics.touched


def test_a_holonomic_robot_pushes_sideways():
    physics = simulation(HolonomicDrive())
    physics.place((6.5, 3.3, 0.0))
    for _ in range(40):
        physics.drive(0.0, 0.3, 0.0)
    assert physics.poses[1, 1] > 4.2 + 0.2


class Fixed:
    """A source of one task."""

    def __init__(self, task):
        self._task = task

    def draw(self, rng, options, fresh):
        return self._task

    def close(self):
        pass


def environment(**options):
    pair = GoalPair(0, START, (6.5, 1.0, 0.0), "anywhere", "anywhere")
    task = Task(LAYOUT, LAYOUT.protocol, pair, pushable=MASSES)
    return gym.make("LabFloorNav-v0", tasks=Fixed(task), **options).unwrapped


def test_the_scene_at_the_start_looks_like_that_of_fixed_things():
    env, static = environment(exact=True), gym.make("LabFloorNav-v0", layout=LAYOUT, exact=True).unwrapped
    there, _ = env.reset(seed=0)
    fixed, _ = static.reset(seed=0, options={"start": START, "goal": (6.5, 1.0)})
    np.testing.assert_allclose(there["lidar"], fixed["lidar"], atol=1e-5)
    assert env.state.clearance == pytest.approx(static.state.clearance, abs=1e-9)
    for geometry in ("solid", "visual"):
        angles = np.linspace(-0.5, 0.5, 200)
        along = np.column_stack([np.cos(angles), np.sin(angles), -0.1 * np.ones(200)])
        along /= np.linalg.norm(along, axis=1)[:, None]
        origins = np.tile((1.5, 1.0, 0.5), (200, 1))
        moving, plain = env.state.rays(geometry), static.state.rays(geometry)
        (near, hit), (expected, of) = moving.cast(origins, along), plain.cast(origins, along)
        np.testing.assert_allclose(near, expected, atol=1e-5)
        seen = (hit >= 0) & (of >= 0)
        owners = plain.owners(of[seen])
        same = moving.owners(hit[seen]) == owners
        assert same.mean() > 0.98
        assert len(LAYOUT.placements) - 3 in owners
        if geometry == "visual":
            colors, others = moving.color(hit, along), plain.color(of, along)
            assert (np.abs(colors.astype(int) - others.astype(int)).max(axis=1) <= 2).mean() > 0.97


def test_sensors_see_a_thing_where_it_was_pushed():
    env = environment()
    env.reset(seed=0)
    for _ in range(25):
        observation, _, _, _, info = env.step([0.5, 0.0])
    assert not info["contacts"]
    x, y, yaw = env.state.moving.simulation.pose_of(0)
    assert x > 3.0
    moved = [
        replace_pose(placement, x, y, yaw) if placement.id == TROLLEY else placement for placement in LAYOUT.placements
    ]
    world = World(LAYOUT.replace(placements=tuple(moved)))
    assert env.state.clearance == pytest.approx(world.clearance(*env.state.pose[:2]), abs=1e-6)
    from labgym.envs.sensors import Lidar

    np.testing.assert_allclose(observation["lidar"], Lidar().scan(world.solid, env.state.pose), atol=1e-4)


def replace_pose(placement, x, y, yaw):
    return placement.model_copy(update={"position": (x, y, 0.0), "yaw": yaw})


def test_a_thing_can_be_away_and_come_back():
    env = environment()
    env.reset(seed=0)
    physics = env.state.moving.simulation
    physics.remove(TROLLEY)
    observation, *_ = env.step([1.0, 0.0])
    assert observation["lidar"][90] > 3.0
    for _ in range(25):
        env.step([1.0, 0.0])
    assert env.state.pose[0] > 3.2
    assert physics.ways[0] == 0.0
    physics.put_back(TROLLEY)
    observation, *_ = env.step([0.0, 0.0])
    assert physics.pose_of(0) == pytest.approx((2.6, 1.0, 0.4), abs=1e-12)
    assert observation["lidar"][0] < 1.0


def test_what_cannot_be_pushed_is_refused():
    def check(match, layout=LAYOUT, masses=MASSES, **options):
        pair = GoalPair(0, START, (6.5, 1.0, 0.0), "anywhere", "anywhere")
        env = gym.make("LabFloorNav-v0", tasks=Fixed(Task(layout, None, pair, pushable=masses)), **options)
        with pytest.raises(OptionError, match=match):
            env.reset(seed=0)

    check("cannot be pushed", masses={"FumeHood_1": 30.0})
    loaded = LAYOUT.replace(placements=(*LAYOUT.placements, put("flask", "Beaker", 2.6, 1.0, 0.9, on=TROLLEY, slot=0)))
    check("carries 'flask'", layout=loaded)
    check("interactive=False", interactive=True)
    check("planar kernel", physics="planar")
    check("cannot push things", robot="wheels")
