"""The assets, classes of substances and operations that a text in English or Chinese mentions."""

from labgym.protocols.language.concepts import concepts, gloss, language_of
from labgym.protocols.language.folding import unified
from labgym.protocols.language.mentions import Mention, mentions, without_chinese_names

__all__ = ["Mention", "concepts", "gloss", "language_of", "mentions", "unified", "without_chinese_names"]
