"""Which variants of furniture stand on a floor: one for each role, drawn by the seed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from labgym.assets import Asset, Catalog
from labgym.layouts.roles import with_role

Variety = Literal["plain", "training", "held_out"]
"""Which furniture a floor may have: no variants, the variants of training, or those that training never shows."""
VARIANT_STREAM = 0x7A
"""Sub-stream of the seed from which variants are drawn."""


@dataclass(frozen=True)
class Furniture:
    """The catalog with a variant, or an existing piece, in the place of some assets.

    Attributes:
        chosen: names of variants by the name of the asset whose role they have.
    """

    catalog: Catalog
    chosen: Mapping[str, str] = field(default_factory=dict)

    def get(self, name: str) -> Asset:
        """Return the asset that has the role of the named one.

        Raises:
            UnknownNameError: the catalog has no such asset.
        """
        return with_role(self.catalog.get(self.chosen.get(name, name)), self.catalog.get(name).role)

    def instead(self, asset: Asset) -> Asset:
        """Return what stands in the place of an asset: itself, or a variant."""
        return self.get(asset.role) if asset.role in self.chosen else asset


def draw_variants(catalog: Catalog, variety: Variety, seed: int) -> dict[str, str]:
    """Return names of variants by role: one draw for each subtype, so that all benches are of one range.

    For training an asset itself is one of the choices, which is the absence of its role from the result.
    """
    if variety == "plain":
        return {}
    generator = np.random.default_rng([seed, VARIANT_STREAM])
    held_out = variety == "held_out"
    roles = sorted({asset.variant_of for asset in catalog if asset.variant_of is not None})
    draws = {subtype: float(generator.random()) for subtype in sorted({catalog.get(role).subtype for role in roles})}
    chosen = {}
    for role in roles:
        names = [asset.name for asset in catalog.variants(role, held_out)]
        choices = names if held_out else [role, *names]
        if choices:
            chosen[role] = choices[int(draws[catalog.get(role).subtype] * len(choices))]
    return {role: name for role, name in chosen.items() if name != role}
