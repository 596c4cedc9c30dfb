"""The properties of a task that the evaluator announces to a policy."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ScoreWeights:
    """Amounts that a score counts besides the success of a drive.

    Attributes:
        time: weight of OT / max(T, OT). people: of the distance from people. length: of L* / max(P, L*).
    """

    time: float = 1.0
    people: float = 0.1
    length: float = 0.0


DEFAULT_WEIGHTS = ScoreWeights()


@dataclass(frozen=True)
class TaskProperties:
    """The properties of a task that a policy receives at the start of a drive, whatever the level.

    Attributes:
        rests: whether the robot must come to rest at its goal, and whether its actions come late by the policy's
            latency; False where touching the goal's disc ends the episode.
        drift: whether the odometry drifts. noise: whether the depth camera has errors.
        people: whether people may walk. glass: whether there may be panes, which rays pass.
        mounting: whether the sensors are off their nominal places.
        weights: what the score counts.
        dock_slack: distance from a docking pose within which the robot may end without a loss, meters.
    """

    rests: bool = False
    drift: bool = False
    noise: bool = False
    people: bool = False
    glass: bool = False
    mounting: bool = False
    weights: ScoreWeights = DEFAULT_WEIGHTS
    dock_slack: float = 0.0


TRANSITION = TaskProperties()
"""The paper's transition: an episode ends when the robot touches the goal's disc, and sensors are exact."""
