"""The semantic and domain phases by a language model: its answer is data, and only valid parts of it are used.

The model describes an object from measurements, the draft of the rules and pictures.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, create_model

from labgym.assets.catalog import Catalog
from labgym.assets.checks import MIN_CHARACTERS
from labgym.assets.forge.drafting import EntryDraft, free_name, write_caption
from labgym.assets.forge.facts import Facts
from labgym.assets.forge.record import Share, origin
from labgym.assets.model import Asset, Hazards, Kind
from labgym.assets.search import normalize
from labgym.documents import Record

if TYPE_CHECKING:
    from labgym.llm import LanguageModel

PROMPT = Path(__file__).resolve().parent / "prompts" / "annotate_asset.md"
MAX_SYNONYMS = 8
Words = Annotated[str, Field(min_length=1, max_length=60)]


class Described(Record):
    """A language model's description of an object.

    Attributes:
        semantic, domain: confidence in name, category and words; and in the hazards, between 0 and 1.
    """

    name: Annotated[str, Field(pattern=r"^[A-Z][A-Za-z0-9]{1,63}$")]
    kind: Kind
    category: str
    subtype: str
    synonyms_en: Annotated[tuple[Words, ...], Field(max_length=MAX_SYNONYMS)]
    synonyms_zh: Annotated[tuple[Words, ...], Field(max_length=MAX_SYNONYMS)]
    description: Annotated[str, Field(min_length=1, max_length=600)]
    caption: Annotated[str, Field(min_length=1, max_length=300)]
    hazards: Hazards
    semantic: Share
    domain: Share


Annotator = Callable[[Mapping[str, Any], Mapping[str, Any], Sequence[bytes]], Described]
"""Asks a model for a description: takes measurements, the draft of the rules and PNG views."""


def describe(
    model: LanguageModel,
    catalog: Catalog,
    measured: Mapping[str, Any],
    draft: Mapping[str, Any],
    pictures: Sequence[bytes] = (),
) -> Described:
    """Return a language model's description of an object, with a kind, category and subtype of the catalog.

    Args:
        model: the client.
        catalog: its kinds, categories and subtypes are the ones to choose from.
        measured: name, sizes in meters, materials and colors from the file; untrusted text to the model.
        draft: the entry by rules.
        pictures: PNG views of the object.

    Raises:
        LanguageModelError: no usable answer.
    """
    from labgym.llm import LanguageModelError, load_prompt

    prompt = load_prompt(PROMPT)
    categories = _categories(catalog.assets)
    question = prompt.fill(pictures, measured=dict(measured), draft=dict(draft), categories=categories)
    reply = model.ask(prompt.label, question, _answer(catalog.assets))
    answer = Described.model_validate(reply.answer.model_dump())
    if answer.subtype not in categories.get(answer.kind, {}).get(answer.category, []):
        problem = f"no {answer.kind} of the catalog has category {answer.category!r} and subtype {answer.subtype!r}"
        raise LanguageModelError("malformed", f"language model: {problem}; ask again with another model", reply.text)
    return answer


def measured(facts: Facts) -> dict[str, Any]:
    """Return the description of a mesh for a model: sizes in meters and the file's texts."""
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


def drafted(draft: EntryDraft) -> dict[str, Any]:
    """Return the draft of the rules for a model."""
    names = ("name", "kind", "category", "subtype", "synonyms_en", "synonyms_zh", "description", "caption")
    return {**{name: draft.fields[name] for name in names}, "hazards": draft.fields["hazards"].model_dump()}


def take(answer: Described, facts: Facts, draft: EntryDraft) -> None:
    """Put the answer of a model into a draft, with the confidence that it states.

    The rules decide what a model cannot know: a reagent's chemistry and flags come from the chemistry base, a model can
    neither make an object a reagent nor a reagent something else, and the heat class is that of the resembled entry.
    """
    chemical = "reagent" in (answer.kind, draft.fields["kind"])
    semantic = origin("model", confidence=answer.semantic)
    if chemical and answer.kind != draft.fields["kind"]:
        draft.notes.append(f"the model calls it {answer.kind} {answer.category}; the kind by rules is used")
    elif not chemical:
        for name, value in (("kind", answer.kind), ("category", answer.category), ("subtype", answer.subtype)):
            draft.put(name, value, semantic)
        _place(answer, facts, draft)
        _hazards(answer, facts, draft)
    if facts.chosen_name is None and not chemical:
        draft.put("name", free_name(facts, answer.name[:54], draft.fields["kind"]), semantic)
    for name, texts in (("synonyms_en", answer.synonyms_en), ("synonyms_zh", answer.synonyms_zh)):
        synonyms = _extended(draft.fields[name], texts, facts)
        if len(synonyms) > len(draft.fields[name]):
            draft.put(name, synonyms, semantic)
    short = len(answer.description) < MIN_CHARACTERS
    text = f"{answer.description} {draft.fields['description']}" if short else answer.description
    draft.put("description", text, semantic)
    write_caption(draft)
    draft.put("caption", f"{answer.caption.rstrip('. ')}. {draft.fields['caption']}", semantic)


def _place(answer: Described, facts: Facts, draft: EntryDraft) -> None:
    """Place the object as the published entries of that kind, category and subtype are placed."""
    alike = [
        a for a in facts.catalog if (a.kind, a.category, a.subtype) == (answer.kind, answer.category, answer.subtype)
    ]
    if alike and facts.like not in alike:
        near = alike[0]
        source = origin("catalogue", f"as {near.name}", answer.semantic)
        draft.put("placing", near.placing, source)
        draft.put("clearance", near.clearance, source)
        draft.put("mount_height", near.mount_height, source)
        draft.fields.pop("surfaces", None)


def _hazards(answer: Described, facts: Facts, draft: EntryDraft) -> None:
    flags = answer.hazards.model_dump()
    if draft.fields["category"] == "glassware":
        flags["glass_container"] = True
    if flags["heat_source"]:
        heats = facts.like.heat_class if facts.like and facts.like.heat_class else "instrument"
        draft.put("heat_class", heats, origin("model", confidence=answer.domain))
    else:
        draft.fields.pop("heat_class", None)
    draft.fields["hazards"] = Hazards(**flags)
    draft.origins |= {f"hazards.{flag}": origin("model", confidence=answer.domain) for flag in flags}


def _extended(synonyms: tuple[str, ...], texts: Sequence[str], facts: Facts) -> tuple[str, ...]:
    """Return synonyms with those texts of a model that are not names of a published entry."""
    forms = {normalize(text): text for text in synonyms}
    for text in texts:
        if normalize(text) and normalize(text) not in facts.taken:
            forms.setdefault(normalize(text), text)
    return tuple(forms.values())


def _categories(assets: Sequence[Asset]) -> dict[str, dict[str, list[str]]]:
    """Return the subtypes by kind and category, sorted."""
    by_kind: dict[str, dict[str, set[str]]] = {}
    for asset in assets:
        by_kind.setdefault(asset.kind, {}).setdefault(asset.category, set()).add(asset.subtype)
    return {
        kind: {category: sorted(subtypes) for category, subtypes in sorted(categories.items())}
        for kind, categories in sorted(by_kind.items())
    }


def _answer(assets: Sequence[Asset]) -> type[Record]:
    categories: Any = Literal[tuple(sorted({asset.category for asset in assets}))]
    subtypes: Any = Literal[tuple(sorted({asset.subtype for asset in assets}))]
    return create_model("AssetDescription", __base__=Described, category=(categories, ...), subtype=(subtypes, ...))
