"""Floors and worlds of episodes as the viewer draws them: plain data in centimeters, room frame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.envs.tasks import Task
from labgym.eval.drawing import palette
from labgym.eval.drawing.changed_plan import map_changes
from labgym.eval.drawing.episode_plan import route_of
from labgym.eval.drawing.floor_drawing import outlines, sweep
from labgym.eval.drawing.plan_labels import readable_name
from labgym.geometry import OrientedBox
from labgym.geometry.polygons import difference, polygons, union
from labgym.layouts.floor import Floor
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, Placement
from labgym.navigation import OBSTACLE_HEIGHT
from labgym.scenes.building import building_solids
from labgym.scenes.floor_covering import coverings, region_outline

CM = 100.0
CLASSES: dict[str, tuple[str, str]] = {
    palette.BENCH.label: ("bench", "Bench, table or desk"),
    palette.HOOD.label: ("hood", "Fume hood or glove box"),
    palette.STORAGE.label: ("storage", "Storage cabinet"),
    palette.COLD.label: ("cold", "Refrigerator or freezer"),
    palette.SAFETY.label: ("safety", "Shower, eyewash, spill kit"),
    palette.WASTE.label: ("waste", "Waste"),
    palette.OTHER.label: ("other", "Other equipment"),
}
"""Class and words in the legend of each kind of furniture, by the label of its swatch."""
STORES = {
    "Flammable": "flammables",
    "Acid": "acids",
    "Base": "bases",
    "Oxidizer": "oxidizers",
    "Toxic": "toxics",
    "WaterReactive": "water-reactive chemicals",
    "Gas": "gases",
}
"""Words for the chemicals of a storage cabinet, which the plan marks in the color of the cabinet."""
LINE = 0.3
"""Height of the name of a space, meters."""
MOST_CONTENTS = 12
"""Most names of contents that are listed of a piece of furniture."""


def plan_of_map(layout: Layout) -> dict[str, Any]:
    """Return the floor and the furniture of a map.

    Returns:
        `bounds` (x0, y0, x1, y1); `rooms` and `walls`, SVG paths whose y points up; `doors`, leaf and sweep of each;
        `panes`, windows and glazing as lines; `names` of the spaces, each [x, y, name, width]; `items`, each
        [x, y, width, depth, yaw in degrees, class, store, name, contents] with the front along +y.
    """
    floor = layout.floor
    rooms = region_of(floor)
    solids = region_outline([box for box in building_solids(floor, leaves=False).values() if box.z0 < OBSTACLE_HEIGHT])
    ways = [wall.piece(*opening.span, 0.0, opening.top) for wall in floor.walls for opening in wall.openings]
    walls = difference(solids, region_outline(ways))
    x0, y0, x1, y1 = union([rooms, solids]).bounds
    doors, panes = _openings(floor)
    return {
        "bounds": centimeters((x0, y0, x1, y1)),
        "rooms": svg_path(rooms),
        "walls": svg_path(walls),
        "doors": doors,
        "panes": panes,
        "names": _names(layout),
        "items": [
            _item(layout, placement)
            for placement in layout.placements
            if placement.support == FLOOR and layout.box(placement.id).z0 < OBSTACLE_HEIGHT
        ],
    }


def world_of_episode(task: Task) -> dict[str, Any]:
    """Return what an episode adds to its map.

    Args:
        task: the episode after its conditions.

    Returns:
        `start`; `goals`, each [x, y, yaw in degrees, name]; `dock`, whether the heading counts; `path`, the shortest
        one as a flat list; `changes`, each [kind, name, corners as a flat list], where kind is "added", "movable",
        "gone", "glass", "shut" or "opened".
    """
    pairs = (task.pair, *task.following)
    return {
        "start": _pose(task.pair.start),
        "goals": [[*_pose(pair.goal), place_name(pair.goal_location)] for pair in pairs],
        "dock": "station" in task.conditions,
        "path": centimeters(route_of(task).ravel()),
        "changes": changes_of_map(task),
    }


def changes_of_map(task: Task) -> list[list[Any]]:
    """Return what differs between the map and the true floor, and glass, as `world_of_episode`."""
    return [
        [
            "added" if change.kind == "part" else change.kind,
            change.name if change.name == "door" else readable_name(change.name),
            centimeters(change.points.ravel()),
        ]
        for change in map_changes(task.old_map or task.layout, task.layout, task.pushable)
    ]


def region_of(floor: Floor) -> shapely.Geometry:
    """Return the outline of the floor's coverings."""
    return union(coverings(floor))


