"""The configurations of the registered environments, and a user's configuration by name, file or mapping."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import fields, replace
from functools import cache
from pathlib import Path
from typing import Any

from labgym.documents import read_json, read_yaml
from labgym.envs.checks import record_of
from labgym.envs.config import LABNAV, OBSERVATIONS, PointNavConfig
from labgym.envs.labnav.curriculum import RULES, Curriculum
from labgym.envs.labnav.task import STOPS, Stop
from labgym.envs.labnav.tasks import HEADLINE, TASKS, config_of
from labgym.envs.parts.actions import DiscreteActions
from labgym.envs.parts.endings import REST_DISTANCE, RestEnding, StopEnding
from labgym.envs.parts.goals import GoalEnding, GoalTerm
from labgym.envs.parts.measures import EXTENDED
from labgym.envs.parts.rays import LidarSensor
from labgym.envs.parts.rewards import RewardWeights
from labgym.envs.parts.vectors import JointSensor, PlaceSensor, PoseSensor, VelocitySensor
from labgym.envs.tasks import TRAINING_SPLITS
from labgym.errors import DocumentError, OptionError, UnknownArgumentError, UnknownNameError, check_name, refuse_idle

MAX_FILE_BYTES = 2**18
"""Largest size of a file; PyYAML takes 20 s for a megabyte."""
_PLACE = re.compile(r"[^\W\d][\w.]*:[^\W\d][\w.]*")
"""A class or a function as "module:name", which is imported and called."""


def read_mapping(path: str | Path) -> Mapping[str, Any]:
    """Return the mapping in a .json or .yaml file, which is data: it may name no code.

    Raises:
        DocumentError: the file cannot be read, exceeds the limits of documents, holds something else than a mapping, or
            names a class or a function as "module:name".
        MissingDependencyError: PyYAML is not installed.
    """
    path = Path(path)
    if path.suffix in (".yaml", ".yml"):
        data = read_yaml(path, MAX_FILE_BYTES, f"reading {path.name}")
    else:
        data = read_json(path, MAX_FILE_BYTES)
    if not isinstance(data, Mapping):
        raise DocumentError(path, "", f"holds a {type(data).__name__}, expected a mapping of arguments")
    for text in _texts(data):
        if _PLACE.fullmatch(text):
            raise DocumentError(
                path, "", f"names the code {text[:80]!r}, which runs; if you trust it, pass the content as a mapping"
            )
    return data


def _texts(data: Any) -> Iterator[str]:
    """Yield the texts in plain data."""
    if isinstance(data, str):
        yield data
    elif isinstance(data, Mapping):
        for value in data.values():
            yield from _texts(value)
    elif isinstance(data, list | tuple | set):
        for value in data:
            yield from _texts(value)


CHOICE = (
    "split",
    "layout",
    "protocol",
    "profile",
    "episodes_per_layout",
    "training",
    "pool",
    "resident_mb",
    "drives",
    "floors",
)
"""Arguments that choose the task of an episode, which the argument `tasks` replaces."""
GENERATED = ("profile", "episodes_per_layout", "training", "pool")
"""Arguments of generated layouts."""
PICTURE = ("width", "height", "quality")
"""Arguments of the image from behind and above the robot."""


def check_effects(config: PointNavConfig, names: Collection[str]) -> None:
    """Refuse arguments that have no effect in a configuration.

    Args:
        names: the arguments that were passed; those that have their default are not checked.

    Raises:
        OptionError: an argument has no effect; names the reason and the remedy.
        UnknownNameError: `onward` names an ending that does not exist.
    """
    passed = [each.name for each in fields(config) if each.name in names and getattr(config, each.name) != each.default]
    for name in passed:
        reason = _reason(config, name, passed)
        refuse_idle(((f"{name}={str(getattr(config, name))[:60]!r}", bool(reason), reason),))
    if "onward" in passed:
        endings = [ending.name for ending in config.endings]
        for name in config.onward:
            check_name("ending in onward", name, endings)


def _reason(config: PointNavConfig, name: str, passed: Collection[str]) -> str:
    """Return why an argument has no effect, and the remedy; "" if it has one."""
    if name in CHOICE and config.tasks is not None:
        return "with tasks, which choose layout and drive: leave one of the two out"
    if name in ("split", *GENERATED, "resident_mb") and config.layout is not None:
        return "with a fixed layout: leave one of the two out"
    if name in GENERATED and config.split not in TRAINING_SPLITS:
        return f"in split {config.split!r}, whose layouts are published: pass split='train' or split='floors-train'"
    if name == "floors" and not config.drives.startswith(LABNAV):
        return "here: only LabNav ids draw from a pack"
    if name in ("split", "layout", "protocol", *GENERATED) and config.floors is not None:
        return "with floors, a pack of floors with their episodes: leave one of the two out"
    if name == "distance_to_go" and config.rewards is not None:
        return "on these reward terms: pass rewards, such as rewards=[{'kind': 'progress', 'method': 'exact'}, ...]"
    if name == "observation" and "sensors" in passed:
        return "with sensors: pass one of the two"
    # Gymnasium's checker makes every render mode with the same arguments.
    if name in PICTURE and config.render_mode is None:
        return "without a render mode: pass render_mode='rgb_array'"
    if name == "onward" and config.tasks is None and config.drives == "pair":
        return "in episodes of one drive: pass drives='protocol'"
    return ""


FLOORS = "floors-train"
"""The split of the ids on floors and of the tasks of LabNav."""


@cache
def presets() -> dict[str, PointNavConfig]:
    """Return the configurations by environment id."""
    first = PointNavConfig(
        split=FLOORS,
        distance_to_go="exact",
        endings=(RestEnding(),),
        disc=REST_DISTANCE,
        measures=EXTENDED,
    )
    joint = JointSensor(sensors=(PoseSensor(), VelocitySensor(), LidarSensor()))
    return {
        "LabPointNav-v0": PointNavConfig(),
        "LabFloorNav-v0": first,
        "LabFloorNavDepth-v0": replace(first, observation="depth"),
        "LabFloorNavRGBD-v0": replace(first, observation="rgbd"),
        "LabFloorNavDiscrete-v0": replace(first, actions=DiscreteActions(), endings=(StopEnding(),)),
        "LabFloorNavGoal-v0": replace(
            first,
            sensors=(joint, PlaceSensor("achieved_goal", "robot"), PlaceSensor("desired_goal", "goal")),
            rewards=(GoalTerm(),),
            endings=(GoalEnding(),),
        ),
        "LabProtocolNav-v0": replace(first, drives="protocol", measures=(*EXTENDED, "leg", "legs")),
        **{labnav_id(task): _labnav(task) for task in TASKS},
    }


def labnav_id(task: str) -> str:
    """Return the id of the environment of a LabNav task."""
    return f"LabNav{task.capitalize()}-v0"


def labnav_config_name(task: str, level: int, observation: str) -> str:
    """Return the name for `preset` of a LabNav task at a level with an observation, such as "labnav-people-3-rgbd"."""
    return f"{LABNAV}{task}-{level}-{observation}"


def _labnav(
    task: str, level: int = HEADLINE, observation: str = "lidar", stop: Stop | None = "brake"
) -> PointNavConfig:
    return config_of(task, level, observation, stop, split=FLOORS, drives=f"{LABNAV}{task}-{level}")


def preset(name: str) -> PointNavConfig:
    """Return the configuration of a registered environment, or of a LabNav task at any level with any observation.

    Args:
        name: an id, or a name such as "labnav-people-3-rgbd".

    Raises:
        UnknownNameError: no environment has that id, or the task, level or observation does not exist.
    """
    if name in presets():
        return presets()[name]
    task, _, rest = name.removeprefix(LABNAV).partition("-")
    level, _, observation = rest.partition("-")
    if not name.startswith(LABNAV) or not level.isdecimal():
        kind = 'configuration (an id, "labnav-TASK-LEVEL-OBSERVATION", or a .json or .yaml file)'
        raise UnknownNameError(kind, name, presets())
    return _labnav(task, int(level), observation or "lidar")


def configured(
    config: PointNavConfig | Mapping[str, Any] | str | Path | None, options: Mapping[str, Any]
) -> PointNavConfig:
    """Return a configuration with some fields replaced.

    Args:
        config: a configuration, a mapping of its fields, the path of a .json or .yaml file of one, or the id of a
            registered environment; None for the defaults.
        options: values of fields; of a LabNav task, also its `level`, how an agent ends a drive (`stop`), and the rule
            of its `curriculum`.

    Raises:
        UnknownArgumentError: no field has that name.
        OptionError: a value is out of range or of the wrong type, or an argument has no effect.
        DocumentError: the file is not a mapping, or names code ("module:Class"), which only a mapping may.
        MissingDependencyError: PyYAML is not installed.
    """
    if isinstance(config, str | Path):
        name, config = config, _named_config(config)
        if isinstance(config, PointNavConfig) and config.drives.startswith(LABNAV):
            if options.get("curriculum") is not None:
                return _on_ladder(name, options)
            config, options = _labnav_config(config, options)
    if config is not None and not isinstance(config, PointNavConfig | Mapping):
        raise OptionError(f"config is a {type(config).__name__}, expected a PointNavConfig, a mapping or a path")
    names = [each.name for each in fields(PointNavConfig)]
    for name in (*(config if isinstance(config, Mapping) else ()), *options):
        if name not in names:
            raise UnknownArgumentError("the environment", name, names)
    _check_observation(config, options)
    if isinstance(config, PointNavConfig):
        passed = set(options)
        config = replace(config, **_reward(config, options)) if options else config
    else:
        passed = {*(config or {}), *options}
        config = PointNavConfig(**{**(config or {}), **options})
    check_effects(config, passed)
    return config


def _reward(config: PointNavConfig, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return options whose weights are complete, and whose terms of the reward take the place of the weights."""
    weights = options.get("weights")
    if isinstance(weights, Mapping) and isinstance(config.weights, RewardWeights):
        return {**options, "weights": record_of(weights, config.weights, "weights", "reward term")}
    return {"weights": None, **options} if options.get("rewards") is not None else dict(options)


