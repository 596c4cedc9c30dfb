"""Holodeck: constraints from a designer, depth-first search on a grid, small objects at random on receptacles."""

from labgym.paper.rivals.holodeck.proposer import HolodeckPlusProposer, HolodeckProposer

__all__ = ["HolodeckPlusProposer", "HolodeckProposer"]
