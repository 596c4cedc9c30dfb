"""Robots whose base moves in the plane on joints."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields, replace
from typing import Any

import mujoco

from labgym.counts import is_finite
from labgym.envs.checks import positive, record_of
from labgym.envs.parts.protocols import Command, Robot
from labgym.envs.parts.registry import registered
from labgym.envs.robot import BOTTOM, ROBOT, RobotSpec, robot_spec
from labgym.envs.simulation import CHECK_INTERVAL
from labgym.envs.wheels import CASTER_MASS, Wheels, wheeled_spec
from labgym.errors import OptionError, check_name
from labgym.navigation import OBSTACLE_HEIGHT, PLANNING_RADIUS

HOLONOMIC = replace(ROBOT, v_side=0.5)
"""Dimensions and limits of the holonomic robot."""


@registered("robot", "differential")
class DifferentialDrive(Robot):
    """A base that drives forward and turns, with grip sideways; by default the differential robot of `LabPointNav-v0`.

    Attributes:
        size: dimensions and limits, as `RobotSpec` or a mapping of those that differ from the default.
    """

    size: RobotSpec = ROBOT

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", size_of(self.size))
        if self.size.v_side:
            raise OptionError(
                "DifferentialDrive: v_side is not 0: pass robot='holonomic' for a base that moves sideways"
            )

    @property
    def axes(self) -> tuple[str, ...]:
        """Forward velocity, m/s, and turn rate, rad/s."""
        return ("forward", "turn")

    def command(self, action: Iterable[float]) -> Command:
        """Return the target velocities of an action in [-1, 1] per axis; values outside are clipped."""
        return self.size.twist(*action)

    def spec(self) -> mujoco.MjSpec:
        """Return the robot without a scene, as `robot_spec`."""
        return robot_spec(self.size)


@registered("robot", "holonomic")
class HolonomicDrive(Robot):
    """A base that drives forward and sideways and turns, as one on mecanum wheels.

    Attributes:
        size: dimensions and limits, as `RobotSpec` or a mapping of those that differ from the default, which moves
            sideways at up to 0.5 m/s.
    """

    size: RobotSpec = HOLONOMIC

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", size_of(self.size, HOLONOMIC))
        if not self.size.v_side:
            raise OptionError("HolonomicDrive: v_side is 0 m/s, expected a velocity above 0")

    @property
    def axes(self) -> tuple[str, ...]:
        """Velocities forward and to the left, m/s, and turn rate, rad/s."""
        return ("forward", "sideways", "turn")

    def command(self, action: Iterable[float]) -> Command:
        """Return the target velocities of an action in [-1, 1] per axis; values outside are clipped."""
        return velocities(self.size, action)

    def spec(self) -> mujoco.MjSpec:
        """Return the robot without a scene, as `robot_spec`."""
        return robot_spec(self.size)


def velocities(size: RobotSpec, action: Iterable[float]) -> Command:
    """Return the target velocities (forward, sideways, turn) of an action in [-1, 1] per axis, m/s and rad/s."""
    forward, sideways, turn = action
    v, w = size.twist(forward, turn)
    return v, min(max(sideways, -1.0), 1.0) * size.v_side, w


def size_of(value: Any, default: RobotSpec = ROBOT) -> RobotSpec:
    """Return dimensions and limits passed as an object or as a mapping of those that differ from the default.

    Raises:
        UnknownNameError: no dimension has that name.
        OptionError: neither, or a value is out of range.
    """
    size = record_of(value, default, "size of the robot", "dimension of the robot")
    check_size(size)
    return size


def check_size(size: RobotSpec) -> None:
    """Check dimensions and limits.

    Raises:
        OptionError: a value is not a number, or is out of range.
    """
    for each in fields(size):
        value = getattr(size, each.name)
        if not is_finite(value):
            raise OptionError(f"robot: {each.name} is {str(value)[:40]!r}, expected a finite number")
    ranges = {
        "v_min": (-5.0, 0.0),
        "v_max": (0.01, 5.0),
        "v_side": (0.0, 5.0),
        "chassis_radius": (0.05, PLANNING_RADIUS),
        "planning_radius": (PLANNING_RADIUS, PLANNING_RADIUS),
        "height": (BOTTOM + 0.03, OBSTACLE_HEIGHT),
        "camera_forward": (-PLANNING_RADIUS, PLANNING_RADIUS),
        "camera_hfov": (0.01, 3.0),
    }
    for name, (low, high) in ranges.items():
        if not low <= getattr(size, name) <= high:
            raise OptionError(
                f"robot: {name} is {getattr(size, name)}, expected {low} to {high}{_REASONS.get(name, '')}"
            )
    for name in ("mass", "yaw_inertia", "w_max", "acceleration", "turn_acceleration", "grip", "lag", "lidar_height"):
        if getattr(size, name) <= 0.0:
            raise OptionError(f"robot: {name} is {getattr(size, name)}, expected a number above 0")
    steps = CHECK_INTERVAL / size.timestep if size.timestep > 0.0 else 0.0
    if not (2 <= round(steps) <= 100 and abs(steps - round(steps)) < 1e-6):
        raise OptionError(
            f"robot: timestep is {size.timestep} s, expected 0.025 s divided by a whole number from 2 to 100"
        )


_REASONS = {
    "chassis_radius": " m: goals and shortest paths are those of a disc of this radius",
    "planning_radius": " m: goals and shortest paths are those of a disc of this radius",
    "height": " m: shortest paths pass under what is higher",
}


WHEELED = replace(ROBOT, timestep=0.0025)
"""Dimensions and limits of the robot on wheels; with larger physics steps its speed oscillates by 4%."""
WHEELS = Wheels()
"""Wheels and casters of that robot."""


@registered("robot", "wheels")
class WheeledDrive(Robot):
    """A differential drive on two driven wheels and two sprung casters, with friction on the floor.

    The base is a free body. The wheels may slip, and braking pitches the base. `wheels.friction` takes the place of
    `size.grip`. Resistance of the casters and inertia of the wheels take 8% of the acceleration.

    Attributes:
        size: dimensions and limits, as `RobotSpec` or a mapping of those that differ from the default.
        wheels: wheels and casters, as `Wheels` or a mapping of what differs from the default.
    """

    size: RobotSpec = WHEELED
    wheels: Wheels = WHEELS

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", size_of(self.size, WHEELED))
        object.__setattr__(self, "wheels", wheels_of(self.wheels))
        size, wheels = self.size, self.wheels
        if size.v_side:
            raise OptionError("WheeledDrive: v_side is not 0: its wheels do not roll sideways")
        reach = max(wheels.track / 2.0 + wheels.width / 2.0, wheels.caster_reach + wheels.caster_radius)
        if reach > size.chassis_radius:
            raise OptionError(
                f"WheeledDrive: wheels reach {reach:.3f} m from the axis, expected at most chassis_radius, "
                f"{size.chassis_radius} m"
            )
        if size.mass <= 4.0 * (wheels.mass + CASTER_MASS) or size.yaw_inertia <= wheels.mass * wheels.track**2:
            raise OptionError("WheeledDrive: the wheels are too heavy for mass and yaw_inertia of the robot")

    @property
    def axes(self) -> tuple[str, ...]:
        """Forward velocity, m/s, and turn rate, rad/s."""
        return ("forward", "turn")

    def command(self, action: Iterable[float]) -> Command:
        """Return the target velocities of an action in [-1, 1] per axis; values outside are clipped."""
        return self.size.twist(*action)

    def spec(self) -> mujoco.MjSpec:
        """Return the robot without a scene, as `wheeled_spec`."""
        return wheeled_spec(self.size, self.wheels)


def wheels_of(value: Any) -> Wheels:
    """Return wheels passed as an object or as a mapping.

    Raises:
        UnknownNameError: wheels have no such dimension.
        OptionError: neither, or a value is out of range.
    """
    if isinstance(value, Mapping):
        names = [each.name for each in fields(Wheels)]
        for name in value:
            check_name("dimension of the wheels", name, names)
        value = Wheels(**value)
    if not isinstance(value, Wheels):
        raise OptionError(f"wheels of the robot are a {type(value).__name__}, expected Wheels or a mapping")
    positive(value, *(each.name for each in fields(Wheels)))
    if value.caster_load >= 0.5:
        raise OptionError(f"Wheels: caster_load is {value.caster_load}, expected a share of the weight below 0.5")
    return value
