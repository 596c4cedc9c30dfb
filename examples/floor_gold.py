"""Score the floor that `labgym outline` recognized against one that a person drew with floor_gold.html.

    python examples/floor_gold.py floor.json examples/floor_golds/kobuki_lab.json

Prints the overlap (intersection over union) of the outlines and of each drawn room with the recognized room matched to
it, and how many drawn doors have a recognized one within 0.3 m. Coordinates of a gold are meters in the frame of the
file: the map frame of ROS, or a drawing's units times its scale.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy.optimize import linear_sum_assignment
from shapely import MultiPolygon, Polygon
from shapely.affinity import affine_transform

from labgym.exchange.structure import outline
from labgym.layouts import Layout

WALL = 0.6
"""Width of walls and doorways between rooms that belong to the outline of a floor, meters."""
NEAR = 0.3
"""Greatest distance of a recognized door from a drawn one, meters."""


def recognized(path: Path) -> tuple[list[Polygon], list[tuple[float, float]]]:
    """Return the rooms and the middles of doors and passages of a layout in the frame of its file, meters."""
    floor = Layout.load(path).floor
    x, y, yaw = floor.origin or (0.0, 0.0, 0.0)
    cosine, sine = float(np.cos(yaw)), float(np.sin(yaw))
    frame = [cosine, -sine, sine, cosine, x, y]
    ways = [wall.point(way.position) for wall in floor.walls for way in wall.openings if way.kind != "window"]
    doors = [affine_transform(shapely.Point(way), frame) for way in ways]
    return [affine_transform(outline(space), frame) for space in floor.spaces], [(door.x, door.y) for door in doors]


def overlap(first: Polygon | MultiPolygon, second: Polygon | MultiPolygon) -> float:
    """Return the area of the intersection as a share of that of the union."""
    return float(first.intersection(second).area / first.union(second).area)


def whole(rooms: Sequence[Polygon]) -> Polygon | MultiPolygon:
    """Return the outline of a floor: its rooms with the walls between them."""
    margin = WALL / 2.0
    return shapely.union_all(rooms).buffer(margin, join_style="mitre").buffer(-margin, join_style="mitre")


def score(layout: Path, gold: Path) -> dict[str, Any]:
    """Return the overlap of the outline, of each drawn room in its order, and the number of doors found."""
    drawn: dict[str, Any] = json.loads(gold.read_text(encoding="utf-8"))
    ignored = shapely.union_all([Polygon(ring) for ring in drawn.get("ignore", [])])
    golds = [Polygon(room["outer"], room.get("holes", [])).buffer(0.0).difference(ignored) for room in drawn["rooms"]]
    rooms, doors = recognized(layout)
    rooms = [room.difference(ignored) for room in rooms if not ignored.contains(room.buffer(-0.1))]
    table = np.array([[overlap(first, second) for second in rooms] for first in golds])
    pairs = dict(zip(*(indices.tolist() for indices in linear_sum_assignment(-table)), strict=True))
    places = np.array(doors).reshape(-1, 2)
    distances = [np.hypot(*(places - door).T).min(initial=np.inf) for door in drawn["doors"]]
    return {
        "outline": round(overlap(whole(golds), whole(rooms)), 3),
        "rooms": [round(float(table[row, pairs[row]]), 3) if row in pairs else 0.0 for row in range(len(golds))],
        "recognized": len(rooms),
        "doors": f"{sum(distance <= NEAR for distance in distances)}/{len(distances)}",
    }


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: python floor_gold.py FLOOR.json GOLD.json")
    print(json.dumps(score(Path(sys.argv[1]), Path(sys.argv[2]))))
