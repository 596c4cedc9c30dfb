"""Randomization of the colors that cameras see."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from labgym.envs.checks import positive
from labgym.envs.palette import Palette
from labgym.envs.parts.protocols import Randomization
from labgym.envs.parts.registry import registered
from labgym.envs.setting import Setting
from labgym.scenes.mesh import MATERIAL_NAMES


@registered("randomization")
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
        brightness = float(1.0 + self.brightness * rng.uniform(-1.0, 1.0))
        factors = 1.0 + self.tint * rng.uniform(-1.0, 1.0, (len(MATERIAL_NAMES), 3))
        tints = {name: tuple(factor) for name, factor in zip(MATERIAL_NAMES, factors.tolist(), strict=True)}
        setting.palette = Palette(tints, brightness)
        return {"brightness": brightness, "tints": tints}
