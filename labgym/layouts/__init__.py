"""LabGen: layouts proposed, repaired, adjusted and refined for navigation."""

from labgym.layouts.generate import generate
from labgym.layouts.model import Door, Layout, Placement, Provenance, Room
from labgym.layouts.optimise import optimise
from labgym.layouts.refine import refine
from labgym.layouts.rooms import room_presets
from labgym.layouts.splits import load_published, published, train_layout

__all__ = [
    "Door",
    "Layout",
    "Placement",
    "Provenance",
    "Room",
    "generate",
    "load_published",
    "optimise",
    "published",
    "refine",
    "room_presets",
    "train_layout",
]
