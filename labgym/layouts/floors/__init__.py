"""Families of floors: seeded generators of rooms and suites, with sourced ranges for every parameter."""

from labgym.layouts.floors.building import FloorDraw
from labgym.layouts.floors.draw import FAMILIES, Family, draw_floor
from labgym.layouts.floors.populations import SPLITS, Population, population_of
from labgym.layouts.floors.style import FamilyStyle, HoodWall, Island

__all__ = [
    "FAMILIES",
    "SPLITS",
    "Family",
    "FamilyStyle",
    "FloorDraw",
    "HoodWall",
    "Island",
    "Population",
    "draw_floor",
    "population_of",
]
