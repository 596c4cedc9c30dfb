"""The episodes that a viewer offers, and what its page draws of them besides the scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from labgym.eval.driving.assignments import Assignment, assignments
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.navigation import OBSTACLE_HEIGHT, ShortestPaths
from labgym.scenes.building import building_solids
from labgym.suites import Suite


@dataclass(frozen=True, eq=False)
class ViewerEpisode:
    """An episode that can be driven: an assignment in a layout."""

    layout: Layout
    assignment: Assignment

    @property
    def label(self) -> str:
        """The layout's id, and from where to where the robot drives."""
        pair = self.assignment.pair
        repeat = f", repeat {self.assignment.repeat}" if self.assignment.repeat else ""
        return f"{self.layout.id}: {pair.start_location} to {pair.goal_location}{repeat}"


def episodes_of(layouts: Sequence[Layout], suite: Suite) -> tuple[ViewerEpisode, ...]:
    """Return the episodes of a suite in layouts, in the order in which an evaluation drives them.

    Raises:
        LabgymError: a layout has no protocol, or does not place one of its locations.
    """
    return tuple(ViewerEpisode(layout, one) for layout in layouts for one in assignments(layout, suite))


def description(episode: ViewerEpisode, success_distance: float) -> dict[str, Any]:
    """Return what the page draws of an episode: its ends, its shortest path and the plan; meters, room frame."""
    layout, pair = episode.layout, episode.assignment.pair
    path = ShortestPaths(layout).path(pair.start[:2], pair.goal[:2])
    return {
        "label": episode.label,
        "layout": layout.id,
        "protocol": "" if layout.protocol is None else layout.protocol.name,
        "start": list(pair.start),
        "goal": list(pair.goal),
        "success_distance": success_distance,
        "shortest": None if path is None else round(path.length, 3),
        "path": [] if path is None else np.round(path.points, 3).tolist(),
        **plan_of(layout),
    }


def plan_of(layout: Layout) -> dict[str, Any]:
    """Return what the page draws of a floor: bounds, walls and furniture below 1.4 m, as corners in meters."""
    floor = layout.floor
    walls = [box.corners() for box in building_solids(floor).values() if box.z0 < OBSTACLE_HEIGHT]
    boxes = [layout.box(placement.id) for placement in layout.placements if placement.support == FLOOR]
    furniture = [box.corners() for box in boxes if box.z0 < OBSTACLE_HEIGHT]
    return {
        "bounds": [round(float(value), 3) for value in floor.bounds],
        "walls": [np.round(corners, 3).tolist() for corners in walls],
        "furniture": [np.round(corners, 3).tolist() for corners in furniture],
    }
