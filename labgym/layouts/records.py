"""Records of a layout besides its floor and placements, and records as plain data for content hashes."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, PlainSerializer
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from labgym.documents import Record, tagged
from labgym.geometry import wrap_angle
from labgym.layouts.floor import Identifier
from labgym.protocols import Protocol


class Provenance(Record):
    """How a layout was made: enough to make it again."""

    generator: str = "manual"
    seed: int | None = None
    options: dict[str, Any] = Field(default_factory=dict)
    versions: dict[str, str] = Field(default_factory=dict)


def _untagged(data: Any) -> Any:
    """Return an embedded document without its schema tag, which must be that of a protocol."""
    if not isinstance(data, dict) or "schema" not in data:
        return data
    if data["schema"] != Protocol.SCHEMA:
        raise ValueError(f"expected schema {Protocol.SCHEMA!r}, got {str(data['schema'])[:80]!r}")
    return {key: value for key, value in data.items() if key != "schema"}


class _TaggedSchema:
    """Puts the schema tag into the JSON Schema of an embedded protocol."""

    def __get_pydantic_json_schema__(self, core_schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        reference = handler(core_schema)
        body = handler.resolve_ref_schema(reference)
        body.update(tagged(body, Protocol))
        return reference


EmbeddedProtocol = Annotated[
    Protocol, BeforeValidator(_untagged), PlainSerializer(Protocol.to_json, return_type=dict), _TaggedSchema()
]


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


def canonical(value: Any) -> Any:
    """Return plain data with lengths in 0.1 mm and yaws in 0.1 mrad, without fields that have their default value."""
    if isinstance(value, Record):
        body: dict[str, Any] = {}
        for name, field in type(value).model_fields.items():
            item = _canonical_field(name, getattr(value, name))
            if field.is_required() or item != _canonical_field(name, field.get_default(call_default_factory=True)):
                body[name] = item
        return body
    if isinstance(value, tuple | list):
        return [canonical(item) for item in value]
    return round(value * 1e4) if isinstance(value, float) else value


def _canonical_field(name: str, value: Any) -> Any:
    if name == "yaw":
        return round(wrap_angle(value) * 1e4) % round(2e4 * math.pi)
    return canonical(value)
