"""Which goal pairs of a protocol are feasible, and why the others are not."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal
from typing import Protocol as Interface

import numpy as np

from labgym.errors import check_name
from labgym.navigation.barriers import Barriers
from labgym.navigation.goals import GoalPair, Pose, location_pose, resolve_protocol, same_place
from labgym.navigation.occupancy import RESOLUTION, OccupancyGrid, occupancy
from labgym.navigation.plan import PLANNING_RADIUS, FloorPlan
from labgym.navigation.visibility import ShortestPaths
from labgym.protocols import Protocol

Method = Literal["grid", "exact"]
"""How the free positions of a disc are determined.

"grid": on the 5 cm occupancy grid dilated by the disc, which refuses passages up to 15 cm wider than the disc. Version
1: the rule set `paper`, LabPointNav-v0 and everything published with them.
"exact": by the exact clearance from every footprint and wall. Version 2.
"""
METHODS: tuple[Method, ...] = ("grid", "exact")

Leg = tuple[str, str, Pose | None, Pose | None]
"""Names of two consecutive locations, and their goal poses; None for a location that is not placed."""
Failure = Literal["missing", "outside_room", "endpoint_invalid", "unreachable"]
End = Literal["start", "goal"]


@dataclass(frozen=True)
class Transition:
    """The verdict on one transition between locations.

    Attributes:
        start_location, goal_location: asset names.
        start, goal: (x, y, yaw); None if the location is not placed.
        failure: None if a path exists; otherwise the first of these that applies: missing (a location is not placed),
            outside_room (an end is in no room), endpoint_invalid (the robot does not fit at an end),
            unreachable (the robot fits at both ends, but no path connects them).
        ends: the ends that cause the failure; empty for unreachable.
    """

    start_location: str
    goal_location: str
    start: Pose | None
    goal: Pose | None
    failure: Failure | None
    ends: tuple[End, ...] = ()

    @property
    def leg(self) -> Leg:
        """The locations and poses that the verdict is on."""
        return self.start_location, self.goal_location, self.start, self.goal

    @property
    def feasible(self) -> bool:
        """Whether a collision-free path exists."""
        return self.failure is None


def feasibility(
    plan: FloorPlan,
    pairs: Iterable[GoalPair],
    radius: float = PLANNING_RADIUS,
    resolution: float = RESOLUTION,
    grid: OccupancyGrid | None = None,
    method: Method = "grid",
) -> tuple[Transition, ...]:
    """Judge goal pairs for a disc: a path exists if both ends are in the same connected region of its free positions.

    Args:
        plan: the layout.
        pairs: goal pairs, as from `goal_pairs`.
        radius: radius of the disc, meters.
        resolution: side of a cell, meters, for the method "grid".
        grid: the dilated grid if it exists already; radius, resolution and method are then ignored.
        method: "grid" (8-connected, no corner cutting) or "exact"; see `Method`.

    Raises:
        UnknownNameError: no method has that name.
    """
    space = grid if grid is not None else _free_positions(plan, radius, resolution, method)
    floor = Barriers.of(plan)
    return tuple(_judge(floor, space, (p.start_location, p.goal_location), p.start, p.goal) for p in pairs)


def transitions(
    plan: FloorPlan,
    protocol: Protocol | str | Path | None = None,
    radius: float = PLANNING_RADIUS,
    resolution: float = RESOLUTION,
    method: Method = "grid",
) -> tuple[Transition, ...]:
    """Judge every transition of a protocol, including those to locations that are not placed.

    Unlike `goal_pairs`, a missing location is a failure and not an error. Transitions of zero length are dropped.
    Arguments as in `feasibility`.

    Raises:
        UnknownNameError: no protocol of the library, or no method, has that name.
        LabgymError: no protocol is given and the layout has none.
    """
    protocol = resolve_protocol(plan, protocol)
    return judge_legs(plan, legs(plan, protocol), _free_positions(plan, radius, resolution, method))


def judge_legs(plan: FloorPlan, drives: Iterable[Leg], space: FreePositions) -> tuple[Transition, ...]:
    """Judge drives between named places.

    Args:
        plan: the layout.
        drives: as from `legs`.
        space: free positions of the disc in the plan: a `ShortestPaths` or a dilated `OccupancyGrid`.
    """
    floor = Barriers.of(plan)
    return tuple(_judge(floor, space, (here, there), start, goal) for here, there, start, goal in drives)


def legs(plan: FloorPlan, protocol: Protocol) -> list[Leg]:
    """Return every transition of a protocol but those of zero length."""
    poses: dict[str, Pose | None] = {
        location: location_pose(plan, location) if plan.find(location) is not None else None
        for location in protocol.locations
    }
    steps = ((here, there, poses[here], poses[there]) for here, there in pairwise(protocol.route))
    return [
        (here, there, start, goal)
        for here, there, start, goal in steps
        if start is None or goal is None or not same_place(start, goal)
    ]


class FreePositions(Interface):
    """Where a disc fits, and between which positions it can move."""

    def free(self, x: float, y: float) -> bool:
        """Whether the disc fits at a point."""
        ...

    def connected(self, start: tuple[float, float], goal: tuple[float, float]) -> bool:
        """Whether a path between two points exists."""
        ...


def _free_positions(plan: FloorPlan, radius: float, resolution: float, method: Method) -> FreePositions:
    check_name("method of feasibility", method, METHODS)
    return ShortestPaths(plan, radius) if method == "exact" else occupancy(plan, resolution).dilated(radius)


def _judge(
    floor: Barriers, space: FreePositions, locations: tuple[str, str], start: Pose | None, goal: Pose | None
) -> Transition:
    ends: tuple[tuple[End, Pose | None], ...] = (("start", start), ("goal", goal))
    at_fault = tuple(end for end, pose in ends if pose is None)
    if start is None or goal is None:
        return Transition(*locations, start, goal, "missing", at_fault)
    at_fault = tuple(end for end, pose in ends if pose is not None and not floor.inside(np.array([pose[:2]]))[0])
    if at_fault:
        return Transition(*locations, start, goal, "outside_room", at_fault)
    at_fault = tuple(end for end, pose in ends if pose is not None and not space.free(pose[0], pose[1]))
    if at_fault:
        return Transition(*locations, start, goal, "endpoint_invalid", at_fault)
    joined = space.connected((start[0], start[1]), (goal[0], goal[1]))
    return Transition(*locations, start, goal, None if joined else "unreachable")
