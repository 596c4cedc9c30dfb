"""The actor of a stable-baselines3 model as a file that `labgym eval` loads without trusting its author."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import torch
from gymnasium import spaces
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnvWrapper, VecExtractDictObs, VecFrameStack, VecNormalize
from torch import Tensor, nn

from labgym.envs.sensors import LIDAR_RAYS
from labgym.envs.wrappers import ActionRepeat
from labgym.errors import OptionError
from labgym.policies.adapters.actor import SIZES, check_actor
from labgym.policies.adapters.actor_file import (
    ACTIVATIONS,
    LSTM_PARTS,
    Activation,
    ActorHeader,
    Perceptron,
    RunningActor,
)
from labgym.policies.adapters.inputs import NEAR_GOAL_M, NEAR_GOAL_SCALE
from labgym.policies.adapters.ray_encoder import ENCODED, RayEncoder

FLAT = ("goal", "lidar", "velocity")
"""The order in which `gymnasium.wrappers.FlattenObservation` concatenates the observation of `LabPointNav-v0`."""
WRAPPERS = (
    gym.wrappers.DelayObservation,
    gym.wrappers.FrameStackObservation,
    gym.wrappers.NormalizeObservation,
    gym.wrappers.RescaleAction,
    gym.wrappers.RescaleObservation,
    gym.wrappers.StickyAction,
    ActionRepeat,
)
"""Wrappers of single environments that change what a model sees or does."""
SAMPLES, TOLERANCE = 16, 1e-4
"""Number of random observations on which the file is compared with its model, and largest difference of an action."""


def save_policy(
    model: BaseAlgorithm, path: str | Path, normalize: VecNormalize | None = None, environment: str = ""
) -> Path:
    """Write the actor of a model, with the statistics of `VecNormalize`, and return the path of the file.

        save_policy(model, "ppo-lab.safetensors")

    `labgym eval --policy ppo-lab.safetensors` evaluates it.

    Args:
        model: PPO, A2C, SAC, TD3 or DDPG with layers between flat observations and actions: "MlpPolicy", or
            "MultiInputPolicy" without images; or RecurrentPPO of sb3-contrib. Frames may be stacked by a
            `VecFrameStack`, inside `VecNormalize`.
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
        OptionError: the action is not (2,) in [-1, 1], the network has other parts or another state, or the environment
            is wrapped in something that the file would lack: export the model to ONNX.
        UnknownNameError: the model has an input that is not an observation.
    """
    space = model.action_space
    if not isinstance(space, spaces.Box) or space.shape != (2,) or not ((space.low == -1) & (space.high == 1)).all():
        raise OptionError(f"model with the action space {space}: expected Box(-1, 1, (2,))")
    with _on_processor(model.policy) as policy:
        return _actor(model, policy, normalize or model.get_vec_normalize_env(), environment)


def _actor(model: BaseAlgorithm, policy: Any, normalize: VecNormalize | None, environment: str) -> Perceptron:
    """Return the actor of a model whose policy is on the processor."""
    stack = _stack(model)
    memory = _memory(policy)
    if hasattr(policy, "mlp_extractor"):
        features, modules = policy.pi_features_extractor, [*policy.mlp_extractor.policy_net, policy.action_net]
    else:
        features, modules = policy.actor.features_extractor, _actor_modules(policy.actor)
    encoder: dict[str, Tensor] = {}
    limit = float(modules.pop().max_val) if isinstance(modules[-1], nn.Hardtanh) else None
    layers, activation, squash = _layers(modules)
    if isinstance(features, RobotFrame):
        inputs, statistics = INPUTS, frame_statistics()
        constants = {"clip": CLIP, "epsilon": 0.0}
    elif isinstance(features, Rays):
        if stack > 1 or (normalize is not None and normalize.norm_obs):
            raise OptionError("the features rays take one frame as observed: leave frame_stack and norm_obs out")
        inputs, statistics, constants = ENCODED, {}, {}
        encoder = {name: weight.detach().clone() for name, weight in features.encoder.state_dict().items()}
    else:
        inputs = _inputs(features, model.observation_space, stack)
        statistics = {} if normalize is None or not normalize.norm_obs else _statistics(normalize, inputs, stack)
        constants = {} if normalize is None else {"clip": normalize.clip_obs, "epsilon": normalize.epsilon}
    header = ActorHeader(
        algorithm=type(model).__name__,
        environment=environment,
        inputs=inputs,
        encoder=features.features_dim if encoder else 0,
        stack=stack,
        memory=len(memory),
        activation=activation,
        squash=squash or bool(policy.squash_output),
        limit=limit,
        normalized=tuple(statistics),
        **constants,
    )
    actor = Perceptron(header, layers, statistics, memory, encoder)
    check_actor(actor, "the model")
    if not isinstance(features, RobotFrame):
        _check_actions(model, actor, normalize)
    return actor


@contextmanager
def _on_processor(policy: Any) -> Iterator[Any]:
    """Move a policy to the processor for a while: a GPU computes LSTMs with fewer digits than the file."""
    device = policy.device
    try:
        yield policy.to("cpu")
    finally:
        policy.to(device)


def _stack(model: BaseAlgorithm) -> int:
    """Return the number of frames that the model sees, 1 without a stack.

    Other wrappers that change what the model sees or does are refused: the file would lack them.

    Raises:
        OptionError: the environment has one.
    """
    env = model.get_env()
    wrapped: list[type] = [kind for kind in WRAPPERS if env is not None and any(env.env_is_wrapped(kind))]
    normalizations, frames = 0, 1
    while isinstance(env, VecEnvWrapper):
        normalizations += isinstance(env, VecNormalize)
        if isinstance(env, VecFrameStack):
            inside = isinstance(env.venv, VecNormalize) or frames > 1
            wrapped += [VecFrameStack] if inside else []
            frames = env.stacked_obs.n_stack
        wrapped += [VecExtractDictObs] if isinstance(env, VecExtractDictObs) else []
        env = env.venv
    if wrapped:
        raise OptionError(
            f"the model was trained in environments with {wrapped[0].__name__}, which the file would lack: train "
            "without it, or export the model with it to ONNX"
        )
    if normalizations > 1:
        raise OptionError(f"the model was trained with {normalizations} VecNormalize, of which the file holds one")
    return frames


def _memory(policy: Any) -> tuple[tuple[Tensor, Tensor, Tensor, Tensor], ...]:
    """Return the LSTM layers of the actor of a `RecurrentPPO`, none of a policy without memory.

    Raises:
        OptionError: the policy has another recurrent part.
    """
    lstm = getattr(policy, "lstm_actor", None)
    known = [lstm, getattr(policy, "lstm_critic", None)]
    others = [each for each in policy.modules() if isinstance(each, nn.RNNBase | nn.RNNCellBase) and each not in known]
    plain = lstm is None or (isinstance(lstm, nn.LSTM) and not (lstm.bidirectional or lstm.proj_size or lstm.dropout))
    if others or not plain:
        kind = type(others[0] if others else lstm).__name__
        raise OptionError(
            f"the policy {type(policy).__name__} carries {kind} from action to action, which the file would lack: "
            "train RecurrentPPO, or write a Policy class (docs/policies.md)"
        )
    if lstm is None:
        return ()
    try:
        layers: Any = [
            tuple(getattr(lstm, f"{part}_l{k}").detach().clone() for part in LSTM_PARTS) for k in range(lstm.num_layers)
        ]
    except AttributeError:
        raise OptionError("the LSTM of the model has no bias: leave bias=False out of lstm_kwargs") from None
    return tuple(layers)


def _check_actions(model: BaseAlgorithm, actor: Perceptron, normalize: VecNormalize | None) -> None:
    """Compare the actions of the file with those of the model on random observations.

    Raises:
        OptionError: they differ.
    """
    running, stack, state = RunningActor(actor), actor.header.stack, None
    for number, sample in enumerate(_samples(model, SAMPLES)):
        if not actor.header.memory:
            running.reset()
        seen = sample if normalize is None else normalize.normalize_obs(copy.deepcopy(sample))
        start = np.array([number == 0])
        expected, state = model.predict(seen, state=state, episode_start=start, deterministic=True)
        inputs = sample if isinstance(sample, dict) else _split(sample, actor.header.inputs, stack)
        frames = {name: np.split(np.ravel(inputs[name]), stack) for name in actor.header.inputs}
        for name, parts in frames.items():
            for part in parts[:-1]:
                running.see(name, part)
        action = np.clip(running.act({name: parts[-1] for name, parts in frames.items()}), -1.0, 1.0)
        if not np.abs(action - expected).max() <= TOLERANCE or (state is not None and not actor.header.memory):
            raise OptionError(
                f"the policy {type(model.policy).__name__} acts otherwise than its linear layers on a random "
                f"observation ({expected} instead of {action}), so that the file would lack a part of it: "
                "export it to ONNX"
            )


def _samples(model: BaseAlgorithm, count: int) -> list[Any]:
    """Return random observations of a model, always the same."""
    space = copy.deepcopy(model.observation_space)
    space.seed(0)
    return [space.sample() for _ in range(count)]


def _split(vector: NDArray[Any], names: Sequence[str], stack: int = 1) -> dict[str, NDArray[Any]]:
    """Return the parts of a flat observation by name, with all frames of each."""
    frames, ends = np.reshape(vector, (stack, -1)), np.cumsum([SIZES[name] for name in names])[:-1]
    return {name: part.ravel() for name, part in zip(names, np.split(frames, ends, axis=1), strict=True)}


def _actor_modules(actor: Any) -> list[nn.Module]:
    """Return the modules of the actor of SAC, with the limit of its mean if it explores by gSDE, or of TD3 and DDPG."""
    last = [*actor.mu] if isinstance(actor.mu, nn.Sequential) else [actor.mu]
    return [*getattr(actor, "latent_pi", []), *last]


def _inputs(features: nn.Module, space: spaces.Space[Any], stack: int) -> tuple[str, ...]:
    """Return the entries of the observation in the order of the network's input."""
    if isinstance(space, spaces.Dict):
        extractors: Any = getattr(features, "extractors", {})
        if extractors and all(isinstance(each, nn.Flatten) for each in extractors.values()):
            return tuple(extractors)
    elif space.shape == (stack * sum(SIZES[name] for name in FLAT),) and not list(features.parameters()):
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


