"""Adjust by rules and search, each command verified before it is accepted; and the limit of work of a repair."""

from __future__ import annotations

import math
import typing
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Literal

from labgym.errors import LabgymError
from labgym.geometry import BoxArray, OrientedBox, wrap_angle
from labgym.layouts.model import Layout
from labgym.layouts.moves import Command, Move, Rotate, Swap, apply, may_move
from labgym.layouts.placement import FLOOR, WALL
from labgym.layouts.relocation import free_places
from labgym.layouts.rules.building import building_of
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule import Instance
from labgym.layouts.rules.thresholds import MOVABLE, ONE_SIDED, Profile
from labgym.layouts.settling import free_spots, homes
from labgym.layouts.tidying import hanging_place
from labgym.layouts.trace import Recorder
from labgym.protocols import Protocol

UNITS = 1_000_000
"""Units of a repair, one to two minutes. The repair of a damaged layout usually takes some thousands."""
WAYS = 3
"""The ways of an assessment count as this many assessments without ways, as they take as long."""
TRIALS = 30
"""Assessments for which an adjustment is charged: it verifies at most twice as many commands."""


class WorkLimitError(LabgymError):
    """A repair has reached its limit of work; `repair_layout` and `refine` return the best layout until then."""


@dataclass
class RepairBudget:
    """The units that are left: an assessment takes one for each object and one for each violation of the layout."""

    units: int = UNITS

    def spend(self, assessment: Assessment, times: int = 1) -> None:
        """Charge for one or more assessments.

        Raises:
            WorkLimitError: no units are left.
        """
        if self.units <= 0:
            raise WorkLimitError("the repair has reached its limit of work: repair fewer faults at a time")
        self.units -= times * (len(assessment.arrangement) + assessment.v)


@dataclass(frozen=True)
class LimitedAdjuster:
    """An adjuster that charges for each adjustment."""

    adjuster: Adjuster
    work: RepairBudget

    def adjust(
        self,
        layout: Layout,
        protocol: Protocol | None,
        assessment: Assessment,
        level: Level,
        trace: Recorder | None = None,
    ) -> Layout:
        """Return what the adjuster returns.

        Raises:
            WorkLimitError: no units are left.
        """
        self.work.spend(assessment, TRIALS)
        return self.adjuster.adjust(layout, protocol, assessment, level, trace)


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
SLOTS = 10
"""Maximum number of slots on which spots are tried for an object."""
OWN_SPOTS = 4
"""Maximum number of spots tried on the slot on which an object stands; on other slots one is tried."""
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
    """Relocates, turns, slides and swaps furniture; turns items, and settles them elsewhere on any proper surface."""

    def adjust(
        self,
        layout: Layout,
        protocol: Protocol | None,
        assessment: Assessment,
        level: Level,
        trace: Recorder | None = None,
    ) -> Layout:
        """Return the layout after the first command that improves it, or the same object if none does."""
        if level == "room":
            commands = _room_commands(layout, assessment)
        else:
            commands = _desktop_commands(layout, protocol, assessment)
        tried: set[Command] = set()
        for command in commands:
            if command in tried:
                continue
            if len(tried) >= BUDGET:
                break
            tried.add(command)
            candidate = apply(layout, command)
            proposed = evaluate_layout(candidate, protocol, assessment.rules, earlier=assessment)
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
    """Relocations, turns, slides and swaps of the floor objects that break a rule or carry what does."""
    groups = [issue.ids for issue in assessment.errors]
    groups += [collision.ids for collision in assessment.collisions]
    groups += [(fault.id,) for fault in assessment.bounds]
    groups += [instance.ids for instance in _unsatisfied(assessment) if len(instance.ids) == 2]
    yield from _in_turn([_for_group(layout, ids) for ids in dict.fromkeys(groups)])


def _in_turn(sources: Sequence[Iterator[Command]]) -> Iterator[Command]:
    """Yield the first command of each source, then the second of each: none keeps the others from being tried."""
    waiting = list(sources)
    while waiting:
        remaining = []
        for source in waiting:
            command = next(source, None)
            if command is not None:
                yield command
                remaining.append(source)
        waiting = remaining


def _for_group(layout: Layout, ids: tuple[str, ...]) -> Iterator[Command]:
    roots = [root for root in dict.fromkeys(layout.root(item).id for item in ids) if may_move(layout, root)]
    for root in roots:
        yield from free_places(layout, root, PLACES)
        place = hanging_place(layout, root) if layout.placement(root).support == WALL else None
        if place is not None:
            yield place
    for root in roots:
        yield from _turns(layout, root)
    for root in roots:
        yield from _slides(layout, root)
    for root in roots:
        yield from swaps(layout, root)


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


def swaps(layout: Layout, root: str) -> Iterator[Command]:
    """Yield swaps of a floor object with others of about the same footprint, the most similar first."""
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


def _turns(layout: Layout, root: str) -> Iterator[Command]:
    """Turns that set an object parallel to the walls, then by quarters from there, the least first.

    What hangs on a wall keeps its back to it: `hanging_place` finds it another wall.
    """
    box, building = layout.box(root), building_of(layout)
    skew = float(building.skew(BoxArray.of([box]))[0])
    straight = min(
        (wrap_angle(box.yaw + turn) for turn in (skew, -skew)),
        key=lambda yaw: float(building.skew(BoxArray.of([replace(box, yaw=yaw)]))[0]),
    )
    count = 1 if layout.placement(root).support == WALL else 4
    quarters = [wrap_angle(straight + quarter * math.pi / 2.0) for quarter in range(count)]
    for yaw in sorted(quarters, key=lambda yaw: abs(wrap_angle(yaw - box.yaw))):
        if abs(wrap_angle(yaw - box.yaw)) > 1e-6:
            yield Rotate(root, round(yaw, 9))


def _desktop_commands(layout: Layout, protocol: Protocol | None, assessment: Assessment) -> Iterator[Command]:
    """Other spots for what breaks a rule on a surface, and for what lies on the floor but belongs on a surface."""
    items = [item for collision in assessment.collisions for item in collision.ids]
    items += [fault.id for fault in assessment.bounds]
    items += [item for instance in _unsatisfied(assessment) for item in instance.ids]
    items += [p.id for p in layout.placements if p.support == FLOOR and layout.asset(p.id).placing == "desktop"]
    able = [item for item in dict.fromkeys(items) if layout.asset(item).placing == "desktop" and may_move(layout, item)]
    yield from _in_turn([_spots(layout, item, protocol, assessment.profile) for item in able])


def _spots(layout: Layout, item: str, protocol: Protocol | None, profile: Profile) -> Iterator[Command]:
    """A quarter turn in place, then free spots on the object's surface and on others where it may stand."""
    placement = layout.placement(item)
    if placement.support != FLOOR:
        yield Rotate(item, round(wrap_angle(placement.yaw + math.pi / 2.0), 9))
    for support, slot in islice(homes(layout, item, protocol), SLOTS):
        most = OWN_SPOTS if (support, slot) == (placement.support, placement.slot) else 1
        yield from free_spots(layout, item, support, slot, profile, most)
