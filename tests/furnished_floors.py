"""Floors of several shapes for the tests of scenes and drawings: a suite on a corridor, an L, and an old building."""

from __future__ import annotations

import math
from collections.abc import Sequence

from labgym.layouts import Layout, Placement
from labgym.layouts.floor import Column, Finishes, Floor, Opening, Rectangle, Space, Wall

Point = tuple[float, float]
HALF = math.pi / 2.0


def walls_around(
    corners: Sequence[Point], openings: dict[int, tuple[Opening, ...]], thickness: float = 0.2
) -> list[Wall]:
    """Return walls outside of the sides of a counter-clockwise polygon; side k starts at corner k."""
    walls = []
    for k, start in enumerate(corners):
        end = corners[(k + 1) % len(corners)]
        length = math.dist(start, end)
        out = ((end[1] - start[1]) / length * thickness / 2.0, -(end[0] - start[0]) / length * thickness / 2.0)
        walls.append(
            Wall(
                start=(start[0] + out[0], start[1] + out[1]),
                end=(end[0] + out[0], end[1] + out[1]),
                thickness=thickness,
                openings=openings.get(k, ()),
            )
        )
    return walls


def window(position: float, width: float = 2.0) -> Opening:
    return Opening(kind="window", position=position, width=width, sill=1.0, height=1.4)


def suite() -> Floor:
    """Five rooms on a corridor, 14 x 10 m, with doors in several states, a passage, a glazed part and windows."""
    outer = [(0.0, 0.0), (14.0, 0.0), (14.0, 10.0), (0.0, 10.0)]
    walls = walls_around(
        outer,
        {
            0: (window(3.0), window(11.0)),
            2: (window(2.0), window(7.0), window(11.5)),
            1: (Opening(position=4.9, width=1.2),),
            3: (Opening(position=5.1, width=1.2, swing="left"),),
        },
    )
    south = (
        Opening(position=2.0, state="open", hinge="start", swing="right"),
        Opening(position=10.0, swing="right"),
        Opening(kind="glazing", position=5.0, width=2.4, sill=0.9, height=1.3),
    )
    north = (
        Opening(kind="passage", position=2.5, width=1.2),
        Opening(position=7.0, state="open", angle=1.2, hinge="end"),
        Opening(position=11.5, state="closed"),
    )
    walls += [
        Wall(start=(0.0, 3.9), end=(14.0, 3.9), openings=south),
        Wall(start=(0.0, 5.9), end=(14.0, 5.9), openings=north),
        Wall(start=(8.0, 0.0), end=(8.0, 3.8)),
        Wall(start=(5.0, 6.0), end=(5.0, 10.0), thickness=0.12),
        Wall(start=(9.5, 6.0), end=(9.5, 10.0), thickness=0.12),
    ]

    def space(name: str, x0: float, y0: float, x1: float, y1: float, **fields: object) -> Space:
        return Space(id=name, region=(Rectangle(x0=x0, y0=y0, x1=x1, y1=y1),), **fields)  # type: ignore[arg-type]

    return Floor(
        name="suite",
        walls=tuple(walls),
        spaces=(
            space("corridor", 0.0, 4.0, 14.0, 5.8, use="corridor", finishes=Finishes(floor="terrazzo", accent=None)),
            space("synthesis", 0.0, 0.0, 7.9, 3.8),
            space("analysis", 8.1, 0.0, 14.0, 3.8, finishes=Finishes(floor="epoxy", accent="navy")),
            space("write-up", 0.0, 6.0, 4.94, 10.0, use="write-up", finishes=Finishes(walls="cream", accent="ochre")),
            space("instruments", 5.06, 6.0, 9.44, 10.0, use="instrument", finishes=Finishes(floor="tile", walls="sky")),
            space("store", 9.56, 6.0, 14.0, 10.0, use="store", finishes=Finishes(floor="concrete", walls="gray")),
        ),
    )


def ell() -> Floor:
    """An L: one space of two rectangles, with an exit in each leg."""
    corners = [(0.0, 0.0), (9.0, 0.0), (9.0, 5.0), (4.0, 5.0), (4.0, 9.0), (0.0, 9.0)]
    doors = {
        0: (Opening(position=1.5),),
        4: (Opening(position=1.0, hinge="end"),),
        1: (window(2.5),),
        5: (window(3.0), window(6.5)),
    }
    region = (Rectangle(x1=9.0, y1=5.0), Rectangle(y0=5.0, x1=4.0, y1=9.0))
    return Floor(name="ell", walls=tuple(walls_around(corners, doors)), spaces=(Space(region=region),))


