"""LabGen: propose, repair, adjust and refine layouts for navigation."""

from labgym.layouts.floor import Door, Floor, Room
from labgym.layouts.generate import GENERATOR, generate, reasons, resolve_request
from labgym.layouts.method import Method
from labgym.layouts.model import Layout
from labgym.layouts.optimise import optimise
from labgym.layouts.placement import Placement
from labgym.layouts.refinement import refine
from labgym.layouts.rooms import room_presets
from labgym.layouts.splits import load_published, published, train_layout

__all__ = [
    "GENERATOR",
    "Door",
    "Floor",
    "Layout",
    "Method",
    "Placement",
    "Room",
    "generate",
    "load_published",
    "optimise",
    "published",
    "reasons",
    "refine",
    "resolve_request",
    "room_presets",
    "train_layout",
]
