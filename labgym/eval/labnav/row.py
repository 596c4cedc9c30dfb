"""The results of a LabNav episode: a row of `episodes.jsonl`."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, StrictBool

from labgym.documents import Record
from labgym.envs.conditions.payload import MOST_LEGS
from labgym.envs.labnav.tasks import TaskName
from labgym.eval.driving.episode_row import Count, Length, Pose, Share
from labgym.eval.labnav.rules import Ending

Track = Literal["deployed", "mapless", "privileged"]
"""What a policy knows: the old map, no map, or the world as it is and will be."""


Stopped = Literal["policy", "evaluator", ""]


class LabNavLegRow(Record):
    """The results of a drive of a shift.

    Attributes:
        success: S_i, whether the robot rested in the goal's disc. docked: whether within 0.10 m and 0.10 rad, too.
        ending, stopped: as in `LabNavRow`.
        shortest: L*_i from where the drive began, meters. path_length: P_i. time: seconds.
        final_distance: from the goal, meters. final_heading: deviation from the goal's heading, radians.
        beaker: whether the robot carried the beaker. rise: greatest rise of its liquid, meters.
    """

    success: StrictBool
    docked: StrictBool
    ending: Ending
    stopped: Stopped = ""
    shortest: Length
    path_length: Length
    time: Length
    final_distance: Length
    final_heading: float
    beaker: bool
    rise: Length


class LabNavRow(Record):
    """The results of an episode. A value that does not apply is None.

    Attributes:
        suite: name and version of the suite. task, level: of LabNav.
        floor, floor_hash, number: the episode.
        policy: label. track: what it knows. seed: random seed of the evaluation.
        score: see `labgym.eval.labnav.scores`.
        success: S, whether the robot rested in the goal's disc without a contact that ends the drive.
        ending: "success", or why the drive failed.
        contact: name of the thing whose touch ended the drive, "" without. touched: of all that it touched, at most 20.
        stopped: who decided that the robot had arrived: the policy, or the evaluator for one that cannot stop.
        shortest: L*, meters. straight: distance from start to goal. path_length: P. time: T, seconds.
        neck: radius of the widest disc of `necks.RADII` that reaches the goal, meters; None if none does.
        final_distance: from the goal, meters. final_heading: deviation from the goal's heading, radians.
        odometry_error: distance between the pose by odometry and the true one at the end, meters.
        steps: control steps. contacts: of them with a contact.
        waited: seconds at rest near people.
        delay: control steps by which actions came late.
        outcomes: results of the conditions by name.
        error: of the policy, in one line.
        legs: in `shift` the results of the drives that were begun. goals: number of drives.
            `shortest` and `straight` are then sums over all drives from goal to goal, `final_distance` and
            `final_heading` those of the last one that was begun; `success` is that all were, with docking.
    """

    suite: str
    task: TaskName
    level: Annotated[int, Field(ge=1, le=3)]
    floor: str
    floor_hash: str
    number: Count
    policy: str
    track: Track
    seed: int
    score: Share
    success: StrictBool
    ending: Ending
    contact: str = ""
    touched: tuple[Annotated[str, Field(max_length=100)], ...] = ()
    stopped: Stopped = ""
    shortest: Length
    straight: Length
    neck: Length | None = None
    path_length: Length
    time: Length
    final_distance: Length
    final_heading: float
    odometry_error: Length
    steps: Count
    contacts: Count
    waited: Length = 0.0
    delay: Count = 0
    outcomes: dict[str, Any] = Field(default_factory=dict)
    error: str | None = None
    legs: Annotated[tuple[LabNavLegRow, ...], Field(max_length=MOST_LEGS)] = ()
    goals: Count = 1

    @property
    def key(self) -> str:
        """Task, floor and number: identifies the episode within an evaluation."""
        return f"{self.task}-{self.level}/{self.floor}/{self.number}"


class LabNavRoute(Record):
    """A line of `routes.jsonl`: poses (x, y, yaw) after each control step, meters and radians, rounded to 0.001."""

    key: str
    poses: tuple[Pose, ...]


class LabNavTime(Record):
    """A line of `times.jsonl`, which is measured.

    Attributes:
        planning_ms: mean wall-clock milliseconds of the policy per action; None without an action.
        high_ms: their 90th percentile.
        slow: whether that is longer than the latency of the drive, or than a control step if it is less.
    """

    key: str
    planning_ms: Length | None
    high_ms: Length | None = None
    slow: bool
