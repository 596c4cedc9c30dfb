"""One driven episode as a row of `episodes.jsonl`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

from pydantic import Field, ValidationError

from labgym.documents import Record

Pose = tuple[float, float, float]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Length = Annotated[float, Field(ge=0.0)]
Count = Annotated[int, Field(ge=0)]


class EpisodeRow(Record):
    """What is known of an episode when it is over. None where a value does not apply.

    Attributes:
        suite: name and version. split: None for layouts given by hand.
        layout, layout_hash, protocol, pair: the drive; pair is the index into `goal_pairs(layout)`.
        policy, seed: who drove, and the seed of the evaluation.
        start, goal: (x, y, yaw) in the room frame, metres and radians.
        success: the robot's centre came within the suite's distance of the goal in time, by the suite's rules.
        spl, soft_spl: see `navigation_metrics`; None where no path exists for a disc of the planning radius, and in
            suites with the NavDP benchmark's rules.
        navdp_spl: SPL as that benchmark has it; None in other suites.
        path_length: driven, metres. shortest_path_length: L*, metres.
        final_distance: from the robot's centre to the goal at the end, metres.
        contacts: control steps in which the robot touched something.
        min_clearance: least distance of the chassis to any footprint or wall during the episode, metres.
        steps: control steps. time: simulated seconds.
        planning_ms: mean wall-clock time that the policy took for an action, its reset included; the only field
            that differs between runs.
        error: what the policy raised, one line; the episode then counts as failed.
    """

    suite: str
    split: str | None
    layout: str
    layout_hash: str
    protocol: str | None
    pair: Count
    policy: str
    seed: int
    start: Pose
    goal: Pose
    success: bool
    spl: Share | None
    soft_spl: Share | None
    path_length: Length
    shortest_path_length: Length | None
    final_distance: Length
    contacts: Count
    min_clearance: float
    steps: Count
    time: Length
    planning_ms: Length | None
    error: str | None = None
    navdp_spl: Share | None = None

    @property
    def key(self) -> tuple[str, int]:
        """What tells the episodes of one evaluation apart: layout id and pair."""
        return self.layout, self.pair


def row_line(row: EpisodeRow) -> str:
    """Return the row as one line of JSON with its newline."""
    return json.dumps(row.model_dump(mode="json"), allow_nan=False) + "\n"


def read_rows(path: str | Path) -> tuple[EpisodeRow, ...]:
    """Return the rows of an `episodes.jsonl`; none where there is no file.

    A line that is no row is left out: a run that was killed may have left half a line, and its episode is driven anew.
    """
    path = Path(path)
    if not path.is_file():
        return ()
    rows: list[EpisodeRow] = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        try:
            rows.append(EpisodeRow.model_validate_json(line))
        except ValidationError:
            continue
    return tuple(rows)
