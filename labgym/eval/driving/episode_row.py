"""The results of an episode: a row of `episodes.jsonl`, of a transition or of a task of LabNav."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import Field, StrictBool

from labgym.documents import Record
from labgym.envs.conditions.payload import MOST_LEGS
from labgym.envs.labnav.tasks import TaskName

Pose = tuple[float, float, float]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Length = Annotated[float, Field(ge=0.0)]
Count = Annotated[int, Field(ge=0)]
Track = Literal["deployed", "mapless", "privileged"]
"""What a policy knows: the old map, no map, or the world as it is and will be."""
TRACKS: dict[Track, str] = {
    "deployed": "Deployed: a map from before things moved",
    "mapless": "Mapless: no map",
    "privileged": "Privileged: the true world and the people's future",
}
"""The tracks and their headings, in the order of the tables."""
Stopped = Literal["policy", "evaluator", ""]
Ending = Literal[
    "success", "contact", "stuck", "lost", "wrong place", "frozen", "spilt", "undocked", "time", "error"
]  # fmt: skip
"""How an episode ended."""
ENDINGS: tuple[Ending, ...] = get_args(Ending)
"""How episodes end, in the order of the tables."""


class EpisodeRow(Record):
    """Base of the rows of all tasks. Each kind declares the fields itself, since their order is that of its files.

    Attributes:
        suite: name and version of the suite. policy: label of the policy. seed: random seed of the evaluation.
        success: whether the robot reached its goal by the rules of the task.
        path_length: length driven, meters. final_distance: from the goal at the end, meters.
        contacts: control steps in which the robot touched something. steps: control steps. time: simulated seconds.
        error: the exception of the policy, in one line; the episode then counts as failed.
    """

    if TYPE_CHECKING:
        suite: str
        policy: str
        seed: int
        success: bool
        path_length: float
        final_distance: float
        contacts: int
        steps: int
        time: float
        error: str | None

    @property
    @abstractmethod
    def place(self) -> dict[str, Any]:
        """The fields by which the files of routes and times name the episode."""

    @property
    def key(self) -> str:
        """Identifies the episode within an evaluation."""
        return "/".join(map(str, self.place.values()))


class TransitionRow(EpisodeRow):
    """The results of a transition. A value that does not apply is None.

    Attributes:
        suite: name and version of the suite. split: its split, None for layouts passed by hand.
        layout, layout_hash, protocol: the layout and the protocol that gives the goal pairs.
        pair: index into `goal_pairs(layout)`; -1 for a drive between two points. repeat: number of the repeat of this
            pair, from 0.
        policy: label of the policy. seed: random seed of the evaluation.
        start, goal: poses (x, y, yaw) in the room frame, meters and radians; the start with its jitter.
        success: whether the robot's center came within the suite's success distance of the goal before the time limit,
            by the suite's rules.
        spl, soft_spl: see `navigation_metrics`; None if no path exists for a disc of the planning radius, and in suites
            with the NavDP benchmark's rules.
        navdp_spl: SPL by the NavDP benchmark's definition; None in other suites.
        path_length: length driven, meters. shortest_path_length: L*, meters.
        final_distance: distance from the robot's center to the goal at the end, meters.
        contacts: control steps in which the robot touched something.
        min_clearance: smallest distance from the chassis to any footprint or wall during the episode, meters.
        steps: control steps. time: simulated seconds.
        error: the exception of the policy, in one line; the episode then counts as failed.
    """

    suite: str
    split: str | None
    layout: str
    layout_hash: str
    protocol: str | None
    pair: Annotated[int, Field(ge=-1)]
    repeat: Count = 0
    policy: str
    seed: int
    start: Pose
    goal: Pose
    success: StrictBool
    spl: Share | None
    soft_spl: Share | None
    path_length: Length
    shortest_path_length: Length | None
    final_distance: Length
    contacts: Count
    min_clearance: float
    steps: Count
    time: Length
    error: str | None = None
    navdp_spl: Share | None = None

    @property
    def place(self) -> dict[str, Any]:
        """Layout, pair and repeat."""
        return {"layout": self.layout, "pair": self.pair, "repeat": self.repeat}


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


class LabNavRow(EpisodeRow):
    """The results of an episode of LabNav. A value that does not apply is None.

    Attributes:
        suite: name and version of the suite. task, level: of LabNav.
        floor, floor_hash, number: the episode.
        policy: label. track: what it knows. seed: random seed of the evaluation.
        score: see `labgym.eval.labnav.scores`.
        success: S in the scores, whether the robot rested in the goal's disc without a contact that ends the drive,
            docked or not and with or without a spill; success rates count the ending "success".
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
    def place(self) -> dict[str, Any]:
        """The key: task, level, floor and number."""
        return {"key": f"{self.task}-{self.level}/{self.floor}/{self.number}"}
