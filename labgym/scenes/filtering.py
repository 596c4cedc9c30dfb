"""Edge-avoiding filter of ray-traced light, which removes the noise of few rays per pixel.

The à-trous wavelet filter of Dammertz, Sewtz, Hanika and Lensch (High-Performance Graphics 2010), guided by normals
and distances: rounds of a 5-point kernel whose spacing doubles in each round.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]
KERNEL = ((-2, 1.0 / 16.0), (-1, 1.0 / 4.0), (0, 3.0 / 8.0), (1, 1.0 / 4.0), (2, 1.0 / 16.0))
ROUNDS = 4
NORMAL_SHARPNESS = 24.0
DISTANCE_SHARPNESS = 30.0
LIGHT_SHARPNESS = 2.5


def smooth_light(light: Floats, normal: Floats, distance: Floats) -> Floats:
    """Return light (h, w, 3) smoothed along surfaces given by normals (h, w, 3) and distances (h, w) in meters.

    The kernel is applied along rows and then along columns.
    """
    normal = normal / np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), np.float32(1e-9))
    for k in range(ROUNDS):
        step = 2**k
        for axis in (0, 1):
            light = _pass(light, normal, distance, step, axis, LIGHT_SHARPNESS * 2.0**k if k > 0 else 0.0)
    return light


def _pass(light: Floats, normal: Floats, distance: Floats, step: int, axis: int, sharpness: float) -> Floats:
    total = np.zeros_like(light)
    weights = np.zeros(distance.shape, dtype=np.float32)
    tone = light.mean(axis=2)
    for shift, share in KERNEL:
        here, there = _windows(light.shape[axis], shift * step, axis)
        apart = 1.0 - np.einsum("ijk,ijk->ij", normal[here], normal[there])
        gap = np.abs(distance[here] - distance[there]) / (0.05 + distance[here]) / step
        closeness = NORMAL_SHARPNESS * np.maximum(apart, 0.0) + DISTANCE_SHARPNESS * gap
        if sharpness > 0.0:
            closeness += sharpness * np.abs(tone[here] - tone[there])
        weight = np.float32(share) * np.exp(-closeness).astype(np.float32)
        total[here] += weight[..., None] * light[there]
        weights[here] += weight
    return np.asarray(total / np.maximum(weights, np.float32(1e-20))[..., None], dtype=np.float32)


def _windows(length: int, shift: int, axis: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Return slices of the pixels that have a neighbor at distance `shift` along an axis, and of those neighbors."""
    reach = min(abs(shift), length)
    low, high = slice(0, length - reach), slice(reach, length)
    here, there = (low, high) if shift >= 0 else (high, low)
    whole = slice(None)
    return ((here, whole), (there, whole)) if axis == 0 else ((whole, here), (whole, there))
