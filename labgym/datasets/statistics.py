"""Statistics of features as LeRobot's policies normalize by them: of each episode, and of all."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}

Statistics = dict[str, NDArray[Any]]
"""min, max, mean, std and quantiles, each of the shape of the feature, and count (1,)."""


def statistics(values: NDArray[Any]) -> Statistics:
    """Return the statistics of vectors (n, k) over their rows."""
    values = np.asarray(values, np.float64)
    return {
        "min": values.min(axis=0),
        "max": values.max(axis=0),
        "mean": values.mean(axis=0),
        "std": values.std(axis=0),
        "count": np.array([len(values)]),
        **{name: np.quantile(values, share, axis=0) for name, share in QUANTILES.items()},
    }


def picture_statistics(pictures: NDArray[np.uint8]) -> Statistics:
    """Return the statistics of images (n, rows, columns, 3) by channel, (3, 1, 1), in shares of 255; count is n."""
    channels = {name: each for name, each in statistics(pictures.reshape(-1, 3)).items() if name != "count"}
    return {
        **{name: each.reshape(3, 1, 1) / 255.0 for name, each in channels.items()},
        "count": np.array([len(pictures)]),
    }


def aggregated(parts: Sequence[Statistics]) -> Statistics:
    """Return the statistics of all episodes from those of each; quantiles are means weighted by count, as LeRobot's."""
    counts = np.array([part["count"][0] for part in parts], np.float64)
    weights = counts / counts.sum()

    def weighted(name: str, values: Sequence[NDArray[Any]] | None = None) -> NDArray[Any]:
        return np.tensordot(weights, np.stack([part[name] for part in parts] if values is None else values), axes=1)

    mean = weighted("mean")
    variance = weighted("", [part["std"] ** 2 + (part["mean"] - mean) ** 2 for part in parts])
    return {
        "min": np.min([part["min"] for part in parts], axis=0),
        "max": np.max([part["max"] for part in parts], axis=0),
        "mean": mean,
        "std": np.sqrt(variance),
        "count": np.array([int(counts.sum())]),
        **{name: weighted(name) for name in QUANTILES},
    }
