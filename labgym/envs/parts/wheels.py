"""A robot that drives on real wheels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

import mujoco

from labgym.envs.checks import positive
from labgym.envs.parts.protocols import Command, Robot
from labgym.envs.parts.registry import registered
from labgym.envs.parts.robots import size_of
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.envs.wheels import CASTER_MASS, Wheels, wheeled_spec
from labgym.errors import OptionError, UnknownNameError

WHEELED = replace(ROBOT, timestep=0.0025)
"""Dimensions and limits of the robot on wheels; with larger physics steps its speed oscillates by 4%."""
WHEELS = Wheels()
"""Wheels and casters of that robot."""


@registered("robot")
@dataclass(frozen=True)
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
    kind: str = field(default="wheels", init=False)

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
            if name not in names:
                raise UnknownNameError("dimension of the wheels", name, names)
        value = Wheels(**value)
    if not isinstance(value, Wheels):
        raise OptionError(f"wheels of the robot are a {type(value).__name__}, expected Wheels or a mapping")
    positive(value, *(each.name for each in fields(Wheels)))
    if value.caster_load >= 0.5:
        raise OptionError(f"Wheels: caster_load is {value.caster_load}, expected a share of the weight below 0.5")
    return value
