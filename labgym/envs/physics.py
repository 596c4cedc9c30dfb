"""The physics of an episode, by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from labgym.envs.parts.protocols import Robot
from labgym.envs.simulation import Simulation
from labgym.envs.state import Pose
from labgym.envs.world import World
from labgym.errors import UnknownNameError

PHYSICS = ("mujoco",)
"""Names of the engines: "mujoco" is the reference."""


class Physics(Protocol):
    """One robot in a scene, advanced by control steps.

    Attributes:
        pose: (x, y, yaw) in the room frame; yaw in (-pi, pi].
        velocity: forward velocity, m/s, and turn rate, rad/s.
    """

    pose: Pose
    velocity: tuple[float, float]

    def place(self, pose: Pose) -> None:
        """Put the robot at rest at a pose and set the clock to 0."""
        ...

    def drive(self, v: float, w: float, /) -> tuple[float, bool]:
        """Apply target velocities for one control step.

        Returns:
            the length driven in meters, and whether the robot touched anything.
        """
        ...


def make_physics(name: str, world: World, robot: Robot, control_dt: float) -> Physics:
    """Return the physics of a robot in a world.

    Args:
        name: one of `PHYSICS`.
        control_dt: duration of a control step, seconds.

    Raises:
        UnknownNameError: no physics has that name.
    """
    size = robot.size if robot.size.control_dt == control_dt else replace(robot.size, control_dt=control_dt)
    if name == "mujoco":
        return Simulation(world.model, size, world.out_of_reach)
    raise UnknownNameError("physics", name, PHYSICS)
