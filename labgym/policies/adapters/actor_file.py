"""The actor of a trained model in one file: layers and normalization as numbers, in a format that cannot run code."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn

from labgym.documents import Document, check_safetensors_header, write_bytes
from labgym.errors import DocumentError
from labgym.policies.adapters.inputs import checked_file
from labgym.policies.adapters.ray_encoder import ENCODED, ENCODED_SIZE, RayEncoder
from labgym.policies.options import NonNegative, Positive

Activation = Literal["elu", "relu", "silu", "tanh"]

ACTIVATIONS: dict[Activation, type[nn.Module]] = {"elu": nn.ELU, "relu": nn.ReLU, "silu": nn.SiLU, "tanh": nn.Tanh}
"""Functions between the layers."""
LSTM_PARTS = ("weight_ih", "weight_hh", "bias_ih", "bias_hh")
"""Tensors of an LSTM layer, as torch names them."""
MAX_BYTES = 256 * 1024 * 1024


class ActorHeader(Document):
    """The description of an actor, stored in the metadata of its file.

    Attributes:
        algorithm: algorithm that trained it. environment: id of the environment.
        inputs: entries of the observation, in the order in which they are concatenated.
        encoder: number of features of the `RayEncoder` after the inputs, which are then those of it; 0 without one.
        stack: number of frames of each input, one after the other, the oldest first; zeros before the first one.
        memory: number of LSTM layers between the inputs and the layers.
        activation: function between the layers.
        squash: whether the hyperbolic tangent follows the last layer.
        limit: largest magnitude of the last layer's output, before the hyperbolic tangent; None without a limit.
        normalized: inputs that are normalized: (x - mean) / sqrt(var + epsilon), clipped to [-clip, clip].
        clip, epsilon: constants of the normalization.
    """

    SCHEMA: ClassVar[str] = "labgym.actor/1"

    algorithm: str
    environment: str = ""
    inputs: Annotated[tuple[str, ...], Field(min_length=1)]
    encoder: Annotated[int, Field(ge=0, le=4096)] = 0
    stack: Annotated[int, Field(ge=1, le=64)] = 1
    memory: Annotated[int, Field(ge=0, le=16)] = 0
    activation: Activation
    squash: bool
    limit: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
    normalized: tuple[str, ...] = ()
    clip: Positive = 10.0
    epsilon: NonNegative = 1e-8


@dataclass(frozen=True, eq=False)
class Perceptron:
    """A multilayer perceptron from observations to actions, after encoder and LSTM if any, and its normalization.

    Attributes:
        header: the description.
        layers: weight (outputs, inputs) and bias (outputs,) of each linear layer, float32.
        statistics: mean and variance of each normalized input, of all its frames, float64.
        memory: weights of inputs (4 h, n) and of the state (4 h, h), and biases (4 h,) of both, of each LSTM layer.
        encoder: weights of the `RayEncoder` by name; none without one.
    """

    header: ActorHeader
    layers: tuple[tuple[Tensor, Tensor], ...]
    statistics: dict[str, tuple[Tensor, Tensor]]
    memory: tuple[tuple[Tensor, Tensor, Tensor, Tensor], ...] = ()
    encoder: Mapping[str, Tensor] = field(default_factory=dict)

    @property
    def width(self) -> int:
        """Number of values that the inputs must have."""
        return ENCODED_SIZE if self.encoder else self._features

    @property
    def _features(self) -> int:
        """Number of values that the first layer after the encoder takes."""
        return int(self.memory[0][0].shape[1] if self.memory else self.layers[0][0].shape[1])

    def encoding(self) -> RayEncoder | None:
        """Return the encoder in evaluation mode; None without one."""
        if not self.encoder:
            return None
        encoder = RayEncoder(self.header.encoder)
        encoder.load_state_dict(self.encoder)
        return encoder.eval()

    def recurrence(self) -> nn.LSTM | None:
        """Return the LSTM in evaluation mode; None without one."""
        if not self.memory:
            return None
        lstm = nn.LSTM(self._features, self.memory[0][1].shape[1], len(self.memory)).eval()
        for index, tensors in enumerate(self.memory):
            for part, tensor in zip(LSTM_PARTS, tensors, strict=True):
                getattr(lstm, f"{part}_l{index}").data = tensor
        return lstm

    def network(self) -> nn.Sequential:
        """Return the layers as a network in evaluation mode."""
        parts: list[nn.Module] = []
        for weight, bias in self.layers:
            linear = nn.Linear(weight.shape[1], weight.shape[0])
            linear.weight.data, linear.bias.data = weight, bias
            parts += [linear, ACTIVATIONS[self.header.activation]()]
        parts.pop()
        if self.header.limit is not None:
            parts.append(nn.Hardtanh(-self.header.limit, self.header.limit))
        return nn.Sequential(*parts, *([nn.Tanh()] if self.header.squash else [])).eval()

    @cached_property
    def _scales(self) -> dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Mean and deviation of each normalized input."""
        return {
            name: (mean.double().numpy(), np.sqrt(variance.double().numpy() + self.header.epsilon))
            for name, (mean, variance) in self.statistics.items()
        }

    def normalized(self, name: str, value: NDArray[Any]) -> NDArray[np.float32]:
        """Return an input as the first layer takes it, float32."""
        if name in self._scales:
            mean, deviation = self._scales[name]
            value = np.clip((value - mean) / deviation, -self.header.clip, self.header.clip)
        return value.astype(np.float32)

    def save(self, path: str | Path) -> Path:
        """Write the actor as a .safetensors file atomically and return its path."""
        tensors: dict[str, Tensor] = {}
        for index, (weight, bias) in enumerate(self.layers):
            tensors |= {f"layers.{index}.weight": weight, f"layers.{index}.bias": bias}
        for index, parts in enumerate(self.memory):
            tensors |= {f"memory.{index}.{name}": part for name, part in zip(LSTM_PARTS, parts, strict=True)}
        tensors |= {f"encoder.{name}": tensor for name, tensor in self.encoder.items()}
        for name, (mean, variance) in self.statistics.items():
            tensors |= {f"statistics.{name}.mean": mean, f"statistics.{name}.var": variance}
        metadata = {"labgym": json.dumps(self.header.to_json())}
        return write_bytes(Path(path), save({key: each.contiguous() for key, each in tensors.items()}, metadata))

    @classmethod
    def load(cls, path: str | Path) -> Perceptron:
        """Read the file of an actor; nothing in it is executed.

        Raises:
            LabgymError: the file does not exist.
            DocumentError: the file is too large, of another kind or damaged, or holds NaN or infinite numbers.
        """
        path = checked_file(path)
        if path.stat().st_size > MAX_BYTES:
            raise DocumentError(path, "", f"larger than {MAX_BYTES} bytes")
        check_safetensors_header(path)
        try:
            with safe_open(path, framework="pt") as file:
                metadata = file.metadata() or {}
                tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - not a mapping
        except (SafetensorError, OSError, ValueError) as error:
            raise DocumentError(path, "", f"is not a safetensors file ({' '.join(str(error).split())[:120]})") from None
        if "labgym" not in metadata:
            raise DocumentError(path, "", "has no description of an actor; labgym.training.save_policy writes one")
        try:
            data = json.loads(metadata["labgym"])
        except (ValueError, RecursionError):
            raise DocumentError(path, "labgym", "its description is not JSON") from None
        header = ActorHeader.parse(data, path)
        return _checked(header, tensors, path)


