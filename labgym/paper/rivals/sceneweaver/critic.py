"""SceneWeaver's critic: four grades from 0 to 10, the physical faults, and the problems behind them.

Public repository Scene-Weaver/SceneWeaver, `evaluation.py`: a vision-language model grades realism, functionality,
layout and completion by written criteria, next to the numbers of objects that collide or lie outside. Here rules that
check the same criteria grade: those that can be decided from poses. They know no protocol and no chemistry.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from labgym.assets import Asset
from labgym.geometry import BoxArray, OrientedBox, pairwise_penetration
from labgym.paper.rivals.chamber import SLACK, Chamber, footprints
from labgym.paper.rivals.household import FLOOR as CHOICES
from labgym.paper.rivals.piece import RivalPiece
from labgym.paper.rivals.sceneweaver.physics import collisions, outside
from labgym.paper.rivals.sceneweaver.scene import WeaverScene

Criterion = Literal["physics", "realism", "functionality", "layout", "completion"]
Fault = Literal[
    "collision", "outside", "missing", "monotonous", "crowded", "off the wall", "facing a wall", "seat astray",
    "blocked", "bare", "empty",
]  # fmt: skip

CAPPED = 5.0
"""Greatest grade of functionality while something critical is missing, and of layout while objects collide."""
FRONT_USE = 0.6
"""Depth in front of furniture that nothing should block, meters: an assumption for "blocker in front of furniture"."""
AWAY = 0.1
"""Distance from which furniture that belongs at a wall stands off it, meters: an assumption."""
FACING = 0.3
"""A front that is this close to a wall faces it, meters: as in Holodeck."""
SEATED = 0.3
"""Greatest gap between a seat and the furniture in front of it, meters: an assumption."""
FULL_SHELVES = 6
"""Objects that shelves should hold: "each shelf is full of objects (>5)"."""
COVERED = 0.5
"""Share of the floor that furniture and its use should take: "empty area is less than 50%"."""
CROWDED = 0.4
"""Share of the floor above which furniture alone makes a room crowded: an assumption, Holodeck's capacity."""
KINDS = 15
"""Different kinds of object that make a room rich: an assumption."""
CRITICAL: tuple[tuple[str, Callable[[Asset], bool]], ...] = (
    ("LabBench1800", lambda asset: asset.subtype == "workbench"),
    ("FumeHood", lambda asset: asset.fume_hood),
    ("GeneralCabinet", lambda asset: asset.subtype.endswith("_cabinet")),
    ("SinkBench", lambda asset: asset.subtype == "sink"),
    ("LabStool", lambda asset: asset.subtype == "seat"),
)
"""Functions that a layperson expects in a chemistry laboratory: an asset that provides each, and a test for others."""

_EDGE = frozenset(choice.asset for choice in CHOICES if choice.relations[0][0] == "edge")


@dataclass(frozen=True)
class SceneProblem:
    """A fault of a scene under one criterion: the object at fault, or the name of the asset that is missing."""

    criterion: Criterion
    fault: Fault
    subject: str = ""


@dataclass(frozen=True)
class Critique:
    """The grades of a scene, 0 to 10 by criterion; the number of physical faults; and its problems."""

    faults: int
    grades: dict[str, float]
    problems: tuple[SceneProblem, ...]

    @cached_property
    def total(self) -> float:
        """Sum of the grades, 0 to 40."""
        return sum(self.grades.values())

    def worse_than(self, other: Critique) -> bool:
        """Whether a scene is worse: more physical faults, or as many and a lower sum of grades."""
        return (self.faults, -round(self.total, 9)) > (other.faults, -round(other.total, 9))


def critique(scene: WeaverScene, chamber: Chamber, named: Sequence[Asset]) -> Critique:
    """Grade a scene.

    Args:
        named: assets that the description names, which are critical too.
    """
    physical = [SceneProblem("physics", "collision", first) for first, _, _ in collisions(scene)]
    physical += [SceneProblem("physics", "outside", one) for one in outside(scene, chamber)]
    functionality, missing = _functionality(scene, named)
    layout, misplaced = _layout(scene, chamber)
    completion, unfinished = _completion(scene, chamber)
    realism, unreal = _realism(scene, chamber)
    grades = {
        "realism": realism,
        "functionality": functionality,
        "layout": min(layout, CAPPED) if physical else layout,
        "completion": completion,
    }
    return Critique(len(physical), grades, (*physical, *missing, *misplaced, *unfinished, *unreal))


