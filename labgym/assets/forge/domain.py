"""The domain phase by rules: the nine hazard flags, each with where it comes from."""

from __future__ import annotations

from labgym.assets.forge.facts import Facts
from labgym.assets.forge.record import Origin, origin
from labgym.assets.forge.semantic import Draft
from labgym.assets.model import Asset, Hazards

BASE_CONFIDENCE = {"high": 0.95, "medium": 0.85, "low": 0.7}
"""How sure flags of a reagent are by the confidence of its data in the chemistry base."""
VESSELS = ("glassware", "plasticware", "ceramic")


def domain(facts: Facts, draft: Draft) -> None:
    """Set hazards, and the heat class that goes with one of them."""
    like = facts.like
    found = _of_contents(like) if like and like.kind == "reagent" else _of_equipment(facts, draft)
    draft.fields["hazards"] = Hazards(**{flag: value for flag, (value, _) in found.items()})
    draft.origins |= {f"hazards.{flag}": source for flag, (_, source) in found.items()}
    if like and like.heat_class is not None and found["heat_source"][0]:
        draft.put("heat_class", like.heat_class, origin("catalogue", f"like {like.name}"))


def _of_contents(like: Asset) -> dict[str, tuple[bool, Origin]]:
    chemistry = like.chemistry
    sure = BASE_CONFIDENCE[chemistry.confidence] if chemistry else 0.5
    source = origin("catalogue", f"data of {like.name}", sure)
    return {flag: (getattr(like.hazards, flag), source) for flag in Hazards.model_fields}


def _of_equipment(facts: Facts, draft: Draft) -> dict[str, tuple[bool, Origin]]:
    like, match = facts.like, facts.match
    none = origin("rule", "equipment without contents", 0.8)
    found: dict[str, tuple[bool, Origin]] = dict.fromkeys(Hazards.model_fields, (False, none))
    if like and match:
        source = origin("catalogue", f"like {like.name}", match.confidence)
        found |= {flag: (True, source) for flag in Hazards.model_fields if getattr(like.hazards, flag)}
    found["glass_container"] = _glass(facts, draft)
    heats = bool(like and like.heat_class)
    found["heat_source"] = heats, found["heat_source"][1] if heats else origin("rule", "no heating equipment", 0.7)
    return found


def _glass(facts: Facts, draft: Draft) -> tuple[bool, Origin]:
    category, made = draft.fields["category"], facts.substances
    if category == "glassware":
        why = "a material is named glass" if "glass" in made else "glassware is glass"
        return True, origin("rule", why, 0.95 if "glass" in made else draft.origins["category"].confidence)
    if facts.like and facts.like.hazards.glass_container and not made:
        return True, origin("catalogue", f"like {facts.like.name}", draft.origins["category"].confidence)
    vessel = category in VESSELS
    why = f"made of {', '.join(made)}" if made else f"{category} is no glass vessel"
    return vessel and "glass" in made, origin("rule", why, 0.8 if made else 0.6)
