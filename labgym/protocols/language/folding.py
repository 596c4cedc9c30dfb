"""Text folded for comparison, with the position of every character in the original."""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass

_SPELLINGS = {"α": "alpha", "β": "beta", "γ": "gamma", "μ": "u", "µ": "u"}
_VARIANTS = (("sulph", "sulf"), ("aluminium", "aluminum"), ("caesium", "cesium"))


@dataclass(frozen=True)
class Folded:
    """A text without case, accents, spacing and punctuation, as `labgym.assets.search.normalise` makes it.

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
