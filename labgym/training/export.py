"""The actor of a stable-baselines3 model as a file that `labgym eval` loads without trusting its author."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import torch
from gymnasium import spaces
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecNormalize
from torch import Tensor, nn

from labgym.errors import OptionError
from labgym.policies.adapters.actor import SIZES
from labgym.policies.adapters.actor_file import ACTIVATIONS, Activation, ActorHeader, Perceptron
from labgym.training import robot_frame
from labgym.training.robot_frame import RobotFrame

FLAT = ("goal", "lidar", "velocity")
"""The order in which `gymnasium.wrappers.FlattenObservation` concatenates the observation of `LabPointNav-v0`."""


def save_policy(
    model: BaseAlgorithm, path: str | Path, normalize: VecNormalize | None = None, environment: str = ""
) -> Path:
    """Write the actor of a model, with the statistics of `VecNormalize`, and return the path of the file.

        save_policy(model, "ppo-lab.safetensors")

    `labgym eval --policy ppo-lab.safetensors` evaluates it.

    Args:
        model: PPO, A2C, SAC, TD3 or DDPG with layers between flat observations and actions: "MlpPolicy", or
            "MultiInputPolicy" without images.
        path: path of the file, with the suffix .safetensors.
        normalize: statistics of the observations; by default those of the model's environment, if it has any.
        environment: id of the environment, for the record.

    Raises:
        OptionError: the suffix is another one, or as `actor_of`.
    """
    path = Path(path)
    if path.suffix != ".safetensors":
        raise OptionError(f"policy {str(path)!r}: expected the suffix .safetensors")
    return actor_of(model, normalize, environment).save(path)


def actor_of(model: BaseAlgorithm, normalize: VecNormalize | None = None, environment: str = "") -> Perceptron:
    """Return the actor of a model; the arguments are those of `save_policy`.

    Raises:
        OptionError: the action is not (2,) in [-1, 1], or the network has other parts: export it to ONNX.
    """
    space = model.action_space
    if not isinstance(space, spaces.Box) or space.shape != (2,) or not ((space.low == -1) & (space.high == 1)).all():
        raise OptionError(f"model with the action space {space}: expected Box(-1, 1, (2,))")
    normalize = normalize or model.get_vec_normalize_env()
    policy: Any = model.policy
    if hasattr(policy, "mlp_extractor"):
        features, modules = policy.pi_features_extractor, [*policy.mlp_extractor.policy_net, policy.action_net]
    else:
        features, modules = policy.actor.features_extractor, _actor_modules(policy.actor)
    layers, activation, squash = _layers(modules)
    if isinstance(features, RobotFrame):
        inputs, statistics = robot_frame.INPUTS, robot_frame.statistics()
        constants = {"clip": robot_frame.CLIP, "epsilon": 0.0}
    else:
        inputs = _inputs(features, model.observation_space)
        statistics = {} if normalize is None or not normalize.norm_obs else _statistics(normalize, inputs)
        constants = {} if normalize is None else {"clip": normalize.clip_obs, "epsilon": normalize.epsilon}
    header = ActorHeader(
        algorithm=type(model).__name__,
        environment=environment,
        inputs=inputs,
        activation=activation,
        squash=squash or bool(policy.squash_output),
        normalized=tuple(statistics),
        **constants,
    )
    return Perceptron(header, layers, statistics)


def _actor_modules(actor: Any) -> list[nn.Module]:
    """Return the modules of the actor of SAC, or of TD3 and DDPG."""
    return [*actor.latent_pi, actor.mu] if hasattr(actor, "latent_pi") else [*actor.mu]


def _inputs(features: nn.Module, space: spaces.Space[Any]) -> tuple[str, ...]:
    """Return the entries of the observation in the order of the network's input."""
    if isinstance(space, spaces.Dict):
        extractors: Any = getattr(features, "extractors", {})
        if extractors and all(isinstance(each, nn.Flatten) for each in extractors.values()):
            return tuple(extractors)
    elif space.shape == (sum(SIZES[name] for name in FLAT),) and not list(features.parameters()):
        return FLAT
    raise OptionError("the model looks at images, or at another observation: export it to ONNX")


def _layers(modules: list[nn.Module]) -> tuple[tuple[tuple[Tensor, Tensor], ...], Activation, bool]:
    """Return the linear layers, the function between them, and whether the hyperbolic tangent follows the last."""
    squash = isinstance(modules[-1], nn.Tanh)
    modules = modules[:-1] if squash else modules
    linear, between = modules[::2], modules[1::2]
    names = {name for name, kind in ACTIVATIONS.items() if any(type(each) is kind for each in between)} or {"tanh"}
    uniform = len({type(each) for each in between}) <= 1 and (not between or type(between[0]) in ACTIVATIONS.values())
    if not uniform or not all(isinstance(each, nn.Linear) for each in linear):
        kinds = ", ".join(sorted({type(each).__name__ for each in modules}))
        raise OptionError(f"the model's actor consists of {kinds}; expected linear layers and one kind of activation")
    layers = [(each.weight.detach().clone(), each.bias.detach().clone()) for each in linear]  # type: ignore[operator]
    return tuple(layers), names.pop(), squash


def _statistics(normalize: VecNormalize, inputs: tuple[str, ...]) -> dict[str, tuple[Tensor, Tensor]]:
    """Return mean and variance of each normalized input, float64."""
    rms: Any = normalize.obs_rms
    if not isinstance(rms, dict):
        ends = np.cumsum([SIZES[name] for name in inputs])[:-1]
        parts = zip(inputs, np.split(rms.mean, ends), np.split(rms.var, ends), strict=True)
        return {name: (torch.tensor(mean), torch.tensor(variance)) for name, mean, variance in parts}
    return {
        name: (torch.as_tensor(rms[name].mean).clone(), torch.as_tensor(rms[name].var).clone())
        for name in inputs
        if name in rms
    }
