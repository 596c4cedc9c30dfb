"""Commands of a model at each level: their form, and their translation into edits of a layout."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import reduce
from operator import or_
from typing import Annotated, Any

from pydantic import Field

from labgym.documents import Record
from labgym.errors import LabgymError
from labgym.geometry import wrap_angle
from labgym.layouts.adjust import Level
from labgym.layouts.language.answers import Turn, at_most, coordinates, form, one_of
from labgym.layouts.language.grounding import radians
from labgym.layouts.model import Layout
from labgym.layouts.moves import Command, Move, Rotate, Settle, Swap, descendants, may_move
from labgym.layouts.placement import FLOOR, WALL

MAX_COMMANDS = 12
"""Greatest number of commands in an answer."""
Slot = Annotated[int, Field(ge=0, le=63)]
"""Number of a surface."""
Reach = Annotated[float, Field(ge=0.0, le=10.0)]
"""A place along a surface, meters."""


class CommandError(LabgymError):
    """A command that cannot be applied to a layout."""


def command_form(layout: Layout, level: Level, movable: Sequence[str], carriers: Sequence[str]) -> type[Record]:
    """Return the form of an answer: a list of commands that name only some objects.

    Args:
        movable: ids of the objects that the commands may name; at least one.
        carriers: ids of the furniture on which items may stand.
    """
    x, y = coordinates(layout.floor)
    name = one_of(list(movable))
    kinds = [
        form("Move", command=one_of(["move"]), id=name, x=x, y=y),
        form("Rotate", command=one_of(["rotate"]), id=name, yaw=Turn),
        form("Swap", command=one_of(["swap"]), first=name, second=name),
    ]
    if level == "desktop" and carriers:
        support = one_of(list(carriers))
        place = {"support": support, "surface": Slot, "x": Reach, "y": Reach, "yaw": Turn}
        kinds.append(form("Settle", command=one_of(["settle"]), id=name, **place))
    result: type[Record] = form("Adjustment", commands=at_most(MAX_COMMANDS, reduce(or_, kinds)))
    return result


def edits(layout: Layout, proposed: Any) -> tuple[Command, ...]:
    """Return the edits that a command asks for.

    Raises:
        CommandError: it names a fixed object, an object that does not move, or a surface that does not exist.
    """
    if proposed.command == "swap":
        return _swapped(layout, proposed.first, proposed.second)
    _check_movable(layout, proposed.id)
    placement = layout.placement(proposed.id)
    if proposed.command == "move":
        x, y, _ = placement.position
        return (Move(proposed.id, round(proposed.x - x, 6), round(proposed.y - y, 6)),)
    if proposed.command == "rotate":
        return (Rotate(proposed.id, radians(proposed.yaw)),)
    if proposed.support in (proposed.id, *descendants(layout, proposed.id)):
        raise CommandError(f"{proposed.id} cannot stand on itself or on what it carries")
    surfaces = layout.asset(proposed.support).surfaces
    if proposed.surface >= len(surfaces):
        raise CommandError(f"{proposed.support} has {len(surfaces)} surfaces; there is no surface {proposed.surface}")
    surface = surfaces[proposed.surface]
    # The frame of a surface is that of a person in front of it, who looks against the front of the furniture.
    x, y = surface.width / 2.0 - proposed.x, surface.depth / 2.0 - proposed.y
    return (Settle(proposed.id, proposed.support, proposed.surface, round(x, 6), round(y, 6), radians(proposed.yaw)),)


def surface_pose(layout: Layout, item: str) -> tuple[float, float, float]:
    """Return where an item stands in the frame of its surface: x, y from its front-left corner, yaw in degrees."""
    placement = layout.placement(item)
    surface = layout.surface(placement.support, placement.slot or 0)
    x, y = surface.to_local(placement.position[0], placement.position[1])
    turn = math.degrees(wrap_angle(placement.yaw - surface.yaw))
    return round(surface.width / 2.0 - x, 3), round(surface.depth / 2.0 - y, 3), round(turn, 1)


def _swapped(layout: Layout, first: str, second: str) -> tuple[Command, ...]:
    """Exchange two floor objects, or the places of two items."""
    if first == second:
        raise CommandError(f"{first} cannot be swapped with itself")
    for name in (first, second):
        _check_movable(layout, name)
    supports = {layout.placement(name).support for name in (first, second)}
    if supports == {FLOOR}:
        return (Swap(first, second),)
    if supports & {FLOOR, WALL}:
        raise CommandError(f"{first} and {second} do not both stand on the floor or on furniture")
    if second in descendants(layout, first) or first in descendants(layout, second):
        raise CommandError(f"one of {first} and {second} stands on the other")
    return (_in_place_of(layout, first, second), _in_place_of(layout, second, first))


def _in_place_of(layout: Layout, item: str, other: str) -> Settle:
    place = layout.placement(other)
    surface = layout.surface(place.support, place.slot or 0)
    x, y = surface.to_local(place.position[0], place.position[1])
    return Settle(item, place.support, place.slot or 0, round(x, 6), round(y, 6), round(place.yaw - surface.yaw, 9))


def _check_movable(layout: Layout, name: str) -> None:
    if not may_move(layout, name):
        raise CommandError(f"{name} is fixed, or carries what is fixed")
