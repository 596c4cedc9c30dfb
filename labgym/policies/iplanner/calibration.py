"""How far the fear of a trained network can be trusted: its probabilities against what its paths do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray

from labgym.policies.data import Dataset
from labgym.policies.iplanner.config import PlannerConfig
from labgym.policies.iplanner.loss import CostMaps, fear_label, in_room
from labgym.policies.iplanner.network import PlannerNetwork
from labgym.policies.iplanner.train import Samples, divided

BINS = 10


@dataclass(frozen=True, eq=False)
class Calibration:
    """Fear over samples.

    Attributes:
        fear: (n,) probabilities. collides: (n,) whether the path's beginning does, by the cost map.
    """

    fear: NDArray[np.float64]
    collides: NDArray[np.bool_]

    def precision(self, threshold: float) -> float | None:
        """Return the share of fearful samples whose path collides; None where none is fearful."""
        found = self.collides[self.fear > threshold]
        return float(found.mean()) if len(found) else None

    def recall(self, threshold: float) -> float | None:
        """Return the share of colliding paths that are feared; None where none collides."""
        found = self.fear[self.collides] > threshold
        return float(found.mean()) if len(found) else None

    def reliability(self) -> NDArray[np.float64]:
        """Return for each tenth of probability that occurs its mean, the share that collides, the count: (m, 3)."""
        tenth = np.minimum((self.fear * BINS).astype(int), BINS - 1)
        rows = [
            (self.fear[tenth == k].mean(), self.collides[tenth == k].mean(), (tenth == k).sum()) for k in set(tenth)
        ]
        return np.array(sorted(rows), dtype=np.float64).reshape(-1, 3)

    def error(self) -> float:
        """Return the expected calibration error: how far probability and share are apart, over the tenths."""
        if len(self.fear) == 0:
            return 0.0
        mean, share, count = self.reliability().T
        return float((np.abs(mean - share) * count).sum() / count.sum())


@torch.no_grad()
def calibration(network: PlannerNetwork, data: Dataset, config: PlannerConfig) -> Calibration:
    """Return what a network fears, and what its paths do, on the samples that were held out."""
    samples, maps = Samples.of(data, config.loss), CostMaps(data.maps)
    _, held_out = divided(data, config.training)
    fears, labels = [torch.empty(0)], [torch.empty(0)]
    for chosen in torch.split(held_out, config.training.batch):
        if len(chosen) == 0:
            break
        path, fear = network.eval()(samples.depth[chosen].float() / 1000.0, samples.goal[chosen])
        costs = maps.at(in_room(path, samples.pose[chosen]), samples.place[chosen])
        fears.append(torch.sigmoid(fear))
        labels.append(fear_label((path[:, 1:] - path[:, :-1]).norm(dim=2), costs, config.loss))
    return Calibration(torch.cat(fears).double().numpy(), torch.cat(labels).numpy() > 0.5)
