"""The navigation stack without a map: it maps the floor with the lidar while it drives."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.geometry import Array, compose
from labgym.navigation import Pose
from labgym.policies.policy import EpisodeStart
from labgym.policies.stack.docking import FrontEstimate
from labgym.policies.stack.old_map import OldMap
from labgym.policies.stack.policy import StackPolicy
from labgym.policies.stack.seen_floor import PaneReturns, SeenFloor

AROUND_M = 15.0
"""Width of the region around start and goal that the map covers, meters."""
MATCH_STEPS = 5
"""Control steps after which the localization takes the latest marks."""

DRIFTING_STOP_M = 0.10
"""Distance from the goal at which the robot stops where the odometry drifts, meters: its own map drifts, too."""

LOOK_STEPS = 10
"""Control steps for which the robot rests at first where people walk: who moves shows only in several scans."""


class MaplessStackPolicy(StackPolicy):
    """The parts of `stack` on an empty map that grows. Not privileged.

    - Map: the lidar's marks; what no ray has met counts as free, so that plans are optimistic.
    - Localization: scan matching with these marks where the odometry drifts.
    - People: returns from floor that was seen empty before; what stays there is a thing.
    - Glass: places at which rays end and which other rays pass.
    """

    name: ClassVar[str] = "mapless-stack"
    privileged: ClassVar[bool] = False
    # What the odometry errs in excess of the assumed errors stays in a map that is drawn by it.
    drift: ClassVar[float] = 4.0

    def reset(self, episode: EpisodeStart) -> None:
        """Begin with an empty map in the start frame."""
        super().reset(episode)
        assert self._map is not None
        self._floor, self._pane_returns = SeenFloor(self._map.clearance), PaneReturns()
        self._since_match = self._looked = 0

    def _begin(self, episode: EpisodeStart, goal: Pose, old: OldMap) -> None:
        super()._begin(episode, goal, old)
        if episode.task.drift and not self._docking:
            self._arrival.short = DRIFTING_STOP_M

    def _station_at(self, old: OldMap) -> FrontEstimate:  # noqa: ARG002
        return FrontEstimate(self._goal)

    def _drive(self, pose: Pose, velocity: tuple[float, float]) -> tuple[float, float]:
        if self._crowd is not None and self._looked < LOOK_STEPS:
            self._looked += 1
            return 0.0, 0.0
        return super()._drive(pose, velocity)

    def _known(self, episode: EpisodeStart) -> tuple[OldMap, Pose, Pose]:
        goal = _pose(episode)
        far = np.array([[0.0, 0.0], goal[:2]])
        bounds = *(far.min(axis=0) - AROUND_M), *(far.max(axis=0) + AROUND_M)
        self._map = OldMap.empty(tuple(math.floor(edge) for edge in bounds))
        return self._map, (0.0, 0.0, 0.0), goal

    def _next_place(self, episode: EpisodeStart) -> Pose:
        # The goal is announced in the frame of the odometry, with its errors.
        assert self._localizer is not None
        return compose(self._localizer.reckoned, _pose(episode))

    def _strange(self, pose: Pose, points: Array) -> NDArray[np.bool_]:
        return self._floor.moving(pose, points)

    def _of_panes(self, pose: Pose, ranges: Array, points: Array) -> tuple[Array, Array]:
        return self._pane_returns.observe(pose, ranges, points)

    def _sense(self, pose: Pose, ranges: Array) -> None:
        super()._sense(pose, ranges)
        self._floor.observe(pose, ranges, self._placed)
        self._since_match += 1
        if self._since_match >= MATCH_STEPS and self._localizer is not None:
            self._localizer.seen, self._since_match = self._costmap.marks_around(pose), 0


def _pose(episode: EpisodeStart) -> Pose:
    """Return the goal of an episode in its start frame, with heading 0 if any will do."""
    return (*episode.goal, episode.heading or 0.0)
