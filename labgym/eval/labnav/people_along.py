"""People along a recorded route: where they were while the robot drove it, without the policy."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.cast import cast_of
from labgym.envs.conditions.crowd import REST, Crowd
from labgym.envs.conditions.intentions import DT
from labgym.envs.conditions.orca import Disc, Vector
from labgym.envs.conditions.walking import AT_REST
from labgym.envs.robot import ROBOT
from labgym.envs.state import Pose
from labgym.envs.tasks import Task
from labgym.envs.world import world_of


@dataclass(frozen=True, eq=False)
class PeopleAlong:
    """The people of an episode along a route.

    Attributes:
        places: (t, n, 2) centers at the start and after each control step, meters, room frame.
        yields: whether each person avoids the robot while it moves, (n,).
        least: least distance between the centers of the robot and a person after a control step, meters; None without
            people.
    """

    places: NDArray[np.float64]
    yields: tuple[bool, ...]
    least: float | None


def people_along(task: Task, route: Sequence[Pose]) -> PeopleAlong:
    """Return where people were along a route.

    People depend on the episode and on the motion of the robot alone. The route has the robot's poses every 0.1 s, so
    that its velocity is that between two poses; `least` shows how near the result is to the recorded drive.

    Args:
        task: the episode after its conditions. route: poses at the start and after each control step.

    Raises:
        OptionError: the episode's data does not describe people.
    """
    data = task.conditions.get("people")
    crowd = Crowd(world_of(task.layout), cast_of({} if data is None else data))
    if not crowd.stops or not len(route):
        return PeopleAlong(np.zeros((len(route), 0, 2)), (), None)
    poses = np.asarray(route, dtype=np.float64)
    velocities = velocities_of(poses)
    rest = REST
    places: list[list[Vector]] = []
    for (x, y, _), (vx, vy) in zip(poses.tolist(), velocities.tolist(), strict=True):
        if places:
            rest = 0.0 if math.hypot(vx, vy) >= AT_REST else rest + DT
        places.append(crowd.places)
        crowd.step(Disc(x, y, vx, vy, ROBOT.chassis_radius), rest)
    at = np.array(places, dtype=np.float64)
    away = np.linalg.norm(at - poses[:, None, :2], axis=2)
    return PeopleAlong(at, crowd.yields, float(away.min()))


def velocities_of(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the velocity at each pose of a route, (t, 2) m/s: along its heading, from the way since the last pose."""
    steps = np.diff(poses[:, :2], axis=0)
    along = np.column_stack([np.cos(poses[1:, 2]), np.sin(poses[1:, 2])])
    speeds = (steps * along).sum(axis=1) / ROBOT.control_dt
    return np.concatenate([np.zeros((1, 2)), speeds[:, None] * along])
