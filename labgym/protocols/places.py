"""Suitability of places for steps."""

from __future__ import annotations

from labgym.assets import Asset

BENCH_CATEGORIES = ("furniture", "containment", "safety_equipment")


def is_workplace(asset: Asset) -> bool:
    """Return whether a step can take place there: a bench, hood or glove box with a surface, not a storage cabinet."""
    return (
        asset.kind == "facility"
        and asset.category in BENCH_CATEGORIES
        and bool(asset.surfaces)
        and asset.storage_class is None
    )


def is_ventilated(asset: Asset) -> bool:
    """Return whether a place is ventilated: a fume hood, a glove box, or a bench with local exhaust."""
    return asset.fume_hood or asset.category == "containment" or "local_exhaust" in asset.specs.features


def needs_ventilation(reagent: Asset) -> bool:
    """Return whether an open container of a reagent releases toxic or flammable vapor.

    Solids do so only if they are dissolved or heated, so weighing them on a bench is allowed; see
    `labgym.protocols.rules.safety`.
    """
    return reagent.hazards.volatile_or_toxic or reagent.hazards.flammable
