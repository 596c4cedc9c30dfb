"""The end of a drive: braking at STOP, the evaluator's parking for policies that cannot stop, and how it failed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from labgym.envs.robot import ROBOT
from labgym.errors import check_name
from labgym.eval.driving.episode_row import Ending

WAITED = 30.0
"""Seconds at rest near people from which a drive without end counts as frozen."""


def delay_of(latency: float, control_dt: float = ROBOT.control_dt) -> int:
    """Return the number of control steps by which actions of a declared latency, seconds, come late."""
    return math.ceil(latency / control_dt - 1e-9)


def is_slow(seconds: float, latency: float, control_dt: float = ROBOT.control_dt) -> bool:
    """Whether a measured time per action exceeds the declared latency, and the control step that every policy has."""
    return seconds > max(latency, control_dt)


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
