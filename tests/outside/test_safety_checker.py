"""The checker of laboratory safety finds each fault of hand-made layouts, and nothing in a layout without faults."""

from __future__ import annotations

import copy
import math

import pytest
from outside.safety_checker import faults

RIGHT, UP, LEFT = -math.pi / 2, 0.0, math.pi / 2
"""Yaws of fronts toward +x, +y and -x."""
DOOR = {"kind": "door", "width": 1.0, "height": 2.1, "hinge": "start", "swing": "left"}
STEP = {"action": "Add", "text": "Add the hydride.", "temperature": None, "duration": 1.0}


def piece(name, asset, x, y, yaw=UP, z=0.0, support="floor", slot=None):
    pose = {"position": [x, y, z], "yaw": yaw, "support": support, "slot": slot}
    return {"id": name, "asset": asset, **pose, "fixed": False, "size": None}


def sound():
    """A room of 10 x 8 m with an exit at (9, 0): hydride at the left, water at the right, ether at the back."""
    walls = [
        {"start": [0, -0.1], "end": [10, -0.1], "openings": [{**DOOR, "position": 9.0}]},
        {"start": [0, 8.1], "end": [10, 8.1], "openings": []},
        {"start": [-0.1, 0], "end": [-0.1, 8], "openings": []},
        {"start": [10.1, 0], "end": [10.1, 8], "openings": []},
    ]
    return {
        "schema": "labgym.layout/2",
        "id": "by-hand",
        "protocols": [
            {"steps": [{**STEP, "location": "FumeHood", "uses": ["LithiumAluminumHydride", "DiethylEther"]}]}
        ],
        "floor": {
            "walls": [{**wall, "thickness": 0.2, "height": 3.0} for wall in walls],
            "spaces": [{"id": "laboratory", "use": "laboratory", "ceiling": 3.0, "region": [{"x1": 10.0, "y1": 8.0}]}],
        },
        "placements": [
            piece("hood", "FumeHood", 2.0, 8.0 - 0.425, math.pi),
            piece("reactive", "WaterReactiveCabinet", 0.32, 4.0, RIGHT),
            piece("hydride", "LithiumAluminumHydride", 0.32, 4.0, RIGHT, 0.08, "reactive", 0),
            piece("flammable", "FlammableCabinet", 5.0, 8.0 - 0.23, math.pi),
            piece("ether", "DiethylEther", 5.0, 8.0 - 0.23, math.pi, 0.1, "flammable", 0),
            piece("desk", "WritingDesk", 3.0, 0.31),
            piece("laptop", "Laptop", 3.0, 0.31, UP, 0.75, "desk", 0),
            piece("basin", "HandWashSink", 9.77, 6.0, LEFT),
            piece("shower", "EmergencyShower", 9.6, 4.0, LEFT),
            piece("eyewash", "EyewashStation", 9.8, 2.5, LEFT),
            piece("powder", "FireExtinguisher", 7.0, 0.09, UP, 0.6, "wall"),
            piece("sand", "ClassDExtinguisher", 0.13, 2.5, RIGHT),
            piece("detector", "GasDetector", 3.5, 8.0 - 0.04, math.pi, 2.0, "wall"),
        ],
    }


def spoilt(*names, asset=None, at=None, **changes):
    """The sound layout without some pieces or, with changes, with one piece or asset changed or added."""
    data = copy.deepcopy(sound())
    if asset is not None:
        data["placements"].append(piece("new", asset, *at, **changes))
    elif at is None and not changes:
        data["placements"] = [p for p in data["placements"] if p["id"] not in names]
    for placement in data["placements"]:
        if placement["id"] in names and asset is None:
            x, y, z = placement["position"] if at is None else (*at, placement["position"][2])
            placement["position"] = [x, y, changes.get("z", z)]
            placement.update({key: value for key, value in changes.items() if key != "z"})
    return data


