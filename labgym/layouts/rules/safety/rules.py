"""All safety rules."""

from __future__ import annotations

from labgym.layouts.rules.rule import FacilityRule
from labgym.layouts.rules.safety import (
    fire,
    heights,
    pieces,
    planning,
    room_uses,
    rooms,
    signs,
    square,
    standing,
    walks,
    walls,
    wet,
)

RULES: tuple[FacilityRule, ...] = (
    *wet.RULES,
    *fire.RULES,
    *rooms.RULES,
    *walks.RULES,
    *walls.RULES,
    *heights.RULES,
    *standing.RULES,
    *room_uses.RULES,
    *signs.RULES,
    *square.RULES,
    *pieces.RULES,
    *planning.RULES,
)
"""The rules in the order of reports."""
