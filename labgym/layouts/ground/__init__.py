"""Grounds: what a space offers to furniture, in the space's own frame."""

from labgym.layouts.ground.ground import Ground, Use, grounds
from labgym.layouts.ground.segments import Gate, Segment, without

__all__ = ["Gate", "Ground", "Segment", "Use", "grounds", "without"]
