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
    Quirk("room", "room as the library has its name, long side along x", "`room_size`, w along x"),
    Quirk("oblique", "angles other than 90 and 270 degrees count as 0", "footprints are turned"),
    Quirk("middle", "z is the middle of a body", "z is its bottom"),
    Quirk("depth", "collisions overlap by more than 5 cm on each axis", "by more than 1 mm"),
    Quirk("groups", "furniture, and items of one label, can collide", "all but an item with its carriers"),
    Quirk("names", "seven kinds stand on the floor, whatever their label", "the label decides"),
    Quirk("obj", "Obj counts the room", "it does not"),
    Quirk("surface", "the first object called as the label, in the label's size", "the nearest, in its size"),
    Quirk("unplaced", "no such object: in bounds, Glass is 1", "out of bounds, 0; furniture has no Glass"),
    Quirk("snake", "heights are checked under Pascal-case labels", "under any spelling"),
    Quirk("first", "judged at the first object whose id contains the name", "at its own object"),
    Quirk("pairs", "ordered pairs of ids; C5 and C7 are the same", "pairs of kinds once, no C7"),
    Quirk("cabinet", "the first reagent cabinet, in the library's size", "any, in its own size"),
    Quirk("jump", "satisfaction falls from 0.21 to 0.20 at a ratio of 0.7", "it rises from 0.21"),
    Quirk("layers", "cabinet layers by label, if z differs by over 0.1 m", "if both are in one cabinet"),
    Quirk("empty", "a category without constraints scores 1", "it does not apply"),
    Quirk("walls", "walls are no obstacles to the robot", "they are"),
    Quirk("exact", "sizes of the last entry of the exact id, others a pixel", "the sizes of other rules"),
    Quirk("keys", "paths by names of their ends, one more if furniture turns", "each drive"),
    Quirk("flip", "a goal outside of the room moves behind the furniture", "it cannot be reached"),
    Quirk("sizes", "labgym's objects in the library's size, if it has the name", "in their own size"),
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
MODES: dict[str, Reading] = {"literal": LITERAL, "corrected": CORRECTED}
