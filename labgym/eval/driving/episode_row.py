"""The results of an episode: a row of `episodes.jsonl`."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, StrictBool

from labgym.documents import Record

Pose = tuple[float, float, float]
Key = tuple[str, int, int]
"""Layout id, index of the goal pair and number of the repeat: identifies an episode within an evaluation."""
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Length = Annotated[float, Field(ge=0.0)]
Count = Annotated[int, Field(ge=0)]


class EpisodeRow(Record):
    """The results of an episode. A value that does not apply is None.

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
    def key(self) -> Key:
        """Layout id, pair and repeat: identifies the episode within an evaluation."""
        return self.layout, self.pair, self.repeat