def _named_config(name: str | Path) -> PointNavConfig | Mapping[str, Any]:
    return read_mapping(name) if Path(name).suffix in (".json", ".yaml", ".yml") else preset(str(name))


MIXED_TASKS = ("aisle", "people", "odometry", "glass")
"""Tasks that the curriculum "tasks" adds: the planar kernel has all their parts, and a drive ends at a point."""
ROOM_OPTIONS = ("split", "floors", "training", "pool", "episodes_per_layout")
"""Options that choose floors, which the rung of rooms does not take over."""


def _on_ladder(name: str | Path, options: Mapping[str, Any]) -> PointNavConfig:
    """Return a LabNav configuration with the rungs of its curriculum.

    Raises:
        UnknownNameError: there is no such rule, or no such level.
        OptionError: `tasks` choose the episodes.
    """
    rule = options["curriculum"]
    check_name("curriculum", rule, RULES)
    for other in ("tasks", "drives"):
        refuse_idle((("curriculum", options.get(other) is not None, f"with {other}: leave one of the two out"),))
    own = {key: value for key, value in options.items() if key != "curriculum"}
    last = configured(name, own)
    rooms = {key: value for key, value in own.items() if key not in ROOM_OPTIONS}
    # A pack needs no generator: with it the ladder begins on its floors.
    rungs = [] if own.get("floors") else [configured(name, {**rooms, "split": "train", "level": 0})]
    level = int(last.drives.split("-")[-1])
    rungs += [configured(name, {**own, "level": each}) for each in range(level)]
    if rule == "tasks":
        others = [each for each in MIXED_TASKS if last.drives != f"{LABNAV}{each}-{level}"]
        rungs += [configured(labnav_id(each), {**own, "level": rung}) for each in others for rung in range(level + 1)]
    return replace(last, curriculum=Curriculum(rule, (*rungs, last)))


