"""A small laboratory with placements on the floor, on a bench, in a hood, on shelves and on a wall."""

from __future__ import annotations

import math

import pytest

from labgym.layouts import Door, Layout, Placement, Room


@pytest.fixture(scope="session")
def laboratory() -> Layout:
    room = Room(width=6.0, depth=5.0, doors=(Door(wall="front", offset=1.5),))
    half = math.pi / 2.0
    placements = (
        Placement(id="hood", asset="FumeHood", position=(2.0, 4.57, 0.0), yaw=math.pi),
        Placement(id="flask", asset="RoundBottomFlask", position=(2.1, 4.5, 0.9), yaw=0.3, support="hood", slot=0),
        Placement(id="stirrer", asset="MagneticHotplateStirrer", position=(1.7, 4.5, 0.9), support="hood", slot=0),
        Placement(id="bench", asset="PreparationBench", position=(4.0, 2.0, 0.0), yaw=0.4),
        Placement(id="balance", asset="AnalyticalBalance", position=(4.1, 2.0, 0.9), yaw=0.4, support="bench", slot=0),
        Placement(id="cabinet", asset="FlammableCabinet", position=(0.24, 2.5, 0.0), yaw=-half),
        Placement(id="acetone", asset="Acetone", position=(0.24, 2.5, 0.1), yaw=-half, support="cabinet", slot=0),
        Placement(id="acetone_2", asset="Acetone", position=(0.24, 2.7, 0.52), yaw=-half, support="cabinet", slot=1),
        Placement(id="stool", asset="LabStool", position=(2.6, 1.4, 0.0)),
        Placement(id="clock", asset="Clock", position=(5.97, 2.0, 2.0), yaw=half, support="wall"),
    )
    return Layout(id="by-hand", floor=room.floor, placements=placements)
