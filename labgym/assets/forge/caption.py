"""The caption phase by rules: one line with the object, its place and its precautions."""

from __future__ import annotations

from typing import Any

from labgym.assets.forge.naming import as_words
from labgym.assets.forge.record import origin
from labgym.assets.forge.semantic import EntryDraft
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
    name, subtype = as_words(fields["name"]).capitalize(), fields["subtype"].replace("_", " ")
    return f"{name} ({subtype}): {'; '.join([place, *cares])}."


def write_caption(draft: EntryDraft) -> None:
    """Set the caption, with the least confidence of the fields that it is made from."""
    sources = [source for name, source in draft.origins.items() if name.startswith(("hazards", "kind"))]
    confidence = min(source.confidence for source in sources)
    draft.put("caption", caption(draft.fields), origin("rule", "kind, hazards and placing", confidence))
