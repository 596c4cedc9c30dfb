"""The places that a scene's goal pairs lead to, and a protocol that visits them."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated

from pydantic import Field

from labgym.documents import Record, read_json, validating
from labgym.layouts import Layout
from labgym.layouts.placement import FLOOR
from labgym.paper.labbuilder.frame import to_room
from labgym.paper.labbuilder.scene import Tolerant
from labgym.protocols import Protocol
from labgym.protocols.model import ReagentUse, Step

PAIRS_FILE = "goal_pairs.json"
STAND_OFF = 0.6
"""Distance of the authors' goal poses from half the long side of the object, meters."""
NEAR = 0.3
"""Greatest distance between a goal pose and that of the object which it belongs to, meters."""
MAX_BYTES = 4 * 1024 * 1024

Number = Annotated[float, Field(ge=-1000.0, le=1000.0)]


class _Pair(Tolerant):
    start: tuple[Number, Number, Number]
    end: tuple[Number, Number, Number]


class _Pairs(Tolerant):
    pairs: Annotated[tuple[_Pair, ...], Field(max_length=200)] = ()


class GoalPose(Record):
    """A goal pose of a scene: x, y in the room's frame, meters."""

    x: float
    y: float


def read_goals(path: Path, scene: str) -> tuple[GoalPose, ...]:
    """Return the goal poses of a scene in their order, repeats in a row merged; none if the file lacks the scene.

    Args:
        path: goal_pairs.json of the folder.
        scene: name of the scene's file without its suffix.

    Raises:
        DocumentError: the file is not of this form.
    """
    if not path.is_file():
        return ()
    data = read_json(path, MAX_BYTES)
    own = data.get(scene) if isinstance(data, dict) else None
    if own is None:
        return ()
    with validating(f"{path}: {scene}"):
        pairs = _Pairs.model_validate(own).pairs
    poses = [pose for pair in pairs for pose in (pair.start, pair.end)]
    goals = [GoalPose(x=x, y=y) for x, y, _ in (to_room(pose[0], pose[1], 0.0) for pose in poses)]
    return tuple(goal for k, goal in enumerate(goals) if k == 0 or goal != goals[k - 1])


def visited(layout: Layout, goals: Iterable[GoalPose]) -> tuple[str, ...]:
    """Return the assets that goal poses belong to: those on the floor whose front, as the authors take it, is nearest.

    A pose that is more than `NEAR` from every front is left out.
    """
    fronts = []
    for placement in layout.placements:
        if placement.support == FLOOR:
            box = layout.box(placement.id)
            reach = max(box.width, box.depth) / 2.0 + STAND_OFF
            x, y = box.x - reach * math.sin(box.yaw), box.y + reach * math.cos(box.yaw)
            fronts.append((placement.asset, x, y))
    assets: list[str] = []
    for goal in goals:
        if not fronts:
            break
        name, x, y = min(fronts, key=lambda front: math.hypot(front[1] - goal.x, front[2] - goal.y))
        if math.hypot(x - goal.x, y - goal.y) <= NEAR and assets[-1:] != [name]:
            assets.append(name)
    return tuple(assets)


def usual_places(layout: Layout) -> tuple[str, ...]:
    """Return the places of work of a scene without goal pairs, in the usual order of an experiment.

    Cabinets that hold something come first, then hoods, then other furniture that carries something, then instruments
    on the floor.
    """
    carriers = {placement.support for placement in layout.placements}
    places: list[tuple[int, str]] = []
    for placement in layout.placements:
        asset = layout.asset(placement.id)
        loaded = placement.id in carriers
        if placement.support == FLOOR and (loaded or asset.fume_hood or asset.kind == "instrument"):
            rank = 1 if asset.fume_hood else 3 if not loaded else 0 if asset.storage_class is not None else 2
            places.append((rank, asset.name))
    return tuple(dict.fromkeys(name for _, name in sorted(places, key=lambda place: place[0])))


def route_protocol(layout: Layout, places: Sequence[str]) -> Protocol | None:
    """Return a protocol that visits places and requires what the scene holds; None if it has no reagent or instrument.

    Args:
        layout: the scene.
        places: assets of the layout, in the order of the visits.
    """
    kinds = {
        kind: [p.asset for p in layout.placements if layout.asset(p.id).kind == kind]
        for kind in ("reagent", "instrument")
    }
    if not (kinds["reagent"] and kinds["instrument"] and places):
        return None
    name = re.sub(r"[^a-z0-9_-]+", "-", layout.id.lower()).strip("-_")[:64] or "scene"
    query = str(layout.provenance.options.get("query") or layout.id)
    return Protocol(
        id=name,
        name=query[:200],
        reaction_type="substitution",
        reagents=tuple(ReagentUse(name=each, role="unknown") for each in kinds["reagent"][:60]),
        instruments=tuple(name for name in kinds["instrument"] if name not in places)[:100],
        steps=tuple(
            Step(index=index, location=place, action="visit", text=f"Work at {place}.")
            for index, place in enumerate(places[:100], start=1)
        ),
    )
