"""Search terms of a text: canonical names of assets and concepts, English stems, Chinese bigrams."""

from __future__ import annotations

import re

from labgym.assets import Catalog
from labgym.protocols.language import concepts, gloss, mentions, without_chinese_names
from labgym.protocols.language.words import word_table

_WORD = re.compile(r"[a-z][a-z]+|\d+(?:\.\d+)?")
_HAN = re.compile(r"[\u3400-\u9fff]+")
_ENDINGS = ("ations", "ation", "ising", "izing", "ised", "ized", "ingly", "ings", "ing", "ions", "ion", "ies", "ied")
_SHORT_ENDINGS = ("ise", "ize", "ed", "es", "er", "ly", "al", "ic", "e", "s", "y")
MIN_STEM = 4
NAME_WORDS = re.compile(r"[A-Z]+(?=[A-Z][a-z])|[A-Z]?[a-z]+|[A-Z]+|\d+")


def terms(text: str, catalog: Catalog) -> list[str]:
    """Return the search terms of a text, including repeats.

    Assets become their canonical names, so that "DCM" matches 二氯甲烷; operations and transformations become the names
    of concepts, so that "rotovap" matches "evaporate".
    """
    named = mentions(text, catalog)
    rest, last = [], 0
    for mention in named:
        rest.append(text[last : mention.start])
        last = mention.end
    plain = " ".join([*rest, text[last:]]).lower()
    return [
        *(f"asset:{mention.name}" for mention in named if mention.kind != "class"),
        *(f"concept:{name}" for name in concepts(without_chinese_names(text, catalog))),
        *(stem(word) for word in _WORD.findall(text.lower()) if word not in word_table().english_words),
        *(run[i : i + 2] for run in _HAN.findall(plain) for i in range(max(len(run) - 1, 1))),
    ]


def english(text: str, catalog: Catalog) -> str:
    """Return a text for an English embedding model: names of assets spelled out, Chinese technical terms translated."""
    pieces, last = [], 0
    for mention in mentions(text, catalog):
        pieces += [gloss(text[last : mention.start]), _spelt(mention.name)]
        last = mention.end
    pieces.append(gloss(text[last:]))
    return " ".join(" ".join(pieces).split())


def stem(word: str) -> str:
    """Return an English word without its most common endings; queries and fragments are stemmed alike."""
    for endings in (_ENDINGS, _SHORT_ENDINGS):
        for ending in endings:
            if word.endswith(ending) and len(word) - len(ending) >= MIN_STEM:
                return word.removesuffix(ending)
    return word


def _spelt(name: str) -> str:
    return " ".join(NAME_WORDS.findall(name)).lower() if name[:1].isupper() and " " not in name else name
