"""The caption phase by rules: what it is for, what to mind, where it belongs, in a line."""

from __future__ import annotations

from typing import Any

from labgym.assets.forge.record import origin
from labgym.assets.forge.semantic import Draft
from labgym.assets.forge.words import spoken
from labgym.assets.model import Hazards

_CARE = {
    "flammable": "away from flames and hot surfaces",
    "explosive": "away from shock, friction and heat",
    "volatile_or_toxic": "open it in a fume hood",
    "glass_container": "a hand's width from the edge of the bench",
    "heat_source": "away from flammable reagents",
    "acid": "apart from bases",
    "base": "apart from acids",
    "oxidizer": "apart from fuels and reducing agents",
    "active_metal": "dry, away from water and acids",
}
_PLACES = {"floor": "stands on the floor", "desktop": "stands on a bench", "wall": "hangs on a wall"}


def caption(fields: dict[str, Any]) -> str:
    """Return the caption of a draft's fields."""
    hazards: Hazards = fields["hazards"]
    cares = [care for flag, care in _CARE.items() if getattr(hazards, flag)]
    chemistry = fields.get("chemistry")
    if chemistry is not None:
        place = f"kept in a cabinet of class {chemistry.storage_class}"
    else:
        free = f" with {fields['clearance']:g} m free in front" if fields.get("clearance") else ""
        place = _PLACES[fields["placing"]] + free
    return (
        f"{spoken(fields['name']).capitalize()} ({fields['subtype'].replace('_', ' ')}): {'; '.join([place, *cares])}."
    )


def write_caption(draft: Draft) -> None:
    """Set the caption, as sure as what it is made from."""
    sure = min(source.confidence for name, source in draft.origins.items() if name.startswith(("hazards", "kind")))
    draft.put("caption", caption(draft.fields), origin("rule", "kind, hazards and placing", sure))
