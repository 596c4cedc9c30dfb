"""Vector environments for stable-baselines3: on the compiled kernel, in processes, or one after the other."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib.util import find_spec
from typing import Any, NoReturn

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv, VecEnv, VecEnvWrapper, VecMonitor
from tqdm import tqdm

import labgym  # noqa: F401 -- registers the environments
from labgym.counts import MAX_PROCESSES, PROCESS_MB, SINGLE_MB, check_memory, whole_number
from labgym.envs.conditions.changes import Changes
from labgym.envs.config import PointNavConfig
from labgym.envs.presets import configured, presets
from labgym.envs.training import LayoutSource, TrainingRooms, training_floor
from labgym.envs.vector.arguments import kernel_has
from labgym.envs.vector.processes import processors
from labgym.envs.world import keep
from labgym.errors import MissingDependencyError, OptionError, SearchLimitWarning, check_name
from labgym.layouts import Layout
from labgym.policies.adapters.inputs import NEAR_GOAL_SCALE, near_goal

RESIDENT_MB = 2048.0
"""Budget of a process for prepared training layouts, megabytes; with the lidar, a room takes 2 MB."""
SOURCES: dict[str, LayoutSource] = {"train": TrainingRooms(), "floors-train": training_floor}
"""The layouts of each training split."""


@dataclass(frozen=True)
class FirstLayouts:
    """The first layouts of a source of training layouts, drawn again and again.

        LabVecEnv(64, split="train", training=FirstLayouts(64), episodes_per_layout=1)

    A process generates each layout once, when it is first drawn, and keeps it prepared.

    Attributes:
        count: number of layouts.
        split: "train" or "floors-train".

    Raises:
        OptionError: the count is not a whole number of at least 1.
        UnknownNameError: the split has no training layouts.
    """

    count: int
    split: str = "train"

    def __post_init__(self) -> None:
        whole_number("layouts", self.count)
        check_name("split of training layouts", self.split, SOURCES)

    def __call__(self, number: int) -> Layout:
        """Return layout `number` modulo the count."""
        layout = _layout(self.split, number % self.count)
        keep(layout, RESIDENT_MB)
        return layout


@lru_cache(maxsize=4096)
def _layout(split: str, number: int) -> Layout:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SearchLimitWarning)  # Less furniture than the room holds is no loss here.
        layout = SOURCES[split](number)
    for bar in _bars:
        bar.update()
        if bar.n >= bar.total:
            bar.close()
    return layout


_bars: list[tqdm[NoReturn]] = []
"""Bars that count the layouts which this process generates."""


@contextmanager
def layout_progress(count: int) -> Iterator[None]:
    """Show on a terminal, on stderr, how many of `count` layouts this process has generated, until all are."""
    with tqdm(total=count, desc="training layouts", unit="layout", disable=None, leave=False) as bar:
        _bars.append(bar)
        try:
            yield
        finally:
            _bars.remove(bar)


VECTORIZATIONS = ("auto", "kernel", "processes", "dummy", "subproc")
MEASURES = ("is_success", "cost", "path_length", "shortest_path_length")
"""The entries of the info that the logs and scores of training need."""
NEAR_GOAL = "near_goal"
"""Entry of the observation that holds the goal up close."""
CHOICES = ("floors", "layout", "tasks", "training", "profile", "episodes_per_layout", "protocol")
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
            of them in one process per processor, which takes the kernel if it has all parts (`LabVecEnv`); "dummy",
            one after the other in this process; "subproc", one process each. "auto" takes the kernel if numba is
            installed and it has all parts of the environment, otherwise "dummy"; both it and "processes" take the
            planar physics if numba is installed, nothing is pushed and `physics` is not passed. Make processes under
            `if __name__ == "__main__":`.
        layouts: number of layouts of the splits "train" and "floors-train" (`FirstLayouts`), for ids with such a split
            too; 0 generates new ones without end, which takes longer than driving in them.
        options: arguments of the environment, and `max_episode_steps`, by default that of the id.

    Raises:
        UnknownNameError: there is no such environment, option or vectorization.
        OptionError: a value is out of range, `layouts` has no effect, or the kernel lacks a part.
        MissingDependencyError: "kernel" without numba.
    """
    check_name("vectorization", vectorization, VECTORIZATIONS)
    check_name("environment", environment, presets())
    whole_number("number of environments", count)
    whole_number("layouts", layouts, 0)
    options = {"measures": MEASURES, **options}
    if layouts:
        options |= _first_layouts(environment, layouts, options)
    compiled = find_spec("numba") is not None
    if vectorization == "kernel" and not compiled:
        raise MissingDependencyError("numba", "vectorization 'kernel'", "fast")
    if vectorization in ("auto", "processes") and compiled and not _pushes(environment, options):
        options = {"physics": "planar", **options}
    if vectorization == "auto":
        vectorization = "kernel" if compiled and kernel_has(_config(environment, options)) else "dummy"
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


