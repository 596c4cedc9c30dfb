"""Vector environments for stable-baselines3: on the compiled kernel where possible, else one environment at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from typing import Any

import gymnasium as gym
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv, VecMonitor

import labgym  # noqa: F401 -- registers the environments
from labgym.envs.config import PointNavConfig
from labgym.envs.presets import presets
from labgym.envs.tasks import FLOORS_TRAIN
from labgym.errors import MissingDependencyError, OptionError, UnknownNameError
from labgym.training.layouts import FirstLayouts
from labgym.training.start_frame import StartFrame

VECTORIZATIONS = ("auto", "kernel", "dummy", "subproc")
MEASURES = ("is_success", "cost", "path_length", "shortest_path_length")
"""The entries of the info that the logs and scores of training need."""


def make_environments(
    environment: str = "LabPointNav-v0", count: int = 64, vectorization: str = "auto", layouts: int = 0, **options: Any
) -> VecEnv:
    """Return `count` environments as a `VecEnv` that records returns and lengths of episodes (`VecMonitor`).

    Goal environments get poses in the frame of the episode's start (`StartFrame`).

    Args:
        environment: id of a registered environment.
        count: number of environments.
        vectorization: "kernel", all on the planar kernel with threads (`LabVecEnv`, extra `fast`); "dummy", one after
            the other in this process; "subproc", one process each; "auto", the kernel if numba is installed and it has
            all parts of the environment, else "dummy", on the planar physics if numba is installed.
        layouts: number of layouts of the splits "train" and "floors-train" (`FirstLayouts`); 0 generates new ones
            without end, which takes longer than driving in them.
        options: arguments of the environment, and `max_episode_steps`, by default that of the id.

    Raises:
        UnknownNameError: there is no such environment, option or vectorization.
        OptionError: a value is out of range, or the kernel lacks a part.
        MissingDependencyError: "kernel" without numba.
    """
    if vectorization not in VECTORIZATIONS:
        raise UnknownNameError("vectorization", vectorization, VECTORIZATIONS)
    if environment not in presets():
        raise UnknownNameError("environment", environment, presets())
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise OptionError(f"number of environments is {count!r}, expected a whole number of at least 1")
    options = {"measures": MEASURES, **options}
    split = options.get("split")
    if layouts and split in ("train", FLOORS_TRAIN):
        training = FirstLayouts(layouts, "rooms" if split == "train" else "floors")
        options |= {"split": "train", "training": training, "episodes_per_layout": 1}
    compiled = find_spec("numba") is not None
    if vectorization == "kernel" or (vectorization == "auto" and compiled):
        if not compiled:
            raise MissingDependencyError("numba", "vectorization 'kernel'", "fast")
        try:
            return VecMonitor(_kernel(environment, count, options))
        except OptionError:
            if vectorization == "kernel":
                raise
    if vectorization == "auto" and compiled:
        options = {"physics": "planar", **options}
    makers: list[Callable[[], gym.Env[Any, Any]]] = [partial(_single, environment, options)] * count
    return VecMonitor(SubprocVecEnv(makers) if vectorization == "subproc" else DummyVecEnv(makers))


def _kernel(environment: str, count: int, options: Mapping[str, Any]) -> VecEnv:
    from labgym.envs.vector.env import check_kernel
    from labgym.envs.vector.stable_baselines import LabVecEnv

    parts = {name: value for name, value in options.items() if name != "max_episode_steps"}
    check_kernel(PointNavConfig.of(environment, {"physics": "planar", **parts}))
    limit = {"max_episode_steps": gym.spec(environment).max_episode_steps}
    return LabVecEnv(count, **{**limit, "config": environment, **options})


def _single(environment: str, options: Mapping[str, Any]) -> gym.Env[Any, Any]:
    made = gym.make(environment, disable_env_checker=True, **options)
    space = made.observation_space
    is_goal = isinstance(space, gym.spaces.Dict) and "achieved_goal" in space.spaces
    return StartFrame(made) if is_goal else made
