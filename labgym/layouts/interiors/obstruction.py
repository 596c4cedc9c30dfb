"""Furniture that has no place along any wall of a floor, and the reason."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Unit
from labgym.layouts.floor.fields import HOOD_DOOR_LEAST
from labgym.layouts.ground import Ground
from labgym.layouts.interiors.standing import Standing
from labgym.layouts.interiors.supply import required

Pieces = Mapping[str, Sequence[tuple[Unit, OrientedBox]]]


def obstructions(units: Sequence[Unit], grounds: Sequence[Ground], fixed: Pieces) -> list[str]:
    """Return a sentence for each unit that would stand at no wall even if it were the only one.

    Args:
        grounds: the spaces that may be furnished.
        fixed: the fixed pieces of each space, by its id.
    """
    return [
        f"{unit.id} ({unit.width:.2f} m wide, {unit.depth:.2f} m deep) has no place along a wall: "
        f"{_reason(unit, grounds, fixed)}"
        for unit in units
        if not any(_has_place(unit, ground, fixed.get(ground.space, ())) for ground in grounds)
    ]


def _reason(unit: Unit, grounds: Sequence[Ground], fixed: Pieces) -> str:
    """The first thing without which the unit would have a place."""
    kinds = sorted({kind for ground in grounds for kind in unit.supplies if kind in ground.supplies.required})
    reliefs: list[tuple[str, Callable[[Ground], bool]]] = [
        (
            f"within reach of {' and '.join(kinds)} nothing is free",
            lambda ground: _has_place(replace(unit, supplies=()), ground, fixed.get(ground.space, ())),
        ),
        (
            f"fixed pieces take it ({', '.join(piece.id for pieces in fixed.values() for piece, _ in pieces)})",
            lambda ground: _has_place(unit, ground, ()),
        ),
        (
            "keep-outs take it",
            lambda ground: _has_place(unit, replace(ground, clear=()), fixed.get(ground.space, ())),
        ),
        (
            f"doors take it, with the {HOOD_DOOR_LEAST:g} m that hoods keep from them"
            if unit.asset.fume_hood
            else "the areas inside doors take it",
            lambda ground: _has_place(unit, replace(ground, gates=()), fixed.get(ground.space, ())),
        ),
        (
            f"{unit.front:.2f} m in front of it must be free",
            lambda ground: _has_place(replace(unit, front=0.0), ground, fixed.get(ground.space, ())),
        ),
    ]
    for text, relief in reliefs:
        if any(relief(ground) for ground in grounds):
            return text
    segments = [segment for ground in grounds for segment in ground.segments]
    stretches = [stretch for segment in segments for stretch in segment.free(unit.asset.size.height)]
    longest = max((high - low for low, high in stretches), default=0.0)
    return f"the longest free stretch is {longest:.2f} m"


def _has_place(unit: Unit, ground: Ground, fixed: Sequence[tuple[Unit, OrientedBox]]) -> bool:
    """Whether a unit could stand at a wall of a space among its fixed pieces alone."""
    if unit.asset.size.height > ground.ceiling:
        return False
    standing = Standing(ground)
    for piece, foot in fixed:
        standing.add(foot, piece.front, piece.clear)
    options = [(segment, standing.places(segment, unit)) for segment in ground.segments]
    return bool(required([option for option in options if option[1]], unit, ground.supplies))
