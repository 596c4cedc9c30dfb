"""What the places where steps happen are good for."""

from __future__ import annotations

from labgym.assets import Asset

BENCH_CATEGORIES = ("furniture", "containment", "safety_equipment")


def is_workplace(asset: Asset) -> bool:
    """Say whether a step can happen there: a bench, hood or glove box with a surface, not a storage cabinet."""
    return (
        asset.kind == "facility"
        and asset.category in BENCH_CATEGORIES
        and bool(asset.surfaces)
        and asset.storage_class is None
    )


def is_ventilated(asset: Asset) -> bool:
    """Say whether vapours are carried off there: a fume hood, a glove box, or a bench with local exhaust."""
    return asset.fume_hood or asset.category == "containment" or "local_exhaust" in asset.specs.features


def needs_ventilation(reagent: Asset) -> bool:
    """Say whether an open container of a reagent gives off something toxic or flammable.

    Solids do so only when dissolved or heated, so that weighing them on a bench is allowed; see
    `labgym.protocols.rules.safety`.
    """
    return reagent.hazards.volatile_or_toxic or reagent.hazards.flammable
