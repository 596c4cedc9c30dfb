"""Patterns of surfaces: brightness and tint relative to the color of a material, in linear light.

Each pattern is a function of a random generator and a number of pixels that returns factors, shape (size, size) for
gray patterns or (size, size, 3). It is built from noise that is periodic over its square, so that it repeats without a
seam. Lengths in the comments are for the periods of `RECIPES`.
"""

from __future__ import annotations

from collections.abc import Callable

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


STONES = ((1.16, 1.15, 1.12), (0.80, 0.79, 0.78), (0.55, 0.55, 0.57), (1.05, 0.93, 0.80), (0.88, 0.93, 0.90))
"""Tones of the chips of terrazzo: marble, gray, dark, ochre and green stone."""
Pattern = Callable[[np.random.Generator, int], Field]

TILES, GROUT = 4, 0.012
"""Tiles along a period of `ceramic_tiles`, and the width of their joints as a share of a tile."""


def sheet_vinyl(generator: np.random.Generator, size: int) -> Field:
    """Sheet vinyl: fine chips of two darker tones and a lighter one."""
    factors = 1.0 + 0.012 * cloud(generator, size, 0.10)
    for width, share, tone in ((0.006, 0.10, 0.84), (0.004, 0.07, 0.93), (0.005, 0.09, 1.10)):
        factors = np.where(speckles(generator, size, width, share) > 0.0, tone, factors)
    return np.asarray(factors)


def cast_resin(generator: np.random.Generator, size: int) -> Field:
    """Poured resin: faint clouds and a few flakes."""
    factors = 1.0 + 0.022 * octaves(generator, size, 0.16, 4)
    flakes = speckles(generator, size, 0.004, 0.012)
    return np.asarray(factors * (1.0 - 0.10 * flakes))


def terrazzo(generator: np.random.Generator, size: int) -> Field:
    """Terrazzo: stone chips of several tones and sizes in a binder."""
    factors = np.repeat(1.02 + 0.015 * cloud(generator, size, 0.02)[..., None], 3, axis=2)
    tones = np.array(STONES)
    for count, least in ((420, 0.022), (2600, 0.0085)):
        chip, edge = chips(generator, size, count)
        tone = tones[generator.choice(len(tones), count, p=(0.38, 0.24, 0.12, 0.14, 0.12))]
        # Only the inner part of some cells is a chip; binder fills the rest.
        inset = size * least * generator.uniform(0.15, 0.6, count)
        stone = generator.uniform(size=count) < 0.62
        inside = stone[chip] & (edge > inset[chip])
        factors = np.where(inside[..., None], tone[chip], factors)
    return np.asarray(factors)


def concrete(generator: np.random.Generator, size: int) -> Field:
    """Ground concrete: clouds of several sizes, trowel marks and pores."""
    factors = 1.0 + 0.06 * octaves(generator, size, 0.2, 6) + 0.012 * cloud(generator, size, 0.12, 0.004)
    pores = speckles(generator, size, 0.0025, 0.006)
    return np.asarray(np.clip(factors, 0.75, 1.25) * (1.0 - 0.35 * pores))


def ceramic_tiles(generator: np.random.Generator, size: int) -> Field:
    """Square tiles of different tones, four in each direction, with joints and rounded edges."""
    place = (np.arange(size) + 0.5) / size * TILES
    row, column = np.meshgrid(place, place, indexing="ij")
    gap = 0.5 - np.maximum(np.abs(np.modf(row)[0] - 0.5), np.abs(np.modf(column)[0] - 0.5))
    tone = 1.0 + 0.035 * generator.standard_normal((TILES, TILES))
    factors = tone[row.astype(int), column.astype(int)] * (1.0 + 0.012 * cloud(generator, size, 0.03))
    factors = factors * (1.0 - 0.05 * np.exp(-gap / 0.02))
    joint = gap < GROUT / 2.0
    return np.asarray(np.where(joint, 0.66 + 0.03 * cloud(generator, size, 0.01), factors))


def painted_plaster(generator: np.random.Generator, size: int) -> Field:
    """Paint on plaster: the relief of a roller, 4 mm, on slow unevenness."""
    bumps = cloud(generator, size, 0.006) + 0.6 * cloud(generator, size, 0.03)
    return np.asarray(relief(bumps, 0.014) * (1.0 + 0.008 * cloud(generator, size, 0.25)))


