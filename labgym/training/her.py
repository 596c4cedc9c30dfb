"""Soft actor-critic with hindsight experience replay (Andrychowicz et al. 2017) and the sparse reward.

Episodes that miss the goal are stored a second time with goals that they reached. The environments are goal
environments in the frame of the start (`labgym.training.environments`), so that the policy needs odometry, not a map;
`labgym.training.export` gives its network goal and sensors as the robot sees them.
"""

from __future__ import annotations

from pathlib import Path

from stable_baselines3 import SAC, HerReplayBuffer

from labgym.training.export import RobotFrame
from labgym.training.hyperparameters import Hyperparameters
from labgym.training.run import RunSettings, model_errors, train_model, training_environments


def train_her(hyperparameters: Hyperparameters, settings: RunSettings) -> Path:
    """Train, or resume, the run in a folder and return the file of the best policy.

    Raises:
        OptionError: the folder is in use or holds another run, or a hyperparameter is out of range.
        DocumentError: the checkpoint is damaged, or a finished run was changed.
    """
    with training_environments(hyperparameters, settings) as environments:
        with model_errors():
            arguments = hyperparameters.algorithm_arguments()
            arguments["policy_kwargs"] = {"features_extractor_class": RobotFrame, **arguments["policy_kwargs"]}
            model = SAC(
                hyperparameters.policy,
                environments,
                replay_buffer_class=HerReplayBuffer,
                **arguments,
                seed=settings.seed,
                device="cpu",
            )
        return train_model(model, hyperparameters, settings)
