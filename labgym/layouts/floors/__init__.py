"""Families of floors: seeded generators of rooms and suites, with sourced ranges for every parameter."""

from labgym.layouts.floors.building import FloorDraw
from labgym.layouts.floors.draw import FAMILIES, SPLITS, Family, Population, draw_floor, population_of
from labgym.layouts.floors.fittings import FamilyStyle, HoodWall, Island

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
