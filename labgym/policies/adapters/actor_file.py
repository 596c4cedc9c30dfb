"""The actor of a trained model in one file: layers and normalization as numbers, in a format that cannot run code."""

from __future__ import annotations

import json
from dataclasses import dataclass
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
from labgym.policies.options import NonNegative, Positive

Activation = Literal["elu", "relu", "silu", "tanh"]

ACTIVATIONS: dict[Activation, type[nn.Module]] = {"elu": nn.ELU, "relu": nn.ReLU, "silu": nn.SiLU, "tanh": nn.Tanh}
"""Functions between the layers."""
MAX_BYTES = 256 * 1024 * 1024


class ActorHeader(Document):
    """The description of an actor, stored in the metadata of its file.

    Attributes:
        algorithm: algorithm that trained it. environment: id of the environment.
        inputs: entries of the observation, in the order in which they are concatenated.
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
    activation: Activation
    squash: bool
    limit: Annotated[float, Field(gt=0.0, allow_inf_nan=False)] | None = None
    normalized: tuple[str, ...] = ()
    clip: Positive = 10.0
    epsilon: NonNegative = 1e-8


@dataclass(frozen=True, eq=False)
class Perceptron:
    """A multilayer perceptron from observations to actions, and the normalization of its inputs.

    Attributes:
        header: the description.
        layers: weight (outputs, inputs) and bias (outputs,) of each linear layer, float32.
        statistics: mean and variance of each normalized input, float64.
    """

    header: ActorHeader
    layers: tuple[tuple[Tensor, Tensor], ...]
    statistics: dict[str, tuple[Tensor, Tensor]]

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
    layers: list[tuple[Tensor, Tensor]] = []
    while f"layers.{len(layers)}.weight" in tensors:
        weight, bias = (tensors.pop(f"layers.{len(layers)}.{part}", torch.empty(0)) for part in ("weight", "bias"))
        fits = weight.ndim == 2 and bias.shape == weight.shape[:1] and weight.dtype == bias.dtype == torch.float32
        if not fits or (layers and weight.shape[1] != len(layers[-1][1])):
            raise DocumentError(path, f"layers.{len(layers)}", "does not fit the layer before it or its own bias")
        layers.append((weight, bias))
    if not layers:
        raise DocumentError(path, "layers", "missing")
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
    return Perceptron(header, tuple(layers), statistics)
