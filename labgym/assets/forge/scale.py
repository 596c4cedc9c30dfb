"""Implausible sizes, with the most likely unit or scale."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from labgym.assets.catalog import Catalog
from labgym.assets.forge.facts import standing
from labgym.assets.forge.matching import Extents, Resemblance, size_distance, volume_of
from labgym.assets.meshes import UNITS, MeshError, MeshFile
from labgym.assets.model import Asset
from labgym.assets.plausibility import Bounds, bounds_of

SPREAD = 4.0
"""The longest side may be this many times beyond those of the published entries of the same subtype."""
HINT_SPREAD = 2.5
"""The same limit for a suggested unit, because a wrong hint is worse than no hint."""
BOX_PER_VOLUME = (0.7, 30.0)
"""Volume of the bounding box of a vessel or bottle over the volume in its name, least and greatest."""
UNIT_NAMES = {
    "m": "meters",
    "dm": "decimeters",
    "cm": "centimeters",
    "mm": "millimeters",
    "um": "micrometers",
    "in": "inches",
    "ft": "feet",
    "yd": "yards",
}
COMMON_UNITS = ("mm", "m", "cm", "in", "um")
"""Units in which models are drawn; only these are suggested."""
EXPORTED_UNITS = ("mm", "cm", "m")
"""Units suggested if the file or its format states one: exporters that write a wrong unit drew in one of these."""


@dataclass(frozen=True)
class _Limits:
    """Limits on the dimensions of a mesh.

    Attributes:
        allowed: sides, by category. usual: longest side, by the entries of the same subtype, or None.
        volume: of the bounding box, m3, by the volume in the name, or None.
    """

    allowed: Bounds
    usual: Bounds | None
    volume: tuple[float, float] | None

    def admit(self, sides: Extents) -> bool:
        """Return whether sides in meters are within all limits."""
        within = all(self.allowed.least <= side <= self.allowed.greatest for side in sides)
        box = sides[0] * sides[1] * sides[2]
        return (
            within
            and (self.usual is None or self.usual.least <= max(sides) <= self.usual.greatest)
            and (self.volume is None or self.volume[0] <= box <= self.volume[1])
        )


def check_scale(catalog: Catalog, file: MeshFile, stem: str, nearest: Resemblance | None) -> None:
    """Check that a mesh has a size that its category allows and, unless the user named the unit, a usual one.

    Args:
        stem: name of the file, which may give a volume.
        nearest: the entry that the mesh resembles; it counts even below the floor of confidence if only its size
            speaks against it, so that a wrong unit is reported rather than a wrong category.

    Raises:
        MeshError: the size is implausible; names the likely unit or scale.
    """
    low, high = file.bounds
    sides = (float(high[0] - low[0]), float(high[1] - low[1]), float(high[2] - low[2]))
    like = nearest.asset if nearest else None
    kind, category, placing = standing(like, sides)
    gas = like is not None and like.phase == "gas"
    allowed = bounds_of(kind, category, placing, gas)
    limits = _Limits(allowed, _usual(catalog, like, SPREAD), _volume(like, stem))
    if (_Limits(allowed, None, None) if file.unit_from == "option" else limits).admit(sides):
        return
    likely = replace(limits, usual=_usual(catalog, like, HINT_SPREAD))
    shown = " x ".join(f"{side:.3g}" for side in sides)
    what = f"{category} ({nearest.why}, like {nearest.asset.name})" if nearest else f"{category} ({kind}, by size)"
    if limits.volume and _Limits(allowed, limits.usual, None).admit(sides):
        least, greatest = (1000.0 * bound for bound in limits.volume)
        expected = f"expected a bounding box of {least:.2g} to {greatest:.2g} L for the volume in its name"
    else:
        bounds = limits.usual if limits.usual and _Limits(allowed, None, None).admit(sides) else allowed
        expected = f"expected {bounds.least:.3g} to {bounds.greatest:.3g} m for the category {what}"
    raise MeshError(file.path, f"measures {shown} m, {expected}; {_remedy(file, sides, likely, like)}")


def _usual(catalog: Catalog, like: Asset | None, spread: float) -> Bounds | None:
    """Return bounds of the longest side by the published entries of the same subtype; None for reagents."""
    if like is None or like.kind == "reagent":
        return None
    longest = [
        max(asset.size.width, asset.size.depth, asset.size.height)
        for asset in catalog.roles
        if (asset.kind, asset.category, asset.subtype) == (like.kind, like.category, like.subtype)
    ]
    return Bounds(min(longest) / spread, max(longest) * spread)


def _volume(like: Asset | None, stem: str) -> tuple[float, float] | None:
    milliliters = volume_of(stem)
    if milliliters is None or like is None or like.specs.volume_mL is None:
        return None
    return BOX_PER_VOLUME[0] * milliliters * 1e-6, BOX_PER_VOLUME[1] * milliliters * 1e-6


def _remedy(file: MeshFile, sides: Extents, limits: _Limits, like: Asset | None) -> str:
    units = list(_fitting_units(file, sides, limits))
    if units:
        unit = min(units, key=lambda unit: size_distance(like, _in_unit(file, sides, unit))) if like else units[0]
        read = UNIT_NAMES.get(file.source_unit, file.source_unit)
        return f"looks like {UNIT_NAMES[unit]} read as {read} ({file.unit_from}): --unit {unit}"
    if like is None:
        return "no common unit makes it fit: give --scale, or --like with the published entry that it is a model of"
    longest = max(like.size.width, like.size.depth, like.size.height)
    scale = float(f"{longest / max(sides):.2g}")
    as_long = f"its longest side {scale * max(sides):.2g} m, as of {like.name}"
    return f"no common unit makes it fit: --scale {scale:g} makes {as_long}; --like names another entry"


def _fitting_units(file: MeshFile, sides: Extents, limits: _Limits) -> Iterator[str]:
    units = EXPORTED_UNITS if file.unit_from == "file metadata" else COMMON_UNITS
    return (unit for unit in units if limits.admit(_in_unit(file, sides, unit)))


def _in_unit(file: MeshFile, sides: Extents, unit: str) -> Extents:
    """Return the sides as they would be if the file were in another unit."""
    read = UNITS.get(file.source_unit) or float(file.source_unit.split()[0])
    width, depth, height = (side * UNITS[unit] / read for side in sides)
    return width, depth, height
