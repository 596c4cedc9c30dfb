"""The compiled scene of a robot in a layout, for the differential robot or any other, with or without moving parts."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, replace

import mujoco
import numpy as np

from labgym.assets.articulation import FOOTINGS, footing
from labgym.envs.mount import Mount, attach
from labgym.envs.parts.protocols import Robot
from labgym.envs.parts.robots import DifferentialDrive
from labgym.envs.pushing import Thing
from labgym.envs.reach import OutOfReach, robot_alone
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.world import World, world_of
from labgym.errors import OptionError
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.scenes import to_mjcf
from labgym.scenes.castors import add_castored


@dataclass(frozen=True)
class Moving:
    """Kinds of things that move in a scene besides the robot.

    Attributes:
        interactive: whether drawers, doors, sashes, stools, trolleys and boxes move. loose: objects on surfaces too.
        visible: whether the model has the visual shapes, which cameras see.
        pushable: ids of the placements that the robot can push in a scene that is not interactive, with masses in kg.
    """

    interactive: bool = False
    loose: bool = False
    visible: bool = False
    pushable: tuple[tuple[str, float], ...] = ()


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
        out_of_reach: where it can touch nothing but `things`; None likewise.
        things: what the robot can push. quiet: the scene without them; None without things.
    """

    model: mujoco.MjModel
    alone: mujoco.MjModel | None = None
    out_of_reach: OutOfReach | None = None
    things: tuple[Thing, ...] = ()
    quiet: mujoco.MjModel | None = None


def assembly_of(world: World, robot: Robot, moving: Moving = STATIC) -> Assembly:
    """Return a robot in the layout of a world. Environments of a process share it if the robot has a hash.

    Raises:
        OptionError: the robot cannot push the things that `moving` names.
    """
    if moving == STATIC and is_standard(robot):
        return Assembly(world.model, robot_alone(), world.out_of_reach)

    def build(layout: Layout) -> Assembly:
        return _built(layout, robot, moving)

    key = _key(robot, moving)
    return build(world.layout) if key is None else world.derived(key, build)


def is_standard(robot: Robot) -> bool:
    """Whether the physics of a robot are those of the differential robot."""
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
    masses = dict(moving.pushable)
    things = tuple(_thing(layout, name, mass) for name, mass in moving.pushable)
    static = layout.without(masses)
    scene = to_mjcf(static, visible=moving.visible, interactive=moving.interactive, loose=moving.loose)
    attach(scene, robot)
    for thing in things:
        asset = layout.asset(thing.name)
        add_castored(scene, thing.name, asset, thing.pose, thing.mass, thing.friction)
    scene.compiler.discardvisual = not moving.visible
    scene.compiler.fusestatic = not moving.interactive
    model = scene.compile()
    mount = Mount.of(model)
    if moving.interactive:
        model.geom_group[mount.geoms] = UNSEEN
    quiet = None
    if things:
        _check_pushing(mount, robot, moving)
        quiet = assembly_of(world_of(static), robot, replace(moving, pushable=())).model
    elif not mount.alone:
        return Assembly(model)
    single = mujoco.MjSpec()
    attach(single, robot)
    single.compiler.discardvisual = True
    alone = single.compile()
    return Assembly(model, alone, OutOfReach(model, robot.size), things, quiet)


def _thing(layout: Layout, name: str, mass: float) -> Thing:
    """Return a placement as a thing that the robot can push.

    Raises:
        UnknownNameError: no placement has that id.
        OptionError: it does not stand on castors or feet that slide, or it carries something.
    """
    placement, asset = layout.placement(name), layout.asset(name)
    foot = footing(asset)
    if foot is None or placement.support != FLOOR:
        raise OptionError(
            f"placement {name!r} ({asset.name}) cannot be pushed: choose one that stands on the floor, of the shapes "
            f"{', '.join(sorted(FOOTINGS))}"
        )
    if layout.children(name):
        raise OptionError(
            f"placement {name!r} carries {layout.children(name)[0].id!r}: only empty things can be pushed"
        )
    corners = np.concatenate([box.corners() for box in asset.solids()])
    radius = float(np.hypot(*corners.T).max())
    return Thing(name, mass, foot.friction, (*placement.position[:2], placement.yaw), radius)


def _check_pushing(mount: Mount, robot: Robot, moving: Moving) -> None:
    if moving.interactive:
        raise OptionError("things that the robot can push are part of an interactive scene: pass interactive=False")
    if not mount.planar or mount.rates.stop - mount.rates.start != 3:
        raise OptionError(
            f"robot {type(robot).__name__} cannot push things: pass robot='differential' or robot='holonomic'"
        )
