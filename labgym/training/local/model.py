"""The network that is trained: actor and critic of stable-baselines3, and its actor as a file."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.policies import ActorCriticPolicy
from torch import Tensor, nn

from labgym.policies.adapters.actor_file import ActorHeader, Perceptron
from labgym.policies.local.inputs import SIZE, SIZES

WIDTHS = (256, 256)
ENVIRONMENT = "LabNav"
RATE = 3e-4
"""Learning rate of the optimizer that comes with a new model."""


def model_arguments(noise: float) -> tuple[spaces.Box, spaces.Box, dict[str, Any]]:
    """Return the spaces of inputs and actions, and the arguments of an actor and a critic that share no weights.

    Args:
        noise: standard deviation of the actions.
    """
    inputs = spaces.Box(-np.inf, np.inf, (SIZE,), np.float32)
    actions = spaces.Box(-1.0, 1.0, (2,), np.float32)
    arguments = {
        "net_arch": {"pi": list(WIDTHS), "vf": list(WIDTHS)},
        "activation_fn": nn.ReLU,
        "ortho_init": False,
        "log_std_init": math.log(noise),
    }
    return inputs, actions, arguments


def new_model(seed: int, noise: float) -> ActorCriticPolicy:
    """Return an actor and a critic with new weights.

    Args:
        seed: random seed of the weights. noise: standard deviation of the actions.
    """
    torch.manual_seed(seed)
    inputs, actions, arguments = model_arguments(noise)
    return ActorCriticPolicy(inputs, actions, lambda _: RATE, **arguments)


def actor_parts(model: ActorCriticPolicy) -> list[nn.Module]:
    """Return the layers from the input to the mean action."""
    extractor: Any = model.mlp_extractor
    return [*extractor.policy_net, model.action_net]


def mean_actions(model: ActorCriticPolicy, inputs: Tensor) -> Tensor:
    """Return the mean actions (n, 2) for inputs (n, SIZE)."""
    for part in actor_parts(model):
        inputs = part(inputs)
    return inputs


def actor_of(model: ActorCriticPolicy, algorithm: str) -> Perceptron:
    """Return the actor of a model.

    Args:
        algorithm: that trained it, for the record.
    """
    layers = tuple(
        (part.weight.detach().clone(), part.bias.detach().clone())
        for part in actor_parts(model)
        if isinstance(part, nn.Linear)
    )
    header = ActorHeader(
        algorithm=algorithm, environment=ENVIRONMENT, inputs=tuple(SIZES), activation="relu", squash=False
    )
    return Perceptron(header, layers, {})


def save_actor(model: ActorCriticPolicy, path: Path, algorithm: str) -> Path:
    """Write the actor of a model and return its path."""
    return actor_of(model, algorithm).save(path)


def load_actor(model: ActorCriticPolicy, actor: Perceptron) -> None:
    """Give a model the weights of an actor."""
    linear = [part for part in actor_parts(model) if isinstance(part, nn.Linear)]
    with torch.no_grad():
        for part, (weight, bias) in zip(linear, actor.layers, strict=True):
            part.weight.copy_(weight)
            part.bias.copy_(bias)
