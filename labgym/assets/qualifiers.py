"""Qualifiers of a name: strengths, grades, packages and suppliers of substances; makers of equipment.

The words are data (`assets/language/qualifiers.json`); this module turns them into patterns.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, ClassVar

from pydantic import Field

from labgym.artefacts import artefacts
from labgym.assets.measures import BEFORE, NUMBER, SIZE
from labgym.assets.model import Asset
from labgym.documents import Document

AQUEOUS_BELOW_PERCENT = 90.0
"""Strength in percent below which a liquid reagent holds enough water to be another substance without it."""

Words = Annotated[tuple[Annotated[str, Field(min_length=1, max_length=40)], ...], Field(min_length=1, max_length=300)]


class Qualifiers(Document):
    """Words that may accompany a name without changing what it means.

    Attributes:
        suppliers: of chemicals. makers: of equipment; their model designations follow them.
        materials, descriptors: of equipment.
        qualities: purity, dryness and grade of a substance. forms: physical forms of a solid, and "gas".
        packages: what a substance comes in. solvents: what a solution or dispersion is in.
        qualities_zh: Chinese qualities, before or after the name.
    """

    SCHEMA: ClassVar[str] = "labgym.qualifiers/1"

    suppliers: Words
    makers: Words
    materials: Words
    descriptors: Words
    qualities: Words
    forms: Words
    packages: Words
    qualities_zh: Words
    solvents: Words


@dataclass(frozen=True)
class QualifiedName:
    """A text split into a name and its qualifiers.

    Attributes:
        name: what is left of the text. qualifiers: what was set aside, as written.
    """

    name: str
    qualifiers: tuple[str, ...]

    @property
    def excludes_water(self) -> bool:
        """Whether the qualifiers ask for a dry substance, or for a solution in something other than water."""
        return any(_patterns().excludes_water.search(words) for words in self.qualifiers)


@dataclass(frozen=True)
class Patterns:
    """The compiled patterns of `Qualifiers`."""

    supplier: re.Pattern[str]
    makers: tuple[re.Pattern[str], ...]
    quality: re.Pattern[str]
    quality_zh: re.Pattern[str]
    solvent: re.Pattern[str]
    trailing_solvent: re.Pattern[str]
    neutral: re.Pattern[str]
    excludes_water: re.Pattern[str]


_STRENGTH = re.compile(
    rf"(?:[≥>~]\s*)?{BEFORE}{NUMBER}(?:\s*-\s*{NUMBER})?\+?\s*+(?:(?:wt|vol|w/w|w/v|v/v)?\.?\s*+%"
    r"(?:\s*(?:w/w|w/v|v/v|wt|vol))?|proof"
    r"|(?:m?mol/l|mm|m|n|kg|mg|ug|g|m?mol|equiv\.?|eq\.?|Å|克|毫克|千克)(?![A-Za-z0-9-]))",
    re.IGNORECASE,
)
_MESH = r"\(?\d{2,4}(?:\s*[-\u2013]\s*\d{2,4})?\s*(?:mesh|目)\)?"
_BOILING_RANGE = re.compile(r"[(\uff08]?(?<!\d)\d{2,3}\s*[-\u2013~]\s*\d{2,3}\s*+(?:°\s*C|℃)?[)\uff09]?\s*+$")
_CAS = re.compile(r"^\s*cas(?:[ -]?(?:no|nr|rn|number))?[.:#\s]*(?=\d{2,7}-\d{2}-\d\s*$)", re.IGNORECASE)
_CLAUSE = re.compile(
    r"(?<![\s,])[\s,]+(?:(?:stabili[sz]ed|inhibited|preserved)\s+with\s+.*$"
    r"|(?:(?:extra|super|freshly)\s+)?(?:dried|dry|stored|kept|distilled|redistilled)\s+(?:over|from|under)\s.*$"
    r"|(?:over|from)\s+(?:activated\s+)?(?:molecular\s+)?(?:sieves|sodium|cah2|calcium hydride|p2o5)\b.*$)",
    re.IGNORECASE | re.DOTALL,
)
_WITH = re.compile(r"(?<![\s,])[\s,]+(?:with|w/|incl\.?|including)\s.*$", re.IGNORECASE | re.DOTALL)
_ENDS = re.compile(r"^[\s,;]+|(?<![\s,;(\uff08])[\s,;(\uff08]+$")
_DRY = r"(?:oven|flame|freshly|extra|super|ultra)?[ -]?(?:anhydrous|anhyd|anh|dry|dried)"


@lru_cache(maxsize=1)
def qualifiers() -> Qualifiers:
    """Return the published words; they are read once per process."""
    return Qualifiers.load(artefacts("assets") / "language" / "qualifiers.json")


def of_substance(text: str) -> tuple[QualifiedName, QualifiedName]:
    """Set aside the strengths and amounts that a text gives of a substance, and then grades and packages as well."""
    patterns = _patterns()
    aside: list[str] = []

    def put(match: re.Match[str]) -> str:
        aside.append(match[0].strip(" ,;"))
        return " "

    rest = _CAS.sub("", text)
    for pattern in (_STRENGTH, SIZE):
        rest = pattern.sub(put, rest)
    if aside:
        rest = patterns.solvent.sub(put, rest)
    strengths = QualifiedName(rest, tuple(aside))
    if aside:
        rest = patterns.trailing_solvent.sub(
            lambda match: put(match) if rest[: match.start()].strip() else match[0], rest
        )
    for pattern in (_CLAUSE, patterns.supplier, patterns.quality, _BOILING_RANGE, patterns.quality_zh):
        rest = _ENDS.sub("", pattern.sub(put, rest.strip()))
    return strengths, QualifiedName(rest, tuple(aside))


def of_equipment(text: str) -> tuple[str, ...]:
    """Return a text without the qualifiers of equipment, and the same without maker and model.

    Model designations have a digit, or are one or two words with a capital after the maker: IKA RCT, Waters Acquity.
    """
    rest = _WITH.sub("", text)
    readings = [" ".join(maker.sub(" ", rest).split()) for maker in _patterns().makers]
    return tuple(dict.fromkeys((rest, *readings)))


def is_neutral(words: Iterable[str]) -> bool:
    """Return whether words next to the name of equipment do not change its meaning.

    Neutral are materials, descriptors, colors, sizes, joints such as 24/40, and model designations of at least two
    digits; a formula such as N2 is not.
    """
    return _patterns().neutral.fullmatch(" ".join(words)) is not None


def is_aqueous(asset: Asset) -> bool:
    """Return whether a reagent is a solution in water, and without the water a substance with other hazards.

    It is if it has the reactive group "aqueous", or is a liquid with a strength below 90 % in one of its names.
    """
    if asset.phase != "liquid":
        return False
    names = (_PERCENT.search(form) for form in asset.synonyms_en)
    strengths = [float(match[1]) for match in names if match is not None]
    return "aqueous" in asset.groups or any(strength < AQUEOUS_BELOW_PERCENT for strength in strengths)


def is_hydrate(asset: Asset) -> bool:
    """Return whether the structure of a solid reagent contains water of crystallization."""
    return asset.phase == "solid" and "O" in asset.smiles.split(".")


_UNITS = "mg|g|kg|ug|w|kw|v|hz|khz|rpm|bar|mbar|°?c|gal|gallons?|oz|l|ml|mm|cm|ft|in|inch(?:es)?"
_PERCENT = re.compile(r"(?<!\d)(\d+(?:\.\d+)?)\s*%")


def _either(words: Iterable[str]) -> str:
    """Return a pattern of any of the words, the longest first; a space in a word matches a space or a hyphen."""
    ordered = sorted(words, key=lambda word: (-len(word), word))
    return "|".join(re.escape(word).replace(r"\ ", "[ -]") for word in ordered)


@lru_cache(maxsize=1)
def _patterns() -> Patterns:
    words = qualifiers()
    start, end = r"(?<![A-Za-z0-9-])", r"(?![A-Za-z0-9-])"
    ascii_suppliers = [word for word in words.suppliers if word.isascii()]
    zh_suppliers = [word for word in words.suppliers if not word.isascii()]
    zh = _either([*words.qualities_zh, *zh_suppliers])
    forms, solvents = _either(words.forms), _either(words.solvents)
    maker = rf"{start}(?i:{_either(words.makers)}){end}(?:[ -][A-Z0-9](?=[\w./+-]*\d)[\w./+-]++|[ -]\d++)*+"
    amount = rf"(?<!\d)\d++(?:[.,]\d+)?\s*(?:{_UNITS})"
    designation = r"[A-Z]{0,3}-?\d{2,4}[A-Z]{0,2}"
    neutral = _either([*words.materials, *words.descriptors])
    any_neutral = rf"(?>(?:{amount}|\d{{1,2}}/\d{{1,2}}|{designation}|{neutral})(?=[ ,]|$))"
    return Patterns(
        supplier=re.compile(rf"{start}(?:from[ ])?(?:{_either(ascii_suppliers)}){end}", re.IGNORECASE),
        makers=tuple(re.compile(rf"{maker}(?: [A-Z]\w+){{{count}}}") for count in range(3)),
        quality=re.compile(
            rf"{start}(?:[a-z][a-z-]*[ -]grade|{_either(words.qualities)}|{_either(words.packages)}){end}\.?"
            rf"|{start}(?:{forms}){end}|\((?:aq|s|l|g)\)|{_MESH}",
            re.IGNORECASE,
        ),
        quality_zh=re.compile(
            rf"^(?:[(\uff08]?(?:{zh})[)\uff09]?)+|(?<!\s)(?:[(\uff08,\uff0c]?\s*+(?:{zh})\s*+[)\uff09]?){{1,8}}$"
        ),
        solvent=re.compile(rf"(?<!\s)\s+in\s+(?:{solvents})\)?\s*$", re.IGNORECASE),
        trailing_solvent=re.compile(rf"(?:^|(?<![\s,(/])[\s,(/]+)(?:{solvents})\)?\s*$", re.IGNORECASE),
        neutral=re.compile(rf"{any_neutral}(?:[ ,]++{any_neutral})*+", re.IGNORECASE),
        excludes_water=re.compile(
            rf"^{_DRY}\b|^(?:{forms})\b|^\([sg]\)|无水|干燥|^in (?!water)|^(?!water|oil)(?:{solvents})\)?$",
            re.IGNORECASE,
        ),
    )
