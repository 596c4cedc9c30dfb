"""Language detection: English, Chinese, or unknown."""

from __future__ import annotations

import re
import unicodedata
from typing import Literal

from labgym.protocols.language.words import word_table

Language = Literal["en", "zh", "unknown"]

_WORDS = re.compile(r"[a-zà-öø-ÿ]+(?:'[a-z]+)?", re.IGNORECASE)
_FOREIGN_SCRIPTS = ("HIRAGANA", "KATAKANA", "HANGUL", "CYRILLIC", "ARABIC", "HEBREW", "THAI", "DEVANAGARI")


def language_of(text: str) -> Language:
    """Return the language of a text, judged by its script and its function words.

    Chinese is recognized by its characters; Japanese and Korean are excluded by theirs. Latin script counts as English
    unless function words of other languages outnumber the English ones; formulas and abbreviations count for neither.
    """
    letters = [char for char in text if char.isalpha()]
    if not letters:
        return "unknown"
    names = [unicodedata.name(char, "") for char in letters]
    if any(name.startswith(_FOREIGN_SCRIPTS) for name in names):
        return "unknown"
    if sum(name.startswith("CJK") for name in names) >= 0.08 * len(letters):
        return "zh"
    if sum(name.startswith(("LATIN", "GREEK")) for name in names) < len(letters):
        return "unknown"
    table = word_table()
    tokens = [word.lower() for word in _WORDS.findall(text)]
    english = sum(word in table.english_words for word in tokens)
    other = sum(word in table.other_languages for word in tokens)
    accented = sum(not word.isascii() for word in tokens)
    return "unknown" if other + accented > english else "en"
