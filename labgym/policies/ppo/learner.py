"""The actor's network inside stable-baselines3's PPO, and back."""

from __future__ import annotations

from typing import Any

import torch
from gymnasium import spaces
from stable_baselines3 import PPO
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv
from torch import Tensor, nn

from labgym.policies.ppo.drives import TrainingDrives
from labgym.policies.ppo.inputs import Sensor
from labgym.policies.ppo.network import FEATURES, HIDDEN, Actor, Encoder
from labgym.policies.ppo.options import PPOOptions
from labgym.policies.ppo.practice import PracticeEnv


class EncoderExtractor(BaseFeaturesExtractor):
    """The encoder as a features extractor of stable-baselines3; actor and critic share it."""

    def __init__(self, observation_space: spaces.Box, sensor: Sensor) -> None:
        super().__init__(observation_space, FEATURES)
        self.encoder = Encoder(sensor)

    def forward(self, observations: Tensor) -> Tensor:
        """Return the features of vectors."""
        features: Tensor = self.encoder(observations)
        return features


def make_environments(drives: TrainingDrives, options: PPOOptions) -> DummyVecEnv:
    """Return the training environments, stepped in turn in this process."""
    return DummyVecEnv([lambda: PracticeEnv(drives, options.observation, options.horizon)] * options.environments)


def make_learner(environments: VecEnv, options: PPOOptions) -> PPO:
    """Return a PPO learner with new weights."""
    return PPO(
        "MlpPolicy",
        environments,
        learning_rate=options.rate,
        n_steps=options.rollout,
        batch_size=options.batch,
        n_epochs=options.epochs,
        gamma=options.discount,
        gae_lambda=options.trace,
        clip_range=options.clip,
        ent_coef=options.entropy,
        target_kl=0.03,
        policy_kwargs={
            "features_extractor_class": EncoderExtractor,
            "features_extractor_kwargs": {"sensor": options.observation},
            "net_arch": {"pi": [HIDDEN], "vf": [HIDDEN]},
            "activation_fn": nn.ReLU,
            "log_std_init": float(torch.tensor(options.noise).log()),
            "ortho_init": False,
        },
        seed=options.seed,
        device="cpu",
    )


def actor_of(learner: PPO, sensor: Sensor) -> Actor:
    """Return a copy of the actor: the policy without critic and noise."""
    actor = Actor(sensor)
    policy: Any = learner.policy
    actor.encoder.load_state_dict(policy.features_extractor.encoder.state_dict())
    actor.hidden.load_state_dict(policy.mlp_extractor.policy_net.state_dict())
    actor.action.load_state_dict(policy.action_net.state_dict())
    return actor.eval()
