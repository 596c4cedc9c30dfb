"""Tasks with fixed data of a condition, at a place with free floor ahead."""

from __future__ import annotations

import numpy as np
from laboratories import island_laboratory

from labgym.envs.tasks import Task
from labgym.envs.world import world_of
from labgym.navigation import GoalPair
from labgym.navigation.goals import ANYWHERE

LAYOUT = island_laboratory()


def free_pose(layout):
    """Return a pose in the laboratory that looks along +x with 2.5 m of free floor before it."""
    world = world_of(layout)
    for x in np.arange(0.6, 5.0, 0.1):
        for y in np.arange(0.6, 8.0, 0.1):
            if all(world.clearance(x + d, y + s, 0.3) > 0.1 for d in np.arange(0.0, 2.6, 0.2) for s in (-0.4, 0.4)):
                return float(x), float(y), 0.0
    raise AssertionError("no free place")


POSE = free_pose(LAYOUT)


class Fixed:
    """Draws one task with fixed data of a condition."""

    def __init__(self, condition, data, layout=LAYOUT, pose=POSE):
        goal = (pose[0] + 2.0, pose[1], 0.0)
        self.task = Task(layout, None, GoalPair(-1, pose, goal, ANYWHERE, ANYWHERE), conditions={condition: data})

    def draw(self, rng, options, fresh):
        return self.task

    def close(self):
        pass
