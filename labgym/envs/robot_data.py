"""MuJoCo data that a robot is stepped in: in its scene, alone, or among the few solids around it."""

from __future__ import annotations

import copy
from collections.abc import Callable
from functools import lru_cache
from typing import Generic, TypeVar

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.reach import BOX_FIELDS, TRAVEL, SolidBoxes, robot_alone
from labgym.envs.robot import RobotSpec, attach_robot

SLOTS = 16
"""Largest number of boxes around a robot that are simulated without the rest of the scene."""
WINDOW = 0.25
"""Distance that the robot moves before the boxes around it are looked up again, meters."""
MARGIN = 1e-3
"""Reserve of bounds and distances, meters."""
SPARE = 64
"""Number of unused data of a kind that a process keeps."""
NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
CHILDREN = np.arange(1, 2 * SLOTS - 1, dtype=np.int32).reshape(SLOTS - 1, 2)
"""Children of the inner nodes of a binary tree in which node i has the children 2 i + 1 and 2 i + 2."""
LEAVES = np.arange(SLOTS, dtype=np.int32)


class RobotData:
    """MuJoCo data, with views of the robot's entries.

    Attributes:
        model: the model, whose only joints are x, y and yaw of the robot. data: its data.
        qpos, qvel, warmstart: views of the robot's entries, (3,). ctrl: of the servos that take commands.
    """

    def __init__(self, model: mujoco.MjModel, joints: tuple[int, int] = (0, 0), servos: slice = slice(None)) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        position, rate = joints
        self.qpos: NDArray[np.float64] = self.data.qpos[position : position + 3]
        self.qvel: NDArray[np.float64] = self.data.qvel[rate : rate + 3]
        self.warmstart: NDArray[np.float64] = self.data.qacc_warmstart[rate : rate + 3]
        self.ctrl: NDArray[np.float64] = self.data.ctrl[servos]

    def go_on_from(self, other: RobotData) -> None:
        """Take over the state of the robot."""
        self.qpos[:], self.qvel[:], self.warmstart[:] = other.qpos, other.qvel, other.warmstart
        self.data.time = other.data.time


class NearbyBoxes(RobotData):
    """The robot and the boxes around a point, in the order that they have in the scene.

    The motion equals that in the scene, bit for bit, while the robot touches no other solid: MuJoCo then sums the same
    contacts in the same order.
    """

    def __init__(self, robot: RobotSpec, servos: slice) -> None:
        super().__init__(copy.copy(_robot_with_slots(robot)), servos=servos)
        self._geoms = [getattr(self.model, f"geom_{name}") for name in BOX_FIELDS]
        self._radius = robot.chassis_radius
        self._solids: SolidBoxes | None = None
        self._x = self._y = 0.0
        self._crowded = False

    def hold(self, solids: SolidBoxes, x: float, y: float) -> bool:
        """Whether they hold all boxes of a scene that the robot can touch from a point until the next contact check.

        If they are those of another place, they are replaced, unless there are more than `SLOTS`.
        """
        dx, dy = x - self._x, y - self._y
        if self._solids is not solids or dx * dx + dy * dy > WINDOW * WINDOW:
            boxes = solids.around(x, y, WINDOW + TRAVEL + self._radius + MARGIN)
            self._solids, self._x, self._y, self._crowded = solids, x, y, len(boxes) > SLOTS
            if not self._crowded:
                self._fill(solids, boxes)
        return not self._crowded

    def _fill(self, solids: SolidBoxes, boxes: NDArray[np.intp]) -> None:
        """Put boxes into the model, with the tree of bounds by which MuJoCo looks for contacts."""
        model, count = self.model, len(boxes)
        model.body_geomnum[0] = count
        model.body_bvhnum[0] = max(2 * count - 1, 0)
        if not count:
            return
        for geoms, field in zip(self._geoms, solids.fields, strict=True):
            geoms[:count] = field[boxes]
        inner, nodes = count - 1, 2 * count - 1
        model.bvh_child[:inner] = CHILDREN[:inner]
        model.bvh_child[inner:nodes] = -1
        model.bvh_nodeid[:inner] = -1
        model.bvh_nodeid[inner:nodes] = LEAVES[:count]
        bounds = np.empty((nodes, 2, 3))
        bounds[inner:, 0], bounds[inner:, 1] = solids.low[boxes], solids.high[boxes]
        for node in range(inner - 1, -1, -1):
            one, other = bounds[2 * node + 1], bounds[2 * node + 2]
            np.minimum(one[0], other[0], out=bounds[node, 0])
            np.maximum(one[1], other[1], out=bounds[node, 1])
        model.bvh_aabb[:nodes, :3] = (bounds[:, 0] + bounds[:, 1]) / 2.0
        model.bvh_aabb[:nodes, 3:] = (bounds[:, 1] - bounds[:, 0]) / 2.0 + MARGIN


_Data = TypeVar("_Data", bound=RobotData)


class Spares(Generic[_Data]):
    """Data that simulations of this process take and return: making them takes longer than an episode of some steps.

    Args:
        make: makes new ones.
    """

    def __init__(self, make: Callable[[], _Data]) -> None:
        self._make = make
        self._unused: list[_Data] = []

    def take(self) -> _Data:
        """Return data that nobody uses; their state is any."""
        try:
            return self._unused.pop()
        except IndexError:
            return self._make()

    def give(self, data: _Data) -> None:
        """Return data that will not be used any more."""
        if len(self._unused) < SPARE:
            self._unused.append(data)


@lru_cache(maxsize=16)
def without_scene(robot: RobotSpec) -> tuple[Spares[RobotData], Spares[NearbyBoxes]]:
    """Return the data of the robot that drives where it can touch nothing, and among few boxes."""
    servos = slice(0, 3) if robot.v_side > 0.0 else slice(0, 3, 2)
    alone = copy.copy(robot_alone(robot))
    alone.opt.disableflags |= NO_CONTACTS
    return Spares(lambda: RobotData(alone, servos=servos)), Spares(lambda: NearbyBoxes(robot, servos))


@lru_cache(maxsize=16)
def _robot_with_slots(robot: RobotSpec) -> mujoco.MjModel:
    """Return the robot with the places of boxes in its world."""
    scene = mujoco.MjSpec()
    for _ in range(SLOTS):
        scene.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[1.0, 1.0, 1.0])
    attach_robot(scene, robot)
    scene.compiler.discardvisual = True
    return scene.compile()
