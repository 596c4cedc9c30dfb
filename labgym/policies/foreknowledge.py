"""The world as it is and will be: the knowledge of a policy in the privileged track of LabNav."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from labgym.layouts import Layout
    from labgym.navigation import Pose

RobotPath = Callable[[float], tuple[float, float, float, float, float]]
"""Returns x, y, vx, vy (room frame, m and m/s) and the turn rate (rad/s) of the robot at a time of the episode."""


class Forecast(Protocol):
    """People in the future, in steps of 0.1 s."""

    places: NDArray[np.float64]
    """Their centers, (n, 2) meters in the room frame."""
    following: NDArray[np.float64]
    """The same 0.1 s later: certain, whatever the robot does."""

    def step(self, x: float, y: float, vx: float, vy: float, turn: float) -> None:
        """Advance by 0.1 s.

        Args:
            x, y, vx, vy: of the robot after that time, in the room frame, m and m/s. turn: its turn rate, rad/s.
        """
        ...


class Foreknowledge(Protocol):
    """The world of an episode in progress. Poses are in the room frame, meters and radians; times in seconds.

    It can be asked at any time of the episode and answers for the present drive: in a chain of goals, for the present
    leg.
    """

    @property
    def time(self) -> float:
        """Time of the episode."""
        ...

    @property
    def pose(self) -> Pose:
        """The true pose of the robot (x, y, yaw)."""
        ...

    @property
    def velocity(self) -> tuple[float, float]:
        """The true forward velocity, m/s, and turn rate, rad/s."""
        ...

    @property
    def goal(self) -> Pose:
        """The true goal pose: at a station that moved, the docking pose of its true place."""
        ...

    @property
    def radius(self) -> float:
        """Radius of the disc around the goal in which the robot has to rest, meters."""
        ...

    @property
    def wheels(self) -> tuple[float, float, float]:
        """The errors of the wheels: factors on forward velocity and turn rate, and the veer, radians per meter."""
        ...

    def solids(self) -> Layout:
        """Return the true floor: with all that has been moved, with panes, and with things that have yet to come."""
        ...

    @property
    def yields(self) -> NDArray[np.bool_]:
        """Which of the people avoid the robot while it moves, (n,); the others do not see it until it rests."""
        ...

    def forecast(self) -> Forecast | None:
        """Return the people from now on, to be advanced with any motion of the robot; None without people."""
        ...

    def people(self, times: Sequence[float], path: RobotPath | None = None) -> NDArray[np.float64]:
        """Return where the centers of people will be, (t, n, 2) meters: exact if the robot moves as assumed.

        Args:
            times: of the episode, ascending, not before now.
            path: the motion of the robot; None for one that stands where it is from now on.
        """
        ...