def oblique() -> Floor:
    """A room of an old building with an oblique wall, a chamfered corner and two columns; turned by 0.2 rad."""
    yaw, far = 0.2, 7.0
    corners = [(0.0, 0.0), (8.0, 0.0), (9.5, far), (1.0, far), (0.0, 6.0)]
    steps = [Rectangle(x1=8.0, y0=0.0, y1=6.0)]
    steps += [Rectangle(x1=8.0 + 1.5 * y / far, y0=y, y1=y + 0.5) for y in (0.5 * k for k in range(1, 12))]
    steps += [Rectangle(x0=1.0, x1=8.0 + 1.5 * 6.0 / far, y0=6.0, y1=far)]

    def turned(point: Point) -> Point:
        x, y = point
        return x * math.cos(yaw) - y * math.sin(yaw), x * math.sin(yaw) + y * math.cos(yaw)

    openings = {0: (Opening(position=2.0),), 1: (window(3.5, 3.0),)}
    return Floor(
        name="oblique",
        walls=tuple(walls_around([turned(corner) for corner in corners], openings, 0.3)),
        spaces=(Space(yaw=yaw, region=tuple(steps), finishes=Finishes(floor="epoxy", walls="sage", accent="brick")),),
        columns=tuple(
            Column(id=f"column_{k}", x=x, y=y, yaw=yaw, width=0.4, depth=0.4)
            for k, (x, y) in enumerate([turned((3.0, 4.0)), turned((6.0, 4.0))])
        ),
    )


FLOORS = {"suite": suite, "ell": ell, "oblique": oblique}


def furnished(name: str) -> Layout:
    """Return a floor with a little furniture."""
    floor = FLOORS[name]()
    yaw = floor.spaces[0].yaw
    c, s = math.cos(yaw), math.sin(yaw)
    things = {
        "suite": [
            ("hood", "FumeHood", 1.2, 0.43, 0.0),
            ("hood_2", "FumeHood", 2.8, 0.43, 0.0),
            ("bench", "PreparationBench", 5.6, 1.7, HALF),
            ("sink", "SinkBench", 4.6, 0.4, 0.0),
            ("flammables", "FlammableCabinet", 7.6, 1.2, HALF),
            ("stool", "LabStool", 6.6, 2.6, 0.4),
            ("analysis_bench", "LabBench1800", 9.6, 0.4, 0.0),
            ("analysis_bench_2", "LabBench1800", 11.6, 0.4, 0.0),
            ("lc", "MobileBench", 13.4, 2.2, HALF),
            ("desk", "LabBench1800", 1.5, 9.6, math.pi),
            ("desk_2", "LabBench1800", 0.4, 7.8, -HALF),
            ("seat", "LabStool", 1.5, 8.7, 0.0),
            ("ms_bench", "LabBench1800", 6.6, 9.6, math.pi),
            ("ms_bench_2", "LabBench1800", 8.6, 9.6, math.pi),
            ("acids", "AcidCabinet", 10.2, 9.7, math.pi),
            ("fridge", "LabRefrigerator", 11.6, 9.6, math.pi),
            ("bin", "WasteBin", 13.6, 6.4, 0.0),
        ],
        "ell": [
            ("hood", "FumeHood", 6.0, 0.43, 0.0),
            ("hood_2", "FumeHood", 7.6, 0.43, 0.0),
            ("island", "PreparationBench", 5.2, 2.8, 0.0),
            ("sink", "SinkBench", 0.4, 5.6, -HALF),
            ("bench", "LabBench1800", 0.4, 7.6, -HALF),
            ("stool", "LabStool", 1.6, 6.6, 0.0),
        ],
        "oblique": [
            ("hood", "FumeHood", 5.0, 0.43, 0.0),
            ("island", "PreparationBench", 4.5, 2.4, 0.0),
            ("bench", "LabBench1800", 3.5, 6.6, math.pi),
            ("sink", "SinkBench", 5.6, 6.6, math.pi),
            ("stool", "LabStool", 1.6, 4.6, 0.0),
        ],
    }[name]
    placements = [
        Placement(id=i, asset=a, position=(x * c - y * s, x * s + y * c, 0.0), yaw=turn + yaw)
        for i, a, x, y, turn in things
    ]
    return Layout(id=name, floor=floor, placements=tuple(placements))
