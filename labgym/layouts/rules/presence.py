"""Asset: whether every asset that the protocol requires is placed, supported and in bounds."""

from __future__ import annotations

from collections import Counter
from functools import lru_cache

from labgym.assets import Catalog
from labgym.layouts.rules.arrangement import Arrangement
from labgym.protocols import Protocol


def missing_assets(arrangement: Arrangement, protocol: Protocol, out_of_bounds: frozenset[str]) -> tuple[str, ...]:
    """Return the required assets that are not placed, one name for each missing piece.

    Reagents, instruments and step locations are required, as a multiset with synonyms resolved. A variant counts
    as the asset whose role it has; an object that is out of bounds counts as missing.
    """
    placed = Counter(
        asset.role
        for placement, asset in zip(arrangement.placements, arrangement.assets, strict=True)
        if placement.id not in out_of_bounds
    )
    missing = Counter(resolved(protocol.required_assets(), arrangement.layout.catalog))
    missing.subtract(placed)
    return tuple(name for name, count in missing.items() for _ in range(count))


@lru_cache(maxsize=1024)
def resolved(names: tuple[str, ...], catalog: Catalog) -> tuple[str, ...]:
    """Return the canonical names of assets named in any way that the catalog knows.

    Raises:
        UnknownNameError: the catalog has no such asset.
    """
    return tuple(catalog.find(name).name for name in names)
