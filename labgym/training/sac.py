"""Soft actor-critic (Haarnoja et al. 2018): fewer control steps than PPO, more computation for each."""

from __future__ import annotations

from pathlib import Path

from stable_baselines3 import SAC

from labgym.training.hyperparameters import Hyperparameters
from labgym.training.run import RunSettings, model_errors, train_model, training_environments


def train_sac(hyperparameters: Hyperparameters, settings: RunSettings) -> Path:
    """Train, or resume, the run in a folder and return the file of the best policy.

    Raises:
        OptionError: the folder is in use or holds another run, or a hyperparameter is out of range.
        DocumentError: the checkpoint is damaged, or a finished run was changed.
    """
    with training_environments(hyperparameters, settings) as environments:
        with model_errors():
            model = SAC(
                hyperparameters.policy,
                environments,
                **hyperparameters.algorithm_arguments(),
                seed=settings.seed,
                device="cpu",
            )
        return train_model(model, hyperparameters, settings)
