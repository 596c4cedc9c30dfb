"""Floors: walls with openings, the spaces between them, and what is fixed there."""

from labgym.layouts.floor.doorways import Doorway
from labgym.layouts.floor.fields import IDENTIFIER, Coordinate, Identifier
from labgym.layouts.floor.model import Floor
from labgym.layouts.floor.rooms import Door, Room
from labgym.layouts.floor.spaces import OUTSIDE, Column, Finishes, KeepOut, Rectangle, Service, Space
from labgym.layouts.floor.walls import Opening, Wall

__all__ = [
    "IDENTIFIER",
    "OUTSIDE",
    "Column",
    "Coordinate",
    "Door",
    "Doorway",
    "Finishes",
    "Floor",
    "Identifier",
    "KeepOut",
    "Opening",
    "Rectangle",
    "Room",
    "Service",
    "Space",
    "Wall",
]
