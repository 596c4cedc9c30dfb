"""Changes between a floor and its map, as plain data: added, moved and opened things, and shut doors."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError

from labgym.assets.articulation import footing
from labgym.documents import Record
from labgym.errors import LabgymError, OptionError
from labgym.layouts import Layout, Placement
from labgym.layouts.floor import Identifier
from labgym.layouts.floor.fields import Angle, Coordinate
from labgym.layouts.placement import PartStates

MOST = 64
"""Largest number of changes of an episode."""
Spot = tuple[Coordinate, Coordinate, Angle]
"""A pose (x, y, yaw) in the room frame, meters and radians."""
Kilograms = Annotated[float, Field(gt=0.0, le=500.0)]
Meters = Annotated[float, Field(ge=0.0, le=1000.0)]


class Added(Record):
    """A thing that is not on the map.

    Attributes:
        id: of its placement. asset: name in the catalog. pose: where it stands.
        mass: kg, if the robot can push it; None if it is fixed.
        after: the thing comes while the robot drives: not before it has driven this far, meters; None if it is there
            from the start. Only for things that can be pushed.
    """

    kind: Literal["added"] = "added"
    id: Identifier
    asset: Annotated[str, Field(max_length=64)]
    pose: Spot
    mass: Kilograms | None = None
    after: Meters | None = None


class Moved(Record):
    """A thing that stands elsewhere than on the map: `placement` is its id, the rest as in `Added`."""

    kind: Literal["moved"] = "moved"
    placement: Identifier
    pose: Spot
    mass: Kilograms | None = None


class Opened(Record):
    """Furniture with other drawers and doors open than on the map: how far each is open, by name, 0 to 1."""

    kind: Literal["opened"] = "opened"
    placement: Identifier
    state: PartStates


class Turned(Record):
    """A door between rooms that is shut or open: the index of its wall, and its own among the openings of that wall."""

    kind: Literal["door"] = "door"
    wall: Annotated[int, Field(ge=0, lt=1000)]
    opening: Annotated[int, Field(ge=0, lt=64)]
    state: Literal["open", "closed"]


Change = Annotated[Added | Moved | Opened | Turned, Field(discriminator="kind")]
_CHANGES = TypeAdapter(Annotated[tuple[Change, ...], Field(max_length=MOST)])


def changes_of(data: Any) -> tuple[Added | Moved | Opened | Turned, ...]:
    """Return changes from plain data, a list of mappings.

    Raises:
        OptionError: the data is something else; names the first fault.
    """
    try:
        return _CHANGES.validate_python(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        got = "" if isinstance(first["input"], dict | list) else f", got {repr(first['input'])[:60]}"
        raise OptionError(f"changes.{place}: {' '.join(str(first['msg']).split())}{got}") from None


def plain(changes: Iterable[Record]) -> list[dict[str, Any]]:
    """Return changes as plain JSON data."""
    return [change.model_dump(mode="json", exclude_none=True) for change in changes]


def changed(layout: Layout, changes: Iterable[Added | Moved | Opened | Turned]) -> Layout:
    """Return a layout with changes; what is added comes last. The rules of layouts need not be satisfied.

    Raises:
        OptionError: an asset, a placement, a moving part, a door or the place of a thing does not exist, or two
            placements would have one id.
    """
    try:
        return _changed(layout, tuple(changes))
    except (LabgymError, ValidationError) as error:
        raise OptionError(f"changes: {' '.join(str(error).split())[:300]}") from None


def _changed(layout: Layout, changes: tuple[Added | Moved | Opened | Turned, ...]) -> Layout:
    placements = {placement.id: placement for placement in layout.placements}
    walls = list(layout.floor.walls)
    for change in changes:
        if isinstance(change, Turned):
            _turn(layout, walls, change)
        elif isinstance(change, Opened):
            before = layout.placement(change.placement)
            state = tuple(sorted({**dict(before.state), **dict(change.state)}.items()))
            placements[before.id] = before.model_copy(update={"state": state})
        else:
            placed = _placed(layout, change)
            if isinstance(change, Added) and placed.id in placements:
                raise OptionError(f"the id {placed.id!r} is taken: choose another one")
            placements[placed.id] = placed
    fields: dict[str, Any] = {"placements": tuple(placements.values())}
    if any(isinstance(change, Turned) for change in changes):
        fields["floor"] = layout.floor.model_copy(update={"walls": tuple(walls)})
    result = layout.replace(**fields)
    result.check_references()
    for name in masses(changes):
        if footing(result.asset(name)) is None:
            raise OptionError(f"{name!r} ({result.asset(name).name}) has a mass, but it stands too firmly to be pushed")
    return result


def _turn(layout: Layout, walls: list[Any], change: Turned) -> None:
    """Set the state of a door between rooms."""
    interior = {
        (way.wall, layout.floor.walls[way.wall].openings.index(way.opening))
        for way in layout.floor.doorways
        if not way.exit and way.opening.kind == "door"
    }
    if (change.wall, change.opening) not in interior:
        doors = ", ".join(f"({wall}, {opening})" for wall, opening in sorted(interior)[:8]) or "none"
        raise OptionError(
            f"no door between rooms is opening {change.opening} of wall {change.wall}; there are: {doors}"
        )
    wall = walls[change.wall]
    openings = list(wall.openings)
    openings[change.opening] = openings[change.opening].model_copy(update={"state": change.state})
    walls[change.wall] = wall.model_copy(update={"openings": tuple(openings)})


def _placed(layout: Layout, change: Added | Moved) -> Placement:
    """Return the placement of a thing that was added or moved."""
    x, y, yaw = change.pose
    if layout.floor.space_at(x, y) is None:
        raise OptionError(f"({x:.2f}, {y:.2f}) is in no room: choose a place on the floor")
    if isinstance(change, Added):
        return Placement(id=change.id, asset=change.asset, position=(x, y, 0.0), yaw=yaw)
    before = layout.placement(change.placement)
    if before.support != "floor" or layout.children(before.id):
        raise OptionError(f"{before.id!r} does not stand on the floor, or carries something: it cannot be moved")
    return before.model_copy(update={"position": (x, y, 0.0), "yaw": yaw})


def masses(changes: Iterable[Record]) -> dict[str, float]:
    """Return the masses of the things that can be pushed by the ids of their placements, kg."""
    found: dict[str, float] = {}
    for change in changes:
        if isinstance(change, Added) and change.mass is not None:
            found[change.id] = change.mass
        elif isinstance(change, Moved) and change.mass is not None:
            found[change.placement] = change.mass
    return found
