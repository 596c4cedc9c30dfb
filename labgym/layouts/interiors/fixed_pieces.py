"""Objects that stay where they are, by space."""

from __future__ import annotations

from collections.abc import Sequence

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Unit
from labgym.layouts.ground import Ground
from labgym.layouts.placement import WALL
from labgym.layouts.request import Request
from labgym.layouts.rules.zones import INTRUSION


def fixed_pieces(
    request: Request, required: Sequence[Unit], grounds: Sequence[Ground]
) -> dict[str, list[tuple[Unit, OrientedBox]]]:
    """Return the fixed objects of each space, with their footprints in the frame of its ground.

    Args:
        required: units of the floor; a fixed object that is none of them becomes a unit without a front.
    """
    units = {unit.id: unit for unit in required}
    standing: dict[str, list[tuple[Unit, OrientedBox]]] = {ground.space: [] for ground in grounds}
    for placement in request.fixed:
        asset = request.fixed_asset(placement)
        if placement.support == WALL and asset.size.depth <= INTRUSION:
            continue
        x, y, _ = placement.position
        box = OrientedBox(x, y, asset.size.width, asset.size.depth, placement.yaw)
        space = request.floor.space_at(x, y)
        unit = units.get(placement.id, Unit(placement.id, asset, asset.size.width, asset.size.depth, 0.0))
        for ground in grounds:
            if space is not None and ground.space == space.id:
                standing[ground.space].append((unit, ground.to_ground(box)))
    return standing
