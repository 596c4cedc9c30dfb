"""Noise models: those that fit any sensor, and those of depth cameras and range finders."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from labgym.envs.checks import count, positive
from labgym.envs.parts.protocols import Noise, Reading, Sensor
from labgym.envs.parts.registry import part_of, registered
from labgym.errors import OptionError

if TYPE_CHECKING:
    from labgym.envs.state import State


class NoisySensor(Sensor):
    """A sensor whose readings noise models disturb, one after the other, clipped to the sensor's space.

    Attributes:
        noise: noise models, or plain data for `part_of`.
    """

    noise: tuple[Noise, ...]

    def __post_init__(self) -> None:
        noise = self.noise if isinstance(self.noise, list | tuple) else (self.noise,)
        object.__setattr__(self, "noise", tuple(part_of(each, "noise") for each in noise))

    @abstractmethod
    def measured(self, state: State) -> Reading:
        """Return the reading without noise."""

    def reading(self, state: State, rng: np.random.Generator) -> Reading:
        """Return the reading."""
        measured = self.measured(state)
        if not self.noise:
            return measured
        reading = measured
        for noise in self.noise:
            reading = noise.apply(reading, state, rng)
        low, high = (limit.reshape(reading.shape) for limit in self._limits)
        return np.clip(reading, low, high).astype(measured.dtype, copy=False)

    @cached_property
    def _limits(self) -> tuple[Reading, Reading]:
        """The least and the greatest readings; a space is slow to make."""
        space: Any = self.space  # a Box
        return space.low, space.high


@registered("noise", "gaussian")
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

    def __post_init__(self) -> None:
        positive(self, "sigma", "relative", zero=True)

    def apply(self, reading: Reading, state: State, rng: np.random.Generator) -> Reading:  # noqa: ARG002
        """Return the reading plus errors."""
        sigma = np.hypot(self.sigma, self.relative * reading) if self.relative else self.sigma
        return reading + (self.bias + sigma * rng.standard_normal(reading.shape))

    def scaled(self, factor: float) -> Gaussian:
        """Return the model with errors multiplied by a factor."""
        return replace(self, sigma=self.sigma * factor, relative=self.relative * factor, bias=self.bias * factor)


@registered("noise", "dropout")
class Dropout(Noise):
    """Components that are lost, each with the same probability.

    Attributes:
        rate: probability of a loss.
        value: reading of a lost component; None for the largest reading of the array, as of a ray that hits nothing.
    """

    rate: float = 0.01
    value: float | None = 0.0

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


@registered("noise", "quantization")
class Quantization(Noise):
    """Readings rounded to multiples of a step.

    Attributes:
        step: in the unit of the reading.
    """

    step: float = 0.001

    def __post_init__(self) -> None:
        positive(self, "step")

    def apply(self, reading: Reading, state: State, rng: np.random.Generator) -> Reading:  # noqa: ARG002
        """Return the rounded reading."""
        return np.round(reading / self.step) * self.step

    def scaled(self, factor: float) -> Quantization:
        """Return the model with the step multiplied by a factor."""
        return replace(self, step=self.step * factor) if factor > 0.0 else self


BASELINE = 35.130
"""Disparity of the camera times the depth, pixels times meters."""
JITTER, DISPARITY = 0.25, 1.0 / 36.0
"""Standard deviations of the place of a pixel, pixels, and of the disparity."""
FARTHEST = 10.0
"""Depth from which the camera reads 0, meters."""


@registered("noise", "redwood")
class RedwoodDepth(Noise):
    """Errors of a PrimeSense depth camera (Choi, Zhou and Koltun, CVPR 2015), with the constants of `simdepth.py`.

    A pixel shows the depth of a place up to about a quarter of a pixel away, of every second row and column; the
    disparity 35.13 m / depth has normal errors of 1/36 and is rounded to eighths; from 10 m on the reading is 0. The
    distortion of single devices (Teichman et al. 2013), which the original multiplies in from a table, is left out.

    Attributes:
        multiplier: factor on the deviations.
    """

    multiplier: float = 1.0

    def __post_init__(self) -> None:
        positive(self, "multiplier", zero=True)

    def apply(self, reading: Reading, state: State, rng: np.random.Generator) -> Reading:  # noqa: ARG002
        """Return the depth image (rows, columns) as the camera reads it.

        Raises:
            OptionError: the reading is not an image of depth.
        """
        if reading.ndim != 2:
            raise OptionError("RedwoodDepth is for depth cameras: the reading has no rows and columns")
        height, width = reading.shape
        errors = rng.standard_normal((3, height, width))
        rows = np.arange(height)[:, None] + self.multiplier * JITTER * errors[0]
        columns = np.arange(width)[None, :] + self.multiplier * JITTER * errors[1]
        row = (np.clip(rows, 0.0, height - 1.0) + 0.5).astype(np.int64)
        column = (np.clip(columns, 0.0, width - 1.0) + 0.5).astype(np.int64)
        depth = reading[row - row % 2, column - column % 2].astype(np.float64)
        disparity = BASELINE / np.maximum(depth, 1e-6) + self.multiplier * DISPARITY * errors[2]
        eighths = np.round(disparity * 8.0)
        valid = (depth < FARTHEST) & (depth > 0.0) & (eighths > 0.0)
        return np.where(valid, BASELINE * 8.0 / np.maximum(eighths, 1.0), 0.0).astype(reading.dtype)

    def scaled(self, factor: float) -> RedwoodDepth:
        """Return the model with the deviations multiplied by a factor."""
        return replace(self, multiplier=self.multiplier * factor)


@registered("noise", "rim")
class RimOcclusion(Noise):
    """Lost readings at a rim: where a neighbor is nearer by more than `step`, a stereo camera sees nothing.

    Attributes:
        step: jump of the range at a rim, meters. width: neighbors on each side, pixels or rays, that cast a shadow.
        rate: probability that a shadowed reading is lost. value: reading of a lost one.
    """

    step: float = 0.2
    width: int = 1
    rate: float = 1.0
    value: float = 0.0

    def __post_init__(self) -> None:
        positive(self, "step")
        count(self, "width")
        if not 0.0 <= self.rate <= 1.0:
            raise OptionError(f"RimOcclusion: rate is {self.rate}, expected a probability from 0 to 1")

    def apply(self, reading: Reading, state: State, rng: np.random.Generator) -> Reading:  # noqa: ARG002
        """Return the reading with losses along its last axis."""
        shadow = np.zeros(reading.shape, dtype=bool)
        for shift in range(1, self.width + 1):
            jump = reading[..., shift:] - reading[..., :-shift]
            shadow[..., shift:] |= jump > self.step
            shadow[..., :-shift] |= jump < -self.step
        lost = shadow & (rng.random(reading.shape) < self.rate)
        return np.where(lost, np.asarray(self.value, reading.dtype), reading)

    def scaled(self, factor: float) -> RimOcclusion:
        """Return the model with the rate multiplied by a factor, at most 1."""
        return replace(self, rate=min(self.rate * factor, 1.0))
