"""Quirks of the released evaluator, numbered, with the literal and the corrected reading of each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

QuirkName = Literal[
    "room", "oblique", "middle", "depth", "groups", "names", "obj", "surface", "unplaced", "snake",
    "first", "pairs", "cabinet", "jump", "layers", "empty",
    "walls", "exact", "keys", "flip", "sizes",
]  # fmt: skip


@dataclass(frozen=True)
class Quirk:
    """A quirk of the released evaluator.

    Attributes:
        name: short name, unique.
        literal: what the program does.
        corrected: what it does in the mode `corrected`.
    """

    name: QuirkName
    literal: str
    corrected: str


QUIRKS: tuple[Quirk, ...] = (
    Quirk("room", "the room has the size of its name in the library, the long side along x", "`room_size`, w along x"),
    Quirk("oblique", "angles other than 90 and 270 degrees count as 0", "footprints are turned by the angle"),
    Quirk("middle", "z is the middle of a body", "z is its bottom"),
    Quirk("depth", "bodies collide if they overlap by more than 5 cm on each axis", "by more than 1 mm"),
    Quirk(
        "groups",
        "floor objects, and items with the same label, are compared with each other",
        "all objects, except an item with what carries it",
    ),
    Quirk("names", "seven kinds of furniture stand on the floor, whatever their label", "the label decides"),
    Quirk("obj", "Obj counts the room", "it does not"),
    Quirk(
        "surface",
        "an item stands on the first object that is called as its label, with the size of the label's name",
        "on the nearest of these objects, with its size",
    ),
    Quirk(
        "unplaced",
        "if nothing is called as the label, an item is in bounds and its Glass is 1",
        "it is out of bounds and its Glass is 0; furniture on the floor has no Glass",
    ),
    Quirk("snake", "heights on surfaces are checked under Pascal-case labels", "under any spelling of the label"),
    Quirk("first", "a constraint is judged at the first object whose id contains the name", "at its own object"),
    Quirk(
        "pairs",
        "ordered pairs of ids: C5 and C7 are the same pairs, counted twice",
        "each pair of objects of two kinds once, without C7",
    ),
    Quirk("cabinet", "the first reagent cabinet, with the size of the library", "any reagent cabinet, with its size"),
    Quirk("jump", "satisfaction falls from 0.21 to 0.20 at a ratio of 0.7", "it rises from 0.21 to 0.70"),
    Quirk(
        "layers",
        "reagents are on layers of a cabinet if their labels say so and their heights differ by more than 0.1 m",
        "if both stand in one cabinet",
    ),
    Quirk("empty", "a category without constraints scores 1", "it does not apply"),
    Quirk("walls", "walls are no obstacles to the robot", "they are"),
    Quirk(
        "exact",
        "navigation takes the size of the last entry with exactly the id; others are one pixel and no place",
        "the size that the other rules take",
    ),
    Quirk("keys", "paths are counted by the names of their ends; turning furniture adds a path", "each drive once"),
    Quirk("flip", "a goal outside of the room moves behind the furniture", "it cannot be reached"),
    Quirk("sizes", "a labgym layout's objects have the sizes of the library, if it has their names", "their own sizes"),
)
"""The quirks; the number of each is its place, from 1."""
NUMBERS: dict[QuirkName, int] = {quirk.name: number for number, quirk in enumerate(QUIRKS, 1)}


@dataclass(frozen=True)
class Reading:
    """How the rules are read: the names of the quirks that are corrected."""

    corrected: frozenset[QuirkName] = frozenset()

    def literal(self, name: QuirkName) -> bool:
        """Return whether a quirk is taken literally."""
        return name not in self.corrected

    def correcting(self, name: QuirkName) -> Reading:
        """Return the reading with a further quirk corrected."""
        return Reading(self.corrected | {name})


LITERAL = Reading()
CORRECTED = Reading(frozenset(NUMBERS))
Mode = Literal["literal", "corrected"]
MODES: dict[Mode, Reading] = {"literal": LITERAL, "corrected": CORRECTED}
