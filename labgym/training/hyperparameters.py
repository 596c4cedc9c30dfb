"""Hyperparameters of a training, by environment, in YAML files in the format of RL Baselines3 Zoo."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from stable_baselines3.common.utils import LinearSchedule

from labgym.counts import MAX_COUNT, MAX_STEPS, check_switch, whole_number
from labgym.envs.presets import read_mapping
from labgym.errors import DocumentError, OptionError, UnknownNameError, check_name
from labgym.policies.adapters.actor_file import ACTIVATIONS
from labgym.training.export import EXTRACTORS
from labgym.training.limits import ARGUMENTS, LINEAR, NORMALIZATION, Limit

FOLDER = Path(__file__).parent / "hyperparams"
COMMON = "LabNav"
"""Entry of a file for all environments whose ids begin so, as `atari` in the Zoo."""
ROLLOUTS = {"ppo": 2048, "recurrent-ppo": 128}
"""The defaults of `n_steps`."""


@dataclass(frozen=True)
class Hyperparameters:
    """The hyperparameters of a training.

    Attributes:
        algorithm: "ppo", "recurrent-ppo", "sac", or "her", which is SAC with hindsight experience replay.
        environment: id of the environment.
        n_envs: number of environments. n_timesteps: control steps, summed over the environments.
        policy: policy of stable-baselines3.
        normalize: False; True, for observations and rewards; or arguments of `VecNormalize`.
        near_goal: whether the observation also has the goal up close (`labgym.training.run`).
        observe: entries of the observation that the policy sees; empty for all.
        frame_stack: number of observations that it sees at a time, the last one and those before.
        layouts: number of generated layouts to train in (`FirstLayouts`); 0 generates new ones without end.
        env_kwargs: arguments of the training environments. eval_env_kwargs: those that differ in evaluations.
        imitation: control steps at the beginning in which the policy imitates an expert that plans on scans
            (`labgym.training.guided`); of "ppo" and "recurrent-ppo".
        eval_freq: control steps between two evaluations, each followed by a checkpoint.
        n_eval_episodes: episodes of an evaluation.
        arguments: arguments of the algorithm, as plain data. A number that falls linearly to 0 is "lin_0.001".
    """

    algorithm: str
    environment: str
    n_envs: int
    n_timesteps: int
    policy: str = "MultiInputPolicy"
    normalize: bool | Mapping[str, Any] = False
    near_goal: bool = False
    observe: tuple[str, ...] = ()
    frame_stack: int = 1
    layouts: int = 0
    imitation: int = 0
    env_kwargs: Mapping[str, Any] = field(default_factory=dict)
    eval_env_kwargs: Mapping[str, Any] = field(default_factory=dict)
    eval_freq: int = 100_000
    n_eval_episodes: int = 100
    arguments: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name, least, most in (
            ("n_envs", 1, MAX_COUNT),
            ("n_timesteps", 1, MAX_STEPS),
            ("eval_freq", 1, MAX_STEPS),
            ("n_eval_episodes", 1, MAX_COUNT),
            ("layouts", 0, MAX_COUNT),
            ("imitation", 0, MAX_STEPS),
            ("frame_stack", 1, 64),
        ):
            whole_number(name, getattr(self, name), least, most)
        check_switch("near_goal", self.near_goal)
        if self.imitation and self.algorithm not in ROLLOUTS:
            raise OptionError(f"{self.algorithm} has no imitation: {' and '.join(ROLLOUTS)} have it")
        if not isinstance(self.observe, list | tuple) or not all(isinstance(name, str) for name in self.observe):
            raise OptionError(f"observe is {self.observe!r}, expected names of entries, such as [goal, lidar]")
        if not isinstance(self.policy, str):
            raise OptionError(f"policy is {self.policy!r}, expected the name of a policy, such as MultiInputPolicy")
        if not isinstance(self.normalize, bool | Mapping):
            raise OptionError(f"normalize is {self.normalize!r}, expected true, false or arguments of VecNormalize")
        for name in ("env_kwargs", "eval_env_kwargs"):
            if not isinstance(getattr(self, name), Mapping):
                raise OptionError(f"{name} is {getattr(self, name)!r}, expected a mapping of arguments")
        own = {each.name for each in fields(self)} - {"algorithm", "environment", "arguments"}
        _check(f"hyperparameter of {self.algorithm}", self.arguments, ARGUMENTS[self.algorithm], own)
        if isinstance(self.normalize, Mapping):
            _check("argument of normalize", self.normalize, NORMALIZATION)

    @classmethod
    def load(
        cls, algorithm: str, environment: str, path: Path | None = None, changes: Mapping[str, Any] | None = None
    ) -> Hyperparameters:
        """Read the hyperparameters for an environment.

        Args:
            algorithm: a key of `labgym.training.limits.ARGUMENTS`.
            environment: id of the environment, an entry of the file. The entry `LabNav` is for all tasks of LabNav;
                one for an id replaces single values of it.
            path: a YAML file; None for the one that comes with labgym.
            changes: values that replace those of the file.

        Raises:
            UnknownNameError: the file has no such environment, or a hyperparameter does not exist.
            OptionError: a value is out of range or of the wrong type.
            DocumentError: the file is not a mapping of mappings.
            MissingDependencyError: PyYAML is not installed.
        """
        path = path or FOLDER / f"{algorithm}.yml"
        entries = read_mapping(path)
        names = [name for name in (COMMON, environment) if name in entries and environment.startswith(name)]
        if not names:
            raise UnknownNameError(f"environment in {path.name}", environment, (str(each) for each in entries))
        values: dict[str, Any] = {}
        for name in names:
            if not isinstance(entries[name], Mapping):
                raise DocumentError(path, name, "expected a mapping of hyperparameters")
            values |= entries[name]
        values |= changes or {}
        own = {each.name for each in fields(cls)} - {"algorithm", "environment", "arguments"}
        common = {name: _number(value) for name, value in values.items() if name in own}
        for name in ("n_envs", "n_timesteps"):
            if name not in common:
                raise DocumentError(path, f"{environment}.{name}", "missing")
        arguments = {name: _number(value) for name, value in values.items() if name not in own}
        return cls(algorithm, environment, arguments=arguments, **common)

    def to_json(self) -> dict[str, Any]:
        """Return the hyperparameters as plain data."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def algorithm_arguments(self) -> dict[str, Any]:
        """Return the arguments of the algorithm, with schedules and classes in the place of their names.

        Raises:
            UnknownNameError: there is no such activation function or kind of features.
        """
        arguments = {name: _scheduled(value) for name, value in self.arguments.items()}
        policy = dict(arguments.get("policy_kwargs") or {})
        if "activation_fn" in policy:
            check_name("activation function", policy["activation_fn"], ACTIVATIONS)
            policy["activation_fn"] = ACTIVATIONS[policy["activation_fn"]]
        if "features_extractor_class" in policy:
            check_name("features", policy["features_extractor_class"], EXTRACTORS)
            policy["features_extractor_class"] = EXTRACTORS[policy["features_extractor_class"]]
        return {**arguments, "policy_kwargs": policy}

    def environment_options(self, evaluation: bool = False) -> dict[str, Any]:
        """Return the arguments of `make_environments` for training or for evaluation."""
        options = {**self.env_kwargs, **(self.eval_env_kwargs if evaluation else {})}
        # An evaluation that names its own split or layout leaves the training layouts.
        own = evaluation and any(name in self.eval_env_kwargs for name in ("split", "layout"))
        return options if own else {**options, "layouts": self.layouts}

    @property
    def leg(self) -> int:
        """Control steps from one evaluation to the next: `eval_freq`, rounded up to whole rollouts."""
        name = "train_freq" if self.algorithm in ("sac", "her") else "n_steps"
        default = ROLLOUTS.get(self.algorithm, 1)
        rollout = self.n_envs * int(self.arguments.get(name, default))
        return math.ceil(self.eval_freq / rollout) * rollout

    @property
    def steps(self) -> int:
        """Control steps of the training: `n_timesteps`, rounded up to whole legs."""
        return math.ceil(self.n_timesteps / self.leg) * self.leg


def _number(value: Any) -> Any:
    """Return a value with numbers in place of texts such as 1e-4, which YAML 1.1 reads as text."""
    if isinstance(value, float) and value.is_integer() and abs(value) >= 1000.0:
        return int(value)  # 1e6 control steps
    if not isinstance(value, str):
        return value
    try:
        return _number(float(value))
    except ValueError:
        return value


def _check(kind: str, values: Mapping[str, Any], limits: Mapping[str, Limit], others: Iterable[str] = ()) -> None:
    """Check values by name.

    Raises:
        UnknownNameError: a name is neither limited nor one of the others.
        OptionError: a value is not accepted.
    """
    for name, value in values.items():
        if name not in limits:
            raise UnknownNameError(kind, name, {*limits, *others})
        limits[name].check(name, value)


def _scheduled(value: Any) -> Any:
    """Return a value with a linear schedule in place of "lin_0.001"."""
    if not isinstance(value, str) or not value.startswith(LINEAR):
        return value
    return LinearSchedule(float(value.removeprefix(LINEAR)), 0.0, 1.0)
