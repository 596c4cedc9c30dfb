"""The robot in an arena of walls: motion against closed forms, contact against geometry."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from labgym.envs.robot import PREFIX, ROBOT, attach_robot, robot_spec

WALL = 3.0


class Arena:
    """A floor, and a wall whose near face lies at x = 3 m."""

    def __init__(self) -> None:
        spec = mujoco.MjSpec()
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[10, 10, 0.1])
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.1, 20, 1], pos=[WALL + 0.1, 0, 1])
        attach_robot(spec)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.deepest = 0.0

    def drive(self, v: float, w: float, seconds: float) -> None:
        self.data.actuator(f"{PREFIX}forward").ctrl[0] = v
        self.data.actuator(f"{PREFIX}turn").ctrl[0] = w
        for _ in range(round(seconds / self.model.opt.timestep)):
            mujoco.mj_step(self.model, self.data)
            self.deepest = max([self.deepest, *(-contact.dist for contact in self.data.contact)])


@pytest.fixture
def arena() -> Arena:
    return Arena()


def test_driving_straight_covers_the_distance_of_a_ramp_and_a_cruise(arena: Arena) -> None:
    arena.drive(1.0, 0.0, 2.0)
    ramp = ROBOT.v_max / ROBOT.acceleration
    expected = ROBOT.v_max * (2.0 - ramp / 2.0)
    assert arena.data.qpos == pytest.approx([expected, 0.0, 0.0], abs=0.01)
    assert arena.data.qvel[0] == pytest.approx(ROBOT.v_max, abs=1e-3)


@pytest.mark.parametrize("v", [1.0, -0.3])
def test_the_forward_acceleration_never_exceeds_its_limit(arena: Arena, v: float) -> None:
    speeds = [0.0]
    for command in (v, 0.0):
        for _ in range(40):
            arena.drive(command, 0.0, 0.025)
            speeds.append(arena.data.qvel[0])
    assert np.abs(np.diff(speeds)).max() <= ROBOT.acceleration * 0.025 + 1e-9
    assert speeds[-1] == pytest.approx(0.0, abs=1e-3)


def test_turning_in_place_stays_in_place(arena: Arena) -> None:
    arena.drive(0.0, 1.5, 3.0)
    ramp = ROBOT.w_max / ROBOT.turn_acceleration
    assert arena.data.qpos[2] == pytest.approx(ROBOT.w_max * (3.0 - ramp / 2.0), abs=0.04)
    assert arena.data.qpos[:2] == pytest.approx([0.0, 0.0], abs=1e-9)


def test_driving_and_turning_makes_a_circle_of_radius_v_over_w(arena: Arena) -> None:
    arena.data.qpos[0] = -3.0
    arena.drive(0.8, 1.0, 2.0)
    points = []
    for _ in range(63):
        arena.drive(0.8, 1.0, 0.1)
        points.append(arena.data.qpos[:2].copy())
    centre = np.mean([np.min(points, axis=0), np.max(points, axis=0)], axis=0)
    assert np.linalg.norm(np.array(points) - centre, axis=1) == pytest.approx(0.8, abs=0.01)


def test_the_wheels_do_not_slip_sideways_on_the_tightest_turn(arena: Arena) -> None:
    arena.data.qpos[0] = -3.0
    arena.drive(1.0, 1.5, 2.0)
    yaw = arena.data.qpos[2]
    sideways = -math.sin(yaw) * arena.data.qvel[0] + math.cos(yaw) * arena.data.qvel[1]
    assert abs(sideways) < 0.02


@pytest.mark.parametrize("yaw", [0.0, 0.4, 0.8])
def test_a_wall_stops_the_robot_at_its_chassis_radius(arena: Arena, yaw: float) -> None:
    arena.data.qpos[2] = yaw
    arena.drive(1.0, 0.0, 8.0)
    assert arena.data.qpos[0] == pytest.approx(WALL - ROBOT.chassis_radius, abs=0.001)
    assert arena.deepest < 0.005


def test_the_robot_can_back_away_from_a_wall(arena: Arena) -> None:
    arena.drive(1.0, 0.0, 5.0)
    arena.drive(-0.3, 0.0, 2.0)
    assert arena.data.qpos[0] < WALL - ROBOT.chassis_radius - 0.4
    assert arena.data.ncon == 0


def test_the_robot_at_rest_does_not_move_at_all(arena: Arena) -> None:
    arena.drive(0.0, 0.0, 5.0)
    assert not arena.data.qpos.any()
    assert arena.data.ncon == 0


def test_everything_of_the_robot_stays_inside_its_chassis_radius_and_height() -> None:
    model = robot_spec().compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for geom in range(model.ngeom):
        centre, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
        signs = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        corners = (centre + signs * half) @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        # A round geom's bounding box has corners a factor sqrt(2) outside it.
        assert np.abs(corners[:, :2]).max() <= ROBOT.chassis_radius + 0.001
        assert corners[:, 2].max() <= ROBOT.height + 0.001
        assert corners[:, 2].min() >= -0.001


def test_an_action_maps_onto_the_velocity_limits() -> None:
    assert ROBOT.twist(1.0, 1.0) == (1.0, 1.5)
    assert ROBOT.twist(-1.0, -1.0) == (-0.3, -1.5)
    assert ROBOT.twist(0.0, 0.0) == (0.0, 0.0)
    assert ROBOT.twist(-0.5, 0.5) == pytest.approx((-0.15, 0.75))
    assert ROBOT.twist(7.0, -7.0) == (1.0, -1.5)
