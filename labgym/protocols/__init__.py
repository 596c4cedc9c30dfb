"""LabForge II: protocols, the experiment library and their validation."""

from labgym.protocols.model import Protocol, ReagentUse, Step

__all__ = ["Protocol", "ReagentUse", "Step"]
