"""Functional zones of a laboratory, and which of them carries out the steps of each location."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Annotated, Literal

from pydantic import Field

from labgym.documents import Record
from labgym.layouts.floor import Identifier

Role = Literal["preparation", "reaction", "analysis", "storage", "cleaning", "waste", "safety", "work"]
MOST_ZONES = 200


class Zone(Record):
    """A functional zone: the furniture that makes it up.

    Attributes:
        name: unique in the layout.
        role: its part in the workflow; `work` for furniture without a more specific one.
        furniture: ids of floor or wall objects; what stands on them belongs to the zone too.
    """

    name: Identifier
    role: Role
    furniture: Annotated[tuple[Identifier, ...], Field(min_length=1, max_length=MOST_ZONES)]


class ZoneAssignment(Record):
    """The steps of a location are carried out in a zone.

    Attributes:
        location: asset name, as in `Step.location`.
        zone: name of a zone.
    """

    location: Annotated[str, Field(max_length=64)]
    zone: Identifier


Zones = Annotated[tuple[Zone, ...], Field(max_length=MOST_ZONES)]
Assignments = Annotated[tuple[ZoneAssignment, ...], Field(max_length=MOST_ZONES)]


def zones_within(zones: Iterable[Zone], ids: Collection[str]) -> tuple[Zone, ...]:
    """Return the zones without the furniture that does not exist any more, those that are empty left out."""
    kept = ((zone, tuple(name for name in zone.furniture if name in ids)) for zone in zones)
    return tuple(
        zone if len(furniture) == len(zone.furniture) else zone.model_copy(update={"furniture": furniture})
        for zone, furniture in kept
        if furniture
    )


def zone_problem(zones: Iterable[Zone], assignment: Iterable[ZoneAssignment], roots: Collection[str]) -> str | None:
    """Return what is wrong with zones and their assignment, or None.

    Args:
        roots: ids of the floor and wall objects.
    """
    names: set[str] = set()
    for zone in zones:
        if zone.name in names:
            return f"zone {zone.name!r} occurs twice; names must be unique"
        names.add(zone.name)
        unknown = next((item for item in zone.furniture if item not in roots), None)
        if unknown is not None:
            return f"zone {zone.name!r} names {unknown!r}, which is no object on the floor or a wall"
    locations: set[str] = set()
    for entry in assignment:
        if entry.zone not in names:
            return f"location {entry.location!r} is assigned to the unknown zone {entry.zone!r}"
        if entry.location in locations:
            return f"location {entry.location!r} is assigned twice"
        locations.add(entry.location)
    return None
