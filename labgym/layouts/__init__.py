"""LabGen: layouts proposed, repaired, adjusted and refined for navigation."""

from labgym.layouts.model import Door, Layout, Placement, Provenance, Room

__all__ = ["Door", "Layout", "Placement", "Provenance", "Room"]
