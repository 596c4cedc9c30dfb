"""The clairvoyant as a policy."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.beaker import GRAVITY, Beaker
from labgym.envs.robot import ROBOT
from labgym.envs.world import world_of
from labgym.errors import LabgymError
from labgym.policies.clairvoyant.drives import AloneDrive, CrowdDrive
from labgym.policies.clairvoyant.planning import Errand
from labgym.policies.clairvoyant.route import DriveLimits
from labgym.policies.clairvoyant.smoothing import ClearanceField
from labgym.policies.clairvoyant.worth import Worth
from labgym.policies.gentle import shaping_weights
from labgym.policies.policy import EpisodeStart, Observation, Policy
from labgym.policies.reckoning import DeadReckoning
from labgym.policies.tracking import velocities_to_action

STOP_INSIDE_M = 0.015
"""How far inside the edge of the success disc the robot comes to rest, meters."""
REST_VELOCITIES = (0.01, 0.02)
"""Forward velocity, m/s, and turn rate, rad/s, below which the robot is at rest."""
DOCK_ERRORS = (0.01, 0.01)
"""Errors below which a robot at rest has docked, meters and radians."""
LIQUID_SHARES = (0.56, 0.5)
"""Shares of the acceleration that raises a liquid to the rim that are used along and across the way."""


class ClairvoyantPolicy(Policy):
    """Knows the true floor, its true pose, and how people will answer to what it does. It foresees the world.

    - Alone it takes the fastest of several smooth ways and follows it within the limits of the robot.
    - Among people it plays its drives through before it takes one of them.
    - With a beaker its accelerations raise the liquid to the rim at most, and leave no oscillation behind.
    - It stops where braking ends inside the success disc; at a station it turns to the true docking pose.
    """

    name: ClassVar[str] = "clairvoyant"
    foresees: ClassVar[bool] = True

    def reset(self, episode: EpisodeStart) -> None:
        """Plan a drive from where the robot stands.

        Raises:
            LabgymError: the episode has no world.
        """
        world = episode.world
        if world is None:
            raise LabgymError(f"policy {self.name!r} needs the world: pass an EpisodeStart with world, as LabNav does")
        floor = world_of(world.solids())
        self._world, self._carries, self._docks = world, episode.beaker is not None, episode.heading is not None
        crowded = world.people([world.time]).shape[1] > 0
        # A robot that carries a liquid brakes by its own schedule.
        short = world.radius - 2.0 * STOP_INSIDE_M if (crowded or self._carries) and not self._docks else 0.0
        self._tolerance = episode.task.dock_slack if self._docks else 0.0
        weights = episode.task.weights
        worth = Worth(1.0, weights.time, weights.people, weights.length)
        errand = Errand(
            world=world,
            paths=floor.paths,
            field=floor.derived("clearance field", ClearanceField),
            short=max(short, self._tolerance),
            heading=world.goal[2] if self._docks else None,
            limits=replace(
                DriveLimits() if episode.beaker is None else gentle_limits(episode.beaker),
                speed=min(world.wheels[0], 1.0) * ROBOT.v_max,
            ),
            taut=worth.way > 0.0,
            weights=(1.0,) if episode.beaker is None else shaping_weights(episode.beaker.frequency, ROBOT.control_dt),
        )
        self._drive = CrowdDrive(errand, worth) if crowded else AloneDrive(errand)

    def act(self, observation: Observation) -> NDArray[np.floating[Any]]:  # noqa: ARG002
        """Follow the plan."""
        v, w = self._drive.wanted()
        forward, turn, veer = self._world.wheels
        return velocities_to_action(v / forward, (w - v / forward * veer) / turn, ROBOT)

    def stop(self, observation: Observation) -> bool:  # noqa: ARG002
        """Whether braking ends inside the disc or, with a heading or a beaker, the robot rests where it should."""
        pose, velocity, goal = self._world.pose, self._world.velocity, self._world.goal
        resting = abs(velocity[0]) <= REST_VELOCITIES[0] and abs(velocity[1]) <= REST_VELOCITIES[1]
        away = math.dist(pose[:2], goal[:2])
        if self._docks:
            off = abs(math.remainder(pose[2] - goal[2], 2.0 * math.pi))
            docked = away <= self._tolerance + DOCK_ERRORS[0] and off <= DOCK_ERRORS[1]
            return resting and self._drive.over > (0.3 if docked else 3.0)
        if away > self._world.radius + 0.5 or (self._carries and not resting):
            return False
        reckoning = DeadReckoning()
        reckoning.pose, reckoning.velocity = pose, velocity
        while max(map(abs, reckoning.velocity)) > REST_VELOCITIES[0] / 4.0:
            reckoning.drive(np.zeros(2))
        return math.dist(reckoning.pose[:2], goal[:2]) <= self._world.radius - STOP_INSIDE_M


def gentle_limits(beaker: Beaker) -> DriveLimits:
    """Return the limits of the motion with a beaker."""
    rim = beaker.freeboard * GRAVITY / (beaker.rise(1.0) * GRAVITY / beaker.frequency**2)
    free = DriveLimits()
    along, across = (share * rim for share in LIQUID_SHARES)
    return DriveLimits(acceleration=min(along, free.acceleration), lateral=min(across, free.lateral))
