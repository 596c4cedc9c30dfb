"""Manipulation reach: whether an arm reaches the items of each step from where the robot stands."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from labgym.geometry.frames import PlanarPose
from labgym.layouts.rules.arrangement import Arrangement
from labgym.layouts.rules.whereabouts import Whereabouts
from labgym.navigation.goals import goal_pose, location_pose
from labgym.protocols import Protocol

if TYPE_CHECKING:
    from labgym.layouts.rules.objective import Assessment

ARM_REACH = 1.30
"""Reach of the arm from its shoulder, meters: Universal Robots UR10e, working radius 1300 mm (technical
specifications, 2023). A Franka-class arm (0.855 m) covers 0.25 m of a bench from the goal pose, 0.60 m before it."""

SHOULDER_HEIGHT = 0.87
"""Height of the shoulder above the floor, meters: a mobile base 0.69 m high (Robotnik RB-KAIROS+) and the 0.1807 m from
the UR10e's foot to its shoulder axis (DH parameter d1)."""


@dataclass(frozen=True)
class ItemReach:
    """The distance of one item of a step from the arm's shoulder.

    Attributes:
        step: index of the step that takes it first.
        item: placement id.
        pose: the goal pose that it is taken from.
        distance: from the shoulder to the middle of the item, meters.
    """

    step: int
    item: str
    pose: PlanarPose
    distance: float

    @property
    def reached(self) -> bool:
        """Whether the item lies within the arm's envelope."""
        return self.distance <= ARM_REACH + 1e-9


def item_reaches(arrangement: Arrangement, protocol: Protocol) -> tuple[ItemReach, ...]:
    """Return the reach of every placed item of a protocol, at the first step that uses it.

    An instrument that the protocol puts at the step's location (constraint `on`) is taken from the step's goal pose;
    another instrument and a reagent from the goal pose of the furniture where it stands. Of several placements of an
    asset the nearest counts. The envelope is a ball about the shoulder: joints and obstacles are not considered.
    """
    whereabouts = Whereabouts(arrangement, protocol)
    homes = {rule.subject: rule.object for rule in protocol.spatial_constraints if rule.kind == "on"}
    reaches, seen = [], set[str]()
    for step in protocol.steps:
        for name in step.uses:
            rows = whereabouts.of_name(name)
            if name in seen or not rows:
                continue
            seen.add(name)
            at_home = homes.get(name) == step.location and whereabouts.place(step.location) is not None
            options = []
            for row in rows:
                root = arrangement.placements[whereabouts.root(row)].id
                box = arrangement.layout.box(root)
                pose = location_pose(arrangement.layout, step.location) if at_home else goal_pose(box)
                item = arrangement.placements[row].id
                options.append(ItemReach(step.index, item, pose, _distance(arrangement, row, pose)))
            reaches.append(min(options, key=lambda option: option.distance))
    return tuple(reaches)


def _distance(arrangement: Arrangement, row: int, pose: PlanarPose) -> float:
    """Distance from the shoulder at a pose to the middle of an object, meters."""
    (x, y), (low, high) = arrangement.boxes.centre[row].tolist(), arrangement.boxes.z[row].tolist()
    return math.dist((x, y, (low + high) / 2.0), (pose[0], pose[1], SHOULDER_HEIGHT))


def reach_figures(assessment: Assessment) -> dict[str, float | tuple[str, ...] | None]:
    """Return the share of the items in reach, and the placements out of reach."""
    return {
        "reach": assessment.reach,
        "out_of_reach": tuple(item.item for item in assessment.reaches if not item.reached),
    }
