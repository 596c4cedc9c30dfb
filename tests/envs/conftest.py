"""A laboratory small enough to compute by hand."""

from __future__ import annotations

import math

import pytest

from labgym.layouts import Layout
from labgym.layouts.model import Door, Placement, Room
from labgym.protocols import get

PROTOCOL = "alk_03"
WIDTH, DEPTH = 8.0, 6.0


def standing(asset: str, x: float, y: float, yaw: float = 0.0) -> Placement:
    return Placement(id=f"{asset}_1", asset=asset, position=(x, y, 0.0), yaw=yaw)


@pytest.fixture(scope="session")
def layout() -> Layout:
    """An 8 m x 6 m room with the four places of the protocol along its walls and an island in the middle."""
    return Layout(
        id="by-hand",
        protocols=(get(PROTOCOL),),
        floor=Room(width=WIDTH, depth=DEPTH, doors=(Door(wall="front", offset=1.2),)).floor,
        placements=(
            standing("PreparationBench", 0.38, 2.5, -math.pi / 2),
            standing("FumeHood", 2.0, DEPTH - 0.43, math.pi),
            standing("SinkBench", 5.5, DEPTH - 0.38, math.pi),
            standing("ValidationPlatform", WIDTH - 0.41, 2.5, math.pi / 2),
            standing("IslandBench1800", 4.0, 2.5),
        ),
    )


@pytest.fixture(scope="session")
def empty_room() -> Layout:
    """The same room with nothing in it; no protocol can be done there."""
    return Layout(id="empty", floor=Room(width=WIDTH, depth=DEPTH, doors=()).floor, placements=())
