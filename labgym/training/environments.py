"""Vector environments for stable-baselines3: on the compiled kernel, in processes, or one after the other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from typing import Any

import gymnasium as gym
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv, VecMonitor

import labgym  # noqa: F401 -- registers the environments
from labgym.counts import MAX_PROCESSES, PROCESS_MB, SINGLE_MB, check_memory, whole_number
from labgym.envs.config import PointNavConfig
from labgym.envs.presets import configured, presets
from labgym.envs.vector.processes import processors
from labgym.errors import MissingDependencyError, OptionError, UnknownNameError
from labgym.training.layouts import SOURCES, FirstLayouts
from labgym.training.start_frame import StartFrame

VECTORIZATIONS = ("auto", "kernel", "processes", "dummy", "subproc")
MEASURES = ("is_success", "cost", "path_length", "shortest_path_length")
"""The entries of the info that the logs and scores of training need."""
CHOICES = ("layout", "tasks", "training", "profile", "episodes_per_layout", "protocol")
"""Arguments of an environment that choose its layouts otherwise than `layouts` does."""


def make_environments(
    environment: str = "LabPointNav-v0", count: int = 64, vectorization: str = "auto", layouts: int = 0, **options: Any
) -> VecEnv:
    """Return `count` environments as a `VecEnv` that records returns and lengths of episodes (`VecMonitor`).

    Goal environments get poses in the frame of the episode's start (`StartFrame`).

    Args:
        environment: id of a registered environment.
        count: number of environments.
        vectorization: "kernel", all on the planar kernel with threads (`LabVecEnv`, extra `fast`); "processes", shares
            of them in one process per processor (`LabVecEnv`); "dummy", one after the other in this process; "subproc",
            one process each. "auto" takes the kernel if numba is installed and it has all parts of the environment,
            otherwise "dummy", with the planar physics if numba is installed and `physics` is not passed. Make
            processes under `if __name__ == "__main__":`.
        layouts: number of layouts of the splits "train" and "floors-train" (`FirstLayouts`), for ids with such a split
            too; 0 generates new ones without end, which takes longer than driving in them.
        options: arguments of the environment, and `max_episode_steps`, by default that of the id.

    Raises:
        UnknownNameError: there is no such environment, option or vectorization.
        OptionError: a value is out of range, `layouts` has no effect, or the kernel lacks a part.
        MissingDependencyError: "kernel" without numba.
    """
    if vectorization not in VECTORIZATIONS:
        raise UnknownNameError("vectorization", vectorization, VECTORIZATIONS)
    if environment not in presets():
        raise UnknownNameError("environment", environment, presets())
    whole_number("number of environments", count)
    whole_number("layouts", layouts, 0)
    options = {"measures": MEASURES, **options}
    if layouts:
        options |= _first_layouts(environment, layouts, options)
    compiled = find_spec("numba") is not None
    if vectorization == "kernel" and not compiled:
        raise MissingDependencyError("numba", "vectorization 'kernel'", "fast")
    if vectorization == "auto":
        options = {"physics": "planar", **options} if compiled else options
        vectorization = "kernel" if compiled and _kernel_has(_config(environment, options)) else "dummy"
    if vectorization in ("kernel", "processes"):
        return VecMonitor(_together(environment, count, options, vectorization))
    if vectorization == "subproc":
        whole_number("number of environments of 'subproc'", count, most=MAX_PROCESSES)
        check_memory("number of environments", count, 1e6 * PROCESS_MB)
    else:
        check_memory("number of environments", count, 1e6 * SINGLE_MB)
    makers: list[Callable[[], gym.Env[Any, Any]]] = [partial(_single, environment, options)] * count
    return VecMonitor(SubprocVecEnv(makers) if vectorization == "subproc" else DummyVecEnv(makers))


def _first_layouts(environment: str, count: int, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the options that let environments drive in the first training layouts of their split.

    Raises:
        OptionError: other options choose the layouts, or the split has published ones.
    """
    others = [name for name in CHOICES if options.get(name) is not None]
    if others:
        raise OptionError(f"layouts={count} has no effect with {others[0]}: leave one of the two out")
    split = _config(environment, options).split
    if split not in SOURCES:
        raise OptionError(
            f"layouts={count} has no effect in split {split!r}, whose layouts are published: pass split='train' or "
            "split='floors-train'"
        )
    return {"split": "train", "training": FirstLayouts(count, split), "episodes_per_layout": 1}


def _kernel_has(config: PointNavConfig) -> bool:
    """Whether the planar kernel has all parts of a configuration."""
    from labgym.envs.vector.env import check_kernel

    try:
        check_kernel(config)
    except OptionError:
        return False
    return True


def _together(environment: str, count: int, options: Mapping[str, Any], vectorization: str) -> VecEnv:
    """Return the vector environment of labgym.

    Raises:
        OptionError: the kernel lacks a part, or it is a goal environment, which needs `StartFrame`.
    """
    from labgym.envs.vector.stable_baselines import LabVecEnv

    config = _config(environment, options if vectorization == "processes" else {"physics": "planar", **options})
    processes = None
    if vectorization == "kernel":
        from labgym.envs.vector.env import check_kernel

        check_kernel(config)
    elif _is_goal(config):
        raise OptionError("goal environments do not run with vectorization 'processes': use 'dummy' or 'subproc'")
    else:
        processes = processors()
    spec: Any = gym.spec(environment)
    limit = options.get("max_episode_steps", spec.max_episode_steps)
    return LabVecEnv(count, max_episode_steps=limit, processes=processes, config=config, physics=config.physics)


def _config(environment: str, options: Mapping[str, Any]) -> PointNavConfig:
    parts = {name: value for name, value in options.items() if name != "max_episode_steps"}
    return configured(environment, parts)


def _is_goal(config: PointNavConfig) -> bool:
    return any(sensor.name == "achieved_goal" for sensor in config.observed)


def _single(environment: str, options: Mapping[str, Any]) -> gym.Env[Any, Any]:
    # From its description, an older version is made without Gymnasium's warning.
    single = gym.make(gym.spec(environment), disable_env_checker=True, **options)
    return StartFrame(single) if _is_goal(_config(environment, options)) else single
