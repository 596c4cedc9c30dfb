"""Assets that a text names, in English, Chinese or as formulas, with their places."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from labgym.assets import Asset, Catalog
from labgym.assets.search import normalise, surface_forms
from labgym.protocols.language.folding import Folded
from labgym.protocols.language.words import words

MAX_FORM = 60
MentionKind = Literal["reagent", "instrument", "facility", "class"]


@dataclass(frozen=True)
class Mention:
    """A place in a text that names something.

    Attributes:
        start, end: the span in the text.
        name: canonical name of the asset, or of the class of substances.
    """

    start: int
    end: int
    text: str
    kind: MentionKind
    name: str


@dataclass(frozen=True)
class _Form:
    written: str
    kind: MentionKind
    name: str

    def fits(self, span: str) -> bool:
        """Say whether a span of the text that folds to this form may mean it."""
        if span.lower() in words().everyday:
            return False
        compact = normalise(self.written)
        if len(compact) <= 2 and compact.isascii():
            return span == self.written
        spaced = any(char.isspace() for char in span)
        return not (spaced and len(compact) <= 5 and " " not in self.written and not _chinese(compact))


def mentions(text: str) -> tuple[Mention, ...]:
    """Return what a text names, in order; where names overlap, the one that begins first and is longest.

    Names of assets, classes of substances ("a tert-butyl ester") and laboratory shorthand ("bicarb") are known.
    """
    return tuple(_scan(text))


def _scan(text: str) -> Iterator[Mention]:
    folded = Folded.of(text)
    forms = _forms()
    index, size = 0, len(folded.plain)
    while index < size:
        step = 1
        if folded.begins(index):
            for length in range(min(MAX_FORM, size - index), 0, -1):
                form = forms.get(folded.plain[index : index + length])
                stop = index + length if form is None else _end(folded, index + length)
                if form is None or stop is None:
                    continue
                start, end = folded.places[index], folded.places[stop - 1] + 1
                span = text[start : folded.places[index + length - 1] + 1]
                if form.fits(span):
                    yield Mention(start, end, text[start:end], form.kind, form.name)
                    step = stop - index
                    break
        index += step


def _end(folded: Folded, index: int) -> int | None:
    """Return where the word ends that a form fills, a plural's s included, or None inside a word."""
    if folded.ends(index):
        return index
    return index + 1 if folded.plain[index] == "s" and folded.ends(index + 1) else None


def _chinese(text: str) -> bool:
    return any("\u3400" <= char <= "\u9fff" for char in text)


@lru_cache(maxsize=1)
def _forms() -> dict[str, _Form]:
    forms: dict[str, _Form] = {}
    for kind, table in (("class", words().classes), ("asset", words().shorthand)):
        for name, written in table.items():
            for form in written:
                chosen: MentionKind = "class" if kind == "class" else Catalog.load().get(name).kind
                forms.setdefault(normalise(form), _Form(form, chosen, name))
    for asset in sorted(Catalog.load(), key=_precedence):
        for form in (*surface_forms(asset), *_without_remark(asset)):
            compact = normalise(form)
            if len(compact) > 1 or _chinese(compact):
                forms.setdefault(compact, _Form(form, asset.kind, asset.name))
    return forms


def _without_remark(asset: Asset) -> Iterator[str]:
    """Yield "hydrochloric acid" for "hydrochloric acid (37%)", and "三氯化铝" for "无水三氯化铝"."""
    for form in asset.synonyms_en:
        if form.endswith(")") and " (" in form:
            yield form[: form.index(" (")]
        for remark in (" monohydrate", " dihydrate", " pentahydrate", " hydrate"):
            if form.endswith(remark) and asset.name != "HydrazineHydrate":
                yield form.removesuffix(remark)
    for form in asset.synonyms_zh:
        if form.startswith("无水") and len(form) > 3:
            yield form[2:]


def _precedence(asset: Asset) -> tuple[bool, bool, str]:
    return asset.kind != "reagent", not asset.core, asset.name
