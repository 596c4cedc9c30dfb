"""One network from scans to velocities, with a memory."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from labgym.artefacts import artefacts
from labgym.policies.adapters.actor import ActorPolicy


class LidarLstmPolicy(ActorPolicy):
    """Drives on lidar, velocity and the announced goal: convolutions around the scan, an LSTM, and no map or plan.

    The network copies an expert that plans on what the scans of a drive have shown (docs/learn.md).

    Args:
        weights: the .safetensors file; None for the published one.

    Raises:
        DocumentError: the file is damaged or of another kind.
    """

    name: ClassVar[str] = "lidar-lstm"

    def __init__(self, weights: str | Path | None = None) -> None:
        super().__init__(weights or artefacts("policies") / self.name / "policy.safetensors")
