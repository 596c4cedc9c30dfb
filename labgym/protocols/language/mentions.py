"""Mentions: the assets that a text names in English, in Chinese or as formulas, with their positions."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from labgym.assets import Asset, Catalog
from labgym.assets.search import normalize, surface_forms
from labgym.protocols.language.concepts import word_table
from labgym.protocols.language.folding import Folded

MAX_FORM = 60
PREFIX = 2
"""Number of leading characters by which forms are looked up."""
_NAMES_REACTION = re.compile(r"[ -](?:synthesis|formation|cleavage)\b", re.IGNORECASE)
_RADICAL_BEFORE = re.compile(r"(?:(?<![A-Za-z])(?:\d[\d,']{0,20}|[NOopm])|[a-z](?:o|yl|oxy))-$|(?<![a-z])[a-z]{2,}yl $")
"""Text before a name that makes it part of a longer name: a locant or a radical, as "4-bromo-" or "allyl "."""
_HAN_BEFORE = frozenset("甲乙丙丁戊己庚辛苯氯溴碘氟硝羟氨间邻叔异仲环酰基代酸三四并")
_HAN_AFTER = re.compile(
    r"(?:[甲乙丙丁戊己苄苯叔异正]+酯|[酯醚酸醇酮醛胺烷烯炔腈酐酚肼脲]|[甲乙丙丁苄苯]+基|[基酰钠钾])(?!化)"
)
_NO_WATER_AFTER, _NO_WATER_BEFORE = tuple("脱分无排吸含氨盐冰"), tuple("解浴合蒸相层杨性洗泵")
"""Neighbors of 水 in words that do not mean water as a reagent: 脱水, 水解, 水浴."""
MentionKind = Literal["reagent", "instrument", "facility", "class"]


@dataclass(frozen=True)
class Mention:
    """A span of a text that names an asset or a class of substances.

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

    @property
    def chemical(self) -> bool:
        return self.kind in ("reagent", "class")

    def fits(self, span: str) -> bool:
        """Return whether a span of the text that folds to this form can mean it."""
        if span.lower() in word_table().everyday:
            return False
        compact = normalize(self.written)
        if len(compact) <= 2 and compact.isascii():
            return span == self.written
        spaced = any(char.isspace() for char in span)
        return not (spaced and len(compact) <= 5 and " " not in self.written and not _chinese(compact))


def mentions(text: str, catalog: Catalog) -> tuple[Mention, ...]:
    """Return the mentions in a text in order; of overlapping names, the one that begins first and is longest.

    The names are those of the catalog's assets, of classes of substances ("a tert-butyl ester") and laboratory slang
    ("bicarb"). A name within the name of a reaction ("ether synthesis") is not a mention.
    """
    return tuple(mention for mention in _scan(text, catalog) if not _NAMES_REACTION.match(text, mention.end))


def without_chinese_names(text: str, catalog: Catalog) -> str:
    """Return a text with the Chinese names of reagents blanked, because 硼氢化钠 does not mean 氢化 (hydrogenation)."""
    for mention in mentions(text, catalog):
        if mention.kind == "reagent" and _chinese(mention.text):
            text = text[: mention.start] + " " * len(mention.text) + text[mention.end :]
    return text


def _scan(text: str, catalog: Catalog) -> Iterator[Mention]:
    folded = Folded.of(text)
    forms, lengths = _forms(catalog), _lengths(catalog)
    index, size = 0, len(folded.plain)
    while index < size:
        step = 1
        if folded.begins(index):
            prefix = folded.plain[index : index + PREFIX]
            for length in lengths.get(prefix) or lengths.get(prefix[:1], ()):
                form = forms.get(folded.plain[index : index + length]) if index + length <= size else None
                stop = index + length if form is None else _end(folded, index + length)
                if form is None or stop is None:
                    continue
                start, end = folded.places[index], folded.places[stop - 1] + 1
                span = text[start : folded.places[index + length - 1] + 1]
                if form.fits(span) and not (form.chemical and _inside_longer_name(text, start, end)):
                    yield Mention(start, end, text[start:end], form.kind, form.name)
                    step = stop - index
                    break
        index += step


def _end(folded: Folded, index: int) -> int | None:
    """Return the end of the word that a form fills, including a plural s, or None if the form ends inside a word."""
    if folded.ends(index):
        return index
    return index + 1 if folded.plain[index] == "s" and folded.ends(index + 1) else None


def _inside_longer_name(text: str, start: int, end: int) -> bool:
    """Return whether a name is part of a longer one, as aniline in 4-bromo-aniline or 苯胺 in 乙酰苯胺."""
    if not _chinese(text[start]):
        return _RADICAL_BEFORE.search(text, max(0, start - 40), start) is not None
    single, before, after = end - start == 1, text[start - 1 : start], text[end : end + 1]
    if _HAN_AFTER.match(text, end) or (single and after in tuple("化代并环")):
        return True
    if text[start:end] == "水" and (before in _NO_WATER_AFTER or after in _NO_WATER_BEFORE):
        return True
    return before in _HAN_BEFORE if before != "对" else "进行" not in text[end : end + 12]


def _chinese(text: str) -> bool:
    return any("\u3400" <= char <= "\u9fff" for char in text)


@lru_cache(maxsize=4)
def _lengths(catalog: Catalog) -> dict[str, tuple[int, ...]]:
    """Return the lengths of the forms with each prefix, longest first."""
    by_prefix: dict[str, set[int]] = {}
    shortest: dict[str, set[int]] = {}
    for form in _forms(catalog):
        if len(form) <= MAX_FORM:
            by_prefix.setdefault(form[:PREFIX], set()).add(len(form))
        if len(form) < PREFIX:
            shortest.setdefault(form, set()).add(len(form))
    for prefix, lengths in by_prefix.items():
        for short, short_lengths in shortest.items():
            if prefix.startswith(short):
                lengths |= short_lengths
    for short, short_lengths in shortest.items():
        by_prefix.setdefault(short, set()).update(short_lengths)
    return {prefix: tuple(sorted(lengths, reverse=True)) for prefix, lengths in by_prefix.items()}


@lru_cache(maxsize=4)
def _forms(catalog: Catalog) -> dict[str, _Form]:
    forms: dict[str, _Form] = {}
    for name, written in word_table().classes.items():
        for form in written:
            forms.setdefault(normalize(form), _Form(form, "class", name))
    for name, written in word_table().shorthand.items():
        if name in catalog:
            for form in written:
                for key in (normalize(form), Folded.of(form).plain):
                    forms.setdefault(key, _Form(form, catalog.get(name).kind, name))
    for asset in sorted(catalog, key=_precedence):
        for form in (*surface_forms(asset), *_without_remark(asset)):
            compact = normalize(form)
            if len(compact) > 1 or _chinese(compact):
                forms.setdefault(compact, _Form(form, asset.kind, asset.name))
    return forms


def _without_remark(asset: Asset) -> Iterator[str]:
    """Yield "hydrochloric acid" for "hydrochloric acid (37%)", and "三氯化铝" for "无水三氯化铝"."""
    for form in asset.synonyms_en:
        if form.endswith(")") and " (" in form:
            yield form[: form.index(" (")]
        for remark in (" monohydrate", " dihydrate", " pentahydrate", " hydrate"):
            if form.endswith(remark) and " " in form.removesuffix(remark):
                yield form.removesuffix(remark)
    for form in asset.synonyms_zh:
        if form.startswith("无水") and len(form) > 3:
            yield form[2:]


def _precedence(asset: Asset) -> tuple[bool, bool, str]:
    return asset.kind != "reagent", not asset.core, asset.name