def ceiling_tiles(generator: np.random.Generator, size: int) -> Field:
    """Mineral fiber tiles in a grid of rails, two in each direction, with pores and a shadow along the rails."""
    place = np.abs(np.modf((np.arange(size) + 0.5) / size * 2.0)[0] - 0.5)
    row, column = np.meshgrid(place, place, indexing="ij")
    gap = 0.5 - np.maximum(row, column)
    factors = 1.0 + 0.01 * cloud(generator, size, 0.01)
    factors *= 1.0 - 0.28 * speckles(generator, size, 0.0022, 0.05) - 0.12 * speckles(generator, size, 0.006, 0.03)
    factors = np.where((gap > 0.02) & (gap < 0.028), 0.72, factors)
    return np.asarray(np.where(gap <= 0.02, 1.04, factors))


def wood(generator: np.random.Generator, size: int) -> Field:
    """Veneer with the grain along a row: growth rings, fibers and pores."""
    warp = 0.42 * cloud(generator, size, 0.34, 0.10)
    across = (np.arange(size) + 0.5)[:, None] / size
    rings = np.sin(2.0 * np.pi * (14.0 * across + 1.6 * warp))
    rings += 0.5 * np.sin(2.0 * np.pi * (37.0 * across + 3.0 * warp))
    fibers = cloud(generator, size, 0.12, 0.0022)
    pores = _streaks(generator, size)
    tone = 0.085 * rings / float(rings.std()) + 0.05 * fibers
    tint = np.stack([1.0 + 0.85 * tone, 1.0 + tone, 1.0 + 1.15 * tone], axis=2)
    return np.asarray(np.clip(tint, 0.6, 1.35) * (1.0 - 0.22 * pores[..., None]))


def _streaks(generator: np.random.Generator, size: int) -> Field:
    field = cloud(generator, size, 0.02, 0.0015)
    return np.asarray(field > np.quantile(field, 0.95), dtype=np.float64)


def brushed_metal(generator: np.random.Generator, size: int) -> Field:
    """Steel brushed along a row: fine streaks on slow unevenness."""
    fine, broad = cloud(generator, size, 0.25, 0.003), cloud(generator, size, 0.4, 0.02)
    return np.asarray(1.0 + 0.045 * fine + 0.025 * broad)


def worktop_resin(generator: np.random.Generator, size: int) -> Field:
    """Solid resin of worktops: fine grains, darker and lighter."""
    factors = 1.0 + 0.008 * cloud(generator, size, 0.08)
    factors = np.where(speckles(generator, size, 0.0035, 0.06) > 0.0, 0.90, factors)
    return np.asarray(np.where(speckles(generator, size, 0.0035, 0.05) > 0.0, 1.07, factors))


def dark_resin(generator: np.random.Generator, size: int) -> Field:
    """Black resin of worktops: light grains, which black needs to look like a surface, and slow unevenness."""
    factors = 1.0 + 0.06 * octaves(generator, size, 0.1, 4)
    factors = np.where(speckles(generator, size, 0.0035, 0.05) > 0.0, 1.7, factors)
    return np.asarray(np.where(speckles(generator, size, 0.0035, 0.06) > 0.0, 0.7, factors))


def laminate(generator: np.random.Generator, size: int) -> Field:
    """Laminate with a pearl finish: a fine relief."""
    return relief(cloud(generator, size, 0.004), 0.010)


def granite(generator: np.random.Generator, size: int) -> Field:
    """Granite: crystals of feldspar, quartz and mica."""
    chip, _ = chips(generator, size, 5000)
    tone = generator.choice([0.45, 0.8, 1.05, 1.3], 5000, p=[0.16, 0.3, 0.34, 0.2])
    return np.asarray(tone[chip] * (1.0 + 0.04 * cloud(generator, size, 0.01)))


def cardboard(generator: np.random.Generator, size: int) -> Field:
    """Corrugated cardboard: fibers, and the flutes that show through."""
    flutes = np.sin(2.0 * np.pi * 40.0 * (np.arange(size) + 0.5) / size)[None, :]
    return np.asarray(1.0 + 0.025 * flutes + 0.03 * cloud(generator, size, 0.02, 0.004))
