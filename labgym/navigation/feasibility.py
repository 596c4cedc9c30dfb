"""Which goal pairs of a protocol are feasible, and why the others are not."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Literal

from labgym.navigation.goals import GoalPair, Pose, location_pose, resolve_protocol, same_place
from labgym.navigation.occupancy import RESOLUTION, OccupancyGrid, occupancy
from labgym.navigation.plan import PLANNING_RADIUS, FloorPlan
from labgym.protocols import Protocol

Failure = Literal["missing", "outside_room", "endpoint_invalid", "unreachable"]
End = Literal["start", "goal"]


@dataclass(frozen=True)
class Transition:
    """The verdict on one transition between locations.

    Attributes:
        start_location, goal_location: asset names.
        start, goal: (x, y, yaw); None if the location is not placed.
        failure: None if a path exists; otherwise the first of these that applies: missing (a location is not placed),
            outside_room (an end is outside the room's interior), endpoint_invalid (the robot does not fit at an end),
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
    def feasible(self) -> bool:
        """Whether a collision-free path exists."""
        return self.failure is None


def feasibility(
    plan: FloorPlan,
    pairs: Iterable[GoalPair],
    radius: float = PLANNING_RADIUS,
    resolution: float = RESOLUTION,
    grid: OccupancyGrid | None = None,
) -> tuple[Transition, ...]:
    """Judge goal pairs on the occupancy grid dilated by a disc (8-connected, no corner cutting).

    A path exists if and only if both ends are in the same connected region, so no search is needed.

    Args:
        plan: the layout.
        pairs: goal pairs, as from `goal_pairs`.
        radius: radius of the disc, meters.
        resolution: side of a cell, meters.
        grid: the dilated grid if it exists already; radius and resolution are then ignored.
    """
    grid = grid if grid is not None else occupancy(plan, resolution).dilated(radius)
    return tuple(_judge(plan, grid, (p.start_location, p.goal_location), p.start, p.goal) for p in pairs)


def transitions(
    plan: FloorPlan,
    protocol: Protocol | str | Path | None = None,
    radius: float = PLANNING_RADIUS,
    resolution: float = RESOLUTION,
) -> tuple[Transition, ...]:
    """Judge every transition of a protocol, including those to locations that are not placed.

    Unlike `goal_pairs`, a missing location is a failure and not an error. Transitions of zero length are dropped.

    Raises:
        UnknownNameError: no protocol of the library has that id.
        LabgymError: no protocol is given and the layout has none.
    """
    protocol = resolve_protocol(plan, protocol)
    grid = occupancy(plan, resolution).dilated(radius)
    poses: dict[str, Pose | None] = {
        location: location_pose(plan, location) if plan.find(location) is not None else None
        for location in protocol.locations
    }
    verdicts: list[Transition] = []
    for here, there in pairwise(protocol.route):
        start, goal = poses[here], poses[there]
        if start is None or goal is None or not same_place(start, goal):
            verdicts.append(_judge(plan, grid, (here, there), start, goal))
    return tuple(verdicts)


def _judge(
    plan: FloorPlan, grid: OccupancyGrid, locations: tuple[str, str], start: Pose | None, goal: Pose | None
) -> Transition:
    ends: tuple[tuple[End, Pose | None], ...] = (("start", start), ("goal", goal))
    at_fault = tuple(end for end, pose in ends if pose is None)
    if start is None or goal is None:
        return Transition(*locations, start, goal, "missing", at_fault)
    at_fault = tuple(end for end, pose in ends if pose is not None and not _in_room(plan, pose))
    if at_fault:
        return Transition(*locations, start, goal, "outside_room", at_fault)
    at_fault = tuple(end for end, pose in ends if pose is not None and not grid.free(pose[0], pose[1]))
    if at_fault:
        return Transition(*locations, start, goal, "endpoint_invalid", at_fault)
    joined = grid.connected((start[0], start[1]), (goal[0], goal[1]))
    return Transition(*locations, start, goal, None if joined else "unreachable")


def _in_room(plan: FloorPlan, pose: Pose) -> bool:
    return 0.0 < pose[0] < plan.room.width and 0.0 < pose[1] < plan.room.depth
