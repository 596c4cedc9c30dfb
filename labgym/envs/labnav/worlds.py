"""The world of an episode before it begins, without physics."""

from __future__ import annotations

import math

import numpy as np

from labgym.envs.conditions.bodies import Body
from labgym.envs.conditions.cast import cast_of
from labgym.envs.conditions.figures import figure
from labgym.envs.labnav.drawing import draw_floor
from labgym.envs.labnav.episodes import LabNavEpisode, Split
from labgym.envs.labnav.tasks import condition_names, config_of, task_of
from labgym.envs.tasks import Task
from labgym.errors import OptionError, UnknownNameError
from labgym.layouts import Layout, load_published, published

DRAWS = 100
"""Number of drives that are drawn on a floor before the next one is tried."""
HERE = 0.1
"""A stop nearer than this is where a person stands, meters."""


def prepared(task: str, level: int, episode: LabNavEpisode, layout: Layout) -> Task:
    """Return the task of an episode after its conditions: the true floor, the map, and what can be pushed.

    Args:
        task, level: of LabNav. episode: on the layout. layout: as published.

    Raises:
        UnknownNameError: there is no such task or level, or it has no condition of that name.
        OptionError: the data of a condition is not of this layout.
    """
    names = condition_names(task, level)
    for name in episode.conditions:
        if name not in names:
            raise UnknownNameError(f"condition of {task} {level}", name, names)
    now = episode.task(layout)
    for condition in config_of(task, level).conditions:
        name = condition.name
        data = now.conditions[name] if name in now.conditions else condition.draw(now, np.random.default_rng(0))
        now = condition.prepare(now, data)
    return now


def drawn_episode(task: str, level: int, seed: int, split: Split = "floors-val") -> tuple[Layout, LabNavEpisode]:
    """Return an episode drawn by the rules of the suites, and its floor.

    Args:
        task, level: of LabNav. seed: random seed; it chooses the floor, too.
        split: of the floor.

    Raises:
        UnknownNameError: there is no such task or level.
        OptionError: the seed is below 0, or no floor of the split has such an episode.
    """
    if seed < 0:
        raise OptionError(f"seed is {seed}, expected at least 0")
    task_of(task).level(level)
    names = published(split)
    first = int(np.random.default_rng(seed).integers(len(names)))
    for name in (*names[first:], *names[:first]):
        layout = load_published(split, name)
        episodes, _ = draw_floor(layout, task, level, 1, seed, DRAWS)
        if episodes:
            return layout, episodes[0]
    raise OptionError(f"none of the {len(names)} floors of {split} has an episode of {task} {level} for seed {seed}")


def people_at_start(task: Task) -> tuple[Body, ...]:
    """Return the bodies of the people of an episode where they start, each facing the first place on the way."""
    bodies: list[Body] = []
    data = task.conditions.get("people")
    for number, role in enumerate(() if data is None else cast_of(data).people):
        (x, y), yaw, walks = role.start, 0.0, False
        for stop_x, stop_y, stop_yaw, _ in role.stops:
            walks = math.dist((x, y), (stop_x, stop_y)) > HERE
            yaw = math.atan2(stop_y - y, stop_x - x) if walks else stop_yaw
            if walks:
                break
        bodies += figure(number, x, y, yaw, 0.0, walks)
    return tuple(bodies)
