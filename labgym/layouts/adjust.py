"""Adjust by rules and search: commands for what FastRepair cannot fix, each verified before it is accepted."""

from __future__ import annotations

import math
import typing
from collections.abc import Iterator
from typing import Literal

from labgym.geometry import OrientedBox
from labgym.layouts.model import FLOOR, WALL, Layout
from labgym.layouts.moves import Command, Move, Settle, Swap, apply, may_move
from labgym.layouts.relocation import free_places
from labgym.layouts.rules.building import building_of
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.satisfaction import Instance
from labgym.layouts.rules.storage import STORAGE_CLASSES
from labgym.layouts.rules.thresholds import MOVABLE, ONE_SIDED
from labgym.layouts.tidying import hanging_place
from labgym.layouts.trace import Recorder
from labgym.protocols import Protocol

Level = Literal["room", "desktop"]
ADJUST = "adjust"
"""Operator of the commands in a trace."""
SLIDES = (0.1, 0.25, 0.5, 1.0, 1.5)
"""Distances along a wall that are tried, meters."""
BUDGET = 60
"""Maximum number of commands verified in one adjustment."""
PLACES = 8
"""Maximum number of free places tried for a piece of furniture."""
NUDGES = (0.2, 0.4)
"""Distances that an island is moved to widen a way, meters."""
ALIKE = 0.6
"""Greatest difference in width and depth together between objects that are swapped, meters."""


class Adjuster(typing.Protocol):
    """Proposes a better layout at one level; the loop verifies it again."""

    def adjust(
        self,
        layout: Layout,
        protocol: Protocol | None,
        assessment: Assessment,
        level: Level,
        trace: Recorder | None = None,
    ) -> Layout:
        """Return a better layout, or the same object if no command improves it.

        Args:
            trace: is given every command that is tried (`Recorder.trial`) or cannot be applied (`Recorder.refuse`).
        """


class RuleAdjuster:
    """Relocates, slides and swaps furniture, and rearranges what stands on surfaces."""

    def adjust(
        self,
        layout: Layout,
        protocol: Protocol | None,
        assessment: Assessment,
        level: Level,
        trace: Recorder | None = None,
    ) -> Layout:
        """Return the layout after the first command that improves it, or the same object if none does."""
        commands = _room_commands(layout, assessment) if level == "room" else _desktop_commands(layout, assessment)
        tried: set[Command] = set()
        for command in commands:
            if command in tried:
                continue
            if len(tried) >= BUDGET:
                break
            tried.add(command)
            candidate = apply(layout, command)
            proposed = evaluate_layout(candidate, protocol, assessment.profile)
            better = proposed.better_than(assessment)
            if trace is not None:
                trace.trial(ADJUST, (command,), assessment, proposed, better)
            if better:
                return candidate
        return layout


def _unsatisfied(assessment: Assessment) -> list[Instance]:
    """Instances with less than full satisfaction, the worst first."""
    poor = [instance for instance in assessment.instances if instance.satisfaction < 1.0]
    return sorted(poor, key=lambda instance: (instance.satisfaction, instance.rule, instance.ids))


def _room_commands(layout: Layout, assessment: Assessment) -> Iterator[Command]:
    """Relocations, slides and swaps of the floor objects that break a rule or carry what does."""
    groups = [issue.ids for issue in assessment.errors]
    groups += [collision.ids for collision in assessment.collisions]
    groups += [(fault.id,) for fault in assessment.bounds]
    groups += [instance.ids for instance in _unsatisfied(assessment) if len(instance.ids) == 2]
    for ids in groups:
        roots = [root for root in dict.fromkeys(layout.root(item).id for item in ids) if may_move(layout, root)]
        for root in roots:
            yield from free_places(layout, root, PLACES)
            place = hanging_place(layout, root) if layout.placement(root).support == WALL else None
            if place is not None:
                yield place
        for root in roots:
            yield from _slides(layout, root)
        for root in roots:
            yield from _swaps(layout, root)


