"""Assets described by a language model from measurements, a draft of the rules and pictures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from labgym.assets import Asset, Catalog, Hazards, Kind
from labgym.documents import Record
from labgym.llm.client import LanguageModel
from labgym.llm.errors import LanguageModelError
from labgym.llm.prompting import load_prompt

PROMPT = Path(__file__).resolve().parent / "prompts" / "annotate_asset.md"
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Words = Annotated[str, Field(min_length=1, max_length=60)]


class Description(Record):
    """A model's description of an object.

    Attributes:
        semantic, domain: confidence in name, category and words; and in the hazards, between 0 and 1.
    """

    name: Annotated[str, Field(pattern=r"^[A-Z][A-Za-z0-9]{1,63}$")]
    kind: Kind
    category: str
    subtype: str
    synonyms_en: Annotated[list[Words], Field(max_length=8)]
    synonyms_zh: Annotated[list[Words], Field(max_length=8)]
    description: Annotated[str, Field(min_length=1, max_length=600)]
    caption: Annotated[str, Field(min_length=1, max_length=300)]
    hazards: Hazards
    semantic: Share
    domain: Share


def describe(
    model: LanguageModel,
    catalog: Catalog,
    measured: Mapping[str, Any],
    draft: Mapping[str, Any],
    pictures: Sequence[bytes] = (),
) -> Description:
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
    prompt = load_prompt(PROMPT)
    categories = _categories(catalog.assets)
    question = prompt.fill(pictures, measured=dict(measured), draft=dict(draft), categories=categories)
    reply = model.ask(prompt.label, question, _answer(catalog.assets))
    answer = Description.model_validate(reply.answer.model_dump())
    if answer.subtype not in categories.get(answer.kind, {}).get(answer.category, []):
        problem = f"no {answer.kind} of the catalog has category {answer.category!r} and subtype {answer.subtype!r}"
        raise LanguageModelError("malformed", f"language model: {problem}; ask again with another model", reply.text)
    return answer


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
    return create_model("AssetDescription", __base__=Description, category=(categories, ...), subtype=(subtypes, ...))
