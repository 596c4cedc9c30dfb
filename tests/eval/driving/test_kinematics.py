"""Routes that the robot can and cannot have driven."""

from __future__ import annotations

import math

import numpy as np
import pytest
from laboratories import island_laboratory, small_laboratory

from labgym.envs import LabPointNavEnv
from labgym.envs.robot import ROBOT
from labgym.envs.simulation import Simulation
from labgym.envs.world import world_of
from labgym.eval.driving.kinematics import first_jump, possible_contacts

DT = ROBOT.control_dt


def driven(seed: int, steps: int, bold: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Poses, contacts and clearances of a drive with random actions, in a laboratory full of obstacles."""
    env = LabPointNavEnv(layout=island_laboratory())
    _, info = env.reset(seed=seed)
    rng = np.random.default_rng(seed)
    poses, touched, clearances = [info["pose"]], [], [info["clearance"]]
    action = np.zeros(2)
    for step in range(steps):
        if not bold or step % 15 == 0:
            action = rng.uniform((0.5, -0.6), (1.0, 0.6)) if bold else rng.uniform(-1.0, 1.0, 2)
        info = env.step(action.astype(np.float32))[4]
        poses.append(info["pose"])
        touched.append(info["collision"])
        clearances.append(info["clearance"])
    return np.array(poses), np.array(touched), np.array(clearances)


@pytest.mark.parametrize("bold", [True, False])
def test_what_the_simulation_drives_is_no_jump_rounded_or_not(bold: bool) -> None:
    contacts = 0
    for seed in range(4):
        poses, touched, clearances = driven(seed, 150, bold)
        contacts += touched.sum()
        assert first_jump(poses, touched, DT) is None
        rounded = np.round(poses, 3)
        possible = possible_contacts(rounded, clearances, DT, resolution=1e-3)
        assert (possible | ~touched).all()
        assert first_jump(rounded, possible, DT, resolution=1e-3) is None
    assert contacts > 0 or not bold


def straight_route(count: int = 60) -> np.ndarray:
    """Poses of a robot that accelerates from rest along x, exactly as its limits allow."""
    time = DT * np.arange(count)
    ramp = ROBOT.v_max / ROBOT.acceleration
    x = np.where(time < ramp, ROBOT.acceleration * time**2 / 2.0, ROBOT.v_max * (time - ramp / 2.0))
    return np.column_stack([x, np.zeros(count), np.zeros(count)])


def test_the_fastest_possible_drive_is_no_jump() -> None:
    route = straight_route()
    assert first_jump(route, np.zeros(59), DT) is None
    assert first_jump(np.round(route, 3), np.zeros(59), DT, resolution=1e-3) is None


@pytest.mark.parametrize("distance", [0.05, 0.5, 5.0])
def test_a_jump_is_found_at_its_pose(distance: float) -> None:
    route = straight_route()
    route[30:, 0] += distance
    assert first_jump(route, np.zeros(59), DT) == 30
    assert first_jump(np.round(route, 3), np.zeros(59), DT, resolution=1e-3) == 30


def test_a_jump_of_metres_is_found_among_contacts_too() -> None:
    route = straight_route()
    route[30:, 1] += 2.0
    assert first_jump(route, np.ones(59), DT) == 30


def test_a_start_at_full_speed_a_higher_speed_and_a_spin_are_found() -> None:
    running = np.column_stack([0.1 * np.arange(20), np.zeros(20), np.zeros(20)])
    assert first_jump(running, np.zeros(19), DT) == 1
    hurried = straight_route() * (1.1, 1.0, 1.0)
    assert first_jump(hurried, np.zeros(59), DT) is not None
    spinning = straight_route()
    spinning[20:, 2] = math.pi
    assert first_jump(spinning, np.zeros(59), DT) == 20
    route = straight_route()
    route[10, 1] = math.nan
    assert first_jump(route, np.zeros(59), DT) == 10


def test_a_turn_across_the_branch_of_the_angle_is_no_jump() -> None:
    simulation = Simulation(world_of(small_laboratory("first")).model)
    simulation.place((1.3, 5.0, 3.0))
    poses = [simulation.pose]
    for _ in range(20):
        simulation.drive(0.0, ROBOT.w_max)
        poses.append(simulation.pose)
    assert min(pose[2] for pose in poses) < 0.0 < poses[0][2]
    assert first_jump(poses, np.zeros(20), DT) is None


@pytest.mark.parametrize("spin", [-6.0, 6.0])
def test_a_robot_that_still_spins_and_slips_from_a_contact_has_not_jumped(spin: float) -> None:
    simulation = Simulation(world_of(small_laboratory("first")).model)
    simulation.place((1.3, 5.0, -math.pi / 2.0))
    poses, touched = [simulation.pose], []
    for step in range(18):
        if step == 3:
            simulation.data.qvel[2] += spin  # the impulse of a corner
        touched.append(simulation.drive(ROBOT.v_max, 0.0)[1] or step == 3)
        poses.append(simulation.pose)
    route = np.array(poses)
    assert sum(touched) == 1
    assert np.linalg.norm(np.diff(route[:, :2], axis=0), axis=1).max() > 1.03 * ROBOT.v_max * DT
    assert first_jump(route, touched, DT) is None
    assert first_jump(np.round(route, 3), touched, DT, resolution=1e-3) is None
    route[11:, :2] += 0.5 * (route[11, :2] - route[10, :2])
    assert first_jump(route, touched, DT) == 11