def _checked(header: ActorHeader, tensors: dict[str, Tensor], path: Path) -> Perceptron:
    """Return an actor if its tensors are those of its header."""
    for name, tensor in tensors.items():
        if not bool(torch.isfinite(tensor).all()):
            raise DocumentError(path, name, "holds NaN or infinite numbers; train the model again")
    memory = _checked_memory(header, tensors, path)
    encoder = _checked_encoder(header, tensors, path)
    layers: list[tuple[Tensor, Tensor]] = []
    while f"layers.{len(layers)}.weight" in tensors:
        weight, bias = (tensors.pop(f"layers.{len(layers)}.{part}", torch.empty(0)) for part in ("weight", "bias"))
        fits = weight.ndim == 2 and bias.shape == weight.shape[:1] and weight.dtype == bias.dtype == torch.float32
        if not fits or (layers and weight.shape[1] != len(layers[-1][1])):
            raise DocumentError(path, f"layers.{len(layers)}", "does not fit the layer before it or its own bias")
        layers.append((weight, bias))
    if not layers:
        raise DocumentError(path, "layers", "missing")
    if memory and layers[0][0].shape[1] != memory[-1][1].shape[1]:
        raise DocumentError(path, "layers.0", "does not fit the state of the LSTM before it")
    statistics = {}
    for name in header.normalized:
        mean, variance = (tensors.pop(f"statistics.{name}.{part}", torch.empty(0)) for part in ("mean", "var"))
        if name not in header.inputs or mean.ndim != 1 or not len(mean) or mean.shape != variance.shape:
            raise DocumentError(path, f"statistics.{name}", "not the mean and variance of an input")
        if not bool((variance >= 0.0).all()):
            raise DocumentError(path, f"statistics.{name}.var", "holds negative variances")
        statistics[name] = (mean, variance)
    if tensors:
        raise DocumentError(path, sorted(tensors)[0], "is not part of an actor")
    actor = Perceptron(header, tuple(layers), statistics, memory, encoder)
    if encoder and actor._features != header.encoder:
        raise DocumentError(path, "encoder", "its features do not fit the layer after it")
    return actor


