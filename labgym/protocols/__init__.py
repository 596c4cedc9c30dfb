"""LabForge II: protocols, the experiment library and their validation."""

from labgym.protocols.library import get, protocols
from labgym.protocols.model import ChemicalConstraint, Protocol, ReactionType, ReagentUse, SpatialConstraint, Step

__all__ = [
    "ChemicalConstraint",
    "Protocol",
    "ReactionType",
    "ReagentUse",
    "SpatialConstraint",
    "Step",
    "get",
    "protocols",
]
