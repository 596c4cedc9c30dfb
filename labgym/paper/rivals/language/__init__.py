"""Holodeck and SceneWeaver with a configured language model in place of the seeded table."""

from labgym.paper.rivals.language.proposers import (
    HolodeckLanguageProposer,
    HolodeckPlusLanguageProposer,
    SceneWeaverLanguageProposer,
)

__all__ = ["HolodeckLanguageProposer", "HolodeckPlusLanguageProposer", "SceneWeaverLanguageProposer"]
