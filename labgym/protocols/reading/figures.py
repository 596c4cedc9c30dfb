"""Figures: the numbers with units in a procedure, in base units, with their spans.

Patterns take linear time: each begins at a digit or a number word that no letter or digit precedes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from labgym.protocols.language.folding import SIGNS
from labgym.quantities import ATMOSPHERE_BAR, OVERNIGHT_MIN, ROOM_TEMPERATURE
from labgym.units import BASE, UNITS_BY_SPELLING, Dimension, compact, convert

Kind = Literal[
    "mass", "volume", "substance", "equivalents", "molarity", "percent", "parts", "temperature", "time", "pressure",
    "ph", "ratio", "repeats", "length", "other",
]  # fmt: skip
AMOUNTS: frozenset[Kind] = frozenset(("mass", "volume", "substance", "equivalents", "molarity", "percent", "parts"))
"""Kinds that say how much of a substance is taken."""

_LOOKALIKES = str.maketrans(
    {
        **SIGNS,
        "\u2014": "-",
        **dict.fromkeys("\u00a0\u2002\u2003\u2009\u202f\u200b\ufeff\t\r\n", " "),
        **{chr(0xFF10 + digit): str(digit) for digit in range(10)},
        "˜": "~",
        "（": "(",
        "）": ")",
        "，": ",",
    }
)
_WORDS = {
    "half": 0.5, "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9,
    "ten": 10, "eleven": 11, "twelve": 12, "thirteen": 13, "fourteen": 14, "fifteen": 15, "sixteen": 16,
    "seventeen": 17, "eighteen": 18, "nineteen": 19, "twenty": 20, "thirty": 30, "forty": 40, "fifty": 50, "sixty": 60,
    "one hundred": 100, "a hundred": 100, "a few": 3, "few": 3,
    "several": 3, "a": 1, "an": 1, "half an": 0.5, "half a": 0.5, "one half": 0.5, "a further": 1, "another": 1,
}  # fmt: skip
_N = r"\d{1,3}(?:,\d{3})+(?:\.\d+)?|\d{1,9}(?:\.\d{1,9}|,\d{1,2}(?!\d))?(?:[Ee]-?\d{1,2}\b)?|\.\d{1,6}"
_BEFORE = (
    r"(?:(?<![A-Za-z0-9_.\[,\u0370-\u03ff-])|(?<=\d m[lLg],)|(?<=\d mmol,)|(?<=\d g,)|(?<=\d[xX])"
    r"|(?<=\[)(?=\d[\d.,]{0,8} (?:[km]?g|m[lL]|m?mol)\b))(?<!\d/)"
)
_UNIT = {
    "mass": r"[Kk]g|mgm?|μg|ug|gms?|[Gg]rams?|G(?=\.| of\b| \()|grammes?|milligrams?|kilograms?|micrograms?|g"
    r"|Mg(?=\.? of\b)|lbs?|pounds?|oz|ounces?",
    "volume": r"m[lL]s?|ML|Ml(?=\.? of\b)|cc"
    r"|c\.c\.|μ ?[lL]|u[lL]|[dc]l|cm3|dm3|[lL]iters?|[lL]itres?|milli[lL]it(?:er|re)s?"
    r"|microlit(?:er|re)s?|drops?|gallons?|[lL]",
    "substance": r"mmols?|μmols?|umols?|nmols?|kmols?|[mM]ols?|mmoles?|millimoles?|moles?|m\.? ?mol(?:es?|s)?"
    r"|m(?=\))",
    "equivalents": r"equivalents?|equivs?|eqs?|molar equivalents?|mol(?:e|ar)?[- ]?%|mol(?:e|ar)? percent",
    "percent": r"wt\.? ?%|w/?w ?%|weight ?(?:percent|%)|%(?: ?\(?(?:w/w|w/v|v/v|wt)\)?)?|percent|mass %|w%",
    "molarity": r"mM|M|N|n(?= (?:aqueous|sul|hydrochlor|sodium|HCl|NaOH))|molar|normal"
    r"|mol/[lL]|mol\.?/lit(?:er|re)|mmol/mL",
    "parts": r"parts?(?: by (?:weight|volume))?|vol(?:ume)?s?|ppm|mass ppm|tsps?",
    "temperature": r"° ?[CF]|℃|o ?C|degrees? ?(?:C\b|F\b|Celsius|centigrade|Fahrenheit)?|deg\.? ?[CF]|°|C",
    "time": r"(?:(?:additional|further|more) )?(?:hours?|hrs?|min(?:ute)?s?|days?)|h|seconds?|secs?|sec|s|d|weeks?|wk",
    "pressure": r"mbar|bars?|psig?|psia|p\.s\.i\.?|pounds per square inch|"
    r"atm(?:os(?:pheres?)?)?|torr|Torr|(?:mm|millimeters)\.? ?(?:of )?(?:Hg|mercury)|mm ?hg|atoms?(?= of hydrogen)|kPa|"
    r"(?:lbs?|pounds)\.? ?/ ?sq\.? ?in(?:ch)?|"
    r"MPa|hPa|Pa|kg\.?/cm2|millibar",
    "other": r"[Nn]eck(?:ed)?|A(?= (?:powdered |activated |molecular ))|fractions|revolutions per minute|watts?|"
    r"[Aa]ngstr[oö]ms?|MHz|Hz|rpm|nm|W|kW|eV|mesh|stages|cm-1|cm|mm|mμ|μm?|Å|inch(?:es)?",
}  # fmt: skip
_ORDER: tuple[Kind, ...] = (
    "pressure", "equivalents", "substance", "percent", "mass", "volume", "parts", "other", "time", "temperature",
    "molarity",
)  # fmt: skip
_GLUED = {"percent": "|%(?=[A-Z])"}
"""Units that a name may follow without a space: "4%MeOH"."""
_UNITS = "|".join(f"(?P<{kind}>(?:{_UNIT[kind]})(?![A-Za-z]){_GLUED.get(kind, '')})" for kind in _ORDER)
_UNIT_AT = re.compile(rf"(?:{_UNITS})")
_APPROXIMATE = r"(?:about|approx(?:imately)?\.?|ca\.?|circa|~)"
_VALUE = re.compile(
    rf"{_BEFORE}(?P<sign>[-+~<>]{{0,2}})(?P<low>{_N})"
    rf"(?: ?[x×] ?10(?: ?\^)? ?(?P<power>- ?\d{{1,2}})(?![\d.]))?"
    rf"(?P<inner> ?°(?: ?C\.?)?)?(?: ?(?:±|\+/-) ?\d{{1,3}}(?:\.\d{{1,3}})?)?"
    rf"(?: {{0,2}}(?:-|to|~) ?{_APPROXIMATE}? ?\+?(?P<neg>-)?(?P<high>{_N}))?"
)
_SPOKEN = re.compile(
    r"(?<![A-Za-z-])(?!a second\b|a drop at a time)(?P<word>half an?|one half|an?|(?:a )?few|several|another|a further|"
    r"one|two|three|four|five|six|seven|"
    r"eight|nine|ten|eleven|twelve|(?:thir|four|fif|six|seven|eigh|nine)teen|twenty|thirty|forty|fifty|sixty|"
    r"(?:one|a) hundred)(?: (?:and (?:a|one)[- ]half|to (?P<to>two|three|"
    r"four|five|six|ten)|more|additional))?"
    r" (?:(?P<mass>grams?|milligrams?|kilograms?|pounds?|g)|(?P<volume>drops?|milliliters?|millilitres?|liters?|"
    r"litres?|ml)|"
    r"(?P<equivalents>equivalents?|equiv)|(?P<substance>m?moles?|mmol)|(?P<time>hours?|hrs?|minutes?|"
    r"min|days?|weeks?|seconds?))(?![A-Za-z])",
    re.IGNORECASE,
)
_FRACTION = re.compile(
    rf"{_BEFORE}(?:(\d{{1,2}}?)[ -]?)?([13])/([248]) ?(?:(?P<time>{_UNIT['time']})|"
    rf"(?P<volume>{_UNIT['volume']})|(?P<mass>{_UNIT['mass']}))(?![A-Za-z])"
)
"""Mixed fractions, also as patents print them: "21/2 hours" is two hours and a half."""
_SHARED = re.compile(
    rf"{_BEFORE}(?:(?:\d{{1,4}}(?:\.\d{{1,3}})?/){{1,4}}|(?:\d{{1,4}}-){{2,4}})\d{{1,4}}(?:\.\d{{1,3}})? ?"
    rf"(?:(?P<volume>{_UNIT['volume']})|(?P<mass>{_UNIT['mass']}))(?![A-Za-z])"
)
"""Amounts of a mixture with one unit: "50/5/5 mL", "20-2-2 mL"."""
_PORTIONS = re.compile(rf"{_BEFORE}(\d{{1,2}}) ?(?:[x×*X]|times|portions of|aliquots of) ?(?=\d)")
_WORD_PORTIONS = re.compile(
    r"(?<![A-Za-z])(two|three|four|five|six|seven|eight|ten) (?:--? )?(?=\d[\d,.]{0,8}[- ]?(?:m[lL]|[lL]|"
    r"g|mg)\b\.? ?-?(?:portions|aliquots|volumes|lots))",
    re.IGNORECASE,
)
_PORTIONS_AFTER = re.compile(r" ?(?:each )?[x×X] ?(\d{1,2})(?![\d.,]* ?(?:m?[lL]|m?g|h|min)\b)(?![\d.])")
_TIMES = re.compile(
    r"(?<![A-Za-z])(?:(twice)|(thrice)|(once)|(two|three|four|five|six|seven|\d{1,2})(?: ?times|"
    r" (?:more|additional|further) times|x| [xX](?! ?\d)| ?× ?(?!\d)|"
    r" (?:(?:further|additional) )?(?:\d{1,4} ?m[lL] )?portions))"
    r"(?![A-Za-z])",
    re.IGNORECASE,
)
_TWICE = re.compile(
    r"(?<![A-Za-z])((?:one|two|three|four|five|six|seven|eight|nine|ten|twelve|fifteen|twenty|thirty|forty|fifty"
    r"|hundred) )\((\d[\d.,]{0,9})\)(?= )",
    re.IGNORECASE,
)
_BETWEEN = re.compile(r"(\bbetween [-~]?\d{1,4}(?:\.\d{1,2})?(?: ?° ?C?\.?)?) and (?=[-~]?\d)")
_PH = re.compile(
    r"(?<![A-Za-z])pH(?:-value|(?: [A-Za-z.]{1,15}){0,9} (?:to|at|of|about|between|above|below|is|was|value"
    r"|reached))?(?: (?:about|approximately|ca\.?|between|around|a value of))? ?(?:of )?[=:]? ?[~<>]?\s?"
    r"(\d{1,2}(?:\.\d{1,2})?)(?: {0,2}(?:-|to|and) ?(\d{1,2}(?:\.\d{1,2})?))?",
    re.IGNORECASE,
)
_RATIO = re.compile(
    r"(?<![A-Za-z0-9.,-])\d{1,4}(?:\.\d{1,3})?%?(?: ?[:/] ?\d{1,4}(?:\.\d{1,3})?%?(?![A-Za-z0-9])){1,4}(?! ?(?:°|"
    r"m?[lLg]\b|h\b|hours?|hrs?\b|min|mmol|mol|mm\b|days?|\"|in\b))"
    r"(?: ?(?:\(v/v\)|v/v|V/V|by volume|vol/vol))?"
)
_NAMED = (
    (
        re.compile(
            r"\b(?:room[- ]?(?:temperature|temp\b\.?)|ambient(?: temperature| temp\b\.?)?(?! pressure)|"
            r"r\.? ?t\b\.?|RT\b|normal temperature)"
        ),
        "temperature",
        ROOM_TEMPERATURE,
    ),
    (
        re.compile(r"\bice[- ]?(?:water)?[- ]?bath|\bice[- ]cooling|\bcooling with ice|\bice and water bath"
            r"|\bice[- ]co(?:ld|oled)(?= (?:stirred )?(?:solution|suspension|mixture)\b)"
            r"|(?:(?<=cooled [io]n )|(?<=chilled in )|(?<=cooling in )|(?<=cooled with ))ice(?:[- ]water)?\b"
            r"(?! ?[-/]?(?:salt|bath))"
        ),
        "temperature",
        0.0,
    ),
    (re.compile(r"\b[Dd]ry[- ][Ii]ce(?:(?: ?[-/] ?| in | and )(?:acetone|isopropanol))? bath"), "temperature", -78.0),
    (re.compile(r"\b[Ii]ce(?: ?[-/] ?| and )salt(?: bath)?"), "temperature", -10.0),
    (re.compile(r"(?<![\d/])\d{1,2}/\d{1,2} 20\d\d(?: \d\d:\d\d(?::\d\d)?(?: [+-]\d{4})?)?\b"), "other", 0.0),
    (re.compile(r"\b(?:overnight|over night|over-night|overnite)\b"), "time", OVERNIGHT_MIN),
)  # fmt: skip
_NORMAL = re.compile(r"-(?=(?:hydrochloric|sulfuric|sulphuric|nitric|acetic|sodium|potassium|caustic|HCl|NaOH|KOH)\b)")
"""The hyphen between a normality and its reagent: "1 N-hydrochloric acid"."""
_IONIZED = re.compile(r"-[A-Za-z(\[]|'?-\d|(,\d)")
_RATE = re.compile(r" ?(?:/|per) ?(?:min(?:ute)?|h(?:ou)?r?|s(?:ec)?)\b")
"""The end of a rate of flow: "25 mL/min"."""


@dataclass(frozen=True)
class QuantitySpan:
    """A number with its unit.

    Attributes:
        start, end: the span in the text.
        kind: what it measures.
        value: in base units (g, mL, mol, C, min, bar); equivalents, mol/L, percent and parts as they are; the mean of a
            range.
        text: as written.
        portions: number of portions, as in "3 x 40 mL".
        high: upper end of a range, or None.
        low: lower end of a range, or the value.
    """

    start: int
    end: int
    kind: Kind
    value: float
    text: str
    portions: int = 1
    low: float = 0.0
    high: float | None = None

    @property
    def is_amount(self) -> bool:
        """Whether it says how much of a substance is taken."""
        return self.kind in AMOUNTS


def plain(text: str) -> str:
    """Return a text of the same length with one spelling of each sign, so that spans stay.

    A number that repeats one in words loses its brackets, "five (5.0) grams"; "between 5 and 9" reads "5  to 9".
    """
    simple = _BETWEEN.sub(lambda match: f"{match[1]}  to ", text.translate(_LOOKALIKES))
    return _TWICE.sub(lambda match: f"{match[1]} {match[2]} ", simple)


def figures(text: str) -> list[QuantitySpan]:
    """Return the figures of a text, in order and disjoint.

    Args:
        text: as `plain` returns it.
    """
    taken = bytearray(len(text))
    found: list[QuantitySpan] = []
    for source in (
        _phs(text),
        _named(text),
        _fractions(text),
        _shared(text),
        _spoken(text),
        _ratios(text),
        _numbered(text),
        _repeats(text),
    ):
        for figure in source:
            if not any(taken[figure.start : figure.end]):
                taken[figure.start : figure.end] = b"\1" * (figure.end - figure.start)
                found.append(figure)
    return sorted(found, key=lambda figure: figure.start)


def _numbered(text: str) -> Iterator[QuantitySpan]:
    portions = _portions(text)
    at = 0
    while (match := _VALUE.search(text, at)) is not None:
        at = match.end()
        end, high = match.end(), match["high"]
        gap = 2 if text[end : end + 2] == "  " else text[end : end + 1] in (" ", "-")
        unit = _UNIT_AT.match(text, end + gap)
        apart = bool(match["inner"]) and unit is not None and unit.lastgroup != "temperature"
        if (unit is None or apart) and high is not None:
            # The second number may belong to something else: read the first alone, then go on behind it.
            end = max(match.end("inner"), match.end("power"), match.end("low"))
            at, high = end, None
            unit = _UNIT_AT.match(text, end + (text[end : end + 1] == " "))
        kind = unit.lastgroup if unit is not None else "temperature" if match["inner"] else None
        joined = unit is not None and kind == "molarity" and _NORMAL.match(text, unit.end()) is not None
        label = _IONIZED.match(text, unit.end()) if unit is not None and not joined else None
        ionized = label is not None and not (label[1] and kind in ("mass", "volume", "substance", "equivalents"))
        if kind is None or ionized or (unit is not None and not joined and _is_label(text, unit)):
            continue
        low, upper = _bounds(match, high, kind)
        stop = unit.end() + joined if unit is not None else end
        if kind == "temperature" and text[stop : stop + 1] == "." and text[stop + 1 : stop + 3].strip()[:1].islower():
            stop += 1
        rate = _RATE.match(text, stop) if kind in ("volume", "mass") else None
        if rate is not None:
            kind, stop = "other", rate.end()
        start, times = portions.get(match.start()) or portions.get(match.start("low")) or (match.start(), 1)
        after = _PORTIONS_AFTER.match(text, stop)
        if after is not None and kind in ("mass", "volume"):
            stop, times = after.end(), int(after[1])
        at = max(at, stop) if unit is not None else at
        yield _figure((start, stop), kind, unit[0] if unit is not None else "°", low, upper, text, max(1, times))


def _portions(text: str) -> dict[int, tuple[int, int]]:
    """Return the start and the number of portions by where their amount begins: "3 x 40 mL", "two 5 mL portions"."""
    counted = {match.end(): (match.start(), int(match[1])) for match in _PORTIONS.finditer(text)}
    spoken = {match.end(): (match.start(), int(_WORDS[match[1].lower()])) for match in _WORD_PORTIONS.finditer(text)}
    return {**counted, **spoken}


def _bounds(match: re.Match[str], high: str | None, kind: str) -> tuple[float, float | None]:
    """Return the value of a number, and the upper end of its range."""
    value = _number(match["low"]) * 10.0 ** int((match["power"] or "0").replace(" ", ""))
    upper = _number(high) if high else None
    if "-" in match["sign"]:
        value = -value
        if upper is not None and kind == "temperature" and not match["neg"] and " to " not in match[0]:
            upper = -upper
    if upper is not None and match["neg"]:
        upper = -upper
    return value, upper


def _is_label(text: str, unit: re.Match[str]) -> bool:
    """Return whether a letter after a number is no unit: "2H-pyran", "5 d, 1H", "24M" without a substance."""
    if unit.lastgroup not in ("time", "molarity", "mass", "temperature"):
        return False
    following = text[unit.end() : unit.end() + 1]
    if unit[0] == "d" and text[unit.start() - 1] == "-":
        return True  # the fusion of rings, "pyrido(2,3-d)pyrimidine"
    if unit[0] == "C" and text[unit.start() - 3 : unit.start()] in (" 13", "(13"):
        return True  # the isotope
    return (following == "-" and len(unit[0]) == 1) or (len(unit[0]) == 1 and unit[0] in "CsdN" and following == "=")


def _figure(
    place: tuple[int, int], kind: str, spelled: str, value: float, upper: float | None, text: str, portions: int
) -> QuantitySpan:
    start, end = place
    low, high = _base(kind, spelled, value), None if upper is None else _base(kind, spelled, upper)
    if high is not None and high < low and kind != "temperature":
        low, high = high, low
    mean = low if high is None else (low + high) / 2.0
    return QuantitySpan(start, end, kind, round(mean, 9), text[start:end], portions, low, high)  # type: ignore[arg-type]


def _base(kind: str, spelled: str, value: float) -> float:
    word = compact(spelled.removeprefix("additional").removeprefix("further").removeprefix("more")).rstrip(".")
    if kind == "temperature":
        return round((value - 32.0) / 1.8, 1) if word.endswith(("f", "fahrenheit")) else value
    if kind == "equivalents":
        return value * 0.01 if "%" in word or "percent" in word else value
    if kind == "molarity":
        return value * 1e-3 if spelled == "mM" else value
    if kind in ("percent", "parts", "other"):
        return value
    return _converted(kind, word, value)  # type: ignore[arg-type]


_OTHER_SPELLINGS = {
    "gms": "g",
    "mgm": "mg",
    "μ l": "μl",
    "m.moles": "mmol",
    "m.mole": "mmol",
    "m": "mol",
    "mols": "mol",
    "mm.hg": "mmhg",
    "mm.ofhg": "mmhg",
    "mmofmercury": "mmhg",
    "millimetersofmercury": "mmhg",
    "atom": "atm",
    "atoms": "atm",
    **dict.fromkeys(("lb/sqin", "lbs/sqin", "lb/sq.in", "lbs/sq.in", "lbs./sq.in", "lb./sq.in", "lbs/sqinch"), "psi"),
    "mmofhg": "mmhg",
    "millibar": "mbar",
    "microliter": "μl",
    "microliters": "μl",
    "wk": "week",
    "p.s.i": "psi",
    "poundspersquareinch": "psi",
    "micrograms": "μg",
}


def _converted(kind: Dimension, word: str, value: float) -> float:
    word = _OTHER_SPELLINGS.get(word, word)
    if word in ("kg/cm2", "kg./cm2"):
        return value * 0.980665
    if word in ("kmol", "kmols"):
        return value * 1000.0
    units = UNITS_BY_SPELLING[kind]
    unit = units.get(word) or units.get(word.removesuffix("s")) or units.get(f"{word}s")
    if unit is None:
        return value
    base = convert(value, unit, BASE[kind])
    return round(base + ATMOSPHERE_BAR, 6) if word == "psig" else base


def _number(text: str) -> float:
    if re.fullmatch(r"\d{1,3}(?:,\d{3})+(?:\.\d+)?", text):
        return float(text.replace(",", ""))
    return float(text.replace(",", "."))


def _spoken(text: str) -> Iterator[QuantitySpan]:
    for match in _SPOKEN.finditer(text):
        kind = match.lastgroup if match.lastgroup != "to" else None
        kind = next(name for name in ("mass", "volume", "equivalents", "substance", "time") if match[name])
        word = match["word"].lower()
        value = float(_WORDS[word])
        value += 0.5 if " and " in match[0] else 0.0
        upper = _WORDS[match["to"].lower()] if match["to"] else None
        yield _figure(match.span(), kind, match[kind], value, upper, text, 1)


def _fractions(text: str) -> Iterator[QuantitySpan]:
    for match in _FRACTION.finditer(text):
        value = float(match[1] or 0) + int(match[2]) / int(match[3])
        kind = next(name for name in ("mass", "volume", "time") if match[name])
        yield _figure(match.span(), kind, match[kind], value, None, text, 1)


def _shared(text: str) -> Iterator[QuantitySpan]:
    for match in _SHARED.finditer(text):
        kind = "volume" if match["volume"] else "mass"
        numbers = list(re.finditer(r"[\d.]+", text[match.start() : match.start(kind)]))
        for number in numbers:
            stop = match.end() if number is numbers[-1] else match.start() + number.end()
            yield _figure((match.start() + number.start(), stop), kind, match[kind], float(number[0]), None, text, 1)


def _repeats(text: str) -> Iterator[QuantitySpan]:
    for match in _TIMES.finditer(text):
        number = match[4] or ""
        count = 2 if match[1] else 3 if match[2] else 1 if match[3] else int(_WORDS.get(number.lower(), 0) or number)
        yield QuantitySpan(match.start(), match.end(), "repeats", float(count), match[0])


def _phs(text: str) -> Iterator[QuantitySpan]:
    for match in _PH.finditer(text):
        low, high = float(match[1]), float(match[2]) if match[2] else None
        mean = low if high is None else (low + high) / 2.0
        yield QuantitySpan(match.start(), match.end(), "ph", mean, match[0], 1, low, high)


def _ratios(text: str) -> Iterator[QuantitySpan]:
    for match in _RATIO.finditer(text):
        yield QuantitySpan(match.start(), match.end(), "ratio", 0.0, match[0])


def _named(text: str) -> Iterator[QuantitySpan]:
    for pattern, kind, value in _NAMED:
        for match in pattern.finditer(text):
            yield QuantitySpan(match.start(), match.end(), kind, value, match[0], 1, value)  # type: ignore[arg-type]
