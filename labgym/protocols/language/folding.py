"""Characters: look-alikes brought to one spelling, and text folded for comparison."""

from __future__ import annotations

import re
import unicodedata
from dataclasses import dataclass

SIGNS = {
    **dict.fromkeys("\u00ba\u02da\u2218\u2070\u25e6", "°"),
    **dict.fromkeys("\u00b5", "μ"),
    **dict.fromkeys("\u2010\u2011\u2012\u2013\u2212\ufe63\uff0d", "-"),
    **dict.fromkeys("\u2018\u2019\u02b9\u02bc\u2032\uff07", "'"),
    **dict.fromkeys("\u201c\u201d\u2033\uff02", '"'),
    **{chr(0x2080 + digit): str(digit) for digit in range(10)},
}
"""Signs that look like others, with what they mean; each is one character, so that spans of a text stay."""
_LOOKALIKES = str.maketrans(
    {
        **SIGNS,
        **dict.fromkeys("\u00ad\u200b\u200c\u200d\u2060\ufeff"),
        **{chr(code): "\n" for code in (0x85, 0x2028, 0x2029)},
        **{chr(code): chr(code - 0xFEE0) for code in range(0xFF10, 0xFF5B) if chr(code).isalnum()},
        **dict(zip("\uff05\uff0e\uff0b\uff0f\uff1d\uff5e", "%.+/=~", strict=True)),
        "\u2103": "°C",
        "\u2109": "°F",
        "\u212a": "K",
        "\u212b": "Å",
        "\u2113": "l",
    }
)
"""Characters that look like others or stand for several, with what they mean. Chinese punctuation stays."""
_COMPATIBLE = re.compile(r"[\ufb00-\ufb06\u3380-\u33df\u210e\u2460-\u2473]")
"""Ligatures, unit signs such as ㎎, and circled numbers."""
_DASH_IN_RANGE = re.compile(r"(?<=\d)[\u2014\u2015](?=\d)")
_DEGREE_LETTER = re.compile(r"(?<=\d)( ?)[o°] ?(?=[CF](?![A-Za-z]))")
"""A letter o or a degree sign between number and scale: "25 oC"."""
_SLAVIC = str.maketrans("АВСЕНКМОРТХаеорсху", "ABCEHKMOPTXaeopcxy")
_MIXED = re.compile(r"°\s?С|(?<![A-Za-z0-9А-Яа-я])(?=[А-Яа-я]++[A-Za-z0-9]|[A-Za-z0-9]++[А-Яа-я])[A-Za-z0-9А-Яа-я]++")
"""A Cyrillic letter in the sign of degrees Celsius, or among Latin letters and digits."""

_SPELLINGS = {"α": "alpha", "β": "beta", "γ": "gamma", "μ": "u", "µ": "u"}
_VARIANTS = (("sulph", "sulf"), ("aluminium", "aluminum"), ("caesium", "cesium"))


def unified(text: str) -> str:
    """Return a text with one spelling of each sign: º, ˚ and ℃ become °, µ becomes μ, dashes "-", and the like.

    Also full-width letters and digits, subscripts, special and zero-width spaces, ligatures and Cyrillic look-alikes
    among Latin letters. Unifying twice changes nothing.
    """
    if text.isascii() and "oC" not in text and "oF" not in text:
        return text
    text = _COMPATIBLE.sub(lambda match: unicodedata.normalize("NFKC", match[0]), text.translate(_LOOKALIKES))
    text = "".join(" " if unicodedata.category(char) == "Zs" and char != "\u3000" else char for char in text)
    text = _MIXED.sub(lambda match: match[0].translate(_SLAVIC), _DASH_IN_RANGE.sub("-", text))
    return unicodedata.normalize("NFC", _DEGREE_LETTER.sub(r"\1°", text))


@dataclass(frozen=True)
class Folded:
    """A text without case, accents, spacing and punctuation, as `labgym.assets.search.normalize` makes it.

    Attributes:
        text: the original.
        plain: folded letters and digits.
        places: index in the original of each folded character.
    """

    text: str
    plain: str
    places: tuple[int, ...]

    @classmethod
    def of(cls, text: str) -> Folded:
        """Fold a text."""
        chars: list[str] = []
        places: list[int] = []
        for place, char in enumerate(text):
            for part in unicodedata.normalize("NFKD", _SPELLINGS.get(char, char)).casefold():
                if part.isalnum() and not unicodedata.combining(part):
                    chars.append(part)
                    places.append(place)
        plain = "".join(chars)
        for variant, usual in _VARIANTS:
            at = plain.find(variant)
            while at >= 0:
                plain = plain[:at] + usual + plain[at + len(variant) :]
                places[at : at + len(variant)] = [*places[at : at + len(usual) - 1], places[at + len(variant) - 1]]
                at = plain.find(variant, at + len(usual))
        return cls(text, plain, tuple(places))

    def begins(self, index: int) -> bool:
        """Return whether a word begins at a folded character; each Chinese character is a word."""
        return index == 0 or self._apart(index - 1, index)

    def ends(self, index: int) -> bool:
        """Return whether a word ends before a folded character."""
        return index == len(self.plain) or self._apart(index - 1, index)

    def _apart(self, left: int, right: int) -> bool:
        if self.places[right] - self.places[left] > 1:
            return True
        return _ideograph(self.plain[left]) or _ideograph(self.plain[right])


def _ideograph(char: str) -> bool:
    return "\u3400" <= char <= "\u9fff"
