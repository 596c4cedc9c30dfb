"""Writes a layout of one rectangular room in LabBuilder's form: scene, sizes and goal pairs."""

from __future__ import annotations

import math
import re
from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

from labgym.documents import json_bytes
from labgym.errors import LabgymError
from labgym.layouts import Layout
from labgym.layouts.floor import Room
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.navigation import STAND_OFF
from labgym.navigation.goals import Pose, location_pose, same_place
from labgym.paper.labbuilder.frame import DIGITS, WALL_THICKNESS, heading, to_degrees, to_scene
from labgym.paper.labbuilder.scene import key
from labgym.paper.labbuilder.sizes import SIZES_FILE
from labgym.protocols import Protocol
from labgym.scenes.folders import whole_folder

SCENE_FILE, PAIRS_FILE = "scene.json", "goal_pairs.json"
ROOM = "LaboratoryRoom"
_WORDS = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


def write_labbuilder(layout: Layout, folder: str | Path) -> Path:
    """Write scene.json, asset_bboxes.json and goal_pairs.json into a folder, and return the path of the scene.

    The form has one rectangular room. Doors, and the sizes along x and y, are fields of labgym's own.

    Raises:
        LabgymError: the floor is not one rectangular room, or the folder exists and holds other files.
    """
    folder = Path(folder)
    files = {
        SCENE_FILE: scene_data(layout),
        SIZES_FILE: sizes_data(layout),
        PAIRS_FILE: pairs_data(layout),
    }
    with whole_folder(folder, tuple(files), "scene of LabBuilder") as fresh:
        for name, data in files.items():
            (fresh / name).write_bytes(json_bytes(data))
    return folder / SCENE_FILE


def scene_data(layout: Layout) -> dict[str, Any]:
    """Return the scene: outer size of the room, objects in degrees from its outer corner, doors.

    Raises:
        LabgymError: the floor is not one rectangular room.
    """
    room = _room(layout)
    margin = 2.0 * WALL_THICKNESS
    width, depth = round(room.width + margin, DIGITS), round(room.depth + margin, DIGITS)
    locations = _locations(layout)
    objects = [_object(ROOM, (width / 2.0, depth / 2.0, 0.0), 0.0, FLOOR)]
    for placement in layout.placements:
        support = locations.get(placement.support, placement.support)
        objects.append(_object(placement.id, to_scene(*placement.position), to_degrees(placement.yaw), support))
    query = layout.provenance.options.get("query")
    return {
        "query": query if isinstance(query, str) and query else "; ".join(each.name for each in layout.protocols),
        "id": layout.id,
        "room_size": {"w": width, "d": depth, "h": room.height},
        "doors": [door.model_dump(mode="json") for door in room.doors],
        "objects": objects,
    }


def sizes_data(layout: Layout) -> dict[str, Any]:
    """Return the bounding box, the kind and the asset of each object by its id."""
    table: dict[str, Any] = {}
    for placement in layout.placements:
        asset = layout.asset(placement.id)
        size = asset.size
        table[placement.id] = {
            "short": size.short,
            "long": size.long,
            "height": size.height,
            "type": "room_asset" if asset.kind == "facility" else asset.kind,
            "initial_location": placement.support if placement.support in (FLOOR, WALL) else "surface",
            "width": size.width,
            "depth": size.depth,
            "asset": asset.name,
        }
    return table


def pairs_data(layout: Layout) -> dict[str, Any]:
    """Return the goal pairs of each protocol that the layout embeds, by its id."""
    protocols = layout.protocols or ((layout.protocol,) if layout.protocol is not None else ())
    return {protocol.id: _pairs(layout, protocol) for protocol in protocols}


def _pairs(layout: Layout, protocol: Protocol) -> dict[str, Any]:
    """Return the goal pairs between places that the layout has; the others are listed as missing."""
    missing = [location for location in protocol.locations if layout.find(location) is None]
    poses = {location: location_pose(layout, location) for location in protocol.locations if location not in missing}
    pairs = [
        _pair(here, there, poses[here], poses[there])
        for here, there in pairwise(protocol.route)
        if here in poses and there in poses and not same_place(poses[here], poses[there])
    ]
    data: dict[str, Any] = {"num_targets": len(protocol.steps), "offset_radius": STAND_OFF, "pairs": pairs}
    return {**data, "missing": missing} if missing else data


def _pair(here: str, there: str, start: Pose, goal: Pose) -> dict[str, Any]:
    return {
        "start": _pose(start),
        "end": _pose(goal),
        "distance": round(math.dist(start[:2], goal[:2]), 4),
        "from": here,
        "to": there,
    }


def _pose(pose: Pose) -> list[float]:
    x, y, _ = to_scene(pose[0], pose[1], 0.0)
    return [round(x, 6), round(y, 6), heading(pose[2])]


def _object(name: str, position: tuple[float, float, float], degrees: float, location: str) -> dict[str, Any]:
    return {
        "id": name,
        "position": dict(zip("xyz", position, strict=True)),
        "rotation": {"x": 0, "y": 0, "z": degrees},
        "initial_location": location,
    }


def _locations(layout: Layout) -> dict[str, str]:
    """Return the name of each placement as a location: in snake case, or its id if snake case is not unique."""
    counts = Counter(key(placement.id) for placement in layout.placements)
    reserved = {FLOOR, WALL}
    return {
        placement.id: _snake(placement)
        if counts[key(placement.id)] == 1 and key(placement.id) not in reserved
        else placement.id
        for placement in layout.placements
    }


def _snake(placement: Placement) -> str:
    return _WORDS.sub("_", placement.id).lower()


def _room(layout: Layout) -> Room:
    try:
        return layout.room
    except LabgymError as error:
        raise LabgymError(f"LabBuilder's form has one rectangular room: {error}") from None
