"""Placements: which asset stands where, on what, and with which box; what they name exists."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema

from labgym.assets import Asset, Catalog
from labgym.assets.model import Size
from labgym.assets.plausibility import size_problem
from labgym.documents import Growing
from labgym.errors import DocumentError, LabgymError, UnknownNameError, check_name
from labgym.geometry import OrientedBox, rotate
from labgym.layouts.floor import Coordinate, Identifier
from labgym.layouts.roles import takes_role

FLOOR = "floor"
WALL = "wall"


def _pairs(value: Any) -> Any:
    """Return the pairs of a mapping, sorted by name."""
    return tuple(sorted(value.items())) if isinstance(value, Mapping) else value


PartName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,39}$")]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
PartStates = Annotated[
    tuple[tuple[PartName, Share], ...],
    Field(max_length=64),
    BeforeValidator(_pairs),
    PlainSerializer(dict, return_type=dict),
    WithJsonSchema({"type": "object", "additionalProperties": {"type": "number", "minimum": 0.0, "maximum": 1.0}}),
]
"""Shares of the ranges of moving parts by name, as sorted pairs; a mapping in documents and as an argument."""


class Placement(Growing):
    """One object: the center of its bottom face in the room frame, and its yaw.

    Attributes:
        position: x, y, z in meters.
        yaw: radians, counter-clockwise; the front looks along +y at yaw 0.
        support: "floor", "wall", or the id of the placement that it stands on or in.
        slot: index of the support's surface (a cabinet's shelf), None on floor and wall.
        fixed: whether repair and optimization must leave the object where it is.
        size: width, depth and height in meters in place of the catalog's; surfaces and cavity are scaled with it
            along each axis, and must stay within the bounds of the asset's category (up to 5 m on the floor).
        state: how far drawers, doors and sashes are open, by name: 0 closed to 1 open. Those without an entry are as
            the shape is drawn: drawers and doors closed, the sash of a hood at its stop.
        role: name of the asset whose role it takes, an equal or smaller one of its kind; None for its own.
    """

    ADDED: ClassVar[frozenset[str]] = frozenset({"state", "role"})

    id: Identifier
    asset: Annotated[str, Field(max_length=64)]
    position: tuple[Coordinate, Coordinate, Coordinate]
    yaw: Annotated[float, Field(ge=-7.0, le=7.0)] = 0.0
    support: Identifier = FLOOR
    slot: Annotated[int, Field(ge=0, le=63)] | None = None
    fixed: bool = False
    size: Size | None = None
    state: PartStates = ()
    role: Annotated[str, Field(max_length=64)] | None = None


def rounded(x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a position rounded to micrometers."""
    return round(x, 6), round(y, 6), round(z, 6)


def resized(asset: Asset, size: Size) -> Asset:
    """Return a catalog entry with another bounding box.

    Surfaces and cavity are scaled along each axis. Fittings keep their size and their distances to back and top.
    """
    x, y, z = size.width / asset.size.width, size.depth / asset.size.depth, size.height / asset.size.height
    surfaces = tuple(
        surface.model_copy(
            update={
                "x": surface.x * x,
                "y": surface.y * y,
                "z": surface.z * z,
                "width": surface.width * x,
                "depth": surface.depth * y,
                "headroom": None if surface.headroom is None else surface.headroom * z,
            }
        )
        for surface in asset.surfaces
    )
    cavity = asset.cavity
    if cavity is not None:
        scaled = {"x": x, "y": y, "width": x, "depth": y, "z0": z, "z1": z}
        cavity = cavity.model_copy(update={name: getattr(cavity, name) * k for name, k in scaled.items()})
    back, top = (size.depth - asset.size.depth) / 2.0, size.height - asset.size.height
    fittings = tuple(
        fitting.model_copy(
            update={"x": fitting.x * x, "y": fitting.y - back, "z0": fitting.z0 + top, "z1": fitting.z1 + top}
        )
        for fitting in asset.fittings
    )
    return asset.model_copy(update={"size": size, "surfaces": surfaces, "cavity": cavity, "fittings": fittings})


def placed_box(placement: Placement, asset: Asset) -> OrientedBox:
    """Return the bounding box of an asset where a placement puts it."""
    x, y, z = placement.position
    size = asset.size
    return OrientedBox(x, y, size.width, size.depth, placement.yaw, z, z + size.height)


def placed_part(part: OrientedBox, placement: Placement) -> OrientedBox:
    """Return a box of an asset's frame in the room frame."""
    dx, dy = rotate(part.x, part.y, placement.yaw)
    x, y, z = placement.position
    return OrientedBox(x + dx, y + dy, part.width, part.depth, placement.yaw + part.yaw, z + part.z0, z + part.z1)


def check_placements(placements: Sequence[Placement], catalog: Catalog, source: object) -> None:
    """Check that ids are unique, assets exist, sizes are plausible, moving parts and slots named exist.

    Raises:
        DocumentError: names the source and the first placement at fault.
    """
    by_id: dict[str, Placement] = {}
    for index, placement in enumerate(placements):
        field = f"placements.{index}"
        if placement.id in by_id:
            raise DocumentError(source, f"{field}.id", f"{placement.id!r} occurs twice; ids must be unique")
        by_id[placement.id] = placement
        try:
            asset = catalog.get(placement.asset)
        except UnknownNameError as error:
            raise DocumentError(source, f"{field}.asset", str(error)) from None
        if placement.size is not None:
            asset = resized(asset, placement.size)
            problem = size_problem(asset, on_floor=placement.support == FLOOR)
            if problem is not None:
                raise DocumentError(source, f"{field}.size", problem)
        if placement.role is not None:
            _check_role(placement, asset, catalog, source, f"{field}.role")
        if placement.state:
            _check_state(placement, asset, source, f"{field}.state")
    for index, placement in enumerate(placements):
        try:
            _check_support(placement, by_id, catalog)
        except LabgymError as error:
            raise DocumentError(source, f"placements.{index}.support", str(error)) from None


def _check_role(placement: Placement, asset: Asset, catalog: Catalog, source: object, field: str) -> None:
    try:
        wanted = catalog.get(str(placement.role))
    except UnknownNameError as error:
        raise DocumentError(source, field, str(error)) from None
    if not takes_role(asset, wanted):
        problem = (
            f"{placement.asset} cannot take the role of {wanted.name}: it is of another kind, smaller or less capable"
        )
        raise DocumentError(source, field, problem)


def _check_state(placement: Placement, asset: Asset, source: object, field: str) -> None:
    from labgym.assets.articulation import check_state

    try:
        check_state(asset, placement.state)
    except LabgymError as error:
        raise DocumentError(source, field, str(error)) from None


def _check_support(placement: Placement, by_id: Mapping[str, Placement], catalog: Catalog) -> None:
    """Follow the supports of a placement down to the floor or a wall.

    Raises:
        LabgymError: a support or its slot does not exist, or supports form a cycle.
    """
    carried = {placement.id}
    while placement.support not in (FLOOR, WALL):
        check_name("placement", placement.support, by_id)
        parent = by_id[placement.support]
        slots = len(catalog.get(parent.asset).surfaces)
        if placement.slot is None or placement.slot >= slots:
            raise LabgymError(f"{placement.id!r} names slot {placement.slot} of {parent.id!r}, which has {slots}")
        if parent.id in carried:
            raise LabgymError(f"supports of {placement.id!r} form a cycle")
        carried.add(parent.id)
        placement = parent
