"""The mapless stack with perfect sensors: what knowing the floor in advance is worth."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.errors import LabgymError
from labgym.geometry import Array, relative
from labgym.navigation import Pose
from labgym.policies.policy import EpisodeStart, Observation
from labgym.policies.stack.mapless import MaplessStackPolicy
from labgym.policies.stack.old_map import OldMap, ray_lengths

NEARER_M = 0.2
"""A measured range that is shorter than the true one by more than this is of something that moves, meters."""


class MaplessOraclePolicy(MaplessStackPolicy):
    """`mapless-stack` with the true pose, the true goal and a perfect lidar, which sees panes. It foresees the world.

    It uses nothing of the world but that: what the robot has not seen, it does not know.
    """

    name: ClassVar[str] = "mapless-oracle"
    foresees: ClassVar[bool] = True

    def reset(self, episode: EpisodeStart) -> None:
        """Begin with an empty map in the start frame.

        Raises:
            LabgymError: the episode has no world.
        """
        super().reset(self._exactly(episode))

    def next_goal(self, episode: EpisodeStart) -> None:
        """Go on to the next goal with the map."""
        super().next_goal(self._exactly(episode))

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:
        """Drive by what perfect sensors would measure."""
        measured = np.asarray(observation["lidar"], dtype=np.float64)
        true = self._true_ranges(self._world.pose)
        lidar = np.where(measured < true - NEARER_M, measured, true)
        return super().act({**observation, "odometry": np.array(self._here()), "lidar": lidar})

    def _exactly(self, episode: EpisodeStart) -> EpisodeStart:
        """Return an episode with the true goal and without errors of sensors."""
        world = episode.world
        if world is None:
            raise LabgymError(f"policy {self.name!r} needs the world: pass an EpisodeStart with world, as LabNav does")
        self._world, self._from = world, world.pose
        self._boxes = [box for _, box in OldMap.of(world.solids()).sections]
        x, y, yaw = relative(world.pose, world.goal)
        return replace(
            episode,
            goal=(x, y),
            heading=None if episode.heading is None else yaw,
            task=replace(episode.task, drift=False, noise=False, glass=False, mounting=False),
        )

    def _here(self) -> Pose:
        """Return the true pose in the start frame of the drive."""
        return relative(self._from, self._world.pose)

    def _true_ranges(self, pose: Pose) -> Array:
        """Return the ranges of a perfect lidar at a pose, (180,) meters."""
        angles = -math.pi + 2.0 * math.pi / LIDAR_RAYS * np.arange(LIDAR_RAYS) + pose[2]
        rays = np.column_stack([np.cos(angles), np.sin(angles)])
        away = ray_lengths(np.tile(pose[:2], (LIDAR_RAYS, 1)), rays, self._boxes)
        return np.asarray(np.minimum(away.min(axis=1, initial=math.inf), RANGE))
