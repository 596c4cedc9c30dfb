"""The walking distance of a protocol's workflow, so that to put everything away is not a free win."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.regulations.premises import Premises
from labgym.layouts.rules.whereabouts import Whereabouts
from labgym.protocols import Protocol

if TYPE_CHECKING:
    from labgym.layouts.rules.objective import Assessment


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


def walking_distance(arrangement: Arrangement, protocol: Protocol, premises: Premises | None = None) -> Workflow:
    """Return the length of the walks of a protocol's workflow, along exact shortest paths of a person.

    The walks are those from each step's location to the next one's, and at each step a round trip to every piece of
    furniture that holds items of the step and is not its location, one trip for each piece. An instrument that has been
    fetched stays with the work and goes along to the following locations; a reagent goes back to its place. A person is
    a disc of 0.25 m that opens interior doors and passes movable objects.

    Args:
        premises: the walks of the layout, if they exist already.
    """
    whereabouts = Whereabouts(arrangement, protocol)
    walks = Premises(arrangement) if premises is None else premises
    reagents = {use.name for use in protocol.reagents}
    between, fetching, trips, blocked = 0.0, 0.0, 0, 0
    carried: set[str] = set()
    here: int | None = None
    for step in protocol.steps:
        place = whereabouts.place(step.location)
        if place is None:
            blocked, here = blocked + 1, None
            continue
        stands, sources = whereabouts.root(place), set[int]()
        if here is not None and here != stands:
            length = walks.walk(walks.pose(here), [walks.pose(stands)])
            between, blocked = between + _finite(length), blocked + math.isinf(length)
        here = stands
        for name in dict.fromkeys(step.uses):
            if name in carried:
                continue
            roots = [whereabouts.root(row) for row in whereabouts.of_name(name)]
            if not roots:
                blocked += 1
            elif stands not in roots and step.location not in (arrangement.assets[root].role for root in roots):
                sources.add(min(roots, key=lambda root: (walks.walk(walks.pose(stands), [walks.pose(root)]), root)))
            if name not in reagents:
                carried.add(name)
        for root in sorted(sources):
            length = walks.walk(walks.pose(stands), [walks.pose(root)])
            fetching, blocked, trips = fetching + 2.0 * _finite(length), blocked + math.isinf(length), trips + 1
    return Workflow(between, fetching, trips, blocked)


def _finite(length: float) -> float:
    return length if math.isfinite(length) else 0.0


def workflow_figures(assessment: Assessment) -> dict[str, float | None]:
    """Return the walking distance of the workflow and its parts, meters, and the number of trips."""
    walk = assessment.workflow
    if walk is None:
        return {}
    return {"walk": walk.length, "between_steps": walk.between, "fetching": walk.fetching, "trips": walk.trips}
