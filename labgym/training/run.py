"""The folder of a training run, the environments that its hyperparameters describe, and training by PPO, SAC, HER."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import torch
from stable_baselines3 import PPO, SAC, HerReplayBuffer
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import configure
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

from labgym.documents import write_json, write_text
from labgym.errors import LabgymError, OptionError
from labgym.layouts.batch import catalog_digest
from labgym.policies.learned.training_loop import finish, train_identity
from labgym.runs import RunFolder
from labgym.training.environments import NEAR_GOAL, NearGoal, layout_progress, make_environments
from labgym.training.export import RobotFrame, actor_of, save_policy
from labgym.training.hyperparameters import Hyperparameters
from labgym.training.legs import CHECKPOINT, learn
from labgym.training.scores import ScoreCallback

BEST, LAST = "policy.safetensors", "last.safetensors"
"""The policies with the best evaluation and of the end of the training, for `labgym eval --policy`."""
HYPERPARAMETERS, SCORES, LOGS = "hyperparameters.json", "scores.jsonl", "logs"
EVALUATION_ENVS = 16
"""Largest number of environments of an evaluation."""


@dataclass(frozen=True)
class RunSettings:
    """Everything about a run but its hyperparameters.

    Attributes:
        out: folder of the run. fresh: move its files aside and start anew.
        seed: random seed. threads: threads of torch; the last bits of the weights depend on them.
        vectorization: as of `make_environments`.
        verbose: whether to print the log.
    """

    out: Path
    seed: int = 0
    vectorization: str = "auto"
    threads: int = 1
    fresh: bool = False
    verbose: bool = True

    def __post_init__(self) -> None:
        if self.threads < 1 or self.seed < 0:
            raise OptionError(f"threads is {self.threads} and seed is {self.seed}, expected at least 1 and 0")


@contextmanager
def training_environments(hyperparameters: Hyperparameters, settings: RunSettings) -> Iterator[VecEnv]:
    """Yield the environments to train in, with `VecNormalize` if the hyperparameters ask for it, and close them.

    Raises:
        LabgymError: as `make_environments`.
    """
    options = hyperparameters.environment_options()
    environments = make_environments(
        hyperparameters.environment, hyperparameters.n_envs, settings.vectorization, **options
    )
    try:
        yield _normalized(environments, hyperparameters)
    finally:
        environments.close()


@contextmanager
def evaluation_environments(hyperparameters: Hyperparameters, settings: RunSettings) -> Iterator[VecEnv]:
    """Yield the environments to evaluate in; they take the statistics of the training and do not change them."""
    options = hyperparameters.environment_options(evaluation=True)
    count = min(hyperparameters.n_envs, hyperparameters.n_eval_episodes, EVALUATION_ENVS)
    environments = make_environments(hyperparameters.environment, count, settings.vectorization, **options)
    try:
        normalized = _normalized(environments, hyperparameters)
        if isinstance(normalized, VecNormalize):
            normalized.training, normalized.norm_reward = False, False
        yield normalized
    finally:
        environments.close()


def _normalized(environments: VecEnv, hyperparameters: Hyperparameters) -> VecEnv:
    """Return the environments with the wrappers of the hyperparameters."""
    keys: dict[str, Any] = {}
    if hyperparameters.near_goal:
        environments = NearGoal(environments)
        keys = {"norm_obs_keys": [name for name in environments.observation_space.spaces if name != NEAR_GOAL]}
    if hyperparameters.normalize is False:
        return environments
    arguments = {} if hyperparameters.normalize is True else dict(hyperparameters.normalize)
    discount = {"gamma": hyperparameters.arguments["gamma"]} if "gamma" in hyperparameters.arguments else {}
    return VecNormalize(environments, **{**discount, **keys, **arguments})


@contextmanager
def model_errors() -> Iterator[None]:
    """Raise errors of stable-baselines3 in making a model as `OptionError`: they concern the hyperparameters."""
    try:
        yield
    except (AssertionError, TypeError, ValueError, RuntimeError) as error:
        if isinstance(error, LabgymError):
            raise
        raise OptionError(f"stable-baselines3 refuses the hyperparameters: {error}") from error


def train_model(model: BaseAlgorithm, hyperparameters: Hyperparameters, settings: RunSettings) -> Path:
    """Train a new model, or resume the run in the folder, and return the file of the best policy.

    Raises:
        OptionError: the folder is in use or holds another run; the message names the differences.
        DocumentError: the checkpoint is damaged, or an output of a finished run was changed.
    """
    torch.set_num_threads(settings.threads)
    actor_of(model)  # A model that cannot be saved is refused before it is trained.
    identity = train_identity(
        f"stable-baselines3 {hyperparameters.algorithm}",
        ("stable-baselines3", "gymnasium", *(["numba"] if find_spec("numba") else [])),
        hyperparameters=hyperparameters.to_json(),
        seed=settings.seed,
        threads=settings.threads,
        vectorization=settings.vectorization,
        catalog=catalog_digest(),
    )
    with (
        evaluation_environments(hyperparameters, settings) as evaluation,
        RunFolder.open(settings.out, identity, settings.fresh) as run,
    ):
        if not run.finished:
            write_json(settings.out / HYPERPARAMETERS, hyperparameters.to_json())
            with _progress(hyperparameters, settings):
                _train(model, evaluation, hyperparameters, settings)
            finish(run, (HYPERPARAMETERS, SCORES, BEST, LAST))
        (settings.out / CHECKPOINT).unlink(missing_ok=True)
    return settings.out / BEST


def _progress(hyperparameters: Hyperparameters, settings: RunSettings) -> AbstractContextManager[None]:
    """Return the context that shows how many layouts are generated, if this process generates them."""
    here = settings.vectorization in ("auto", "kernel", "dummy")
    return layout_progress(hyperparameters.layouts) if hyperparameters.layouts and here else nullcontext()


def _train(model: BaseAlgorithm, evaluation: VecEnv, hyperparameters: Hyperparameters, settings: RunSettings) -> None:
    """Train a model, evaluate it after each leg, and write the best and the last policy and all scores."""
    out, environment = settings.out, hyperparameters.environment
    outputs = [*(["stdout"] if settings.verbose else []), *(["tensorboard"] if find_spec("tensorboard") else [])]
    model.set_logger(configure(str(out / LOGS), outputs))
    scores = ScoreCallback(
        evaluation,
        on_best=lambda best: save_policy(best, out / BEST, environment=environment),
        n_eval_episodes=hyperparameters.n_eval_episodes,
        eval_freq=hyperparameters.leg // hyperparameters.n_envs,
        verbose=0,
    )
    learn(model, scores, hyperparameters.steps, hyperparameters.leg, settings.seed, out)
    save_policy(model, out / LAST, environment=environment)
    write_text(out / SCORES, "".join(json.dumps(record) + "\n" for record in scores.records))


ALGORITHMS: dict[str, type[BaseAlgorithm]] = {"ppo": PPO, "sac": SAC, "her": SAC}


def train(hyperparameters: Hyperparameters, settings: RunSettings) -> Path:
    """Train, or resume, the run in a folder and return the file of the best policy.

    "her" is soft actor-critic with hindsight experience replay (Andrychowicz et al. 2017) and the sparse reward:
    episodes that miss the goal are stored a second time with goals that they reached. Its environments are goal
    environments in the frame of the start (`labgym.training.environments`), so that the policy needs odometry, not a
    map; `labgym.training.export` gives its network goal and sensors as the robot sees them.

    Raises:
        OptionError: the folder is in use or holds another run, or a hyperparameter is out of range.
        DocumentError: the checkpoint is damaged, or a finished run was changed.
    """
    with training_environments(hyperparameters, settings) as environments:
        with model_errors():
            arguments = hyperparameters.algorithm_arguments()
            if hyperparameters.algorithm == "her":
                arguments["policy_kwargs"] = {"features_extractor_class": RobotFrame, **arguments["policy_kwargs"]}
                arguments["replay_buffer_class"] = HerReplayBuffer
            algorithm: Any = ALGORITHMS[hyperparameters.algorithm]
            model = algorithm(hyperparameters.policy, environments, **arguments, seed=settings.seed, device="cpu")
        return train_model(model, hyperparameters, settings)
