"""Physics of one robot in a static scene, advanced by control steps."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.reach import FASTEST, OutOfReach, robot_alone
from labgym.envs.robot import PREFIX, ROBOT, RobotSpec
from labgym.geometry import wrap_angle

Pose = tuple[float, float, float]

CHECK_STEPS = 5
"""Physics steps of the differential robot between two checks for contacts: shorter contacts may go unnoticed."""
CHECK_INTERVAL = CHECK_STEPS * ROBOT.timestep
"""Time between two checks for contacts (25 ms), seconds."""

STATE = mujoco.mjtState.mjSTATE_INTEGRATION
"""What the next step depends on."""


class RobotMotion:
    """Base of the simulations of one robot.

    Attributes:
        pose: (x, y, yaw) in the room frame. velocity: forward, m/s, and turn, rad/s. sideways: velocity, m/s.
    """

    def _move(self, x: float, y: float, yaw: float, dx: float, dy: float, turn: float) -> None:
        """Set what the attributes are, from the pose and its rates in the room frame."""
        cosine, sine = math.cos(yaw), math.sin(yaw)
        self.pose: Pose = (x, y, wrap_angle(yaw))
        self.velocity: tuple[float, float] = (cosine * dx + sine * dy, turn)
        self.sideways: float = cosine * dy - sine * dx


class CopiedMotion(RobotMotion, ABC):
    """Base of the simulations that are copied as they are pickled: a new one is put into the same state."""

    @abstractmethod
    def __reduce__(self) -> tuple[Any, ...]: ...

    def __deepcopy__(self, memo: dict[int, Any]) -> Any:
        resume, arguments = self.__reduce__()
        return resume(*arguments)


def stored(data: mujoco.MjData) -> NDArray[np.float64]:
    """Return the state of a simulation, for `restore`."""
    state = np.empty(mujoco.mj_stateSize(data.model, STATE))
    mujoco.mj_getState(data.model, data, state, STATE)
    return state


def restore(data: mujoco.MjData, state: NDArray[np.float64]) -> None:
    """Put data into a state, with all that MuJoCo derives from it."""
    mujoco.mj_setState(data.model, data, state, STATE)
    mujoco.mj_forward(data.model, data)
    mujoco.mj_setState(data.model, data, state, STATE)


class Simulation(CopiedMotion):
    """One robot on the joints x, y and yaw in a compiled scene; nothing else moves.

    While nothing is within reach, the robot is stepped in a model without the scene. The motion is the same to the bit.

    Args:
        model: the scene with the robot.
        robot: its limits.
        out_of_reach: where nothing is within reach; None always steps the scene.
        alone: the robot without the scene; None for a robot of these limits.

    Attributes:
        model: the MuJoCo model of the scene; every contact involves the robot.
        pose: (x, y, yaw) in the room frame; yaw in (-pi, pi].
        velocity: forward velocity, m/s, and turn rate, rad/s. sideways: velocity to the left, m/s.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        robot: RobotSpec = ROBOT,
        out_of_reach: OutOfReach | None = None,
        alone: mujoco.MjModel | None = None,
    ) -> None:
        self.model = model
        self._scene = mujoco.MjData(model)
        self._robot, self._out_of_reach, self._alone_model = robot, out_of_reach, alone
        size = robot if robot.control_dt == ROBOT.control_dt else replace(robot, control_dt=ROBOT.control_dt)
        single = None if out_of_reach is None else robot_alone(size) if alone is None else alone
        self._alone = None if single is None else mujoco.MjData(single)
        self._now = self._scene
        # The joints x, y and yaw were added in this order, so their coordinates are consecutive.
        self._at = slice(model.joint(PREFIX + "x").qposadr[0], model.joint(PREFIX + "yaw").qposadr[0] + 1)
        self._rate = slice(model.joint(PREFIX + "x").dofadr[0], model.joint(PREFIX + "yaw").dofadr[0] + 1)
        # The servos were added in the order forward, grip or sideways, turn.
        first, last = (model.actuator(PREFIX + name).id for name in ("forward", "turn"))
        self._servos = slice(first, last + 1, (last - first) // (len(robot.axes) - 1))
        self._steps = round(CHECK_INTERVAL / robot.timestep)
        self._checks = round(robot.control_dt / CHECK_INTERVAL)
        self.place((0.0, 0.0, 0.0))

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy goes on to the bit: the state has all that the next step depends on.
        return _resumed, (*self._parts(), self._now is self._scene, stored(self._now))

    def _parts(self) -> tuple[mujoco.MjModel, RobotSpec, OutOfReach | None, mujoco.MjModel | None]:
        return self.model, self._robot, self._out_of_reach, self._alone_model

    @property
    def data(self) -> mujoco.MjData:
        """The MuJoCo data of the scene."""
        self._step_in(self._scene)
        return self._scene

    def place(self, pose: Pose) -> None:
        """Put the robot at rest at (x, y, yaw) and set the clock to 0."""
        self._now = self._scene
        mujoco.mj_resetData(self.model, self._scene)
        self._scene.qpos[self._at] = pose
        mujoco.mj_forward(self.model, self._scene)
        self._read()

    def drive(self, *command: float) -> tuple[float, bool]:
        """Apply target velocities, in the order of the robot's axes, in m/s and rad/s for one control step.

        Returns:
            the length driven in meters, as the sum of arcs between contact checks, and whether the robot touched
            anything.
        """
        at, driven, touched = self._at, 0.0, False
        x, y, yaw = self._now.qpos[at].tolist()
        for _ in range(self._checks):
            data = self._within_reach(x, y)
            data.ctrl[self._servos] = command
            touched = self._advance(data, self._steps) or touched
            last, (x, y, yaw) = (x, y, yaw), data.qpos[at].tolist()
            driven += arc(math.hypot(x - last[0], y - last[1]), yaw - last[2])
        self._read()
        return driven, touched

    def _advance(self, data: mujoco.MjData, steps: int) -> bool:
        """Advance by some physics steps; return whether the robot then touches anything."""
        mujoco.mj_step(data.model, data, steps)
        return bool(data.ncon > 0)

    @property
    def timestep(self) -> float:
        """Duration of a physics step, seconds."""
        return self._robot.timestep

    def substep(self, *command: float) -> tuple[str, ...]:
        """Advance by one physics step towards target velocities; return the names of what the robot touches."""
        x, y, _ = self._now.qpos[self._at].tolist()
        data = self._within_reach(x, y)
        data.ctrl[self._servos] = command
        mujoco.mj_step(data.model, data)
        self._read()
        return touched_names(data.model, data.contact.geom.ravel()) if data.ncon else ()

    def _within_reach(self, x: float, y: float) -> mujoco.MjData:
        """Return the data to step from a position: of the robot alone, or of the scene if something is within reach."""
        if self._out_of_reach is None or self._alone is None:
            return self._scene
        dx, dy, _ = self._now.qvel[self._rate].tolist()
        free = self._out_of_reach.at(x, y) and dx * dx + dy * dy < FASTEST * FASTEST
        self._step_in(self._alone if free else self._scene)
        return self._now

    def _step_in(self, data: mujoco.MjData) -> None:
        """Hand the state of the robot over to other data."""
        if data is not self._now:
            data.qpos[self._at], data.qvel[self._rate] = self._now.qpos[self._at], self._now.qvel[self._rate]
            data.qacc_warmstart[self._rate] = self._now.qacc_warmstart[self._rate]
            data.time = self._now.time
            self._now = data

    def _read(self) -> None:
        self._move(*self._now.qpos[self._at].tolist(), *self._now.qvel[self._rate].tolist())


def _resumed(
    model: mujoco.MjModel,
    robot: RobotSpec,
    out_of_reach: OutOfReach | None,
    alone: mujoco.MjModel | None,
    in_scene: bool,
    state: NDArray[np.float64],
) -> Simulation:
    """Return a simulation in the state of another one."""
    simulation = Simulation(model, robot, out_of_reach, alone)
    if not in_scene and simulation._alone is not None:
        simulation._now = simulation._alone
    restore(simulation._now, state)
    simulation._read()
    return simulation


def touched_names(model: mujoco.MjModel, geoms: NDArray[np.integer]) -> tuple[str, ...]:
    """Return what geoms in contact belong to, the robot left out: the first part of their names, in order."""
    names = (model.geom(geom).name for geom in geoms.tolist())
    return tuple(dict.fromkeys(name.partition("/")[0] for name in names if not name.startswith(PREFIX)))


def arc(chord: float, turned: float) -> float:
    """Return the length of the circular arc over a chord along which the heading turned by `turned` radians."""
    half = turned / 2.0
    return chord if abs(half) < 1e-6 else chord * half / math.sin(half)
