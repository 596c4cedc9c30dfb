"""Forms of a model's answers: names as closed sets, numbers within bounds, lists of bounded length."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import GenericAlias
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, create_model

from labgym.assets import Asset
from labgym.documents import Record
from labgym.layouts.floor import Floor
from labgym.layouts.language.offer import Offer

ZONES = (
    *("preparation", "reaction", "workup", "purification", "analysis"),
    *("storage", "cleaning", "safety", "write_up"),
)
"""Names of functional zones: regions of a workflow, not pieces of furniture."""
MAX_PIECES = 150
"""Greatest number of pieces of furniture in an answer."""
MAX_ZONES = 24
Turn = Annotated[float, Field(ge=-360.0, le=360.0)]
"""A yaw, degrees."""


def room_form(offer: Offer, floor: Floor, steps: int) -> type[Record]:
    """Return the form of an answer at room level: zones, furniture with its poses and items, and the zone of each step.

    If fixed pieces have surfaces, `standing` lists the items that they hold.

    Args:
        steps: number of steps of the protocol.
    """
    x, y = coordinates(floor)
    zone, space = one_of(ZONES), one_of([space.id for space in floor.spaces])
    region = form("Zone", name=zone, space=space, x0=x, y0=y, x1=x, y1=y)
    items = at_most(len(offer.items), one_of(list(offer.items) or [""]))
    piece = form("Piece", asset=one_of(list(offer.furniture)), zone=zone, x=x, y=y, yaw=Turn, holds=items)
    step = form("StepZone", step=Annotated[int, Field(ge=1, le=steps)], zone=zone)
    lists = {
        "zones": at_most(MAX_ZONES, region),
        "furniture": at_most(MAX_PIECES, piece),
        "steps": at_most(steps, step),
    }
    if offer.carriers:
        lists["standing"] = at_most(
            len(offer.carriers), form("FixedPiece", id=one_of(list(offer.carriers)), holds=items)
        )
    result: type[Record] = form("ProposedRoom", refusal=Annotated[str, Field(max_length=400)], **lists)
    return result


def surface_form(asset: Asset, items: Mapping[str, Asset]) -> type[Record]:
    """Return the form of an answer for a piece of furniture: surface and pose of each of its items."""
    width = max(surface.width for surface in asset.surfaces)
    depth = max(surface.depth for surface in asset.surfaces)
    item = form(
        "Item",
        id=one_of(list(items)),
        surface=Annotated[int, Field(ge=0, le=len(asset.surfaces) - 1)],
        x=Annotated[float, Field(ge=0.0, le=width)],
        y=Annotated[float, Field(ge=0.0, le=depth)],
        yaw=Turn,
    )
    result: type[Record] = form("ProposedSurface", items=at_most(len(items), item))
    return result


def coordinates(floor: Floor) -> tuple[Any, Any]:
    """Return the types of x and y on a floor: within the extent of its spaces, meters."""
    corners = np.concatenate([box.corners() for space in floor.spaces for box in space.boxes])
    (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return Annotated[float, Field(ge=x0, le=x1)], Annotated[float, Field(ge=y0, le=y1)]


def one_of(names: Sequence[str]) -> Any:
    """Return the type of one of some names."""
    return Literal[tuple(names)]


def at_most(count: int, kind: Any) -> Any:
    """Return the type of a list with at most `count` values."""
    return Annotated[GenericAlias(list, (kind,)), Field(max_length=count)]


def form(title: str, /, **fields: Any) -> Any:
    """Return a record whose fields have some types; all are required."""
    required: dict[str, Any] = {name: (kind, ...) for name, kind in fields.items()}
    return create_model(title, __base__=Record, **required)
