"""The end of a drive: braking at STOP, the evaluator's parking for policies that cannot stop, and how it failed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.envs.labnav.task import LabNavTask
from labgym.envs.robot import ROBOT
from labgym.envs.state import Pose
from labgym.errors import check_name
from labgym.eval.driving.episode_row import Ending
from labgym.geometry import wrap_angle
from labgym.policies.tracking import turn_towards

SHARE = 0.7
"""Share of the success radius within which the evaluator brakes a policy that cannot stop."""
DOCK_RADIUS = 0.05
"""Distance from a docking pose within which it does so, meters."""
REST = (0.01, 0.02)
"""Forward velocity, m/s, and turn rate, rad/s, below which the robot is at rest."""
HEADING = 0.005
"""Deviation from the goal's heading at which the evaluator ends its turn, radians."""
TURNING = 80
"""Greatest number of control steps of that turn."""
STAY = 10
"""Control steps that the robot must rest at a docking pose: 1 s."""
WAITED = 30.0
"""Seconds at rest near people from which a drive without end counts as frozen."""


def delay_of(latency: float, control_dt: float = ROBOT.control_dt) -> int:
    """Return the number of control steps by which actions of a declared latency, seconds, come late."""
    return math.ceil(latency / control_dt - 1e-9)


def is_slow(seconds: float, latency: float, control_dt: float = ROBOT.control_dt) -> bool:
    """Whether a measured time per action exceeds the declared latency, and the control step that every policy has."""
    return seconds > max(latency, control_dt)


def braking_distance(task: LabNavTask) -> float:
    """Return the distance from the goal by odometry at which the evaluator brakes, meters."""
    return DOCK_RADIUS if task.docks else SHARE * task.radius


def stay_of(task: LabNavTask, delay: int) -> int:
    """Return the number of control steps that a robot must rest at its goal.

    In a chain of goals no action that comes late, by `delay` control steps, may reach the next drive.
    """
    if task.chain:
        return delay
    return STAY if task.docks else 0


class Parking:
    """Brings the robot to rest: after a policy's STOP, or in its place.

    Args:
        heading: to which the robot turns once it rests, radians in the start frame; None to leave it.
        stay: control steps that it must rest at the end.
    """

    def __init__(self, heading: float | None = None, stay: int = 0) -> None:
        self._heading, self._left, self._turning = heading, stay, TURNING

    def action(self, pose: Pose, velocity: tuple[float, float]) -> NDArray[np.floating] | None:
        """Return the next action, (2,), or None when the robot has been parked.

        Args:
            pose: by odometry, in the start frame.
            velocity: forward, m/s, and turn rate, rad/s.
        """
        resting = abs(velocity[0]) <= REST[0] and abs(velocity[1]) <= REST[1]
        off = 0.0 if self._heading is None else wrap_angle(self._heading - pose[2])
        if self._turning and abs(off) > HEADING and abs(velocity[0]) <= REST[0]:
            self._turning -= 1
            return turn_towards(off)
        if not resting:
            return np.zeros(2)
        if self._left <= 0:
            return None
        self._left -= 1
        return np.zeros(2)


@dataclass(frozen=True)
class Finish:
    """The facts about a drive that is over.

    Attributes:
        rule: name of the ending that ended it, "" if the robot was parked or the time was over.
        parked: whether the robot came to rest after STOP, or by the evaluator.
        inside: whether it is in the success disc. believed: whether it is there by its odometry.
        docked: whether it is within the errors of docking; True in tasks without.
        spilt: whether it spilt liquid.
        waited: seconds at rest near people.
        error: of the policy.
    """

    rule: str
    parked: bool
    inside: bool
    believed: bool
    docked: bool = True
    spilt: bool = False
    waited: float = 0.0
    error: str | None = None


RULES = ("", "contact", "stuck", "spill", "stop", "time")
"""Names of the endings that may end a drive; "" if the robot was parked or the time was over."""


def ending_of(finish: Finish) -> Ending:
    """Return how an episode ended: "success", or why it failed.

    Raises:
        UnknownNameError: no ending has the name of the rule.
    """
    check_name("ending of a drive", finish.rule, RULES)
    if finish.error is not None:
        return "error"
    if finish.rule == "contact":
        return "contact"
    if finish.rule == "stuck":
        return "stuck"
    if finish.rule == "spill":
        return "spilt"
    if not finish.parked:
        return "frozen" if finish.waited >= WAITED else "time"
    if not finish.inside:
        return "lost" if finish.believed else "wrong place"
    if not finish.docked:
        return "undocked"
    return "spilt" if finish.spilt else "success"