def way_commands(layout: Layout, most: int) -> list[Command]:
    """Return relocations of floor objects that could widen a way out, those near doors first; at most `most`."""
    doors = [entrance.pose for entrance in building_of(layout).entrances]
    near = []
    for placement in layout.placements:
        if placement.support == FLOOR and layout.asset(placement.id).subtype not in MOVABLE:
            box = layout.box(placement.id)
            if may_move(layout, placement.id):
                near.append((min(math.hypot(box.x - x, box.y - y) for x, y, _ in doors), placement.id))
    commands: list[Command] = []
    for _, placement_id in sorted(near):
        commands += free_places(layout, placement_id, PLACES)
        if layout.asset(placement_id).size.depth >= ONE_SIDED:
            for distance in NUDGES:
                for dx, dy in ((distance, 0.0), (-distance, 0.0), (0.0, distance), (0.0, -distance)):
                    commands.append(Move(placement_id, dx, dy))
        if len(commands) >= most:
            break
    return commands[:most]


def _slides(layout: Layout, root: str) -> Iterator[Command]:
    box = layout.box(root)
    along = (math.cos(box.yaw), math.sin(box.yaw))
    for distance in SLIDES:
        for sign in (1.0, -1.0):
            yield Move(root, round(sign * distance * along[0], 6), round(sign * distance * along[1], 6))


def _swaps(layout: Layout, root: str) -> Iterator[Command]:
    """Swaps with floor objects of about the same footprint, the most similar first."""
    box = layout.box(root)
    others = []
    for placement in layout.placements:
        if placement.support == FLOOR and placement.id != root and may_move(layout, placement.id):
            difference = _difference(box, layout.box(placement.id))
            if difference < ALIKE:
                others.append((difference, placement.id))
    for _, other in sorted(others):
        yield Swap(root, other)


def _difference(first: OrientedBox, second: OrientedBox) -> float:
    return abs(first.width - second.width) + abs(first.depth - second.depth)


def _desktop_commands(layout: Layout, assessment: Assessment) -> Iterator[Command]:
    """Other spots for glass near an edge, objects that collide or hang over, and reagents that are not stored."""
    for instance in _unsatisfied(assessment):
        if instance.rule == "storage":
            yield from _cabinet_spots(layout, instance.ids[0])
        else:
            for item in instance.ids:
                yield from _surface_spots(layout, item)
    for collision in assessment.collisions:
        for item in collision.ids:
            yield from _surface_spots(layout, item)
    for fault in assessment.bounds:
        yield from _surface_spots(layout, fault.id)


def _surface_spots(layout: Layout, item: str) -> Iterator[Command]:
    """A coarse grid of spots on the same surface, its middle line first."""
    placement = layout.placement(item)
    if placement.support not in layout.by_id or placement.slot is None or not may_move(layout, item):
        return
    surface, size = layout.surface(placement.support, placement.slot), layout.asset(item).size
    reach_x, reach_y = (surface.width - size.width) / 2.0, (surface.depth - size.depth) / 2.0
    if reach_x < 0.0 or reach_y < 0.0:
        return
    rows = (0.0, -0.5, 0.5)
    for row in rows:
        for column in range(-4, 5):
            yield Settle(item, placement.support, placement.slot, reach_x * column / 4.5, reach_y * row)


def _cabinet_spots(layout: Layout, reagent: str) -> Iterator[Command]:
    """Shelves of a cabinet of the reagent's own class, then of any storage cabinet."""
    if not may_move(layout, reagent):
        return
    chemistry = layout.asset(reagent).chemistry
    own = chemistry.storage_class if chemistry is not None else None
    classes = {placement.id: layout.asset(placement.id).storage_class for placement in layout.placements}
    cabinets = [placement for placement in layout.placements if classes[placement.id] in STORAGE_CLASSES]
    size = layout.asset(reagent).size
    for cabinet in sorted(cabinets, key=lambda placement: (classes[placement.id] != own, placement.id)):
        for slot, surface in enumerate(layout.asset(cabinet.id).surfaces):
            reach = (surface.width - size.width) / 2.0
            if reach < 0.0 or size.depth > surface.depth or (surface.headroom or 10.0) < size.height:
                continue
            for column in range(-2, 3):
                yield Settle(reagent, cabinet.id, slot, reach * column / 2.0, 0.0)
