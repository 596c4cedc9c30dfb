"""Robots."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from labgym.envs.parts.protocols import Command, Robot
from labgym.envs.robot import ROBOT, RobotSpec
from labgym.errors import OptionError, UnknownNameError


@dataclass(frozen=True)
class DifferentialDrive(Robot):
    """The robot of version 0: a base that drives forward and turns; see `RobotSpec` for its dimensions.

    Attributes:
        size: dimensions and limits.
    """

    size: RobotSpec = ROBOT
    kind: str = field(default="differential", init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", size_of(self.size))

    @property
    def axes(self) -> tuple[str, ...]:
        """Forward velocity, m/s, and turn rate, rad/s."""
        return ("forward", "turn")

    def command(self, action: Iterable[float]) -> Command:
        """Return the target velocities of an action in [-1, 1] per axis; values outside are clipped."""
        return self.size.twist(*action)


def size_of(value: Any) -> RobotSpec:
    """Return dimensions and limits passed as an object or as a mapping.

    Raises:
        UnknownNameError: no dimension has that name.
        OptionError: neither.
    """
    if isinstance(value, RobotSpec):
        return value
    if not isinstance(value, Mapping):
        raise OptionError(f"size of the robot is a {type(value).__name__}, expected RobotSpec or a mapping")
    names = [each.name for each in fields(RobotSpec)]
    for name in value:
        if name not in names:
            raise UnknownNameError("dimension of the robot", name, names)
    return RobotSpec(**value)


def check_simulated(robot: Robot) -> None:
    """Check that the physics can simulate a robot.

    Raises:
        OptionError: its dimensions are not those of the robot of version 0, or it has other axes.
    """
    if robot.axes != ("forward", "turn") or replace(robot.size, control_dt=ROBOT.control_dt) != ROBOT:
        raise OptionError(
            "robot has other axes or dimensions than 'differential': the physics cannot simulate it yet; "
            "pass robot='differential'"
        )
