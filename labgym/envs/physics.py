"""The physics of an episode, by name."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

from labgym.envs.assembly import Assembly, assembly_of, is_standard
from labgym.envs.parts.protocols import Robot
from labgym.envs.pushing import PushingSimulation
from labgym.envs.reach import robot_alone
from labgym.envs.scene_simulation import SceneSimulation
from labgym.envs.simulation import Simulation
from labgym.envs.state import Pose
from labgym.envs.static_simulation import StaticSimulation
from labgym.envs.world import World
from labgym.errors import OptionError, UnknownNameError, check_name

PHYSICS = ("mujoco", "planar")
"""Names of the engines: "mujoco" is the reference, "planar" the compiled kernel (`labgym.envs.planar`)."""


class Physics(Protocol):
    """One robot in a scene, advanced by control steps.

    Attributes:
        pose: (x, y, yaw) in the room frame; yaw in (-pi, pi].
        velocity: forward velocity, m/s, and turn rate, rad/s. sideways: velocity to the left, m/s.
    """

    pose: Pose
    velocity: tuple[float, float]
    sideways: float

    def place(self, pose: Pose) -> None:
        """Put the robot at rest at a pose and set the clock to 0."""
        ...

    def drive(self, *command: float) -> tuple[float, bool]:
        """Apply target velocities, in the order of the robot's axes, for one control step.

        Returns:
            the length driven in meters, and whether the robot touched anything.
        """
        ...

    @property
    def timestep(self) -> float:
        """Duration of a physics step, seconds."""
        ...

    def substep(self, *command: float) -> tuple[str, ...]:
        """Advance by one physics step towards target velocities, with the motion of `drive` to the bit.

        Returns:
            the names of the placements, walls or bodies that the robot touches, without repetition.
        """
        ...


def check_physics(name: str) -> None:
    """Check that a physics exists and can run here.

    Raises:
        UnknownNameError: no physics has that name.
        MissingDependencyError: the planar kernel needs numba (extra `fast`).
    """
    check_name("physics", name, PHYSICS)
    if name == "planar":
        import labgym.envs.planar.compiled  # noqa: F401


def make_physics(name: str, world: World, robot: Robot, control_dt: float, assembly: Assembly | None = None) -> Physics:
    """Return the physics of a robot in a world.

    Args:
        name: one of `PHYSICS`.
        control_dt: duration of a control step, seconds.
        assembly: the robot in the layout, compiled; None for one in which nothing else moves.

    Raises:
        UnknownNameError: no physics has that name.
        OptionError: the planar kernel does not have this robot, or solids of this world.
        MissingDependencyError: the planar kernel needs numba (extra `fast`).
    """
    if name == "planar":
        from labgym.envs.planar.scene import scene_of
        from labgym.envs.planar.simulation import PlanarSimulation

        if not is_standard(robot):
            raise OptionError(
                f"the planar kernel has no {type(robot).__name__} of these dimensions: pass physics='mujoco'"
            )
        scene = scene_of(world)
        return PlanarSimulation(scene.plan, scene.body, control_dt)
    if name != "mujoco":
        raise UnknownNameError("physics", name, PHYSICS)
    assembly = assembly_of(world, robot) if assembly is None else assembly
    if assembly.out_of_reach is None:
        return SceneSimulation(assembly.model, robot, control_dt)
    size = robot.size if robot.size.control_dt == control_dt else replace(robot.size, control_dt=control_dt)
    if assembly.quiet is not None:
        models = assembly.model, size, assembly.out_of_reach, assembly.alone, assembly.quiet
        return PushingSimulation(*models, assembly.things)
    if assembly.alone is robot_alone():
        return StaticSimulation(assembly.model, assembly.out_of_reach, size)
    return Simulation(assembly.model, size, assembly.out_of_reach, assembly.alone)
