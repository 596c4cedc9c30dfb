"""Physics of a robot of any kind in a scene of which anything may move, advanced by control steps."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.mount import Mount, at_rest, turned
from labgym.envs.parts.protocols import Robot
from labgym.envs.robot import PREFIX
from labgym.envs.simulation import CHECK_INTERVAL, CopiedMotion, Pose, arc, restore, stored, touched_names
from labgym.errors import OptionError
from labgym.geometry import wrap_angle


class SceneSimulation(CopiedMotion):
    """One robot in a compiled scene in which furniture may move and wheels touch the floor.

    Args:
        model: the scene with the robot.
        robot: the robot.
        control_dt: duration of a control step, seconds.

    Attributes:
        model: the MuJoCo model of the scene. mount: where the robot is in it.
        pose: (x, y, yaw) in the room frame; yaw in (-pi, pi].
        velocity: forward velocity, m/s, and turn rate, rad/s. sideways: velocity to the left, m/s.
    """

    def __init__(self, model: mujoco.MjModel, robot: Robot, control_dt: float) -> None:
        self.model, self.mount = model, Mount.of(model)
        self._data = mujoco.MjData(model)
        self._robot, self._control_dt = robot, control_dt
        self._rest = at_rest(robot)
        self._actuators = [model.actuator(PREFIX + name).id for name in robot.actuators]
        self._steps = round(CHECK_INTERVAL / model.opt.timestep)
        self._checks = round(control_dt / CHECK_INTERVAL)
        self.place((0.0, 0.0, 0.0))

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy goes on to the bit: the state has all that the next step depends on.
        return _resumed, (self.model, self._robot, self._control_dt, stored(self._data))

    @property
    def data(self) -> mujoco.MjData:
        """The MuJoCo data of the scene."""
        return self._data

    def place(self, pose: Pose) -> None:
        """Put the robot at rest at (x, y, yaw), everything else to its initial place, and set the clock to 0."""
        x, y, yaw = pose
        mujoco.mj_resetData(self.model, self._data)
        rest = self._rest.copy()
        if self.mount.planar:
            rest[:3] = pose
        else:
            rest[:2] = x, y
            rest[3:7] = turned(rest[3:7], yaw)
        self._data.qpos[self.mount.coordinates] = rest
        self._data.ctrl[self._actuators] = self._robot.controls((0.0,) * len(self._robot.axes))
        mujoco.mj_forward(self.model, self._data)
        self._read()

    def drive(self, *command: float) -> tuple[float, bool]:
        """Apply target velocities, in the order of the robot's axes, in m/s and rad/s for one control step.

        Returns:
            the length driven in meters, as the sum of arcs between contact checks, and whether the robot touched
            anything but the floor.

        Raises:
            OptionError: the physics diverged.
        """
        model, data = self.model, self._data
        data.ctrl[self._actuators] = self._robot.controls(command)
        driven, touched = 0.0, False
        x, y, yaw = self._place()
        for _ in range(self._checks):
            mujoco.mj_step(model, data, self._steps)
            touched = touched or self.touching
            last, (x, y, yaw) = (x, y, yaw), self._place()
            driven += arc(math.hypot(x - last[0], y - last[1]), wrap_angle(yaw - last[2]))
        if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number:
            raise OptionError(
                f"the physics diverged at {data.time:.2f} s: pass a robot with a smaller timestep than "
                f"{model.opt.timestep:g} s"
            )
        # Bodies are where the last step began; rays are cast from where it ended.
        mujoco.mj_kinematics(model, data)
        self._read()
        return driven, touched

    @property
    def timestep(self) -> float:
        """Duration of a physics step, seconds."""
        return float(self.model.opt.timestep)

    def substep(self, *command: float) -> tuple[str, ...]:
        """Advance by one physics step towards target velocities; return the names of what the robot touches."""
        data = self._data
        data.ctrl[self._actuators] = self._robot.controls(command)
        mujoco.mj_step(self.model, data)
        touched = touched_names(self.model, data.contact.geom[self._touching()].ravel()) if data.ncon else ()
        mujoco.mj_kinematics(self.model, data)
        self._read()
        return touched

    @property
    def touching(self) -> bool:
        """Whether the robot touches anything but the floor."""
        return bool(self._data.ncon and self._touching().any())

    def _touching(self) -> NDArray[np.bool_]:
        """Return which contacts are between the robot and anything but the floor."""
        pairs, own, floor = self._data.contact.geom, self.mount.geoms, self.mount.floor
        mine = own[pairs]
        obstacle: NDArray[np.bool_] = (mine[:, 0] != mine[:, 1]) & ~floor[pairs].any(axis=1)
        obstacle &= self._data.contact.dist <= 0.0
        return obstacle

    def _place(self) -> Pose:
        first = self.mount.coordinates.start
        if self.mount.planar:
            x, y, yaw = self._data.qpos[first : first + 3].tolist()
            return x, y, yaw
        x, y, _, w, i, j, k = self._data.qpos[first : first + 7].tolist()
        return x, y, math.atan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k))

    def _read(self) -> None:
        x, y, yaw = self._place()
        first = self.mount.rates.start
        if self.mount.planar:
            dx, dy, turn = self._data.qvel[first : first + 3].tolist()
        else:
            dx, dy = self._data.qvel[first : first + 2].tolist()
            # A free joint's angular velocity is in the frame of the body.
            base = self._data.qpos[self.mount.coordinates.start + 3 : self.mount.coordinates.start + 7]
            spin = np.empty(3)
            mujoco.mju_rotVecQuat(spin, self._data.qvel[first + 3 : first + 6], base)
            turn = float(spin[2])
        self._move(x, y, yaw, dx, dy, turn)


def _resumed(model: mujoco.MjModel, robot: Robot, control_dt: float, state: NDArray[np.float64]) -> SceneSimulation:
    """Return a simulation in the state of another one."""
    simulation = SceneSimulation(model, robot, control_dt)
    restore(simulation.data, state)
    simulation._read()
    return simulation
