"""Fills a space beyond what protocol and safety require: further pieces, benches in the open, rows along the walls."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from labgym.assets import Asset
from labgym.geometry import OrientedBox, distance
from labgym.layouts.brief import Unit
from labgym.layouts.ground import Segment
from labgym.layouts.habits import RoomHabit
from labgym.layouts.interiors.blocks import BenchBlock, blocks_of, island, place_block
from labgym.layouts.interiors.interior import Interior
from labgym.layouts.interiors.standing import ASIDE, WALL_GAP
from labgym.layouts.interiors.supply import Options, preferred, supplied
from labgym.layouts.request import Request
from labgym.layouts.rules.facility.showers import SHOWER_WALK
from labgym.layouts.rules.supplies import supplies_of

MISSES = 5
"""Number of pieces in a row that find no place before a wall counts as full, and of blocks for the open floor."""
HOOD_FRONT = 1.5
"""Free depth in front of a hood, meters."""
SAME_WALL = 0.7
"""Probability that a piece joins a row instead of standing anywhere along a wall."""
DETOUR_M = 3.0
"""Greatest walk to emergency equipment beyond the way along the axes of the space, meters (assumption: islands)."""
EQUIPPED = frozenset({"EyewashStation", "EmergencyShower", "HandWashSink"})
NEAR_TRIES = 12
"""Random places of which the one nearest to a piece's neighbor is taken."""


@dataclass
class Names:
    """Ids for new pieces: an asset's name and the next free number.

    Attributes:
        taken: ids that exist.
    """

    taken: set[str] = field(default_factory=set)

    def next(self, asset: Asset) -> str:
        """Return an id for one more piece of an asset."""
        number = 1
        while f"{asset.name}_{number}" in self.taken:
            number += 1
        self.taken.add(f"{asset.name}_{number}")
        return f"{asset.name}_{number}"


def add_pieces(
    room: Interior,
    units: Sequence[Unit],
    partners: Mapping[str, Iterable[str]],
    generator: np.random.Generator,
    beyond_supplies: bool = True,
) -> list[Unit]:
    """Place units along the walls, near their partners if they have some; return those without a place.

    Args:
        beyond_supplies: whether a unit may stand beyond the reach of what it needs if it reaches it nowhere.
    """
    left = []
    for unit in units:
        near = [room.feet[other] for other in partners.get(unit.id, ()) if other in room.feet]
        supplies = room.ground.supplies
        options = (preferred if beyond_supplies else supplied)(room.options(unit), unit, supplies)
        if not any(room.add([(unit, foot)]) for foot in _wall_feet(room, unit, options, near, generator)):
            left.append(unit)
    return left


