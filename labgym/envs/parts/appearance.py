"""Randomization of the colors that cameras see."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labgym.assets.shapes import MATERIALS
from labgym.envs.parts.kinds import positive
from labgym.envs.parts.protocols import Randomization
from labgym.envs.setting import Setting
from labgym.scenes.mesh import MATERIAL_NAMES


@dataclass(frozen=True)
class AppearanceRandomization(Randomization):
    """Factors on the colors of materials and on the brightness of everything. Depth and lidar do not change.

    Attributes:
        tint: the red, green and blue of each material are multiplied by factors between 1 - tint and 1 + tint.
        brightness: all colors are multiplied by a factor between 1 - brightness and 1 + brightness.
    """

    name: str = "appearance"
    tint: float = 0.2
    brightness: float = 0.3
    kind: str = field(default="appearance", init=False)

    def __post_init__(self) -> None:
        positive(self, "tint", "brightness", zero=True)

    def randomize(self, setting: Setting, rng: np.random.Generator) -> dict[str, Any]:
        """Draw the factors; return the brightness and the tints by material."""
        setting.brightness *= float(1.0 + self.brightness * rng.uniform(-1.0, 1.0))
        factors = 1.0 + self.tint * rng.uniform(-1.0, 1.0, (len(MATERIALS), 3))
        setting.tints = {
            name: (float(red), float(green), float(blue))
            for name, (red, green, blue) in zip(sorted(MATERIALS), factors.tolist(), strict=True)
        }
        return {"brightness": setting.brightness, "tints": setting.tints}


def tinted(colors: NDArray[np.float32], material: NDArray[np.integer], setting: Setting) -> NDArray[np.float32]:
    """Return colors of faces (m, 3) after the tints of their materials (m,) and the brightness of a setting."""
    factors = np.array([setting.tints.get(name, (1.0, 1.0, 1.0)) for name in MATERIAL_NAMES]) * setting.brightness
    return np.clip(colors * factors[material], 0.0, 255.0).astype(np.float32)
