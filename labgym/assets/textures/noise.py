"""Noise that repeats without a seam: every field is periodic over its square."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Field = NDArray[np.float64]


def cloud(generator: np.random.Generator, size: int, along: float, across: float | None = None) -> Field:
    """Return smooth noise of mean 0 and standard deviation 1, shape (size, size).

    Args:
        along: correlation length along a row, as a share of the period.
        across: correlation length along a column; that of `along` if None.
    """
    across = along if across is None else across
    frequency = np.fft.fftfreq(size, 1.0 / size)
    spectrum = np.fft.rfft2(generator.standard_normal((size, size)))
    wave_y, wave_x = np.meshgrid(frequency, np.fft.rfftfreq(size, 1.0 / size), indexing="ij")
    damping = np.exp(-2.0 * np.pi**2 * ((wave_x * along) ** 2 + (wave_y * across) ** 2) / 4.0)
    damping[0, 0] = 0.0
    field = np.fft.irfft2(spectrum * damping, s=(size, size))
    return np.asarray(field / max(float(field.std()), 1e-12))


def octaves(generator: np.random.Generator, size: int, longest: float, count: int) -> Field:
    """Return noise of several scales, each half as long and half as strong as the one before; deviation 1."""
    field = sum((0.5**k * cloud(generator, size, longest * 0.5**k) for k in range(count)), np.zeros((size, size)))
    return np.asarray(field / float(field.std()))


def speckles(generator: np.random.Generator, size: int, width: float, share: float) -> Field:
    """Return 1 in irregular spots and 0 between them, shape (size, size).

    Args:
        width: of a spot, as a share of the period. share: of the area that spots cover.
    """
    field = cloud(generator, size, width)
    return np.asarray(field > np.quantile(field, 1.0 - share), dtype=np.float64)


def chips(generator: np.random.Generator, size: int, count: int) -> tuple[NDArray[np.int64], Field]:
    """Return the chip (size, size) that each pixel lies in, and its distance from the chip's edge in pixels.

    Chips are the cells of a Voronoi diagram of `count` random points on the torus.
    """
    from scipy.spatial import cKDTree

    points = generator.uniform(0.0, size, (count, 2))
    rows, columns = np.meshgrid(np.arange(size) + 0.5, np.arange(size) + 0.5, indexing="ij")
    distances, nearest = cKDTree(points, boxsize=size).query(np.stack([rows, columns], axis=-1).reshape(-1, 2), k=2)
    edge = (distances[:, 1] - distances[:, 0]) / 2.0
    return nearest[:, 0].reshape(size, size).astype(np.int64), np.asarray(edge.reshape(size, size))


def relief(height: Field, strength: float) -> Field:
    """Return the brightness of a relief that is lit from the upper left, 1 on average."""
    slope = (np.roll(height, 1, axis=1) - np.roll(height, -1, axis=1)) + (
        np.roll(height, 1, axis=0) - np.roll(height, -1, axis=0)
    )
    return np.asarray(1.0 + strength * slope / max(float(slope.std()), 1e-12))
