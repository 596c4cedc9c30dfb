"""The world of an episode before it begins, and the nuisances of LabNav's tasks, each of which can be switched off.

Each part of an environment draws from a separate generator, so that without one nuisance the others have the same
values in an episode. Drives without a nuisance are not LabNav's.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from labgym.envs.conditions.bodies import Body
from labgym.envs.conditions.cast import cast_of
from labgym.envs.conditions.figures import figure
from labgym.envs.labnav.drawing import draw_floor
from labgym.envs.labnav.episodes import LabNavEpisode, Split
from labgym.envs.labnav.task import Level
from labgym.envs.labnav.tasks import condition_names, config_of, task_of
from labgym.envs.tasks import Task
from labgym.envs.world import world_of
from labgym.errors import OptionError, check_name
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
        check_name(f"condition of {task}-{level}", name, names)
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
    raise OptionError(f"none of the {len(names)} floors of {split} has an episode of {task}-{level} for seed {seed}")


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


ERRORS = {
    "wheels": "errors of the wheels",
    "odometry": "drift of the odometry",
    "noise": "noise of the sensors",
    "mounting": "errors of the sensors' places",
}
"""Nuisances that are properties of a level, and what they are."""
CONDITIONS = {
    "parked": "parked things",
    "changes": "changes since the map",
    "people": "people",
    "station": "move of the station",
    "glass": "panes",
    "payload": "beaker",
}
"""Nuisances that are conditions, by the condition's name, and what they are."""
NUISANCES = ERRORS | CONDITIONS
FLOOR = frozenset({"parked", "changes", "station", "glass"})
"""Nuisances without which the floor, or the goal, is another one: L* is computed anew."""
_EXACT: dict[str, Mapping[str, Any]] = {
    "wheels": {"slip": (0.0, 0.0)},
    "odometry": {"odometry": {}},
    "noise": {"lidar": 0.0, "color": 0.0, "redwood": False},
    "mounting": {"mounting": (0.0, 0.0)},
}
"""Properties of a level without its errors."""


def nuisances_of(task: str, level: int) -> tuple[str, ...]:
    """Return the nuisances of a task at a level, in the order of `NUISANCES`.

    Raises:
        UnknownNameError: there is no such task or level.
    """
    properties = task_of(task).level(level)
    kinds = {_condition(each) for each in properties.conditions}
    return tuple(name for name in NUISANCES if name in kinds or _without_error(properties, name) != properties)


def properties_without(task: str, level: int, nuisances: Sequence[str]) -> Level:
    """Return the properties of a level without some nuisances.

    Raises:
        UnknownNameError: there is no such task or level, or it has no such nuisance.
    """
    _check(task, level, nuisances)
    properties = task_of(task).level(level)
    for name in nuisances:
        properties = _without_error(properties, name)
    if "payload" not in nuisances:
        return properties
    others = tuple(each for each in properties.conditions if _condition(each) != "payload")
    return replace(properties, conditions=others)


def episode_without(
    episode: LabNavEpisode, layout: Layout, task: str, level: int, nuisances: Sequence[str]
) -> LabNavEpisode:
    """Return an episode without some nuisances: the data of conditions is empty, and L* that of the floor without them.

    Args:
        episode: of the task and level, on the layout. layout: as published.
        nuisances: of `nuisances_of(task, level)`.

    Raises:
        UnknownNameError: there is no such task or level, or it has no such nuisance.
    """
    _check(task, level, nuisances)
    data = {name: value for name, value in episode.conditions.items() if name != "payload" or name not in nuisances}
    data |= {name: _nothing(name, data[name]) for name in nuisances if name in data}
    calm = episode.model_copy(update={"conditions": data})
    return _measured(calm, layout, task, level) if FLOOR & set(nuisances) else calm


def _check(task: str, level: int, nuisances: Sequence[str]) -> None:
    names = nuisances_of(task, level)
    for name in nuisances:
        check_name(f"nuisance of {task}-{level}", name, names)


def _measured(episode: LabNavEpisode, layout: Layout, task: str, level: int) -> LabNavEpisode:
    """Return an episode with L* of `Drawn`."""
    true, radius = prepared(task, level, episode, layout), task_of(task).radius
    world = world_of(true.fixed)
    lengths = [round(world.length_to_disc(pair, radius), 6) for pair in (true.pair, *true.following)]
    following = [
        leg.model_copy(update={"length": length}) for leg, length in zip(episode.following, lengths[1:], strict=True)
    ]
    return episode.model_copy(update={"length": lengths[0], "following": tuple(following)})


def _without_error(properties: Level, nuisance: str) -> Level:
    return replace(properties, **_EXACT.get(nuisance, {}))


def _condition(data: Mapping[str, Any]) -> str:
    """Return the name of a condition in a level."""
    return "payload" if data["kind"] == "leg_payload" else str(data["kind"])


def _nothing(condition: str, data: Any) -> Any:
    """Return data of a condition with nothing in it."""
    if condition in ("parked", "changes"):
        return []
    if condition == "station":
        return {**data, "shift": [0.0, 0.0, 0.0]}
    return {**data, {"people": "people", "glass": "panes"}[condition]: []}
