"""The domain phase by rules: the nine hazard flags, each with its origin."""

from __future__ import annotations

from labgym.assets.forge.facts import Facts
from labgym.assets.forge.record import Origin, origin
from labgym.assets.forge.semantic import EntryDraft
from labgym.assets.model import Asset, Hazards

BASE_CONFIDENCE = {"high": 0.95, "medium": 0.85, "low": 0.7}
"""Confidence in the flags of a reagent by the confidence of its chemical data."""
VESSELS = ("glassware", "plasticware", "ceramic")


def domain(facts: Facts, draft: EntryDraft) -> None:
    """Set the hazards, and the heat class of a heat source."""
    like = facts.like
    flags = _of_contents(like) if like and like.kind == "reagent" else _of_equipment(facts, draft)
    draft.fields["hazards"] = Hazards(**{flag: value for flag, (value, _) in flags.items()})
    draft.origins |= {f"hazards.{flag}": source for flag, (_, source) in flags.items()}
    if like and like.heat_class is not None and flags["heat_source"][0]:
        draft.put("heat_class", like.heat_class, origin("catalogue", f"like {like.name}"))


def _of_contents(like: Asset) -> dict[str, tuple[bool, Origin]]:
    chemistry = like.chemistry
    confidence = BASE_CONFIDENCE[chemistry.confidence] if chemistry else 0.5
    source = origin("catalogue", f"data of {like.name}", confidence)
    return {flag: (getattr(like.hazards, flag), source) for flag in Hazards.model_fields}


def _of_equipment(facts: Facts, draft: EntryDraft) -> dict[str, tuple[bool, Origin]]:
    like, nearest = facts.like, facts.resemblance
    none = origin("rule", "equipment without contents", 0.8)
    flags: dict[str, tuple[bool, Origin]] = dict.fromkeys(Hazards.model_fields, (False, none))
    if like and nearest:
        source = origin("catalogue", f"like {like.name}", nearest.confidence)
        flags |= {flag: (True, source) for flag in Hazards.model_fields if getattr(like.hazards, flag)}
    flags["glass_container"] = _glass(facts, draft)
    heats = bool(like and like.heat_class)
    flags["heat_source"] = heats, flags["heat_source"][1] if heats else origin("rule", "no heating equipment", 0.7)
    return flags


def _glass(facts: Facts, draft: EntryDraft) -> tuple[bool, Origin]:
    category, materials = draft.fields["category"], facts.substances
    if category == "glassware":
        why = "a material is named glass" if "glass" in materials else "glassware is glass"
        return True, origin("rule", why, 0.95 if "glass" in materials else draft.origins["category"].confidence)
    if facts.like and facts.like.hazards.glass_container and not materials:
        return True, origin("catalogue", f"like {facts.like.name}", draft.origins["category"].confidence)
    vessel = category in VESSELS
    why = f"made of {', '.join(materials)}" if materials else f"{category}: not a glass vessel"
    return vessel and "glass" in materials, origin("rule", why, 0.8 if materials else 0.6)
