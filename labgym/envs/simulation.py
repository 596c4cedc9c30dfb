"""Physics of one robot in a static scene, advanced by control steps."""

from __future__ import annotations

import math

import mujoco

from labgym.envs.robot import PREFIX, ROBOT, RobotSpec
from labgym.geometry import wrap_angle

Pose = tuple[float, float, float]

CHECK_STEPS = 5
"""Physics steps between two checks for contacts (25 ms): shorter contacts may go unnoticed."""


class Simulation:
    """One robot in a compiled scene; nothing else moves.

    Attributes:
        model, data: the MuJoCo model and data; every contact in them involves the robot.
        pose: (x, y, yaw) in the room frame; yaw in (-pi, pi].
        velocity: forward velocity, m/s, and turn rate, rad/s.
    """

    def __init__(self, model: mujoco.MjModel, robot: RobotSpec = ROBOT) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        # The joints x, y and yaw were added in this order, so their coordinates are consecutive.
        self._at = slice(model.joint(PREFIX + "x").qposadr[0], model.joint(PREFIX + "yaw").qposadr[0] + 1)
        self._rate = slice(model.joint(PREFIX + "x").dofadr[0], model.joint(PREFIX + "yaw").dofadr[0] + 1)
        self._forward, self._turn = (model.actuator(PREFIX + name).id for name in ("forward", "turn"))
        self._checks = robot.substeps // CHECK_STEPS
        self.place((0.0, 0.0, 0.0))

    def place(self, pose: Pose) -> None:
        """Put the robot at rest at (x, y, yaw) and set the clock to 0."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self._at] = pose
        mujoco.mj_forward(self.model, self.data)
        self._read()

    def drive(self, v: float, w: float) -> tuple[float, bool]:
        """Apply a target twist in m/s and rad/s for one control step.

        Returns:
            the length driven in meters, as the sum of arcs between contact checks, and whether the robot touched
            anything.
        """
        data, at = self.data, self._at
        data.ctrl[self._forward], data.ctrl[self._turn] = v, w
        driven, touched = 0.0, False
        x, y, yaw = data.qpos[at].tolist()
        for _ in range(self._checks):
            mujoco.mj_step(self.model, data, CHECK_STEPS)
            touched = touched or data.ncon > 0
            last, (x, y, yaw) = (x, y, yaw), data.qpos[at].tolist()
            driven += _arc(math.hypot(x - last[0], y - last[1]), yaw - last[2])
        self._read()
        return driven, touched

    def _read(self) -> None:
        x, y, yaw = self.data.qpos[self._at].tolist()
        dx, dy, turn = self.data.qvel[self._rate].tolist()
        self.pose: Pose = (x, y, wrap_angle(yaw))
        self.velocity: tuple[float, float] = (math.cos(yaw) * dx + math.sin(yaw) * dy, turn)


def _arc(chord: float, turned: float) -> float:
    """Return the length of the circular arc over a chord along which the heading turned by `turned` radians."""
    half = turned / 2.0
    return chord if abs(half) < 1e-6 else chord * half / math.sin(half)