def _checked_encoder(header: ActorHeader, tensors: dict[str, Tensor], path: Path) -> dict[str, Tensor]:
    """Take the weights of the encoder of a header out of the tensors of a file and return them."""
    if not header.encoder:
        return {}
    if header.inputs != ENCODED or header.stack != 1:
        raise DocumentError(path, "inputs", f"the encoder takes {', '.join(ENCODED)}, one frame of each")
    weights = {}
    for name, expected in RayEncoder(header.encoder).state_dict().items():
        weights[name] = tensors.pop(f"encoder.{name}", torch.empty(0))
        if weights[name].shape != expected.shape or weights[name].dtype != torch.float32:
            raise DocumentError(path, f"encoder.{name}", f"does not have the shape {tuple(expected.shape)}")
    return weights


def _checked_memory(
    header: ActorHeader, tensors: dict[str, Tensor], path: Path
) -> tuple[tuple[Tensor, Tensor, Tensor, Tensor], ...]:
    """Take the LSTM layers of a header out of the tensors of a file and return them."""
    memory: list[tuple[Tensor, Tensor, Tensor, Tensor]] = []
    for index in range(header.memory):
        inputs, state, bias, other = (tensors.pop(f"memory.{index}.{name}", torch.empty(0)) for name in LSTM_PARTS)
        size = len(bias) // 4
        fits = inputs.ndim == 2 and size and inputs.shape[0] == 4 * size and state.shape == (4 * size, size)
        fits = fits and bias.shape == other.shape == (4 * size,) and (not memory or inputs.shape[1] == size)
        if not fits or any(each.dtype != torch.float32 for each in (inputs, state, bias, other)):
            raise DocumentError(path, f"memory.{index}", "is no LSTM layer that fits the one before it")
        memory.append((inputs, state, bias, other))
    return tuple(memory)


class RunningActor:
    """An actor in an episode, with its frames and the state of its LSTM.

    Args:
        actor: its layers and normalization.
    """

    def __init__(self, actor: Perceptron) -> None:
        self._actor, self._network = actor, actor.network()
        self._encoder, self._lstm = actor.encoding(), actor.recurrence()
        self.reset()

    def reset(self) -> None:
        """Begin an episode: earlier frames and the state are zeros."""
        self._frames: dict[str, NDArray[Any]] = {}
        self._state: tuple[Tensor, Tensor] | None = None

    def act(self, inputs: Mapping[str, NDArray[Any]]) -> NDArray[np.float32]:
        """Return the output of the last layer for the inputs of a control step, each a vector."""
        names = self._actor.header.inputs
        vector = np.concatenate([self._actor.normalized(name, self.see(name, inputs[name])) for name in names])
        with torch.inference_mode():
            values = torch.from_numpy(vector)[None]
            if self._encoder is not None:
                values = self._encoder(values)
            if self._lstm is not None:
                sequence, self._state = self._lstm(values[None], self._state)
                values = sequence[0]
            output: NDArray[np.float32] = self._network(values)[0].numpy()
        return output

    def see(self, name: str, value: NDArray[Any]) -> NDArray[Any]:
        """Take the frame of an input and return all its frames."""
        stack = self._actor.header.stack
        if stack == 1:
            return value
        frames = self._frames.get(name, np.zeros(stack * len(value), value.dtype))
        self._frames[name] = np.concatenate([frames[len(value) :], value])
        return self._frames[name]