def _labnav_config(config: PointNavConfig, options: Mapping[str, Any]) -> tuple[PointNavConfig, Mapping[str, Any]]:
    """Return a LabNav configuration with level, observation and stop of the options, and the remaining options.

    Raises:
        UnknownNameError: the task has no such level, or there is no such way to stop.
        OptionError: `stop` has no effect.
    """
    task, level = config.drives.removeprefix(LABNAV).split("-")
    observation = config.observation if "sensors" in options else options.get("observation", config.observation)
    own = {name: value for name, value in options.items() if name not in ("level", "stop")}
    refuse_idle((("stop", "stop" in options and "actions" in options, "with actions: leave one of the two out"),))
    stop = options.get("stop", "brake")
    check_name("stop", stop, STOPS)
    if not {"level", "stop"} & set(options) and observation == config.observation:
        return config, own
    return _labnav(task, options.get("level", int(level)), observation, stop), own


def _check_observation(config: PointNavConfig | Mapping[str, Any] | None, options: Mapping[str, Any]) -> None:
    """Refuse an observation that the sensors of the configuration would override.

    Raises:
        OptionError: the options have another observation than the configuration, and the configuration has sensors.
    """
    if "observation" not in options or options.get("sensors") is not None or config is None:
        return
    own = config if isinstance(config, Mapping) else vars(config)
    if own.get("sensors") is not None and options["observation"] != own.get("observation", OBSERVATIONS[0]):
        raise OptionError(
            f"observation={options['observation']!r} has no effect, because this configuration lists its sensors: "
            "pass sensors instead, such as sensors=['goal', 'velocity', 'depth']"
        )
