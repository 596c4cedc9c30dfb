"""Wall units return to walls: what lies on the floor, or on furniture, but belongs on a wall."""

from __future__ import annotations

from labgym.assets import Asset
from labgym.layouts.fitting import Keepouts, on_wall
from labgym.layouts.model import Layout
from labgym.layouts.moves import Place, apply, lifted, may_move, replaced
from labgym.layouts.placement import WALL
from labgym.layouts.repairs.rank import State
from labgym.protocols import Protocol


def taken_down(layout: Layout) -> tuple[str, ...]:
    """Return the ids of the wall units that do not hang on a wall; scaled ones belong where they stand."""
    return tuple(
        placement.id
        for placement in layout.placements
        if placement.support != WALL and placement.size is None and layout.asset(placement.id).placing == "wall"
    )


def hung(state: State) -> State:
    """Return the state after each wall unit that has left its wall went to the nearest free place, the widest first."""
    units = taken_down(state.layout)
    for item in sorted(units, key=lambda unit: (-state.layout.asset(unit).size.width, unit)):
        layout = _hung(state.layout, item, state.protocol) if may_move(state.layout, item) else None
        if layout is not None:
            proposed = state.with_layout(layout)
            state = proposed if proposed.rank.cost <= state.rank.cost else state
    return state


def _hung(layout: Layout, item: str, protocol: Protocol | None) -> Layout | None:
    here = layout.placement(item)
    rest = layout.replace(placements=tuple(placement for placement in layout.placements if placement.id != item))
    place = on_wall(rest, layout.asset(item), Keepouts.of(layout, protocol), here.position[:2])
    if place is None:
        return None
    x, y, z = place.position
    moved = lifted(apply(layout, Place(item, x, y, place.yaw)), item, z)
    return replaced(moved, {item: moved.placement(item).model_copy(update={"support": WALL, "slot": None})})


def added_on_wall(layout: Layout, asset: Asset, protocol: Protocol | None) -> list[Layout]:
    """Return layouts with one more wall unit, each at the free place nearest to another exit."""
    keepouts = Keepouts.of(layout, protocol)
    doors = [way.side(way.spaces[0])[:2] for way in layout.floor.doorways if way.exit]
    places = [on_wall(layout, asset, keepouts, door) for door in doors]
    return [layout.replace(placements=(*layout.placements, place)) for place in places if place is not None]
