"""Placements: which asset stands where, on what, and with which box."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema

from labgym.assets import Asset
from labgym.assets.model import Size
from labgym.geometry import OrientedBox, rotate
from labgym.layouts.floor import Coordinate, Identifier
from labgym.layouts.floor.fields import Growing

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