def svg_path(shape: shapely.Geometry) -> str:
    """Return the rings of a shape as an SVG path in centimeters."""
    paths = []
    for ring in outlines(shape):
        points = np.rint(np.array(ring.coords)[:-1, :2] * CM).astype(np.int64)
        kept = points[(points != np.roll(points, 1, axis=0)).any(axis=1)].tolist()
        paths.append("M" + "L".join(f"{x} {y}" for x, y in kept) + "Z")
    return "".join(paths)


def centimeters(values: Iterable[float] | NDArray[np.float64]) -> list[int]:
    """Return lengths in meters as whole centimeters."""
    return [round(float(value) * CM) for value in values]


def place_name(location: str) -> str:
    """Return the name of a place in words: "entry-2" is "exit 2", "FumeHood" is "fume hood"."""
    if location.startswith("entry"):
        return "exit" + location.removeprefix("entry").replace("-", " ")
    return "" if location == "anywhere" else _lower(readable_name(location.rstrip("0123456789").rstrip("_")))


def thing_name(name: str) -> str:
    """Return the name of a thing that the robot touched in words: "SmallCarton_3" is "small carton"."""
    if name.startswith("person"):
        return name
    return _lower(readable_name(name.partition("_")[0]))


def asset_name(asset: Asset) -> str:
    """Return the name of an asset in words: its first synonym for chemicals and instruments."""
    if asset.kind in ("reagent", "instrument") and asset.synonyms_en:
        return asset.synonyms_en[0]
    return readable_name(asset.name)


def _lower(words: str) -> str:
    """Return words without a capital at the start, unless they start with an abbreviation such as CO."""
    return words if words[1:2].isupper() else words[:1].lower() + words[1:]


def _item(layout: Layout, placement: Placement) -> list[Any]:
    asset, box = layout.asset(placement.id), layout.box(placement.id)
    held = [layout.asset(each.id) for each in layout.placements if each.support == placement.id]
    contents = list(dict.fromkeys(map(asset_name, held)))
    more = len(contents) - MOST_CONTENTS
    words = ", ".join(contents[:MOST_CONTENTS]) + (f" and {more} more" if more > 0 else "")
    kind = CLASSES[palette.swatch(asset).label][0]
    return [*_box(box), kind, STORES.get(asset.storage_class or "", ""), asset_name(asset), words]


def _box(box: OrientedBox) -> list[float]:
    return [*centimeters((box.x, box.y, box.width, box.depth)), round(float(np.degrees(box.yaw)), 1)]


def _pose(pose: Sequence[float]) -> list[int]:
    return [*centimeters(pose[:2]), round(float(np.degrees(pose[2])))]


def _openings(floor: Floor) -> tuple[list[list[list[int]]], list[list[int]]]:
    """Return leaf and sweep of each door, and the lines of windows and glazing."""
    doors, panes = [], []
    for wall in floor.walls:
        for opening in wall.openings:
            if opening.kind in ("window", "glazing"):
                panes.append(centimeters(np.array([wall.point(u) for u in opening.span]).ravel()))
            elif opening.kind == "door":
                turn = opening.angle if opening.state == "open" else np.pi / 2.0
                points = sweep(wall, opening, turn)[[0, *range(1, 25, 4), -1]]
                doors.append([centimeters(points[[0, -1]].ravel()), centimeters(points[1:].ravel())])
    return doors, panes


def _names(layout: Layout) -> list[list[Any]]:
    """Return the names of the spaces, each with middle and width of the free strip through the largest free disc."""
    furniture = [layout.box(placement.id) for placement in layout.placements if placement.support == FLOOR]
    taken = region_outline(furniture)
    names = []
    for space, outline in zip(layout.floor.spaces, coverings(layout.floor), strict=True):
        free = difference(outline, taken)
        free = outline if free.is_empty else free
        x, y = shapely.get_coordinates(shapely.maximum_inscribed_circle(free))[0].tolist()
        left, right = _strip(free, x, y)
        names.append([*centimeters(((left + right) / 2.0, y)), space.id.replace("_", " "), round((right - left) * CM)])
    return names


def _strip(free: shapely.Geometry, x: float, y: float) -> tuple[float, float]:
    """Return the ends of the free horizontal strip through a point, as wide as a line of text, along x."""
    low, _, high, _ = free.bounds
    strip = shapely.box(low - 1.0, y - LINE / 2.0, high + 1.0, y + LINE / 2.0)
    bounds = [part.bounds for part in polygons(difference(strip, free))]
    left = max((each[2] for each in bounds if each[2] <= x), default=low)
    return left, min((each[0] for each in bounds if each[0] >= x), default=high)
