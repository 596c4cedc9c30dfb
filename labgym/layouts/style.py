"""How a floor is furnished: how densely and how regularly, and with which variants of furniture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from labgym.assets import Asset, Catalog
from labgym.layouts.floors import FamilyStyle
from labgym.layouts.roles import with_role

Variety = Literal["plain", "training", "held_out"]
"""Which furniture a floor may have: no variants, the variants of training, or those that training never shows."""
VARIANT_STREAM = 0x7A
"""Sub-stream of the seed from which variants are drawn."""


@dataclass(frozen=True)
class FurnitureRange:
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


AISLE = (1.2, 1.5)
"""Range of the clear width around benches of a floor that is of no family, meters: the same along their sides and at
their ends, 1.5 between occupied benches (UC laboratory design manual) and 1.2 at least."""
WALLS, ISLANDS = (0.4, 0.8), (0.04, 0.14)
"""Ranges of what a floor varies in further; assumptions."""
KINDS = ("island", "island", "double_island", "peninsula", "oblique")


@dataclass(frozen=True)
class Style:
    """How a floor is furnished.

    Attributes:
        aisle: clear width along the sides of free-standing benches, meters.
        neck: clear width at their ends, meters.
        walls: share of the wall length that furniture takes.
        islands: share of the floor area that free-standing benches take.
        kinds: kinds of free-standing benches that occur: island, double_island, peninsula, oblique (along oblique
            walls).
        hood_walls: pairs of a space and the index of a wall that may carry hoods; empty for any wall.
        variety: which variants of furniture it has.
    """

    aisle: float = 1.2
    neck: float = 1.0
    walls: float = 0.65
    islands: float = 0.1
    kinds: tuple[str, ...] = ("island",)
    hood_walls: tuple[tuple[str, int], ...] = ()
    variety: Variety = "plain"

    @classmethod
    def draw(cls, generator: np.random.Generator) -> Style:
        """Return a random style for a floor that is of no family."""
        width = round(float(generator.uniform(*AISLE)), 2)
        return cls(aisle=width, neck=width, kinds=KINDS).varied(generator)

    @classmethod
    def of(cls, style: FamilyStyle) -> Style:
        """Return the style that a family asks for."""
        return cls(
            aisle=style.aisle,
            neck=style.maintenance_aisle,
            kinds=style.islands,
            hood_walls=tuple((each.space, each.wall) for each in style.hood_walls),
            variety="held_out" if style.held_out else "training",
        )

    def varied(self, generator: np.random.Generator) -> Style:
        """Return the style with other shares of walls and floor."""
        return replace(
            self,
            walls=round(float(generator.uniform(*WALLS)), 2),
            islands=round(float(generator.uniform(*ISLANDS)), 3),
        )
