"""Furnishing of floors: one space at a time, in the space's own frame."""

from labgym.layouts.interiors.proposer import FloorProposer

__all__ = ["FloorProposer"]
