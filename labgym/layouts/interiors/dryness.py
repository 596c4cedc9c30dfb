"""Distances of what reacts with water from sinks, eyewashes, showers and ice machines."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Separation, Unit
from labgym.layouts.briefing import MARGIN
from labgym.layouts.rules.supplies import WET

WET_DISTANCE = 1.0 + MARGIN
"""Distance of what stores or handles water-reactives from wet fittings, meters: the rule's 1.0 m and a margin."""


def wet(unit: Unit) -> bool:
    """Whether a unit is a sink, an eyewash, a shower or an ice machine."""
    return unit.asset.subtype in WET


def dry_separations(units: Sequence[Unit]) -> tuple[Separation, ...]:
    """Return the distances of water-reactives from wet fittings."""
    return tuple(
        Separation(one.id, other.id, WET_DISTANCE, "reacts with water")
        for one in units
        if "reactive" in one.hazards
        for other in units
        if wet(other) and other.id != one.id
    )


def dry_distances(unit: Unit, placed: Iterable[tuple[Unit, OrientedBox]]) -> list[tuple[OrientedBox, float]]:
    """Return the footprints from which a unit keeps a distance because one is wet and the other reacts with water."""
    pairs = (
        (wet(unit) and "reactive" in other.hazards, wet(other) and "reactive" in unit.hazards, foot)
        for other, foot in placed
    )
    return [(foot, WET_DISTANCE) for one, two, foot in pairs if one or two]
