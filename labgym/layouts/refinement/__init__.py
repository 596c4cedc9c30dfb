"""Phase 3 of LabGen: furniture makes way until the robot can drive every transition of the protocol."""

from labgym.layouts.refinement.blockages import blockages
from labgym.layouts.refinement.operator import refine, refine_assessed

__all__ = ["blockages", "refine", "refine_assessed"]
