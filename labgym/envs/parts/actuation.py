"""Published models of how far a robot misses the amount of a discrete action."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from labgym.envs.checks import positive
from labgym.envs.parts.registry import registered
from labgym.errors import check_name


@dataclass(frozen=True)
class ActuatorTable:
    """Mean and variance of the errors of one controller, for a step forward and for a turn.

    Attributes:
        ahead: mean, m, and variance, m², along the heading, of a step; turned: of the yaw, rad and rad², of a step.
        ahead_turning, turned_turning: the same of a turn.
    """

    ahead: tuple[float, float]
    turned: tuple[float, float]
    ahead_turning: tuple[float, float]
    turned_turning: tuple[float, float]


LOCOBOT = {
    "ilqr": ActuatorTable((0.014, 0.006), (0.008, 0.004), (0.003, 0.002), (0.023, 0.012)),
    "proportional": ActuatorTable((0.017, 0.007), (0.031, 0.026), (0.001, 0.001), (0.043, 0.017)),
    "movebase": ActuatorTable((0.074, 0.019), (0.189, 0.038), (0.002, 0.0), (0.219, 0.019)),
}
"""LoCoBot's controllers, as in `pyrobot_noise_models` of habitat-sim (agent/controls/pyrobot_noisy_controls.py), whose
second numbers are used there as variances."""


@registered("actuation noise", "locobot")
class LoCoBotActuation:
    """Errors measured on a LoCoBot (Murali et al. 2019, PyRobot), as habitat-sim draws them.

    An error is normal, truncated at three standard deviations and where it would undo 95% of the action, has the sign
    of the action, and is multiplied by `multiplier`. The published model also moves the robot sideways (by 42 mm a step
    on average with the controller "proportional"), which a differential drive whose motion is simulated cannot do; this
    part is left out.

    Attributes:
        controller: "ilqr", "proportional" or "movebase"; the Habitat challenges of 2020 and 2021 use "proportional".
        multiplier: factor on the errors; 0.5 in these challenges.
    """

    controller: str = "proportional"
    multiplier: float = 0.5

    def __post_init__(self) -> None:
        check_name("controller", self.controller, LOCOBOT)
        positive(self, "multiplier", zero=True)

    def errors(self, ahead: float, turn: float, rng: np.random.Generator) -> tuple[float, float]:
        """Return the errors of an action."""
        table = LOCOBOT[self.controller]
        along, around = (table.ahead_turning, table.turned_turning) if turn else (table.ahead, table.turned)
        return (
            self.multiplier * _truncated(*along, abs(ahead), rng) * (-1.0 if ahead < 0.0 else 1.0),
            self.multiplier * _truncated(*around, abs(turn), rng) * (-1.0 if turn < 0.0 else 1.0),
        )


@registered("actuation noise", "robothor")
class RoboThorActuation:
    """Normal errors of RoboTHOR's LoCoBot agent: `movementGaussianSigma` and `rotateGaussianSigma` of AI2-THOR.

    Attributes:
        sigma: standard deviation of a step, m. turn_sigma: of a turn, degrees.
    """

    sigma: float = 0.005
    turn_sigma: float = 0.5

    def __post_init__(self) -> None:
        positive(self, "sigma", "turn_sigma", zero=True)

    def errors(self, ahead: float, turn: float, rng: np.random.Generator) -> tuple[float, float]:  # noqa: ARG002
        """Return the errors of an action."""
        error = float(rng.standard_normal())
        return (0.0, math.radians(self.turn_sigma) * error) if turn else (self.sigma * error, 0.0)


def _truncated(mean: float, variance: float, amount: float, rng: np.random.Generator) -> float:
    """Return an error within three standard deviations that leaves at least 5% of an action of this amount."""
    from scipy.stats import truncnorm

    if variance == 0.0:
        return mean
    sigma = math.sqrt(variance)
    low = max((-0.95 * amount - mean) / sigma, -3.0) if amount else -3.0
    return float(truncnorm.rvs(low, 3.0, mean, sigma, random_state=rng))
