"""A* on the map, followed by odometry (`astar`) or by dead reckoning (`blind`)."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import turn_towards
from labgym.errors import LabgymError
from labgym.geometry import Array, compose, wrap_angle
from labgym.navigation import PLANNING_RADIUS, Pose, ShortestPaths, occupancy
from labgym.navigation.search_kernel import prepare
from labgym.policies.arrival import GoalArrival, planar_pose, shortened
from labgym.policies.gentle import GentleLimits
from labgym.policies.grid_planner import GridPlanner
from labgym.policies.policy import EpisodeStart, GroundTruth, Observation, Policy
from labgym.policies.tracking import PathTracker, TrackingOptions

LENGTH_FACTOR = 1.05
"""A path with more clearance is driven if it is at most this many times as long as the shortest one."""
CLEARANCE_MARGINS_M = (0.05, 0.02)
"""Distances that exact paths keep beyond the planning radius, tried in this order, meters. At a goal in front of
furniture there is often no room for the first."""


class AStarPolicy(Policy):
    """Plans once on the layout's map and follows the path. Privileged.

    It plans on the occupancy grid, with a preference for clearance. The grid refuses passages up to 15 cm wider than
    the robot; if the grid has no path, the policy follows an exact one. Without an exact one, it turns in place. In
    tasks of LabNav it follows an exact path also if that of the grid is clearly longer, plans on the old map, ends at
    rest, and drives gently with a beaker.
    """

    name: ClassVar[str] = "astar"
    privileged: ClassVar[bool] = True

    def __init__(self) -> None:
        # Episodes run in copies of this process.
        prepare()
        self._tracker: PathTracker | None = None
        self._start: Pose = (0.0, 0.0, 0.0)
        self._planned: tuple[str, GridPlanner] | None = None
        self._arrival: GoalArrival | None = None

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
        self._arrival = GoalArrival(episode)
        if path is None or self._arrival.active:
            path = _or_exact(path, truth)
        self._tracker = None if path is None else _tracker(path, episode, self._arrival, truth.start)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Follow the path."""
        if self._tracker is None:
            return turn_towards(1.0)
        return self._tracker.action(
            compose(self._start, self.estimate(observation)), speed=float(observation["velocity"][0])
        )

    def stop(self, observation: Observation) -> bool:
        """Whether the robot rests at the goal."""
        return self._arrival is not None and self._arrival.reached(self.estimate(observation), observation["velocity"])

    def estimate(self, observation: Observation) -> Pose:
        """Return the pose in the start frame by which the path is followed: the odometry."""
        return planar_pose(observation["odometry"])


def _tracker(path: Array, episode: EpisodeStart, arrival: GoalArrival, start: Pose) -> PathTracker:
    """Return the tracker of a path in the room frame, which ends at rest in tasks of LabNav."""
    if not arrival.active:
        return PathTracker(path, episode.robot)
    heading = None if episode.heading is None else wrap_angle(start[2] + episode.heading)
    gentle = None if episode.beaker is None else GentleLimits.of(episode.beaker, episode.robot)
    if episode.heading is None:
        path = shortened(path, arrival.short)
    return PathTracker(path, episode.robot, TrackingOptions(rest=True), heading=heading, gentle=gentle)


def _or_exact(path: Array | None, truth: GroundTruth) -> Array | None:
    """Return a path unless an exact one is clearly shorter; of exact paths the one with more clearance, if it is short.

    Args:
        path: the plan on the grid, (n, 2); None without one.
        truth: layout, start and goal.
    """
    ends = truth.start[:2], truth.pair.goal[:2]
    shortest = ShortestPaths(truth.layout).path(*ends)
    if shortest is None:
        return path
    limit = LENGTH_FACTOR * shortest.length
    if path is not None and float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()) <= limit:
        return path
    for margin in CLEARANCE_MARGINS_M:
        clear = ShortestPaths(truth.layout, PLANNING_RADIUS + margin).path(*ends)
        if clear is not None and clear.length <= limit:
            return clear.points
    return shortest.points
