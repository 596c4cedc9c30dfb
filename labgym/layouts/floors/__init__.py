"""Families of floors: seeded generators of rooms and suites, with sourced ranges for every parameter."""

from labgym.layouts.floors.building import FloorDraw
from labgym.layouts.floors.draw import FAMILIES, SPLITS, Population, draw_floor, population_of
from labgym.layouts.floors.fittings import FamilyStyle

__all__ = [
    "FAMILIES",
    "SPLITS",
    "FamilyStyle",
    "FloorDraw",
    "Population",
    "draw_floor",
    "population_of",
]
