"""Glassware in cabinets and on drying racks is empty, and funnels stand on their rims."""

from __future__ import annotations

from labgym.assets import Asset
from labgym.assets.shapes.registry import EMPTY, INVERTED
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR, WALL
from labgym.scenes.fittings.scope import has_fittings

STORES = ("glassware_cabinet", "rack")
"""Subtypes of furniture in which glassware is stored clean."""
FUNNEL = "funnel"
"""Shape of conical funnels, which cannot stand on their stem."""


def drawn_asset(layout: Layout, placement_id: str) -> Asset:
    """Return the catalog entry whose shape a scene shows for a placement: stored glassware has no liquid."""
    asset = layout.asset(placement_id)
    support = layout.placement(placement_id).support
    if asset.category != "glassware" or support in (FLOOR, WALL) or not has_fittings(layout.floor):
        return asset
    if layout.asset(support).subtype not in STORES:
        return asset
    parameters = {**asset.shape.parameters, EMPTY: True, **({INVERTED: True} if asset.shape.name == FUNNEL else {})}
    return asset.model_copy(update={"shape": asset.shape.model_copy(update={"parameters": parameters})})
