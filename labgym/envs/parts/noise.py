"""Noise models that fit any sensor."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.envs.checks import positive
from labgym.envs.parts import depth_noise  # noqa: F401 - a model may be named by its kind
from labgym.envs.parts.protocols import Noise, Reading
from labgym.envs.parts.registry import part_of, registered
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.envs.state import State


def disturbed(reading: Reading, sensor: Any, state: State, rng: np.random.Generator) -> Reading:
    """Return a reading after the noise models of a sensor, one after the other, clipped to the sensor's space."""
    kind = reading.dtype
    for noise in sensor.noise:
        reading = noise.apply(reading, state, rng)
    low, high = sensor.space.low.reshape(reading.shape), sensor.space.high.reshape(reading.shape)
    return np.clip(reading, low, high).astype(kind, copy=False)


def noises(part: Any) -> None:
    """Replace plain data in the field `noise` of a sensor by noise models."""
    noise = part.noise if isinstance(part.noise, list | tuple) else (part.noise,)
    object.__setattr__(part, "noise", tuple(part_of(each, "noise") for each in noise))


@registered("noise")
@dataclass(frozen=True)
class Gaussian(Noise):
    """Independent normal errors of every component.

    Attributes:
        sigma: standard deviation, in the unit of the reading (0 to 255 for images).
        relative: standard deviation per unit of the reading, added to `sigma` in quadrature.
        bias: mean error.
    """

    sigma: float = 0.0
    relative: float = 0.0
    bias: float = 0.0
    kind: str = field(default="gaussian", init=False)

    def __post_init__(self) -> None:
        positive(self, "sigma", "relative", zero=True)

    def apply(self, reading: Reading, state: State, rng: np.random.Generator) -> Reading:  # noqa: ARG002
        """Return the reading plus errors."""
        sigma = np.hypot(self.sigma, self.relative * reading) if self.relative else self.sigma
        return reading + (self.bias + sigma * rng.standard_normal(reading.shape))

    def scaled(self, factor: float) -> Gaussian:
        """Return the model with errors multiplied by a factor."""
        return replace(self, sigma=self.sigma * factor, relative=self.relative * factor, bias=self.bias * factor)


@registered("noise")
@dataclass(frozen=True)
class Dropout(Noise):
    """Components that are lost, each with the same probability.

    Attributes:
        rate: probability of a loss.
        value: reading of a lost component; None for the largest reading of the array, as of a ray that hits nothing.
    """

    rate: float = 0.01
    value: float | None = 0.0
    kind: str = field(default="dropout", init=False)

    def __post_init__(self) -> None:
        if not 0.0 <= self.rate <= 1.0:
            raise OptionError(f"Dropout: rate is {self.rate}, expected a probability from 0 to 1")

    def apply(self, reading: Reading, state: State, rng: np.random.Generator) -> Reading:  # noqa: ARG002
        """Return the reading with losses."""
        value = reading.max(initial=0.0) if self.value is None else self.value
        return np.where(rng.random(reading.shape) < self.rate, np.asarray(value, reading.dtype), reading)

    def scaled(self, factor: float) -> Dropout:
        """Return the model with the rate multiplied by a factor, at most 1."""
        return replace(self, rate=min(self.rate * factor, 1.0))


@registered("noise")
@dataclass(frozen=True)
class Quantization(Noise):
    """Readings rounded to multiples of a step.

    Attributes:
        step: in the unit of the reading.
    """

    step: float = 0.001
    kind: str = field(default="quantization", init=False)

    def __post_init__(self) -> None:
        positive(self, "step")

    def apply(self, reading: Reading, state: State, rng: np.random.Generator) -> Reading:  # noqa: ARG002
        """Return the rounded reading."""
        return np.round(reading / self.step) * self.step

    def scaled(self, factor: float) -> Quantization:
        """Return the model with the step multiplied by a factor."""
        return replace(self, step=self.step * factor) if factor > 0.0 else self
