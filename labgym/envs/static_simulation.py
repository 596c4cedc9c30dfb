"""Physics of the differential robot in a static scene, as `Simulation`, in half of the time."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from labgym.envs.reach import FASTEST, OutOfReach
from labgym.envs.robot import PREFIX, ROBOT, RobotSpec
from labgym.envs.robot_data import NearbyBoxes, RobotData, without_scene
from labgym.envs.simulation import CHECK_INTERVAL, CopiedMotion, Pose, arc, touched_names


class StaticSimulation(CopiedMotion):
    """The differential robot in a compiled scene; nothing else moves.

    The robot is stepped in a model without the scene while it can touch nothing, and elsewhere in a model of the few
    boxes around it. The motion is that of `Simulation`, to the bit.

    Args:
        model: the scene with the robot.
        out_of_reach: where nothing is within reach.
        robot: dimensions and limits of the differential robot, and the duration of its control step.

    Attributes:
        model: the MuJoCo model of the scene; every contact involves the robot.
        pose: (x, y, yaw) in the room frame; yaw in (-pi, pi].
        velocity: forward velocity, m/s, and turn rate, rad/s. sideways: velocity to the left, m/s.
    """

    def __init__(self, model: mujoco.MjModel, out_of_reach: OutOfReach, robot: RobotSpec = ROBOT) -> None:
        self.model, self._out_of_reach, self._robot = model, out_of_reach, robot
        self._spares = without_scene(replace(robot, control_dt=ROBOT.control_dt))
        self._alone = self._spares[0].take()
        self._around: NearbyBoxes | None = None
        self._scene: RobotData | None = None
        self._now: RobotData = self._alone
        self._steps = round(CHECK_INTERVAL / robot.timestep)
        self._checks = round(robot.control_dt / CHECK_INTERVAL)
        self.place((0.0, 0.0, 0.0))

    def __del__(self) -> None:
        if hasattr(self, "_around"):
            self._spares[0].give(self._alone)
            if self._around is not None:
                self._spares[1].give(self._around)

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy goes on to the bit: the state has all that the next step depends on.
        return _resumed, (self.model, self._out_of_reach, self._robot, self._state())

    def _state(self) -> NDArray[np.float64]:
        now = self._now
        return np.concatenate([now.qpos, now.qvel, now.warmstart, [now.data.time]])

    @property
    def timestep(self) -> float:
        """Duration of a physics step, seconds."""
        return self._robot.timestep

    @property
    def data(self) -> mujoco.MjData:
        """The MuJoCo data of the scene."""
        scene = self._whole()
        self._step_in(scene)
        return scene.data

    def place(self, pose: Pose) -> None:
        """Put the robot at rest at (x, y, yaw) and set the clock to 0."""
        now = self._now = self._alone
        mujoco.mj_resetData(now.model, now.data)
        now.qpos[:] = pose
        self._read()

    def drive(self, *command: float) -> tuple[float, bool]:
        """Apply target velocities, in m/s and rad/s, for one control step.

        Returns:
            the length driven in meters, as the sum of arcs between contact checks, and whether the robot touched
            anything.
        """
        driven, touched, obeys = 0.0, False, None
        x, y, yaw = self._now.qpos.tolist()
        for _ in range(self._checks):
            now = self._within_reach(x, y)
            if now is not obeys:
                now.ctrl[:], obeys = command, now
            mujoco.mj_step(now.model, now.data, self._steps)
            touched = touched or now.data.ncon > 0
            last_x, last_y, last_yaw = x, y, yaw
            x, y, yaw = now.qpos.tolist()
            driven += arc(math.hypot(x - last_x, y - last_y), yaw - last_yaw)
        self._read()
        return driven, touched

    def substep(self, *command: float) -> tuple[str, ...]:
        """Advance by one physics step towards target velocities; return the names of what the robot touches."""
        x, y, _ = self._now.qpos.tolist()
        now = self._within_reach(x, y, named=True)
        now.ctrl[:] = command
        mujoco.mj_step(now.model, now.data)
        self._read()
        return touched_names(now.model, now.data.contact.geom.ravel()) if now.data.ncon else ()

    def _within_reach(self, x: float, y: float, named: bool = False) -> RobotData:
        """Return the data to step from a position, which have all that is within reach; `named`, with its names."""
        dx, dy, _ = self._now.qvel.tolist()
        if dx * dx + dy * dy >= FASTEST * FASTEST:
            self._step_in(self._whole())
        elif self._out_of_reach.at(x, y):
            self._step_in(self._alone)
        elif named or not self._has_surroundings(x, y):
            self._step_in(self._whole())
        else:
            self._step_in(self._surroundings())
        return self._now

    def _has_surroundings(self, x: float, y: float) -> bool:
        solids = self._out_of_reach.solids
        return solids is not None and self._surroundings().hold(solids, x, y)

    def _surroundings(self) -> NearbyBoxes:
        if self._around is None:
            self._around = self._spares[1].take()
        return self._around

    def _whole(self) -> RobotData:
        """Return the data of the scene; they are made when they are first used."""
        if self._scene is None:
            model = self.model
            joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, PREFIX + "x")
            first, last = (
                mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, PREFIX + name) for name in ("forward", "turn")
            )
            # The joints x, y and yaw and the servos forward, grip and turn were added in these orders.
            joints = int(model.jnt_qposadr[joint]), int(model.jnt_dofadr[joint])
            self._scene = RobotData(model, joints, slice(first, last + 1, last - first))
        return self._scene

    def _step_in(self, data: RobotData) -> None:
        """Hand the state of the robot over to other data."""
        if data is not self._now:
            data.go_on_from(self._now)
            self._now = data

    def _read(self) -> None:
        self._move(*self._now.qpos.tolist(), *self._now.qvel.tolist())


def _resumed(
    model: mujoco.MjModel, out_of_reach: OutOfReach, robot: RobotSpec, state: NDArray[np.float64]
) -> StaticSimulation:
    """Return a simulation in the state of another one."""
    simulation = StaticSimulation(model, out_of_reach, robot)
    now = simulation._now
    now.qpos[:], now.qvel[:], now.warmstart[:], now.data.time = state[:3], state[3:6], state[6:9], state[9]
    simulation._read()
    return simulation
