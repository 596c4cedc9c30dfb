"""Sizes that cannot be right, with the unit that was most likely meant."""

from __future__ import annotations

from labgym.assets.catalog import Catalog
from labgym.assets.forge.facts import standing
from labgym.assets.forge.matching import Match, size_distance
from labgym.assets.meshes import UNITS, MeshError, MeshFile
from labgym.assets.sizes import Bounds, bounds_of

SPREAD = 4.0
"""The longest side may be this many times beyond those of the published entries of the same subtype."""
UNIT_NAMES = {
    "m": "metres",
    "dm": "decimetres",
    "cm": "centimetres",
    "mm": "millimetres",
    "um": "micrometres",
    "in": "inches",
    "ft": "feet",
    "yd": "yards",
}


def check_scale(catalog: Catalog, file: MeshFile, match: Match | None) -> None:
    """Check that a mesh is of a size that its category allows and, unless the unit was named, of that of its like.

    Raises:
        MeshError: it is not; names the unit that was likely meant.
    """
    low, high = file.bounds
    width, depth, height = (float(side) for side in high - low)
    sides = (width, depth, height)
    like = match.asset if match else None
    kind, category, placing = standing(like, sides)
    gas = bool(like and like.chemistry and like.chemistry.state == "gas")
    allowed, usual = bounds_of(kind, category, placing, gas), _usual(catalog, match)
    if _fits(sides, allowed, usual if file.unit_from != "option" else None):
        return
    shown = " x ".join(f"{side:.3g}" for side in sides)
    what = f"{category} ({match.why}, like {match.asset.name})" if match else f"{kind} of category {category}"
    limits = usual if _fits(sides, allowed, None) and usual else allowed
    expected = f"expected {limits.least:.3g} to {limits.greatest:.3g} m for a {what}"
    raise MeshError(file.path, f"measures {shown} m, {expected}; {_remedy(file, sides, allowed, usual, match)}")


def _usual(catalog: Catalog, match: Match | None) -> Bounds | None:
    """Return bounds of the longest side by the published entries of the same subtype; None for reagents."""
    if match is None or match.asset.kind == "reagent":
        return None
    like = match.asset
    longest = [
        max(asset.size.width, asset.size.depth, asset.size.height)
        for asset in catalog
        if (asset.kind, asset.category, asset.subtype) == (like.kind, like.category, like.subtype)
    ]
    return Bounds(min(longest) / SPREAD, max(longest) * SPREAD)


def _fits(sides: tuple[float, ...], allowed: Bounds, usual: Bounds | None) -> bool:
    within = all(allowed.least <= side <= allowed.greatest for side in sides)
    return within and (usual is None or usual.least <= max(sides) <= usual.greatest)


def _remedy(
    file: MeshFile, sides: tuple[float, float, float], allowed: Bounds, usual: Bounds | None, match: Match | None
) -> str:
    read = UNITS.get(file.source_unit) or float(file.source_unit.split()[0])
    right: list[tuple[float, str]] = []
    for unit, metres in UNITS.items():
        width, depth, height = (side * metres / read for side in sides)
        if _fits((width, depth, height), allowed, usual):
            off = size_distance(match.asset, (width, depth, height)) if match else float(len(right))
            right.append((off, unit))
    if not right:
        return "no unit makes it fit: name the published entry that it is with --like, or mend the model"
    unit = min(right)[1]
    meant = UNIT_NAMES.get(file.source_unit, file.source_unit)
    return f"looks like {UNIT_NAMES[unit]} read as {meant} ({file.unit_from}): --unit {unit}"
