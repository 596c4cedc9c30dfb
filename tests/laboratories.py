"""Placements and laboratories by hand that several test files share."""

from __future__ import annotations

import math

from labgym.layouts import Door, Layout, Placement, Room, load_published
from labgym.protocols import get

PROTOCOL = "alk_03"
"""Its four locations are in both laboratories."""


def put(
    name: str,
    asset: str,
    x: float,
    y: float,
    z: float = 0.0,
    yaw: float = 0.0,
    on: str = "floor",
    slot: int | None = None,
) -> Placement:
    """Return a placement; `on` is its support."""
    return Placement(id=name, asset=asset, position=(x, y, z), yaw=yaw, support=on, slot=slot)


def published_in_order() -> Layout:
    """Return a published layout without a violation under touchstone-v2.

    Generator 1 hung its extinguisher behind the sink bench, which `extinguisher_front` forbids: it hangs elsewhere here.
    """
    layout = load_published("test", "test-cyc_02")
    moved = put("FireExtinguisher_1", "FireExtinguisher", 6.9, 7.5, 0.6, yaw=math.pi / 2, on="wall")
    return layout.replace(placements=tuple(moved if one.id == moved.id else one for one in layout.placements))


def island_laboratory() -> Layout:
    """Return an 8 m x 6 m room with the four locations of the protocol along its walls and an island in the middle."""
    width, depth = 8.0, 6.0
    return Layout(
        id="by-hand",
        protocols=(get(PROTOCOL),),
        floor=Room(width=width, depth=depth, doors=(Door(wall="front", offset=1.2),)).floor,
        placements=(
            put("PreparationBench_1", "PreparationBench", 0.38, 2.5, yaw=-math.pi / 2),
            put("FumeHood_1", "FumeHood", 2.0, depth - 0.43, yaw=math.pi),
            put("SinkBench_1", "SinkBench", 5.5, depth - 0.38, yaw=math.pi),
            put("ValidationPlatform_1", "ValidationPlatform", width - 0.41, 2.5, yaw=math.pi / 2),
            put("IslandBench1800_1", "IslandBench1800", 4.0, 2.5),
        ),
    )


def hall_laboratory() -> Layout:
    """Return a 12 m x 8 m room with the four locations along its walls and a row of three islands across.

    Most tasks of LabNav find a drive in it at once.
    """
    width, depth = 12.0, 8.0
    return Layout(
        id="hall",
        protocols=(get(PROTOCOL),),
        floor=Room(width=width, depth=depth, doors=(Door(wall="front", offset=1.2),)).floor,
        placements=(
            put("PreparationBench_1", "PreparationBench", 0.38, 2.5, yaw=-math.pi / 2),
            put("FumeHood_1", "FumeHood", 2.0, depth - 0.43, yaw=math.pi),
            put("SinkBench_1", "SinkBench", width - 2.5, depth - 0.38, yaw=math.pi),
            put("ValidationPlatform_1", "ValidationPlatform", width - 0.41, 2.5, yaw=math.pi / 2),
            *(
                put(f"IslandBench1800_{row}", "IslandBench1800", width / 2, 1.8 * row - 0.9, yaw=math.pi / 2)
                for row in (1, 2, 3)
            ),
        ),
    )


def small_laboratory(name: str, shift: float = 0.0) -> Layout:
    """Return a 6.5 m square room with the four locations of the protocol and a bench in the middle.

    Args:
        shift: displacement of three of the locations along their walls, metres.
    """
    return Layout(
        id=name,
        protocols=(get(PROTOCOL),),
        floor=Room(width=6.5, depth=6.5).floor,
        placements=(
            put("PreparationBench", "PreparationBench", 0.40, 2.5 + shift, yaw=-math.pi / 2),
            put("FumeHood", "FumeHood", 2.5 + shift, 6.05, yaw=math.pi),
            put("ValidationPlatform", "ValidationPlatform", 6.05, 4.0 - shift, yaw=math.pi / 2),
            put("SinkBench", "SinkBench", 4.6, 0.45),
            put("IslandBench", "IslandBench", 3.2, 3.3),
        ),
    )
