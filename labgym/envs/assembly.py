"""The compiled scene of a robot in a layout, for the robot of version 0 or any other, with or without moving parts."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

import mujoco

from labgym.envs.mount import Mount, attach
from labgym.envs.parts.protocols import Robot
from labgym.envs.parts.robots import DifferentialDrive
from labgym.envs.reach import OutOfReach, robot_alone
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.world import World
from labgym.layouts import Layout
from labgym.scenes import to_mjcf


@dataclass(frozen=True)
class Moving:
    """Kinds of things that move in a scene besides the robot.

    Attributes:
        interactive: whether drawers, doors, sashes, stools, trolleys and boxes move. loose: objects on surfaces too.
        visible: whether the model has the visual shapes, which cameras see.
    """

    interactive: bool = False
    loose: bool = False
    visible: bool = False


UNSEEN = 5
"""Geom group of the robot in an interactive scene, whose sensors do not see it."""
STATIC = Moving()
"""Nothing but the robot moves."""


@dataclass(frozen=True, eq=False)
class Assembly:
    """A robot in a layout, compiled.

    Attributes:
        model: the scene with the robot.
        alone: the robot without the scene, with the same motion to the bit where it can touch nothing; None if the
            robot is always stepped in the scene.
        out_of_reach: where it can touch nothing; None likewise.
    """

    model: mujoco.MjModel
    alone: mujoco.MjModel | None = None
    out_of_reach: OutOfReach | None = None


def assembly_of(world: World, robot: Robot, moving: Moving = STATIC) -> Assembly:
    """Return a robot in the layout of a world. Environments of a process share it if the robot has a hash."""
    if moving == STATIC and is_standard(robot):
        return Assembly(world.model, robot_alone(), world.out_of_reach)

    def build(layout: Layout) -> Assembly:
        return _built(layout, robot, moving)

    key = _key(robot, moving)
    return build(world.layout) if key is None else world.derived(key, build)


def is_standard(robot: Robot) -> bool:
    """Whether the physics of a robot are those of the robot of version 0."""
    return type(robot) is DifferentialDrive and _physical(robot.size) == ROBOT


def _physical(size: RobotSpec) -> RobotSpec:
    """Return dimensions in which all that does not change the physics has its default."""
    return replace(
        size,
        control_dt=ROBOT.control_dt,
        lidar_height=ROBOT.lidar_height,
        camera_height=ROBOT.camera_height,
        camera_forward=ROBOT.camera_forward,
        camera_hfov=ROBOT.camera_hfov,
    )


def _key(robot: Robot, moving: Moving) -> Hashable | None:
    key = ("assembly", robot, moving)
    try:
        hash(key)
    except TypeError:
        return None
    return key


def _built(layout: Layout, robot: Robot, moving: Moving) -> Assembly:
    scene = to_mjcf(layout, visible=moving.visible, interactive=moving.interactive, loose=moving.loose)
    attach(scene, robot)
    scene.compiler.discardvisual = not moving.visible
    scene.compiler.fusestatic = not moving.interactive
    model = scene.compile()
    mount = Mount.of(model)
    if moving.interactive:
        model.geom_group[mount.geoms] = UNSEEN
    if not mount.alone:
        return Assembly(model)
    single = mujoco.MjSpec()
    attach(single, robot)
    single.compiler.discardvisual = True
    alone = single.compile()
    return Assembly(model, alone, OutOfReach(model, robot.size))
