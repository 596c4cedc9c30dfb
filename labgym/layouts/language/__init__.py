"""Layouts by a language model: a first layout, and commands that adjust one. Both are verified as any other."""

from labgym.layouts.language.adjuster import LanguageAdjuster
from labgym.layouts.language.proposer import LanguageProposer

__all__ = ["LanguageAdjuster", "LanguageProposer"]
