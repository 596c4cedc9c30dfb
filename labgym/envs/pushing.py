"""Physics of one robot in a scene in which it can push some things."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.mount import Mount
from labgym.envs.reach import FASTEST, TRAVEL, OutOfReach
from labgym.envs.robot import RobotSpec
from labgym.envs.simulation import Pose, Simulation, restore, stored, touched_names
from labgym.geometry import wrap_angle

RESTING = 1e-3
"""A thing that the robot does not touch stands still below this speed, m/s, and this turn rate, rad/s."""
AWAY = 10.0
"""Distance from the floor at which things that are not there are parked, meters."""


@dataclass(frozen=True)
class Thing:
    """A thing that the robot can push.

    Attributes:
        name: id of its placement. mass: kg. friction: coefficient of friction on the floor.
        pose: (x, y, yaw) at the start, in the room frame.
        radius: of the vertical cylinder about its middle that holds its solids, meters.
    """

    name: str
    mass: float
    friction: float
    pose: Pose
    radius: float


class PushingSimulation(Simulation):
    """A robot on the joints x, y and yaw among static things and things that it can push.

    While all things stand still and none is within reach of the robot, it is stepped in the scene without them, or,
    where nothing at all is within reach, in a model without the scene. Its motion there is that without the things, to
    the bit.

    Args:
        model: the scene with the robot and the things. robot: limits of the robot.
        out_of_reach: where nothing static is within reach; None always steps the scene.
        alone: the robot without the scene. quiet: the scene without the things.
        things: what it can push, in the order of their bodies.

    Attributes:
        things: what it can push. poses: of the things, (n, 3) in the room frame.
        ways: how far each was pushed, (n,) meters. touched: names of the things that the robot has touched.
        absent: names of the things that are not there.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        robot: RobotSpec,
        out_of_reach: OutOfReach | None,
        alone: mujoco.MjModel | None,
        quiet: mujoco.MjModel,
        things: tuple[Thing, ...],
    ) -> None:
        self.things, self._quiet = things, mujoco.MjData(quiet)
        joints = [[model.joint(f"{thing.name}/{axis}") for axis in ("x", "y", "yaw")] for thing in things]
        self._places = np.array([[int(joint.qposadr[0]) for joint in each] for each in joints])
        self._rates = np.array([[int(joint.dofadr[0]) for joint in each] for each in joints])
        self._start = np.array([thing.pose for thing in things])
        self._names = frozenset(thing.name for thing in things)
        self._own = Mount.of(model).geoms
        self._reach = [thing.radius + robot.chassis_radius + TRAVEL for thing in things]
        super().__init__(model, robot, out_of_reach, alone)

    def place(self, pose: Pose) -> None:
        """Put the robot at rest at a pose and the things where they were at the start, and set the clock to 0."""
        self.absent: frozenset[str] = frozenset()
        self.touched: frozenset[str] = frozenset()
        self.ways: NDArray[np.float64] = np.zeros(len(self.things))
        super().place(pose)
        self._locate()

    def remove(self, name: str) -> None:
        """Take a thing away: nothing touches or sees it until `put_back`."""
        self.absent |= {name}
        index = self._index(name)
        x, y = self.model.stat.center[:2] + self.model.stat.extent + AWAY * (1 + index)
        self._set(index, (float(x), float(y), 0.0))

    def put_back(self, name: str) -> None:
        """Put a thing that is away where it was at the start, at rest."""
        self.absent -= {name}
        index = self._index(name)
        self._set(index, self.things[index].pose)

    def _index(self, name: str) -> int:
        return next(index for index, thing in enumerate(self.things) if thing.name == name)

    def _set(self, index: int, pose: Pose) -> None:
        scene = self._scene
        scene.qpos[self._places[index]] = np.array(pose) - self._start[index]
        scene.qvel[self._rates[index]] = scene.qacc_warmstart[self._rates[index]] = 0.0
        self._locate()

    def _advance(self, data: mujoco.MjData, steps: int) -> bool:
        if data is not self._scene:
            return super()._advance(data, steps)
        touched = False
        for _ in range(steps):
            mujoco.mj_step(data.model, data)
            touched = bool(self._contacts(data)) or touched
        return touched

    def substep(self, *command: float) -> tuple[str, ...]:
        """Advance by one physics step towards target velocities; return the names of what the robot touches.

        Things that it can push are not among them: see `touched`.
        """
        names = super().substep(*command)
        return self._contacts(self._scene) if self._now is self._scene else names

    def _contacts(self, data: mujoco.MjData) -> tuple[str, ...]:
        """Follow the things after a step of the scene; return the names of the static things that the robot touches."""
        names: tuple[str, ...] = ()
        if data.ncon:
            pairs = data.contact.geom
            pairs = pairs[self._own[pairs].any(axis=1)]
            names = touched_names(self.model, pairs.ravel())
        pushed = self._names.intersection(names)
        self.touched |= pushed
        self._follow(data, pushed)
        return tuple(name for name in names if name not in pushed)

    def _follow(self, data: mujoco.MjData, pushed: frozenset[str]) -> None:
        """Stop things that are slow, and add up how far the others moved."""
        rates = data.qvel[self._rates]
        if not rates.any():  # the step that ends at rest does not move
            self._moving = False
            return
        before = self.poses
        slow = (np.hypot(rates[:, 0], rates[:, 1]) < RESTING) & (np.abs(rates[:, 2]) < RESTING)
        slow &= np.array([thing.name not in pushed for thing in self.things])
        if slow.any():
            data.qvel[self._rates[slow]] = 0.0
        self._locate()
        self.ways = self.ways + np.hypot(*(self.poses - before)[:, :2].T)

    def _locate(self) -> None:
        """Read the poses of the things."""
        self.poses = self._scene.qpos[self._places] + self._start
        self._circles = list(zip(*self.poses[:, :2].T.tolist(), self._reach, strict=True))
        self._moving = bool(self._scene.qvel[self._rates].any())

    def _within_reach(self, x: float, y: float) -> mujoco.MjData:
        dx, dy, _ = self._now.qvel[self._rate].tolist()
        fast = dx * dx + dy * dy >= FASTEST * FASTEST
        near = any(math.hypot(x - a, y - b) < reach for a, b, reach in self._circles)
        if self._out_of_reach is None or self._moving or fast or near:
            self._step_in(self._scene)
        else:
            self._step_in(self._alone if self._out_of_reach.at(x, y) else self._quiet)
        return self._now

    def pose_of(self, index: int) -> Pose:
        """Return the pose (x, y, yaw) of a thing; yaw in (-pi, pi]."""
        x, y, yaw = self.poses[index].tolist()
        return x, y, wrap_angle(yaw)

    def __reduce__(self) -> tuple[Any, ...]:
        return _resumed, (type(self), self._made_of(), self._memory())

    def _datas(self) -> tuple[mujoco.MjData, ...]:
        return self._scene, self._alone or self._scene, self._quiet

    def _made_of(self) -> tuple[Any, ...]:
        return (*self._parts(), self._quiet.model, self.things)

    def _memory(self) -> tuple[Any, ...]:
        """Return what the next step depends on: the states of the scene and of the data stepped last, and the rest."""
        current = next(index for index, data in enumerate(self._datas()) if data is self._now)
        return stored(self._scene), current, stored(self._now), self.ways, self.touched, self.absent


def _resumed(kind: type[PushingSimulation], parts: tuple[Any, ...], memory: tuple[Any, ...]) -> PushingSimulation:
    """Return a simulation in the state of another one."""
    simulation = kind(*parts)
    scene, current, state, *rest = memory
    restore(simulation._scene, scene)
    simulation._now = simulation._datas()[current]
    restore(simulation._now, state)
    simulation.ways, simulation.touched, simulation.absent = rest
    simulation._locate()
    simulation._read()
    return simulation
