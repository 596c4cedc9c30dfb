"""Holodeck and SceneWeaver with a configured language model in place of the seeded table."""

from labgym.layouts.rivals.language.proposers import (
    HolodeckLanguageProposer,
    HolodeckPlusLanguageProposer,
    SceneWeaverLanguageProposer,
)

__all__ = ["HolodeckLanguageProposer", "HolodeckPlusLanguageProposer", "SceneWeaverLanguageProposer"]
