"""Checks that what placements name exists: assets, supports and their slots, moving parts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from labgym.assets import Asset, Catalog
from labgym.assets.plausibility import size_problem
from labgym.errors import DocumentError, LabgymError, UnknownNameError
from labgym.layouts.placement import FLOOR, WALL, Placement, resized
from labgym.layouts.roles import takes_role


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
        if placement.support not in by_id:
            raise UnknownNameError("placement", placement.support, by_id)
        parent = by_id[placement.support]
        slots = len(catalog.get(parent.asset).surfaces)
        if placement.slot is None or placement.slot >= slots:
            raise LabgymError(f"{placement.id!r} names slot {placement.slot} of {parent.id!r}, which has {slots}")
        if parent.id in carried:
            raise LabgymError(f"supports of {placement.id!r} form a cycle")
        carried.add(parent.id)
        placement = parent
