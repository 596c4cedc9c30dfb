"""How far the planar kernel and MuJoCo agree, measured on the same drives."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from dataclasses import dataclass

import mujoco
import numpy as np

from labgym.envs.planar.body import TIMESTEP, PlanarBody, body_of
from labgym.envs.planar.plan import PlanarPlan, plan_of
from labgym.envs.planar.simulation import CHECK_INTERVAL, PlanarSimulation
from labgym.envs.reach import robot_alone
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import Lidar
from labgym.envs.simulation import Pose
from labgym.envs.world import world_of
from labgym.layouts import Layout
from labgym.navigation.barriers import Barriers

HOLD = 10
"""Control steps for which a command is held."""


@dataclass(frozen=True)
class ContactAgreement:
    """Contacts on drives in MuJoCo, and in the kernel from the same state at the start of each control step.

    Attributes:
        steps: number of control steps. touching: number of those in which MuJoCo reports a contact.
        reported: number of those in which one of the two reports a contact and the other none. A robot that slides
            leaves the surface by micrometers, so reports, which look four times in a control step, differ by chance.
        states: number of control steps after which, at the same position, one of the two is in contact and the other
            is not. deepest: the largest depth of the contacts of those, meters.
        positions: distance between the two positions after each step with a contact, meters, ascending.
    """

    steps: int
    touching: int
    reported: int
    states: int
    deepest: float
    positions: tuple[float, ...]


class MujocoMotion:
    """The robot in MuJoCo, at any physics step.

    Args:
        model: a compiled scene with the robot. timestep: physics step, seconds.
        single: whether a solid has a single contact point.
    """

    def __init__(self, model: mujoco.MjModel, timestep: float, single: bool = False) -> None:
        self.model = copy.copy(model)
        self.model.opt.timestep = timestep
        if single:
            self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MULTICCD
        self.data = mujoco.MjData(self.model)
        self._steps = round(CHECK_INTERVAL / timestep)

    def place(self, pose: Pose) -> None:
        """Put the robot at rest at (x, y, yaw)."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = pose

    def drive(self, v: float, w: float) -> bool:
        """Apply a target twist for one control step and return whether the robot touched anything."""
        self.data.ctrl[:] = v, 0.0, w
        touched = False
        for _ in range(round(ROBOT.control_dt / CHECK_INTERVAL)):
            mujoco.mj_step(self.model, self.data, self._steps)
            touched = touched or self.data.ncon > 0
        return touched

    @property
    def pose(self) -> Pose:
        """(x, y, yaw) in the room frame."""
        x, y, yaw = self.data.qpos.tolist()
        return x, y, yaw

    @property
    def depth(self) -> float:
        """The depth of the deepest contact at the present position, meters; 0 without contacts."""
        mujoco.mj_fwdPosition(self.model, self.data)
        return -min(self.data.contact.dist, default=0.0)

    def distance(self, pose: Pose) -> float:
        """Return the distance of the robot from a pose, meters."""
        return math.dist(pose[:2], self.data.qpos[:2].tolist())


def planar(model: mujoco.MjModel) -> tuple[PlanarPlan, PlanarBody]:
    """Return what the kernel reads of a compiled scene."""
    return plan_of(model), body_of(model)


def free_motion(drives: int, seconds: float, timestep: float = TIMESTEP, seed: int = 0) -> tuple[float, ...]:
    """Return the largest distance of each drive between the kernel and MuJoCo, meters.

    Nothing is in the robot's way; commands are random and change every second. Positions are compared ten times a
    second.

    Args:
        timestep: physics step of MuJoCo, seconds.
    """
    reference, kernel = MujocoMotion(robot_alone(), timestep), PlanarSimulation(*planar(robot_alone()))
    rng = np.random.default_rng(seed)
    largest = []
    for _ in range(drives):
        pose = (0.0, 0.0, float(rng.uniform(-math.pi, math.pi)))
        reference.place(pose)
        kernel.place(pose)
        distances = []
        for v, w in commands(rng, round(seconds / ROBOT.control_dt)):
            reference.drive(v, w)
            kernel.drive(v, w)
            distances.append(reference.distance(kernel.pose))
        largest.append(max(distances))
    return tuple(largest)


def contacts(
    layout: Layout, drives: int, timestep: float = TIMESTEP, single: bool = False, steps: int = 50, seed: int = 0
) -> ContactAgreement:
    """Drive into things with random commands in MuJoCo, and repeat every control step in the kernel from its start.

    Args:
        drives: number of drives, from random free places. steps: control steps of each.
        timestep: physics step of MuJoCo, seconds.
        single: whether MuJoCo finds a single contact point of each solid. With several, as in the environment, MuJoCo
            4.0 takes the normal of a face for that of a vertical edge in a part of the contacts.
    """
    reference = MujocoMotion(world_of(layout).model, timestep, single)
    kernel = PlanarSimulation(*planar(reference.model))
    rng = np.random.default_rng(seed)
    touching = reported = states = 0
    deepest, positions = 0.0, []
    for pose in free_poses(layout, rng, drives):
        reference.place(pose)
        for v, w in commands(rng, steps):
            kernel.resume(reference.data.qpos, reference.data.qvel)
            touched, touched_too = reference.drive(v, w), kernel.drive(v, w)[1]
            touching += touched
            reported += touched != touched_too
            if touched:
                positions.append(reference.distance(kernel.pose))
            kernel.place(reference.pose)
            depths = reference.depth, kernel.depth
            if (depths[0] > 0.0) != (depths[1] > 0.0):
                states, deepest = states + 1, max(deepest, *depths)
    return ContactAgreement(drives * steps, touching, reported, states, deepest, tuple(sorted(positions)))


def differing_rays(layout: Layout, scans: int, more_than: float = 0.01, seed: int = 0) -> tuple[int, int]:
    """Return how many rays of the two lidars differ by more than a distance in meters, and the number of rays."""
    world, lidar = world_of(layout), Lidar()
    kernel = PlanarSimulation(*planar(world.model))
    differing = rays = 0
    for pose in free_poses(layout, np.random.default_rng(seed), scans):
        kernel.place(pose)
        difference = np.abs(lidar.scan(world.solid, pose) - kernel.scan())
        differing, rays = differing + int((difference > more_than).sum()), rays + len(difference)
    return differing, rays


def commands(rng: np.random.Generator, steps: int) -> Iterator[tuple[float, float]]:
    """Yield target velocities of control steps, m/s and rad/s; every other one held is straight."""
    v = w = 0.0
    for k in range(steps):
        if k % HOLD == 0:
            v, w = float(rng.uniform(ROBOT.v_min, ROBOT.v_max)), float(rng.uniform(-ROBOT.w_max, ROBOT.w_max))
        yield v, w if k // HOLD % 2 else 0.0


def free_poses(layout: Layout, rng: np.random.Generator, count: int) -> Iterator[Pose]:
    """Yield random poses at which the robot touches nothing."""
    barriers = Barriers.of(layout)
    corners = np.concatenate([box.corners() for space in layout.floor.spaces for box in space.boxes])
    while count > 0:
        x, y = rng.uniform(corners.min(axis=0), corners.max(axis=0)).tolist()
        point = np.array([[x, y]])
        if barriers.inside(point)[0] and barriers.clearance(point)[0] > ROBOT.chassis_radius:
            count -= 1
            yield x, y, float(rng.uniform(-math.pi, math.pi))
