"""The walking distance of a protocol's workflow, so that to put everything away is not a free win."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from labgym.geometry.frames import PlanarPose
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.facility import with_open_doors
from labgym.layouts.rules.touchstone2.placing import Whereabouts
from labgym.navigation.goals import goal_pose, location_pose
from labgym.navigation.visibility import ShortestPaths
from labgym.protocols import Protocol

Walk = Callable[[PlanarPose, PlanarPose], float | None]


@dataclass(frozen=True)
class Workflow:
    """The walks that a protocol needs in a layout.

    Attributes:
        between: from step to step, meters.
        fetching: to the items that are not at the step's location, and back, meters.
        trips: number of trips to fetch something.
        blocked: number of walks for which no path exists, or whose item or location is not placed.
    """

    between: float
    fetching: float
    trips: int
    blocked: int

    @property
    def length(self) -> float | None:
        """Total, meters; None if a walk is blocked."""
        return None if self.blocked else self.between + self.fetching


def walking_distance(arrangement: Arrangement, protocol: Protocol, paths: ShortestPaths | None = None) -> Workflow:
    """Return the length of the walks of a protocol's workflow, along exact shortest paths of a disc of 0.30 m.

    The walks are those from each step's location to the next one's, and at each step a round trip to every piece of
    furniture that holds items of the step and is not its location, one trip for each piece. An instrument that has been
    fetched stays with the work and goes along to the following locations; a reagent goes back to its place. Closed
    interior doors are opened.

    Args:
        paths: the shortest paths of the layout with interior doors open, if they exist already.
    """
    whereabouts = Whereabouts.of(arrangement, protocol)
    paths = ShortestPaths(with_open_doors(arrangement.layout)) if paths is None else paths
    reagents = {use.name for use in protocol.reagents}
    lengths: dict[tuple[PlanarPose, PlanarPose], float | None] = {}

    def walk(start: PlanarPose, goal: PlanarPose) -> float | None:
        if (start, goal) not in lengths:
            path = paths.path(start, goal)
            lengths[start, goal] = lengths[goal, start] = None if path is None else path.length
        return lengths[start, goal]

    between, fetching, trips, blocked = 0.0, 0.0, 0, 0
    carried: set[str] = set()
    here: PlanarPose | None = None
    for step in protocol.steps:
        place = whereabouts.place(step.location)
        if place is None:
            blocked, here = blocked + 1, None
            continue
        there = location_pose(arrangement.layout, step.location)
        if here is not None and here != there:
            length = walk(here, there)
            between, blocked = between + (length or 0.0), blocked + (length is None)
        stands, sources = whereabouts.root(place), set[int]()
        for name in dict.fromkeys(step.uses):
            if name in carried:
                continue
            roots = [whereabouts.root(row) for row in whereabouts.of_name(name)]
            if not roots:
                blocked += 1
            elif stands not in roots and step.location not in (arrangement.assets[root].role for root in roots):
                sources.add(_nearest(arrangement, roots, there, walk))
            if name not in reagents:
                carried.add(name)
        for root in sorted(sources):
            length = walk(there, goal_pose(arrangement.layout.box(arrangement.placements[root].id)))
            fetching, blocked = fetching + 2.0 * (length or 0.0), blocked + (length is None)
            trips += 1
        here = there
    return Workflow(between, fetching, trips, blocked)


def _nearest(arrangement: Arrangement, roots: list[int], there: PlanarPose, walk: Walk) -> int:
    """Return the root with the shortest walk, the first of equal ones."""
    lengths = [walk(there, goal_pose(arrangement.layout.box(arrangement.placements[root].id))) for root in roots]
    return min(zip(roots, lengths, strict=True), key=lambda pair: float("inf") if pair[1] is None else pair[1])[0]