SPOILT = {
    "hydride 0.6 m from a basin": (spoilt(asset="HandWashSink", at=(0.23, 5.23), yaw=RIGHT), "wet"),
    "hydride 0.6 m from an ice machine": (spoilt(asset="IceMachine", at=(0.3, 5.2), yaw=RIGHT), "wet"),
    "ether beside the exit": (spoilt("flammable", "ether", at=(7.7, 0.25), yaw=UP), "exit"),
    "no agent for metals": (spoilt("sand"), "extinguisher"),
    "no agent for solvents": (spoilt("powder"), "extinguisher"),
    "extinguisher too high": (spoilt("powder", z=2.35), "extinguisher height"),
    "extinguisher on the floor": (spoilt("powder", z=0.0), "extinguisher height"),
    "no shower": (spoilt("shower"), "shower"),
    "no eyewash": (spoilt("eyewash"), "eyewash"),
    "no basin": (spoilt("basin"), "sink"),
    "no detector": (spoilt("detector"), "gas detector"),
    "notice board across the exit": (spoilt(asset="NoticeBoard", at=(9.0, 0.0125), z=1.2, support="wall"), "opening"),
    "hydride 1.6 m high": (spoilt("hydride", z=1.6), "height"),
    "laptop in the hood": (spoilt("laptop", at=(2.0, 7.55), z=0.9, support="hood", slot=0), "standing"),
    "waste on the desk": (
        spoilt(asset="SolventWasteContainer", at=(2.6, 0.3), z=0.75, support="desk", slot=0), "standing"),
    "ether on the desk": (spoilt("ether", at=(2.6, 0.3), z=0.75, support="desk", slot=0), "standing"),
    "ether on the floor": (spoilt("ether", at=(6.0, 4.0), z=0.0, support="floor", slot=None), "standing"),
    "island askew": (spoilt(asset="IslandBench", at=(5.5, 3.7), yaw=math.radians(27)), "skewed"),
    "two ice machines": (
        {**sound(), "placements": [*sound()["placements"], piece("ice", "IceMachine", 7.5, 7.7, math.pi),
            piece("more ice", "IceMachine", 8.5, 7.7, math.pi)]}, "too many"),
    "cabinet in the wall": (spoilt("reactive", "hydride", at=(0.2, 4.0)), "overlap"),
}  # fmt: skip


def test_a_sound_layout_has_no_fault():
    assert [str(fault) for fault in faults(sound())] == []


@pytest.mark.parametrize("name", SPOILT)
def test_each_fault_is_found_by_its_kind(name):
    data, kind = SPOILT[name]
    assert kind in {fault.kind for fault in faults(data)}


def test_a_shower_behind_a_door_is_not_reached():
    data = sound()
    wall = {"start": [7.0, 0.0], "end": [7.0, 8.0], "thickness": 0.1, "height": 3.0}
    data["floor"]["walls"].append({**wall, "openings": [{**DOOR, "position": 6.0}]})
    space = {"use": "laboratory", "ceiling": 3.0}
    left, right = {"x1": 6.95, "y1": 8.0}, {"x0": 7.05, "x1": 10.0, "y1": 8.0}
    data["floor"]["spaces"] = [{"id": "a", **space, "region": [left]}, {"id": "b", **space, "region": [right]}]
    data["placements"] = [p for p in data["placements"] if p["id"] != "powder"]
    assert {"shower", "eyewash", "sink"} <= {fault.kind for fault in faults(data)}
    data["floor"]["walls"][-1]["openings"][0]["kind"] = "passage"
    assert {"shower", "eyewash", "sink"}.isdisjoint({fault.kind for fault in faults(data)})


def test_walks_are_as_long_as_the_straight_line():
    data = sound()
    data["floor"]["walls"][1].update(start=[0, 24.1], end=[10, 24.1])
    for wall in data["floor"]["walls"][2:]:
        wall["end"][1] = 24
    data["floor"]["spaces"][0]["region"] = [{"x1": 10.0, "y1": 24.0}]
    shower = next(placement for placement in data["placements"] if placement["id"] == "shower")
    for walk in (16.0, 16.6, 17.6):
        data["placements"] = [shower, piece("hood", "FumeHood", 9.575, 4.0 + walk, LEFT)]
        assert ("shower" in {fault.kind for fault in faults(data)}) == (walk > 16.8)
