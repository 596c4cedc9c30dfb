"""The semantic, domain and caption phases by rules: the fields of an entry, the origin of each, and its caption."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from labgym.assets.checks import DENSITY_RANGE_KG_M3
from labgym.assets.forge.facts import Facts, standing, top_surface
from labgym.assets.forge.matching import as_words, camel, is_amount, telling, volume_of
from labgym.assets.forge.record import Origin, origin
from labgym.assets.model import Asset, Hazards, Kind, Size
from labgym.assets.search import normalize
from labgym.assets.specs import Specifications

VESSEL = "vessel"
BULK_DENSITY_KG_M3 = 300.0
"""Mass over bounding box of an unknown object, kg/m3."""
MAX_MASS_KG = 5000.0
DEVICE_SPECIFICATIONS = (
    *("heating_C", "cooling_C", "flame_C", "rotation_rpm", "power_W", "ultimate_mbar", "water_L_min"),
    *("capacity_g", "resolution_g", "measures_C", "features"),
)
"""Specifications that a device shares with the entry that it resembles, independent of size."""
WARE_SPECIFICATIONS = ("withstands_C",)
"""Specifications that ware shares with an entry of the same material."""


@dataclass
class EntryDraft:
    """Fields of an entry that is being annotated, the origin of each, and notes for the user."""

    fields: dict[str, Any] = field(default_factory=dict)
    origins: dict[str, Origin] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def put(self, name: str, value: Any, source: Origin) -> None:
        """Set a field and its origin."""
        self.fields[name], self.origins[name] = value, source


def semantic(facts: Facts) -> EntryDraft:
    """Return a draft with all fields except hazards and caption."""
    draft = EntryDraft()
    _classify(facts, draft)
    _name(facts, draft)
    _synonyms(facts, draft)
    _place(facts, draft)
    _specify(facts, draft)
    draft.put("size", _rounded(facts.size), origin("measured"))
    by_volume = origin("catalogue", f"{facts.like.name}, by volume", 0.4) if facts.like else origin("default")
    draft.put("mass", _mass(facts), by_volume)
    draft.put("description", description(facts, draft), origin("rule"))
    return draft


def description(facts: Facts, draft: EntryDraft) -> str:
    """Return a sentence with the measurements and, if the object resembles an entry, that entry's description."""
    size, like = facts.size, facts.like
    material = f" of {' and '.join(facts.substances)}" if facts.substances else ""
    box = " x ".join(f"{1000.0 * side:.0f}" for side in (size.width, size.depth, size.height))
    first = f"{as_words(draft.fields['name']).capitalize()}{material}, {box} mm, imported from a mesh."
    return f"{first} Like {as_words(like.name)}: {like.description}" if like else first


def _classify(facts: Facts, draft: EntryDraft) -> None:
    like, size, nearest = facts.like, facts.size, facts.resemblance
    kind, category, placing = standing(like, (size.width, size.depth, size.height))
    if like and nearest:
        source = origin("catalogue", f"{nearest.why}, like {like.name}", nearest.confidence)
        subtype = like.subtype
        if category == "glassware" and facts.substances and "glass" not in facts.substances:
            category, source = "plasticware", origin("rule", f"made of {', '.join(facts.substances)}", 0.6)
    elif kind == "instrument" and "glass" in facts.substances:
        category, subtype, source = "glassware", VESSEL, origin("rule", "made of glass, no name matches", 0.3)
    else:
        subtype, source = "other", origin("default", "by size alone")
        draft.notes.append(_unnamed(facts, f"{kind}, {category}"))
    for name, value in (("kind", kind), ("category", category), ("subtype", subtype), ("placing", placing)):
        draft.put(name, value, source)


def _unnamed(facts: Facts, what: str) -> str:
    nearest = facts.resemblance
    doubt = f" (closest: {nearest.asset.name}, confidence {nearest.confidence:.2f})" if nearest else ""
    return f"its texts name no entry of the catalog{doubt}: entered as {what} by size alone; give --like or --model"