@dataclass(frozen=True)
class Filler:
    """Adds furniture that nothing requires: along the walls and in the open, by the style of a request.

    Attributes:
        names: ids of all pieces of the laboratory.
    """

    request: Request
    names: Names
    generator: np.random.Generator

    def add_piece(self, room: Interior, asset: Asset, free_standing: bool) -> bool:
        """Place one more piece of furniture along a wall, or in the open, and return whether it found a place."""
        unit = self._unit(asset, "exists")
        if free_standing:
            added = self._add_at(room, island(asset), [unit], False, 1)
        else:
            added = not add_pieces(room, [unit], {}, self.generator)
        if not added:
            self.names.taken.discard(unit.id)
        return added

    def fill(self, room: Interior, spare: Mapping[str, int]) -> None:
        """Add free-standing benches and rows of furniture along the walls, as much as the style asks for.

        Args:
            spare: number of pieces that the laboratory may still get, by asset name; any number of others.
        """
        habit = self.request.habits.rooms.get(room.ground.use, RoomHabit())
        if habit.islands:
            self._fill_open(room, habit)
        if habit.walls:
            catalog = self.request.furniture.catalog
            usual = [name for name in habit.walls if catalog.get(name).fume_hood <= is_equipped(room)]
            self._fill_walls(room, usual, dict(spare))

    def _fill_open(self, room: Interior, habit: RoomHabit) -> None:
        style = self.request.style
        wanted, taken, misses = style.islands * room.ground.area, 0.0, 0
        while misses < MISSES and taken < wanted:
            kind = style.kinds[int(self.generator.integers(len(style.kinds)))]
            if kind == "peninsula":
                added = self._add_peninsula(room, self.request.furniture.get(self.request.habits.peninsula))
            else:
                added = self._add_block(room, habit, kind, wanted - taken)
            taken += added
            misses = 0 if added else misses + 1

    def _add_block(self, room: Interior, habit: RoomHabit, kind: str, wanted: float) -> float:
        """Add a block of a kind, a large one if it fits, and return its area, 0 if none fits; square meters.

        Args:
            wanted: area that benches in the open may still take, square meters.
        """
        blocks = blocks_of(kind, self.request.furniture, habit.islands, habit.backs)
        first = int(self.generator.integers(len(blocks)))
        for block in blocks[first:]:
            units = [self._unit(bench.asset, f"{kind.replace('_', ' ')} bench") for bench in block.benches]
            count = math.ceil(wanted / (block.width * block.depth))
            if self._add_at(room, block, units, kind == "oblique", count):
                return block.width * block.depth
            self.names.taken.difference_update(unit.id for unit in units)
        return 0.0

    def _add_at(self, room: Interior, block: BenchBlock, units: Sequence[Unit], oblique: bool, wanted: int) -> bool:
        """Add the benches of a block where it fits, and return whether they were added."""
        style = self.request.style
        stances = [replace(unit, stance="island", clear=min(style.aisle, style.neck)) for unit in units]
        pose = place_block(room, block, style, oblique, wanted, self.generator)
        if pose is None or not room.add(list(zip(stances, block.feet(*pose), strict=True))):
            return False
        if abs(math.sin(2.0 * pose[2])) < ASIDE:
            room.blocks.append(OrientedBox(pose[0], pose[1], block.width, block.depth, pose[2]))
        return True

    def _add_peninsula(self, room: Interior, asset: Asset) -> float:
        """Add a bench with one short end at a wall and return its area, 0 if it fits nowhere; square meters."""
        style = self.request.style
        length, depth, aisle = asset.size.width, asset.size.depth, style.aisle
        unit = replace(self._unit(asset, "peninsula bench"), stance="peninsula")
        room_for = replace(unit, width=depth + 2.0 * aisle, depth=length + style.neck, front=0.0)
        for segment, along in _draws(room.options(room_for), self.generator):
            x, y = segment.point(along + aisle + depth / 2.0, WALL_GAP + length / 2.0)
            turn = math.pi / 2.0 if self.generator.random() < 0.5 else -math.pi / 2.0
            foot = OrientedBox(x, y, length, depth, segment.yaw + turn)
            if room.add([(replace(unit, clear=min(aisle, style.neck)), foot)]):
                return length * depth
        self.names.taken.discard(unit.id)
        return 0.0

    def _fill_walls(self, room: Interior, usual: Sequence[str], spare: dict[str, int]) -> None:
        length = sum(segment.length for segment in room.ground.segments)
        used = sum(unit.width for unit in room.units.values() if unit.stance == "wall")
        misses = 0
        while misses < MISSES and used < self.request.style.walls * length:
            offered = [name for name in usual if spare.get(name, 1) > 0]
            name = offered[int(self.generator.integers(len(offered)))]
            unit = self._unit(self.request.furniture.get(name), "fills free wall")
            options = supplied(room.options(unit), unit, room.ground.supplies)
            if any(room.add([(unit, foot)]) for foot in _wall_feet(room, unit, options, (), self.generator)):
                used += unit.width
                if name in spare:
                    spare[name] -= 1
                misses = 0
            else:
                self.names.taken.discard(unit.id)
                misses += 1

    def _unit(self, asset: Asset, reason: str) -> Unit:
        front = max(asset.clearance, HOOD_FRONT if asset.fume_hood else 0.0)
        name, size = self.names.next(asset), asset.size
        return Unit(name, asset, size.width, size.depth, front, reason=reason, supplies=supplies_of(asset))


def is_near(room: Interior, foot: OrientedBox, role: str) -> bool:
    """Whether equipment of a role is so near to a footprint that the walk to it takes at most 10 s."""
    pieces = [room.feet[unit_id] for unit_id, unit in room.units.items() if unit.asset.role == role]
    ways = (abs(foot.x - piece.x) + abs(foot.y - piece.y) for piece in pieces)
    return min(ways, default=math.inf) <= SHOWER_WALK - DETOUR_M


def is_equipped(room: Interior) -> bool:
    """Whether a space has what hazardous work needs: an eyewash, a shower and a sink for washing hands."""
    return {unit.asset.role for unit in room.units.values()} >= EQUIPPED


def _wall_feet(
    room: Interior, unit: Unit, options: Options, near: Sequence[OrientedBox], generator: np.random.Generator
) -> Iterator[OrientedBox]:
    """Yield footprints of a unit along the walls that are free, a few at most; the nearest to others first."""
    feet = []
    for segment, along in _draws(options, generator):
        if segment.straight:
            feet.append(segment.box(along, WALL_GAP, unit.width, unit.depth))
        else:
            foot = room.standing.oblique_foot(segment, along, unit)
            feet += [foot] if room.standing.along_its_wall(segment, foot) else []
    if unit.asset.fume_hood:
        feet = [foot for foot in feet if all(is_near(room, foot, role) for role in EQUIPPED)]
    if near:
        feet.sort(key=lambda foot: min(distance(foot, other) for other in near))
    yield from feet[:3]


def _draws(options: Options, generator: np.random.Generator) -> list[tuple[Segment, float]]:
    """Random places among those along the walls."""
    if not options:
        return []
    weights = np.array([sum(high - low for low, high in intervals) + 0.5 for _, intervals in options])
    draws = []
    for _ in range(NEAR_TRIES):
        segment, intervals = options[int(generator.choice(len(options), p=weights / weights.sum()))]
        low, high = intervals[int(generator.integers(len(intervals)))]
        if generator.random() < SAME_WALL:
            along = low if generator.random() < 0.5 else high
        else:
            along = float(generator.uniform(low, high))
        draws.append((segment, along))
    return draws
