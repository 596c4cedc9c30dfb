"""Floors of several spaces for tests."""

from __future__ import annotations

import numpy as np
from shapely import Polygon

from labgym.geometry import OrientedBox
from labgym.layouts.floor import Door, Floor, Opening, Rectangle, Room, Space, Wall
from labgym.layouts.rules.zones import door_pose

THICKNESS = 0.2


def doorway(room: Room, door: Door) -> OrientedBox:
    """Return the opening itself as a thin box on the wall's inner face."""
    x, y, yaw = door_pose(room, door)
    return OrientedBox(x, y, door.width, 0.0, yaw, 0.0, door.height)


def two_rooms(**door) -> Floor:
    """A laboratory of 6 x 5 m and a store of 3 x 5 m behind a wall of 0.1 m with a door; an exit into each."""
    opening = Opening(**{"position": 2.0, "width": 1.0, "state": "open"} | door)
    return Floor(
        walls=(
            Wall(start=(-0.1, -0.1), end=(9.2, -0.1), openings=(Opening(position=1.5),)),
            Wall(start=(9.2, -0.1), end=(9.2, 5.1), openings=(Opening(position=3.0, width=1.2, swing="left"),)),
            Wall(
                start=(9.2, 5.1),
                end=(-0.1, 5.1),
                openings=(Opening(kind="window", position=2.0, width=1.5, sill=1.0, height=1.2),),
            ),
            Wall(start=(-0.1, 5.1), end=(-0.1, -0.1)),
            Wall(start=(6.05, 0.0), end=(6.05, 5.0), thickness=0.1, openings=(opening,)),
        ),
        spaces=(
            Space(id="lab", region=(Rectangle(x1=6.0, y1=5.0),)),
            Space(id="store", use="store", x=6.1, region=(Rectangle(x1=3.0, y1=5.0),)),
        ),
    )


def polygon_walls(corners, thickness=THICKNESS, style="middle", doors=(0,)) -> tuple[Wall, ...]:
    """Walls around a counter-clockwise polygon of inner corners: middle lines that meet, or that end at the corners."""
    corners = np.asarray(corners, dtype=float)
    ring = Polygon(corners)
    count = len(corners)
    walls = []
    middle = np.array(ring.buffer(thickness / 2.0, join_style="mitre", mitre_limit=20.0).exterior.coords)[:-1]
    order = [int(np.linalg.norm(middle - corner, axis=1).argmin()) for corner in corners]
    for k in range(count):
        start, end = corners[k], corners[(k + 1) % count]
        direction = (end - start) / np.linalg.norm(end - start)
        if style == "middle":
            ends = middle[order[k]], middle[order[(k + 1) % count]]
        else:
            out = np.array([direction[1], -direction[0]]) * thickness / 2.0
            ends = start + out, end + out
        length = float(np.linalg.norm(ends[1] - ends[0]))
        openings = (Opening(position=length / 2.0, width=0.9),) if k in doors else ()
        walls.append(Wall(start=tuple(ends[0]), end=tuple(ends[1]), thickness=thickness, openings=openings))
    return tuple(walls)