def _statistics(normalize: VecNormalize, inputs: tuple[str, ...], stack: int) -> dict[str, tuple[Tensor, Tensor]]:
    """Return mean and variance of each normalized input, float64."""
    rms: Any = normalize.obs_rms
    if not isinstance(rms, dict):
        means, variances = _split(rms.mean, inputs, stack), _split(rms.var, inputs, stack)
        return {name: (torch.tensor(means[name]), torch.tensor(variances[name])) for name in inputs}
    return {
        name: (torch.as_tensor(rms[name].mean).clone(), torch.as_tensor(rms[name].var).clone())
        for name in inputs
        if name in rms
    }


INPUTS: tuple[str, ...] = ("goal", "near_goal", "velocity", "lidar")
"""The features, in their order, as inputs of a policy."""
CLIP = 1.5
"""Features are clipped to [-1.5, 1.5] after normalization, as in the training of `ppo`."""
MEANS = {"goal": (2.0, 0.0, 0.0), "lidar": (1.5,) * LIDAR_RAYS}
VARIANCES = {"goal": (4.0, 1.0, 1.0), "lidar": (1.0,) * LIDAR_RAYS}
"""Fixed normalization of distances, meters: it must hold for goals that were relabeled, too."""
WIDTH = 3 + 3 + 2 + LIDAR_RAYS


