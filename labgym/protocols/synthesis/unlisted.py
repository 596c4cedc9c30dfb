"""Substances that a text names and the catalogue lacks."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import lru_cache

from labgym.protocols.language import Mention, concepts
from labgym.protocols.synthesis.operations import operations, table

SHORTEST = 6
_METALS = (
    r"sodium|potassium|lithium|calcium|barium|zinc|copper|silver|gold|iron|lead|mercury|nickel|cobalt|manganese|tin|"
    r"ammonium|c(?:a)?esium|magnesium|alumini?um|palladium|platinum|titanium|boron|phosphorus|sulfur|chromium|rhodium|"
    r"ruthenium|samarium|indium|bismuth|cerium|hydrogen|thallium|osmium|selenium|arsenic"
)
_SALT = re.compile(
    rf"\b(?:{_METALS})(?:\s?\([iv]+\))?\s(?:(?:tri|di|per|bi|hydrogen\s)?[a-z-]*(?:ide|ate|ite)s?)\b", re.IGNORECASE
)
_ACID = re.compile(r"\b(?:\d[\d,']*-|[opm]-)?[a-z][a-z0-9,()\[\]'-]*(?:ic|ous)\sacid\b", re.IGNORECASE)
_RADICALS = r"[a-z]{4,}onium\s|[a-z]{4,}(?:magnesium|zinc)\s|(?:(?:[a-z0-9,()\[\]'-]*[a-z]yl)[ -])+"
_TWO_WORDS = re.compile(
    rf"(?<![\w-])(?:{_RADICALS})(?:(?:magnesium|lithium|zinc)\s?)?"
    r"(?:chloride|bromide|iodide|fluoride|alcohol|amine|ether|ketone|azide|cyanide|isocyanate|acetate|formate|benzoate|"
    r"acrylate|aniline|phenol|pyridine|benzene|toluene|nitrite|nitrate|mercaptan|thiol|tosylate|mesylate|triflate|"
    r"chloroformate|acetoacetate|malonate)s?\b",
    re.IGNORECASE,
)
_WORD = re.compile(r"(?<![A-Za-z0-9])(?:\d[\d,']*-|[NOopm]-)?[A-Za-z][A-Za-z0-9,()\[\]'-]*[A-Za-z)]")
_ENDING = re.compile(
    r"(?:ane|ene|yne|ol|one|al|amine|aniline|amide|imide|ate|ide|ite|ine|azole|ophene|furan|aldehyde|nitrile|yl|oxide|"
    r"indole|silane|borane|lactone|lactam|acid|phthalein|lithium|oate|azine|urea|hydride)s?$"
)
_MORPHEME = re.compile(
    r"meth|eth|prop|but|pent|hex|hept|oct|phen|benz|naphth|tolu|anis|chlor|brom|iod|fluor|nitr|cyan|amin|hydrox|oxy|"
    r"carb|sulf|phosph|acet|malon|succin|phthal|cinnam|salicyl|furan|thio|pyr|imid|indol|quinol|morphol|piper|azol|"
    r"silyl|boro|ket|cyclo|tert|peroxy|hydr|aldehyde|aniline|styr|allyl|vinyl"
)
_SIMPLE = re.compile(
    r"^(?:meth|eth|prop|but|pent|hex|hept|oct|non|dec)(?:an|en|yn)(?:al|ol|one|e|oic|amine|oate|amide)s?$"
)
_PROCESS = re.compile(r"(?:ation|ylat(?:e|ed|ing)|lysis|ify|ified|ised|ized|ically|ic|ity|ment|ness|ing|ed|tic)$")
_SYMBOLS = (
    "H He Li Be B C N O F Na Mg Al Si P S Cl Ar K Ca Sc Ti V Cr Mn Fe Co Ni Cu Zn Ga Ge As Se Br Rb Sr Y Zr Nb Mo Ru "
    "Rh Pd Ag Cd In Sn Sb Te I Cs Ba La Ce Sm W Re Os Ir Pt Au Hg Tl Pb Bi U"
)
_GENERIC = re.compile(r"\b(?:alk|ar|ac|sil|carbon|hydrox|sulfon|phosphor|phen)yl\b", re.IGNORECASE)
_HAN = (
    "甲乙丙丁戊己庚辛壬癸苯酚酸醇酮醛胺酯醚烷烯炔腈酐氯溴碘氟硝羟氨对间邻叔异正仲环三四硫磷钠钾锂钙镁铝铁铜锌银汞铅锡"
    "氢氧氮杂噻吩呋喃吡啶咪唑喹啉吗萘蒽芴肼脲胍肟"
)
_HAN_NAME = re.compile(
    rf"[{_HAN}二基化代亚次过高酰并]{{1,12}}[酸醇酮醛胺酯醚烷烯炔腈酐酚苯钠钾锂氯溴碘啶唑啉喃吩萘肼脲肟]"
)


def unlisted(text: str, mentioned: Sequence[Mention]) -> tuple[tuple[int, int], ...]:
    """Return the spans of names of substances that no mention covers, in order."""
    spans: list[tuple[int, int]] = []
    for start, end in (*_compounds(text), *_words(text), *_formulas(text), *_chinese(text, mentioned)):
        covered = any(m.start <= start and end <= m.end for m in mentioned)
        if not covered and not any(start < b and a < end for a, b in spans):
            spans.append((start, end))
    return tuple(sorted(spans))


def is_named_like_a_substance(text: str) -> bool:
    """Say whether a phrase may name a substance where the wording says that it is one."""
    words = [word.lower().strip("(),'-") for word in text.split()]
    return any(len(word) >= SHORTEST and _ENDING.search(word) and not _is_operation(word) for word in words)


def _compounds(text: str) -> Iterator[tuple[int, int]]:
    """Names of several words: salts, acids, alkyl derivatives."""
    for pattern in (_SALT, _ACID, _TWO_WORDS):
        for match in pattern.finditer(text):
            generic = _GENERIC.search(match[0]) and pattern is _TWO_WORDS and not _MORPHEME.findall(match[0].lower())
            if not generic and not _is_operation(match[0]):
                yield match.span()


def _words(text: str) -> Iterator[tuple[int, int]]:
    common = frozenset(table().unlisted_words)
    for match in _WORD.finditer(text):
        word = match[0].strip("(),'-").lower()
        plain = word[0].isdigit() or not (_is_operation(word) or concepts(word))
        if word in common or word.rstrip("s") in common or (plain and _looks_chemical(word)):
            yield match.span()


def _looks_chemical(word: str) -> bool:
    if _SIMPLE.match(word):
        return True
    if not _ENDING.search(word) or (_PROCESS.search(word) and not word[0].isdigit()):
        return False
    return len(_MORPHEME.findall(word)) >= (1 if word[0].isdigit() else 2)


def _formulas(text: str) -> Iterator[tuple[int, int]]:
    for match in _formula().finditer(text):
        token = match[0]
        elements = re.findall(r"[A-Z][a-z]?", token)
        if len(elements) >= 2 and token not in table().group_formulas and re.search(r"\d|[a-z]", token):
            yield match.span()


def _chinese(text: str, mentioned: Sequence[Mention]) -> Iterator[tuple[int, int]]:
    """Names in Chinese, in what is left between mentions; classes of substances are mentions too."""
    last = 0
    for start, end in [*((m.start, m.end) for m in mentioned), (len(text), len(text))]:
        for match in _HAN_NAME.finditer(text, last, start):
            if sum(char in _HAN for char in match[0]) >= 2 and not _names_a_process(match[0]):
                yield match.span()
        last = max(last, end)


def _names_a_process(name: str) -> bool:
    """Say whether a Chinese name is a word for an operation or transformation, such as 酯化 or 氧化."""
    return name.endswith("化") or name in ("还原胺", "重氮", "叠氮")


def _is_operation(text: str) -> bool:
    return bool(operations(text))


@lru_cache(maxsize=1)
def _formula() -> re.Pattern[str]:
    symbols = "|".join(sorted(_SYMBOLS.split(), key=len, reverse=True))
    return re.compile(
        rf"(?<![A-Za-z0-9])(?:(?:{symbols})\d{{0,2}}|\((?:(?:{symbols}|Me|Et|Ph|Ac)\d{{0,2}})+\)\d{{0,2}}){{2,}}(?![A-Za-z0-9])"
    )
