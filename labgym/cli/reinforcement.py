"""The commands that train with stable-baselines3."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import OmitArgPrefixes, arg

from labgym.cli.arguments import (
    THIS_PROCESS,
    Execution,
    OptionalPath,
    OptionalText,
    OptionalWholeNumber,
    PolicyOptions,
    parse_options,
)
from labgym.cli.outcome import written
from labgym.cli.problems import check_training
from labgym.counts import whole_number

Named = Annotated[PolicyOptions, arg(name="set")]


@dataclass(frozen=True)
class TrainingArguments:
    """Arguments of the commands that train with stable-baselines3.

    Attributes:
        steps: Control steps, summed over the environments; by default those of the hyperparameters.
        hyperparams: YAML file of hyperparameters by environment, in the format of RL Baselines3 Zoo; by default the
            one that comes with labgym (labgym/training/hyperparams).
        changes: Hyperparameters that replace those of the file, such as learning_rate=1e-4 n_envs=16.
        vectorization: How environments run: on the compiled kernel (extra fast), in one process per processor, one
            after the other in this process (dummy), or one process each (subproc); auto takes the kernel if it has all
            parts of the environment, otherwise dummy.
        seed: Random seed of the whole run.
        out: Folder for policies, scores, logs and checkpoint; by default runs/ALGORITHM/ENVIRONMENT.
        threads: Number of torch threads; the last bits of the weights depend on it.
        device: Device of the network, cpu or cuda; on a GPU, a rerun gives other last bits.
        fresh: Move the files of the folder aside and start anew.
        wandb: Project of Weights & Biases that receives the log, in addition to TensorBoard (pip install wandb).
    """

    steps: OptionalWholeNumber = None
    hyperparams: OptionalPath = None
    changes: Named = ()
    vectorization: Literal["auto", "kernel", "processes", "dummy", "subproc"] = "auto"
    seed: int = 0
    out: OptionalPath = None
    threads: int = 1
    device: str = "cpu"
    fresh: bool = False
    wandb: OptionalText = None

    def train(self, algorithm: str, environment: str) -> int:
        """Train by an algorithm in an environment.

        Raises:
            MissingDependencyError: a package of the extra `train` is not installed.
            UnknownNameError, OptionError, DocumentError: as `Hyperparameters.load`.
        """
        contrib = ("sb3_contrib",) if algorithm == "recurrent-ppo" else ()
        check_training(f"labgym train {algorithm}", "stable_baselines3", "safetensors", "yaml", *contrib)
        from labgym.training.hyperparameters import Hyperparameters
        from labgym.training.run import RunSettings, check_wandb, train

        if self.wandb is not None:
            check_wandb()
        steps = {} if self.steps is None else {"n_timesteps": self.steps}
        changes = {**parse_options(self.changes), **steps}
        hyperparameters = Hyperparameters.load(algorithm, environment, self.hyperparams, changes)
        out = self.out or Path("runs") / algorithm / environment
        settings = RunSettings(
            out, self.seed, self.vectorization, self.threads, self.device, self.fresh, wandb=self.wandb or ""
        )
        return written(train(hyperparameters, settings))


Training = OmitArgPrefixes[TrainingArguments]
USUAL = TrainingArguments()


def floors(
    out: Path = Path("runs/floors"),
    count: int = 500,
    per_level: int = 2,
    execution: Execution = THIS_PROCESS,
    fresh: Annotated[bool, arg(help="Move the files of the folder aside and start anew.")] = False,
) -> int:
    """Draw a pack of training floors with episodes of all LabNav tasks at levels 0 to 3; it resumes.

    gym.make("LabNavPeople-v0", floors="runs/floors") draws its episodes from it.

    Args:
        out: Folder for the pack.
        count: Number of floors; a floor takes about 17 CPU seconds.
        per_level: Most episodes of each task and level on a floor.
    """
    whole_number("count", count)
    whole_number("per_level", per_level)
    from labgym.envs.labnav.pack import described, make_pack

    print(described(make_pack(out, count, per_level, execution.options(), fresh)))
    return written(out)


def ppo(env: str = "LabPointNav-v0", training: Training = USUAL) -> int:
    """Train by proximal policy optimization (stable-baselines3), and evaluate success rate and SPL on the way.

    labgym train ppo-imitation trains the published policy ppo, after a warm start that imitates an expert.

    Args:
        env: Id of the environment, an entry of the file of hyperparameters.
    """
    return training.train("ppo", env)


def recurrent_ppo(env: str = "LabNavPeople-v0", training: Training = USUAL) -> int:
    """Train a policy with memory, an LSTM, by proximal policy optimization (sb3-contrib).

    Args:
        env: Id of the environment, an entry of the file of hyperparameters.
    """
    return training.train("recurrent-ppo", env)


def sac(env: str = "LabPointNav-v0", training: Training = USUAL) -> int:
    """Train by soft actor-critic (stable-baselines3), and evaluate success rate and SPL on the way.

    Args:
        env: Id of the environment, an entry of the file of hyperparameters.
    """
    return training.train("sac", env)


def her(env: str = "LabFloorNavGoal-v0", training: Training = USUAL) -> int:
    """Train by soft actor-critic with hindsight experience replay and a sparse reward (stable-baselines3).

    Args:
        env: Id of the goal environment, an entry of the file of hyperparameters.
    """
    return training.train("her", env)