def _pushes(environment: str, options: Mapping[str, Any]) -> bool:
    """Whether the robot can push things in the environment, which the planar physics does not move."""
    rungs = _config(environment, options).rungs
    return any(isinstance(each, Changes) and each.pushable for rung in rungs for each in rung.conditions)


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


Observation = dict[str, NDArray[np.float32]]


class StartFrame(gym.ObservationWrapper[Observation, NDArray[np.float32], Observation]):
    """`LabFloorNavGoal-v0` with poses and positions in the start frame: origin at the robot's start, x ahead, y left.

    `LabFloorNavGoal-v0` gives poses in the room frame, which a robot without a map does not know. In the start frame
    they are what a `Policy` receives: odometry and goal. Rewards depend on distances alone and stay the same.

    Args:
        env: an environment whose `observation` begins with x, y, cosine and sine of the yaw.
    """

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        super().__init__(env)
        self._place = np.zeros(2)
        self._axes = np.eye(2)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; its first pose is the frame."""
        observation, info = self.env.reset(seed=seed, options=options)
        x, y, cosine, sine = observation["observation"][:4].astype(np.float64).tolist()
        self._place, self._axes = np.array([x, y]), np.array([[cosine, sine], [-sine, cosine]])
        return self.observation(observation), info

    def observation(self, observation: Observation) -> Observation:
        """Return an observation in the start frame."""
        joint = observation["observation"].astype(np.float32)
        joint[:2], joint[2:4] = self._local(joint[:2]), self._axes @ joint[2:4]
        return {
            "observation": joint,
            "achieved_goal": self._local(observation["achieved_goal"]),
            "desired_goal": self._local(observation["desired_goal"]),
        }

    def _local(self, position: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return a position (2,) in the start frame."""
        return (self._axes @ (position - self._place)).astype(np.float32)


class NearGoal(VecEnvWrapper):
    """Environments whose observation has the entry `near_goal`, as `labgym.policies.adapters.inputs`.

    Args:
        venv: environments that observe `goal`.

    Raises:
        OptionError: they do not.
    """

    def __init__(self, venv: VecEnv) -> None:
        space = venv.observation_space
        if not isinstance(space, spaces.Dict) or "goal" not in space.spaces:
            raise OptionError("near_goal needs environments whose observation has the entry goal")
        self.observation_space: spaces.Dict
        entry = spaces.Box(-NEAR_GOAL_SCALE, NEAR_GOAL_SCALE, (3,), np.float32)
        super().__init__(venv, spaces.Dict({**space.spaces, NEAR_GOAL: entry}))

    def reset(self) -> Any:
        """Begin the episodes of all environments."""
        return _extended(self.venv.reset())

    def step_wait(self) -> Any:
        """Carry out the actions."""
        observations, rewards, dones, infos = self.venv.step_wait()
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = _extended(info["terminal_observation"])
        return _extended(observations), rewards, dones, infos


class Entries(VecEnvWrapper):
    """Environments whose observation has some of its entries alone, in the order of the names.

    Args:
        venv: environments with a `Dict` observation. names: of the entries.

    Raises:
        UnknownNameError: an entry does not exist.
        OptionError: the observation has no entries.
    """

    def __init__(self, venv: VecEnv, names: Sequence[str]) -> None:
        space = venv.observation_space
        if not isinstance(space, spaces.Dict):
            raise OptionError("observe needs environments whose observation is a Dict")
        for name in names:
            check_name("entry of the observation", name, space.spaces)
        super().__init__(venv, spaces.Dict({name: space.spaces[name] for name in names}))
        self._names = tuple(names)

    def reset(self) -> Any:
        """Begin the episodes of all environments."""
        return self._chosen(self.venv.reset())

    def step_wait(self) -> Any:
        """Carry out the actions."""
        observations, rewards, dones, infos = self.venv.step_wait()
        for info in infos:
            if "terminal_observation" in info:
                info["terminal_observation"] = self._chosen(info["terminal_observation"])
        return self._chosen(observations), rewards, dones, infos

    def _chosen(self, observation: Any) -> dict[str, Any]:
        return {name: observation[name] for name in self._names}


def _extended(observation: Any) -> dict[str, Any]:
    return {**observation, NEAR_GOAL: near_goal(observation["goal"])}
