"""A* on the true map: the upper bound of the tables."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.errors import LabgymError
from labgym.geometry import compose
from labgym.navigation import Pose, occupancy
from labgym.policies.grid_planner import GridPlanner
from labgym.policies.policy import EpisodeStart, Observation, Policy
from labgym.policies.tracking import PathTracker, turn_towards


class AStarPolicy(Policy):
    """Plans once on the layout's occupancy grid and follows the path. Privileged.

    If there is no path, it turns in place.
    """

    name: ClassVar[str] = "astar"
    privileged: ClassVar[bool] = True

    def __init__(self) -> None:
        self._tracker: PathTracker | None = None
        self._start: Pose = (0.0, 0.0, 0.0)
        self._planned: tuple[str, GridPlanner] | None = None

    def reset(self, episode: EpisodeStart) -> None:
        """Plan from the true start to the true goal.

        Raises:
            LabgymError: the episode has no map.
        """
        truth = episode.truth
        if truth is None:
            raise LabgymError(f"policy {self.name!r} needs the map: pass an EpisodeStart with truth")
        if self._planned is None or self._planned[0] != truth.layout.hash:
            self._planned = truth.layout.hash, GridPlanner(occupancy(truth.layout))
        self._start = truth.start
        path = self._planned[1].plan(truth.start[:2], truth.pair.goal[:2])
        self._tracker = None if path is None else PathTracker(path, episode.robot)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Follow the path."""
        if self._tracker is None:
            return turn_towards(1.0)
        return self._tracker.action(
            compose(self._start, observation["odometry"]), speed=float(observation["velocity"][0])
        )
