"""The folder of a training run, its environments, and training by PPO with or without memory, SAC and HER."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO, SAC, HerReplayBuffer
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import KVWriter, configure
from stable_baselines3.common.vec_env import VecEnv, VecFrameStack, VecNormalize

from labgym.documents import write_json, write_text
from labgym.errors import LabgymError, OptionError, check_name, optional_package
from labgym.layouts.batch import catalog_digest
from labgym.policies.learned.training_loop import finish, train_identity
from labgym.runs import RunFolder
from labgym.training.environments import NEAR_GOAL, Entries, NearGoal, layout_progress, make_environments
from labgym.training.export import RobotFrame, actor_of, save_policy
from labgym.training.guided import Guided, guided
from labgym.training.hyperparameters import Hyperparameters
from labgym.training.legs import CHECKPOINT, learn
from labgym.training.limits import ARGUMENTS
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
        device: of the network, as torch names it, such as "cuda".
        vectorization: as of `make_environments`.
        verbose: whether to print the log.
        wandb: project of Weights & Biases that receives the log, too; "" for none.
    """

    out: Path
    seed: int = 0
    vectorization: str = "auto"
    threads: int = 1
    device: str = "cpu"
    fresh: bool = False
    verbose: bool = True
    wandb: str = ""

    def __post_init__(self) -> None:
        if self.threads < 1 or self.seed < 0:
            raise OptionError(f"threads is {self.threads} and seed is {self.seed}, expected at least 1 and 0")
        check_device(self.device)


def check_device(name: str) -> None:
    """Refuse a device that this torch lacks.

    Raises:
        OptionError: it lacks it, or it knows no such name.
    """
    try:
        torch.zeros(1, device=name)
    except (RuntimeError, AssertionError, NotImplementedError) as error:
        reason = str(error).splitlines()[0][:120]
        raise OptionError(f"device {name!r} is not there: {reason}") from None


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
    if hyperparameters.imitation:
        environments = Guided(environments)
    if hyperparameters.near_goal:
        environments = NearGoal(environments)
        keys = {"norm_obs_keys": [name for name in environments.observation_space.spaces if name != NEAR_GOAL]}
    observed = hyperparameters.observe
    if observed:
        environments = Entries(environments, observed)
        keys = {name: [each for each in names if each in observed] for name, names in keys.items()}
    if hyperparameters.frame_stack > 1:
        environments = VecFrameStack(environments, hyperparameters.frame_stack)
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
    if settings.wandb:
        check_wandb()
    actor_of(model)  # A model that cannot be saved is refused before it is trained.
    contrib = ["sb3-contrib"] if hyperparameters.algorithm == RECURRENT else []
    identity = train_identity(
        f"stable-baselines3 {hyperparameters.algorithm}",
        ("stable-baselines3", "gymnasium", *contrib, *(["numba"] if find_spec("numba") else [])),
        hyperparameters=hyperparameters.to_json(),
        seed=settings.seed,
        threads=settings.threads,
        vectorization=settings.vectorization,
        device=settings.device,
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
    logger = configure(str(out / LOGS), outputs)
    if settings.wandb:
        logger.output_formats.append(WandbOutput(settings.wandb, out, hyperparameters.to_json()))
    model.set_logger(logger)
    scores = ScoreCallback(
        evaluation,
        on_best=lambda best: save_policy(best, out / BEST, environment=environment),
        n_eval_episodes=hyperparameters.n_eval_episodes,
        eval_freq=hyperparameters.leg // hyperparameters.n_envs,
        verbose=0,
    )
    climbs = hyperparameters.env_kwargs.get("curriculum") is not None
    learn(model, scores, hyperparameters.steps, hyperparameters.leg, settings.seed, out, climbs)
    logger.close()
    save_policy(model, out / LAST, environment=environment)
    write_text(out / SCORES, "".join(json.dumps(record) + "\n" for record in scores.records))


class WandbOutput(KVWriter):
    """Writes the numbers of a log to Weights & Biases.

    Args:
        project: name of the project. out: folder of the run, whose path names the run. config: hyperparameters.

    Raises:
        OptionError: the package wandb is not installed.
    """

    def __init__(self, project: str, out: Path, config: Mapping[str, Any]) -> None:
        check_wandb()
        wandb: Any = import_module("wandb")
        self._run = wandb.init(project=project, name=str(out), dir=str(out), config=dict(config), resume="allow")

    def write(self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0) -> None:  # noqa: ARG002
        """Write the numbers of a step."""
        numbers = {name: value for name, value in key_values.items() if isinstance(value, int | float | np.number)}
        self._run.log(numbers, step=step)

    def close(self) -> None:
        """End the run."""
        self._run.finish()


def check_wandb() -> None:
    """Refuse a log in Weights & Biases if its package, which belongs to no extra, is not installed.

    Raises:
        OptionError: it is not.
    """
    if find_spec("wandb") is None:
        raise OptionError("the log in Weights & Biases needs the package wandb: pip install wandb")


RECURRENT = "recurrent-ppo"
"""The algorithm whose policy has a memory."""


def algorithm_of(name: str) -> type[BaseAlgorithm]:
    """Return the class of an algorithm.

    Raises:
        UnknownNameError: there is no such algorithm.
        MissingDependencyError: it is RecurrentPPO, and sb3-contrib is not installed (extra `train`).
    """
    check_name("algorithm", name, ARGUMENTS)
    if name != RECURRENT:
        return PPO if name == "ppo" else SAC
    with optional_package("sb3-contrib", f"labgym train {RECURRENT}", "train"):
        recurrent: type[BaseAlgorithm] = import_module("sb3_contrib").RecurrentPPO
    return recurrent


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
    if hyperparameters.imitation and settings.vectorization == "processes":
        raise OptionError("imitation does not run with vectorization 'processes': use 'kernel' or 'dummy'")
    with training_environments(hyperparameters, settings) as environments:
        with model_errors():
            arguments = hyperparameters.algorithm_arguments()
            if hyperparameters.algorithm == "her":
                arguments["policy_kwargs"] = {"features_extractor_class": RobotFrame, **arguments["policy_kwargs"]}
                arguments["replay_buffer_class"] = HerReplayBuffer
            algorithm: Any = algorithm_of(hyperparameters.algorithm)
            if hyperparameters.imitation:
                algorithm = guided(algorithm, hyperparameters.imitation)
            model = algorithm(
                hyperparameters.policy, environments, **arguments, seed=settings.seed, device=settings.device
            )
        return train_model(model, hyperparameters, settings)