def _functionality(scene: WeaverScene, named: Sequence[Asset]) -> tuple[float, list[SceneProblem]]:
    present = [piece.asset for piece in scene.pieces()]
    missing = [name for name, provides in CRITICAL if not any(provides(asset) for asset in present)]
    missing += [asset.name for asset in named if all(one.role != asset.role for one in present)]
    share = 1.0 - len(missing) / (len(CRITICAL) + len(named))
    grade = min(10.0 * share, CAPPED) if missing else 10.0
    return grade, [SceneProblem("functionality", "missing", name) for name in missing]


def _layout(scene: WeaverScene, chamber: Chamber) -> tuple[float, list[SceneProblem]]:
    pieces = [item.piece for item in scene.large]
    if not pieces:
        return 0.0, []
    boxes = [piece.box for piece in pieces]
    zones = [_zone(box, SEATED if _is_seat(piece) else FRONT_USE) for piece, box in zip(pieces, boxes, strict=True)]
    met = pairwise_penetration(_flat(zones), _flat(boxes)) > SLACK
    np.fill_diagonal(met, False)
    backs = chamber.wall_distance(np.array([box.to_world(0.0, -box.depth / 2.0) for box in boxes]))
    fronts = chamber.wall_distance(np.array([box.to_world(0.0, box.depth / 2.0) for box in boxes]))
    problems = []
    for k, piece in enumerate(pieces):
        ahead = [pieces[other] for other in np.flatnonzero(met[k])]
        fault = _misplacement(piece, float(backs[k]), float(fronts[k]), ahead)
        if fault is not None:
            problems.append(SceneProblem("layout", fault, piece.id))
    return 10.0 * (1.0 - len(problems) / len(pieces)), problems


def _misplacement(piece: RivalPiece, back: float, front: float, ahead: Sequence[RivalPiece]) -> Fault | None:
    """The first fault of a piece's place or orientation.

    Args:
        back, front: distances of the middles of its back and front to the nearest wall, meters.
        ahead: pieces in the zone in front of it.
    """
    if piece.asset.role in _EDGE and back > AWAY:
        return "off the wall"
    if front < FACING:
        return "facing a wall"
    if _is_seat(piece):
        return None if any(other.asset.surfaces for other in ahead) else "seat astray"
    used = piece.asset.role in _EDGE or bool(piece.asset.surfaces)
    return "blocked" if used and any(not _is_seat(other) for other in ahead) else None


def _is_seat(piece: RivalPiece) -> bool:
    return piece.asset.subtype == "seat"


def _zone(box: OrientedBox, depth: float) -> OrientedBox:
    """The floor in front of a box."""
    x, y = box.to_world(0.0, (box.depth + depth) / 2.0)
    return OrientedBox(x, y, box.width, depth, box.yaw)


def _flat(boxes: Sequence[OrientedBox]) -> BoxArray:
    array = BoxArray.of(boxes)
    return footprints(array.centre, array.half, array.yaw)


def _completion(scene: WeaverScene, chamber: Chamber) -> tuple[float, list[SceneProblem]]:
    supporters = [item.piece for item in scene.large if item.piece.asset.surfaces]
    stocked = [min(len(scene.on(piece.id)) / _expected(piece), 1.0) for piece in supporters]
    bare = [piece.id for piece, share in zip(supporters, stocked, strict=True) if share < 1.0]
    covered = covered_share(scene, chamber, FRONT_USE)
    problems = [SceneProblem("completion", "bare", one) for one in bare]
    if covered < COVERED:
        problems.append(SceneProblem("completion", "empty"))
    details = sum(stocked) / len(stocked) if stocked else 0.0
    return 5.0 * details + 5.0 * min(covered / COVERED, 1.0), problems


def _expected(piece: RivalPiece) -> int:
    return FULL_SHELVES if piece.asset.category == "storage" else 1


def _realism(scene: WeaverScene, chamber: Chamber) -> tuple[float, list[SceneProblem]]:
    kinds = len({piece.asset.role for piece in scene.pieces()})
    problems = [SceneProblem("realism", "monotonous")] if kinds < KINDS else []
    grade = 10.0 * min(kinds / KINDS, 1.0)
    covered = covered_share(scene, chamber, 0.0)
    if covered > CROWDED:
        problems.append(SceneProblem("realism", "crowded"))
        grade = max(0.0, grade - 10.0 * (covered - CROWDED) / CROWDED)
    return grade, problems


def covered_share(scene: WeaverScene, chamber: Chamber, front: float) -> float:
    """Return the share of the floor that furniture takes, each piece with a depth in front of it, meters."""
    sizes = [item.piece.asset.size for item in scene.large]
    return sum(size.width * (size.depth + front) for size in sizes) / chamber.ground.area
