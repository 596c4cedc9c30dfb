"""Colors of an episode that differ from those of its layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from labgym.scenes import RayScene
from labgym.scenes.mesh import MATERIAL_NAMES


@dataclass(eq=False)
class Palette:
    """Factors on the colors that cameras see.

    Attributes:
        tints: factors on red, green and blue by material; of others 1. brightness: factor on all colors.
    """

    tints: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    brightness: float = 1.0
    _painted: tuple[RayScene, RayScene] | None = field(default=None, init=False, repr=False)

    def factors(self, name: str) -> NDArray[np.float64]:
        """Return the factors on red, green and blue of a material, (3,)."""
        return np.array(self.tints.get(name, (1.0, 1.0, 1.0))) * self.brightness

    def paint(self, scene: RayScene) -> RayScene:
        """Return a scene in these colors; the latest one is painted once."""
        if self._painted is None or self._painted[0] is not scene:
            factors = np.array([self.factors(name) for name in MATERIAL_NAMES])
            colors = np.clip(scene.colors * factors[scene.mesh.material], 0.0, 255.0).astype(np.float32)
            self._painted = scene, scene.recolored(colors)
        return self._painted[1]

    def __getstate__(self) -> dict[str, object]:
        # The painted scene stays in its process; a copy paints its own.
        return {"tints": dict(self.tints), "brightness": self.brightness, "_painted": None}