def frame_statistics() -> dict[str, tuple[Tensor, Tensor]]:
    """Return mean and variance of each normalized feature."""
    return {name: (torch.tensor(MEANS[name]), torch.tensor(VARIANCES[name])) for name in MEANS}


class RobotFrame(BaseFeaturesExtractor):
    """The observation of a goal environment in the robot's frame, (n, 188).

    A pose and a goal in the start frame become distance, cosine and sine of the bearing, which depend on their
    difference alone. So a goal that hindsight experience replay relabels is the goal of the features, and the policy
    needs the same inputs as one of `labgym train ppo`.

    Args:
        observation_space: with `observation`, (x, y, cosine, sine, velocity, lidar), and `desired_goal`.
    """

    def __init__(self, observation_space: spaces.Dict) -> None:
        super().__init__(observation_space, WIDTH)
        for name, (mean, variance) in frame_statistics().items():
            self.register_buffer(f"{name}_mean", mean, persistent=False)
            self.register_buffer(f"{name}_deviation", variance.sqrt(), persistent=False)

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Return the features."""
        joint = observations["observation"]
        position, axis, velocity, lidar = joint[:, :2], joint[:, 2:4], joint[:, 4:6], joint[:, 6:]
        ahead = observations["desired_goal"] - position
        distance = ahead.norm(dim=1, keepdim=True)
        along = (ahead * axis).sum(dim=1, keepdim=True)
        left = axis[:, :1] * ahead[:, 1:] - axis[:, 1:] * ahead[:, :1]
        bearing = torch.cat([along, left], dim=1) / distance.clamp_min(1e-6)
        goal = torch.cat([distance, bearing], dim=1)
        near = NEAR_GOAL_SCALE / NEAR_GOAL_M * distance.clamp_max(NEAR_GOAL_M)
        parts = [self._normal("goal", goal), near, near * bearing, velocity, self._normal("lidar", lidar)]
        return torch.cat(parts, dim=1)

    def _normal(self, name: str, value: Tensor) -> Tensor:
        mean, deviation = getattr(self, f"{name}_mean"), getattr(self, f"{name}_deviation")
        normal: Tensor = ((value - mean) / deviation).clamp(-CLIP, CLIP)
        return normal


class Rays(BaseFeaturesExtractor):
    """The features of a `RayEncoder`, of environments that observe goal, velocity and lidar.

    Args:
        observation_space: with these entries. width: number of features.

    Raises:
        OptionError: it has other entries.
    """

    def __init__(self, observation_space: spaces.Dict, width: int = 128) -> None:
        if set(getattr(observation_space, "spaces", ())) != set(ENCODED):
            raise OptionError(f"features rays: set observe to [{', '.join(ENCODED)}]")
        super().__init__(observation_space, width)
        self.encoder = RayEncoder(width)

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Return the features."""
        features: Tensor = self.encoder(torch.cat([observations[name] for name in ENCODED], dim=1))
        return features


EXTRACTORS: dict[str, type[BaseFeaturesExtractor]] = {"rays": Rays}
"""Features by the name that a file of hyperparameters gives them."""
