"""Ten kinds of damage to a layout, for the evaluation of repairs. Any floor; seeded; fixed objects stay as they are."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from numpy.random import Generator

from labgym.errors import LabgymError, OptionError, check_name
from labgym.layouts.model import Layout
from labgym.layouts.moves import Move, Place, Settle, apply, may_move, replaced, without
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.rule_sets import PAPER
from labgym.layouts.rules.storage import STORAGE_CLASSES
from labgym.layouts.rules.thresholds import MOVABLE
from labgym.layouts.rules.whereabouts import resolved
from labgym.navigation import goal_poses

MAX_PIECES = 5
DRAWS = 40
"""Maximum number of draws until a damage breaks a rule."""
SHOVE, LIFT = (0.1, 0.5), (0.02, 0.1)
"""Least and greatest shift of an item along its surface, and up or down; meters."""
LEFT_BEHIND, FAR = (0.3, 1.0), (0.2, 2.0)
"""Least and greatest shift of furniture without and with what stands on it, meters."""
TURN = (math.radians(20.0), math.radians(340.0))
"""Least and greatest turn of furniture, radians."""

Candidates = Callable[[Layout], list[str]]
Harm = Callable[[Layout, str, Generator], Layout]
Figure = Callable[[Assessment], int]


@dataclass(frozen=True)
class DamageKind:
    """A kind of damage.

    Attributes:
        title: the damage in words.
        candidates: returns the ids of the pieces that can be damaged.
        harm: damages one piece.
        figure: the number that the damage raises.
        navigation: whether the figure depends on ways, which must then be planned.
    """

    title: str
    candidates: Candidates
    harm: Harm
    figure: Figure
    navigation: bool = False


@dataclass(frozen=True)
class Damage:
    """A damaged layout, the kind of damage, and the ids of the damaged pieces."""

    layout: Layout
    kind: str
    ids: tuple[str, ...]


def damaged(layout: Layout, kind: str, pieces: int, generator: Generator) -> Damage:
    """Return a layout with one kind of damage, which raises the number of faults that this kind causes.

    Args:
        layout: any layout. The kinds `goal_pose` and `removed` require that it has a protocol; its first one counts.
        kind: name of a kind in `KINDS`.
        pieces: number of damaged pieces, 1 to 5.
        generator: source of the draws.

    Raises:
        UnknownNameError: no kind of damage has that name.
        OptionError: the number of pieces is out of range.
        LabgymError: the layout has too few such pieces, or none of 40 draws causes a fault.
    """
    check_name("kind of damage", kind, KINDS)
    if not 1 <= pieces <= MAX_PIECES:
        raise OptionError(f"pieces {pieces} must be 1 to {MAX_PIECES}")
    chosen = KINDS[kind]
    able = [each for each in chosen.candidates(layout) if may_move(layout, each)]
    if len(able) < pieces:
        raise LabgymError(f"layout {layout.id!r} has {len(able)} pieces for damage {kind!r}; {pieces} are required")
    faults = _faults(layout, chosen)
    for _ in range(DRAWS):
        ids = tuple(able[int(index)] for index in generator.permutation(len(able))[:pieces])
        harmed = layout
        for each in ids:
            # What stood on a piece that was removed is gone already.
            harmed = chosen.harm(harmed, each, generator) if each in harmed.by_id else harmed
        if _faults(harmed, chosen) > faults:
            return Damage(harmed, kind, ids)
    raise LabgymError(f"damage {kind!r} of {pieces} pieces caused no fault in layout {layout.id!r} in {DRAWS} draws")


def _faults(layout: Layout, kind: DamageKind) -> int:
    return kind.figure(evaluate_layout(layout, layout.protocol, navigation=kind.navigation, rules=PAPER))


def _furniture(layout: Layout) -> list[str]:
    """Furniture on the floor, without accessories that people push aside."""
    return [p.id for p in layout.placements if p.support == FLOOR and layout.asset(p.id).subtype not in MOVABLE]


def _laden(layout: Layout) -> list[str]:
    carriers = {placement.support for placement in layout.placements}
    return [each for each in _furniture(layout) if each in carriers]


def _items(layout: Layout) -> list[str]:
    return [placement.id for placement in layout.placements if placement.support not in (FLOOR, WALL)]


def _neighbors(layout: Layout, item: Placement) -> list[Placement]:
    """Other objects on the same surface."""
    return [other for other in layout.children(item.support) if other.slot == item.slot and other.id != item.id]


def _crowded(layout: Layout) -> list[str]:
    return [each for each in _items(layout) if _neighbors(layout, layout.placement(each))]


def _stored(layout: Layout) -> list[str]:
    """Reagents in storage cabinets."""
    return [
        each
        for each in _items(layout)
        if layout.asset(each).kind == "reagent"
        and layout.asset(layout.placement(each).support).storage_class in STORAGE_CLASSES
    ]


def _in_the_way(layout: Layout) -> list[str]:
    """Furniture that can be put where the robot works; none without a protocol."""
    return _furniture(layout) if layout.protocol is not None else []


def _required(layout: Layout) -> list[str]:
    """Objects that the protocol requires; none without a protocol."""
    protocol = layout.protocol
    names = set() if protocol is None else set(resolved(protocol.required_assets(), layout.catalog))
    return [placement.id for placement in layout.placements if placement.asset in names]


def _between(limits: tuple[float, float], generator: Generator) -> float:
    return float(generator.uniform(*limits))


def _shift(limits: tuple[float, float], generator: Generator) -> tuple[float, float]:
    """Draw a shift in any direction, meters."""
    length, angle = _between(limits, generator), float(generator.uniform(0.0, 2.0 * math.pi))
    return round(length * math.cos(angle), 6), round(length * math.sin(angle), 6)


def _alone(layout: Layout, each: str, dx: float, dy: float, dz: float = 0.0) -> Layout:
    """Move an object without what stands on it, as an edit of the file does."""
    placement = layout.placement(each)
    x, y, z = placement.position
    position = (round(x + dx, 6), round(y + dy, 6), round(z + dz, 6))
    return replaced(layout, {each: placement.model_copy(update={"position": position})})


def _onto_item(layout: Layout, each: str, generator: Generator) -> Layout:
    item = layout.placement(each)
    others = _neighbors(layout, item)
    x, y, _ = others[int(generator.integers(len(others)))].position
    return apply(layout, Place(each, x, y, item.yaw))


def _shoved(layout: Layout, each: str, generator: Generator) -> Layout:
    sign = 1.0 if generator.random() < 0.5 else -1.0
    return _alone(layout, each, *_shift(SHOVE, generator), sign * _between(LIFT, generator))


def _unstored(layout: Layout, each: str, generator: Generator) -> Layout:
    """Put a reagent on an open surface, or on the floor if the layout has none."""
    surfaces = [
        (carrier, slot)
        for carrier in _furniture(layout)
        for slot, surface in enumerate(layout.asset(carrier).surfaces)
        if surface.headroom is None and layout.asset(carrier).storage_class is None
    ]
    if not surfaces:
        item = layout.placement(each)
        fallen = {"position": (*item.position[:2], 0.0), "support": FLOOR, "slot": None}
        return replaced(layout, {each: item.model_copy(update=fallen)})
    carrier, slot = surfaces[int(generator.integers(len(surfaces)))]
    surface, size = layout.surface(carrier, slot), layout.asset(each).size
    reach_x, reach_y = max((surface.width - size.width) / 2.0, 0.0), max((surface.depth - size.depth) / 2.0, 0.0)
    x, y = _between((-reach_x, reach_x), generator), _between((-reach_y, reach_y), generator)
    return apply(layout, Settle(each, carrier, slot, x, y))


def _left_behind(layout: Layout, each: str, generator: Generator) -> Layout:
    return _alone(layout, each, *_shift(LEFT_BEHIND, generator))


def _moved(layout: Layout, each: str, generator: Generator) -> Layout:
    return apply(layout, Move(each, *_shift(FAR, generator)))


def _turned(layout: Layout, each: str, generator: Generator) -> Layout:
    placement = layout.placement(each)
    return apply(layout, Place(each, *placement.position[:2], placement.yaw + _between(TURN, generator)))


def _moved_and_turned(layout: Layout, each: str, generator: Generator) -> Layout:
    return _turned(_moved(layout, each, generator), each, generator)


def _onto_furniture(layout: Layout, each: str, generator: Generator) -> Layout:
    others = [other for other in _furniture(layout) if other != each]
    if not others:
        return layout
    x, y, _ = layout.placement(others[int(generator.integers(len(others)))]).position
    return apply(layout, Place(each, x, y, layout.placement(each).yaw))


def _onto_goal_pose(layout: Layout, each: str, generator: Generator) -> Layout:
    poses = list(goal_poses(layout).values())
    x, y, _ = poses[int(generator.integers(len(poses)))]
    return apply(layout, Place(each, round(x, 6), round(y, 6), layout.placement(each).yaw))


def _removed(layout: Layout, each: str, _: Generator) -> Layout:
    """Remove an object with everything on it."""
    return without(layout, [each])


def _collisions(assessment: Assessment) -> int:
    return len(assessment.collisions)


def _out_of_bounds(assessment: Assessment) -> int:
    return len(assessment.out_of_bounds)


def _not_stored(assessment: Assessment) -> int:
    return sum(instance.hard for instance in assessment.of("storage"))


def _cost(assessment: Assessment) -> int:
    return assessment.cost


def _infeasible(assessment: Assessment) -> int:
    return len(assessment.unreached)


def _missing(assessment: Assessment) -> int:
    return len(assessment.missing or ())


KINDS: Mapping[str, DamageKind] = {
    "items_stacked": DamageKind("items put into other items of their surface", _crowded, _onto_item, _collisions),
    "items_shoved": DamageKind("items shoved and lifted or lowered", _items, _shoved, _out_of_bounds),
    "reagents_out": DamageKind("reagents taken out of their cabinets", _stored, _unstored, _not_stored),
    "load_left": DamageKind("furniture moved without what stands on it", _laden, _left_behind, _out_of_bounds),
    "moved": DamageKind("furniture moved by up to 2 m", _furniture, _moved, _cost, True),
    "turned": DamageKind("furniture turned", _furniture, _turned, _cost, True),
    "moved_and_turned": DamageKind(
        "furniture moved by up to 2 m and turned", _furniture, _moved_and_turned, _cost, True
    ),
    "furniture_stacked": DamageKind("furniture put into other furniture", _furniture, _onto_furniture, _collisions),
    "goal_pose": DamageKind("furniture put where the robot works", _in_the_way, _onto_goal_pose, _infeasible, True),
    "removed": DamageKind("required objects removed", _required, _removed, _missing),
}
"""The kinds of damage by name."""