def _name(facts: Facts, draft: EntryDraft) -> None:
    if facts.chosen_name:
        draft.put("name", facts.chosen_name, origin("file", "chosen by the user", 1.0))
        return
    parts = telling(facts.label)
    amounts = [part for part in parts if is_amount(part)]
    words = camel([part for part in parts if not is_amount(part)])
    source = origin("file", f"from {facts.label!r}"[:80])
    if facts.like and (facts.like.kind == "reagent" or len(words) < 2):
        words, source = facts.like.name, origin("catalogue", f"like {facts.like.name}", 0.7)
    name = words + camel(["x", *amounts])[1:] if len(words) > 1 else f"Object{facts.digest[:8].upper()}"
    draft.put("name", free_name(facts, name, draft.fields["kind"]), source)


def _synonyms(facts: Facts, draft: EntryDraft) -> None:
    name, like = draft.fields["name"], facts.like
    taken = facts.taken
    words = [as_words(name)] + [text for text in (facts.stem, facts.file.name) if text.isascii()]
    english = _untaken(words, taken) or (f"imported {as_words(name)}",)
    draft.put("synonyms_en", english, origin("file", "names in the file", 0.5))
    chinese = [text for text in (facts.stem, facts.file.name) if not text.isascii()]
    source = origin("file", "names in the file", 0.5)
    if like and like.synonyms_zh:
        chinese.append(f"{like.synonyms_zh[0]} {name}")
        source = origin("catalogue", f"like {like.name}", 0.5)
    elif not chinese:
        chinese, source = [f"导入资产 {name}"], origin("default")
    draft.put("synonyms_zh", _untaken(chinese, taken), source)


def free_name(facts: Facts, name: str, kind: Kind) -> str:
    """Return a name that is not a name or synonym of another entry, with a suffix if it would be."""
    if normalize(name) in facts.taken:
        name += "Bottle" if kind == "reagent" else "Mesh"
    return name + facts.digest[:6].upper() if normalize(name) in facts.taken else name


def _untaken(texts: list[str], taken: frozenset[str]) -> tuple[str, ...]:
    """Return the texts that are not names of another entry, each spelling once."""
    free: dict[str, str] = {}
    for text in texts:
        form = normalize(text)
        if form and form not in taken:
            free.setdefault(form, text[:60])
    return tuple(free.values())


def _place(facts: Facts, draft: EntryDraft) -> None:
    like = facts.like
    if like is None:
        return
    source = origin("catalogue", f"like {like.name}")
    for name in ("clearance", "mount_height", "chemistry"):
        if getattr(like, name):
            draft.put(name, getattr(like, name), source)
    if like.surfaces and like.cavity is None:
        surface = top_surface(facts.mesh)
        if surface is not None:
            draft.put("surfaces", (surface,), origin("measured", "a flat top"))
        else:
            draft.notes.append("its top is not flat, so nothing can stand on it")
    if like.cavity is not None:
        draft.notes.append("its inside is not measured: the asset is solid and holds nothing")


def _specify(facts: Facts, draft: EntryDraft) -> None:
    """Set the specifications: the volume in the name, and those of the resembled entry that do not depend on size."""
    like = facts.like
    specs: dict[str, Any] = {}
    source = origin("default")
    if like is not None and like.kind != "reagent":
        same = like.category == draft.fields["category"]
        specs = {
            name: value
            for name, value in like.specs.items()
            if name in DEVICE_SPECIFICATIONS or (same and name in WARE_SPECIFICATIONS)
        }
        source = origin("catalogue", f"like {like.name}", 0.6)
    volume = volume_of(facts.label)
    if volume and draft.fields["kind"] != "facility":
        specs["pack_mL" if draft.fields["kind"] == "reagent" else "capacity_mL"] = volume
        source = origin("file", f"from {facts.label!r}"[:80])
    if specs:
        draft.put("specs", Specifications.model_validate(specs), source)


def _rounded(size: Size) -> Size:
    """Return a size rounded to a micrometre: files hold single precision."""
    return Size(width=round(size.width, 6), depth=round(size.depth, 6), height=round(size.height, 6))


def _mass(facts: Facts) -> float:
    size, like = facts.size, facts.like
    box = size.width * size.depth * size.height
    density = like.mass / (like.size.width * like.size.depth * like.size.height) if like else BULK_DENSITY_KG_M3
    return min(max(float(f"{density * box:.3g}"), 1.01 * DENSITY_RANGE_KG_M3[0] * box, 1e-6), MAX_MASS_KG)


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
