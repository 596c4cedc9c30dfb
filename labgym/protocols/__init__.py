"""LabForge II: protocols, experiments, their validation, search and synthesis."""

from labgym.protocols.constraints import derive
from labgym.protocols.errors import RefusalError
from labgym.protocols.library import Summary, get, protocols, resolve, statistics
from labgym.protocols.model import ChemicalConstraint, Protocol, ReactionType, ReagentUse, SpatialConstraint, Step
from labgym.protocols.rules import Finding
from labgym.protocols.validate import ProtocolError, check, examine, validate

__all__ = [
    "ChemicalConstraint",
    "Finding",
    "Protocol",
    "ProtocolError",
    "ReactionType",
    "ReagentUse",
    "RefusalError",
    "SpatialConstraint",
    "Step",
    "Summary",
    "check",
    "derive",
    "examine",
    "get",
    "protocols",
    "resolve",
    "statistics",
    "validate",
]
