"""The semantic and domain phases by a language model: what it says is data, taken where it holds up."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

from pydantic import Field

from labgym.assets.checks import MIN_TEXT
from labgym.assets.forge.caption import write_caption
from labgym.assets.forge.facts import Facts
from labgym.assets.forge.record import Share, origin
from labgym.assets.forge.semantic import Draft, free_name
from labgym.assets.model import Hazards, Kind
from labgym.assets.search import normalise
from labgym.documents import Record

MAX_SYNONYMS = 8
Words = Annotated[str, Field(min_length=1, max_length=60)]


class Described(Record):
    """What a language model says of an object.

    Attributes:
        semantic, domain: how sure it is of name, category and words; and of the hazards.
    """

    name: Annotated[str, Field(pattern=r"^[A-Z][A-Za-z0-9]{1,63}$")]
    kind: Kind
    category: Annotated[str, Field(max_length=60)]
    subtype: Annotated[str, Field(max_length=60)]
    synonyms_en: tuple[Words, ...] = ()
    synonyms_zh: tuple[Words, ...] = ()
    description: Annotated[str, Field(max_length=1000)]
    caption: Annotated[str, Field(max_length=500)]
    hazards: Hazards
    semantic: Share
    domain: Share


Annotator = Callable[[Mapping[str, Any], Mapping[str, Any], Sequence[bytes]], Described]
"""Asks a model: measurements, the rules' draft and PNG views to what it says."""


def measured(facts: Facts) -> dict[str, Any]:
    """Return what a model is told of a mesh: sizes in metres and the file's texts."""
    size = facts.size
    return {
        "file": facts.stem[:80],
        "object": facts.file.name[:80],
        "size_m": {"width": round(size.width, 4), "depth": round(size.depth, 4), "height": round(size.height, 4)},
        "watertight": facts.mesh.watertight,
        "parts": [part.name[:40] for part in facts.mesh.parts[:20]],
        "materials": sorted({part.material[:40] for part in facts.mesh.parts if part.material})[:20],
        "resembles": facts.like.name if facts.like else None,
    }


def drafted(draft: Draft) -> dict[str, Any]:
    """Return what a model is told of the rules' draft."""
    names = ("name", "kind", "category", "subtype", "synonyms_en", "synonyms_zh", "description", "caption")
    found = {name: draft.fields[name] for name in names}
    return {**found, "hazards": draft.fields["hazards"].model_dump()}


def take(said: Described, facts: Facts, draft: Draft) -> None:
    """Put what a model says into a draft, as sure as it says it is.

    The rules keep what a model cannot know: a reagent's chemistry and flags come from the chemistry base, and a model
    can make nothing a reagent, nor a reagent something else; heat has a class of the entry that it resembles.
    """
    chemical = "reagent" in (said.kind, draft.fields["kind"])
    semantic = origin("model", confidence=said.semantic)
    if chemical and said.kind != draft.fields["kind"]:
        draft.notes.append(f"the model takes it for {said.kind} {said.category}; the rules' kind is kept")
    elif not chemical:
        for name, value in (("kind", said.kind), ("category", said.category), ("subtype", said.subtype)):
            draft.put(name, value, semantic)
        _place(said, facts, draft)
        _hazards(said, facts, draft)
    if facts.given_name is None and not chemical:
        draft.put("name", free_name(facts, said.name[:54], draft.fields["kind"]), semantic)
    for name, texts in (("synonyms_en", said.synonyms_en), ("synonyms_zh", said.synonyms_zh)):
        kept = _new(texts, facts, draft.fields[name])
        if len(kept) > len(draft.fields[name]):
            draft.put(name, kept, semantic)
    told = (
        said.description if len(said.description) >= MIN_TEXT else f"{said.description} {draft.fields['description']}"
    )
    draft.put("description", told, semantic)
    write_caption(draft)
    draft.put("caption", f"{said.caption.rstrip('. ')}. {draft.fields['caption']}", semantic)


def _place(said: Described, facts: Facts, draft: Draft) -> None:
    """Place it as the published entries of that kind, category and subtype are."""
    alike = [a for a in facts.published if (a.kind, a.category, a.subtype) == (said.kind, said.category, said.subtype)]
    if alike and facts.like not in alike:
        near = alike[0]
        source = origin("catalogue", f"as {near.name}", said.semantic)
        draft.put("placing", near.placing, source)
        draft.put("clearance", near.clearance, source)
        draft.put("mount_height", near.mount_height, source)
        draft.fields.pop("surfaces", None)


def _hazards(said: Described, facts: Facts, draft: Draft) -> None:
    flags = said.hazards.model_dump()
    if draft.fields["category"] == "glassware":
        flags["glass_container"] = True
    if flags["heat_source"]:
        heats = facts.like.heat_class if facts.like and facts.like.heat_class else "instrument"
        draft.put("heat_class", heats, origin("model", confidence=said.domain))
    else:
        draft.fields.pop("heat_class", None)
    draft.fields["hazards"] = Hazards(**flags)
    draft.origins |= {f"hazards.{flag}": origin("model", confidence=said.domain) for flag in flags}


def _new(said: Sequence[str], facts: Facts, ours: tuple[str, ...]) -> tuple[str, ...]:
    """Return our synonyms with those of a model that are no published entry's."""
    found = {normalise(text): text for text in ours}
    for text in said[:MAX_SYNONYMS]:
        if normalise(text) and normalise(text) not in facts.taken:
            found.setdefault(normalise(text), text)
    return tuple(found.values())
