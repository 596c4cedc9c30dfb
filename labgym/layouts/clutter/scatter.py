"""Adds loose objects to a layout without closing a way, a door or a place of work."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.assets.articulation import protruding
from labgym.counts import is_whole
from labgym.errors import OptionError
from labgym.geometry import BoxArray, OrientedBox, interpenetrating
from labgym.layouts.clutter.kinds import DENSITY, KINDS, LEVELS, OPENED, ClutterKind, draw_openings, openable
from labgym.layouts.clutter.ways import Point, Ways
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL, Placement, placed_part
from labgym.layouts.rules.building import Entrance, building_of
from labgym.layouts.rules.thresholds import LOOSE, MOVABLE, SHOWER_RADIUS
from labgym.layouts.rules.zones import HEADROOM, front_zone
from labgym.layouts.style import FurnitureRange
from labgym.navigation import OBSTACLE_HEIGHT, goal_pose

TRIES, BATCH = 100, 20
"""Poses tried for each object, and how many are checked together."""
GAP = 0.03
"""Least gap to everything else, meters."""
GOAL_GAP = 0.45
"""Least distance from a goal, meters: the planning disc and room to turn."""
PART_GAP = 0.35
"""Least distance of an open drawer or door from a goal, meters: the planning disc."""
PULLED = (0.04, 0.55)
"""Range of the distance of an object from the furniture in front of which it stands, meters."""
PARKED = 0.12
"""An object along an edge is at most this far from it, meters."""
AISLE = 0.6
"""A point with less clearance than this is in an aisle up to 1.2 m wide, or near an edge; meters."""
ASKEW = 0.3
"""Largest angle by which an object stands askew, radians."""


def add_clutter(
    layout: Layout,
    level: int,
    generator: np.random.Generator,
    variants: Mapping[str, str] | None = None,
    density: float = 1.0,
) -> Layout:
    """Return a layout with loose objects added, and some drawers and doors of furniture open.

    Equal arguments give equal layouts; existing objects stay. Loose objects and open parts overlap nothing and keep
    clear of doors, goals, safety equipment and keep-outs. Every goal that a disc of 0.30 m reaches from all exits stays
    reachable. Ways out 0.90 m wide are judged without them.

    Args:
        level: 0 (none), 1 (tidy), 2 (busy) or 3 (crowded).
        variants: names of the variants that stand in for some assets; by default those in the layout's provenance.
        density: factor of the number of loose objects.

    Raises:
        OptionError: the level is not 0 to 3.
    """
    check_level(level)
    if level == 0:
        return layout
    rooms = [space for space in layout.floor.spaces if space.use != "corridor"]
    area = sum((r.x1 - r.x0) * (r.y1 - r.y0) for space in rooms for r in space.region)
    count = max(1, round(density * DENSITY[level] * area / 10.0 * float(generator.uniform(0.7, 1.3))))
    chosen = layout.provenance.options.get("variants", {}) if variants is None else variants
    scatter = _Scatter(layout, FurnitureRange(layout.catalog, chosen), generator)
    for placement in openable(layout):
        if generator.random() < OPENED[level]:
            scatter.open(placement)
    weights = np.array([kind.weights[level - 1] for kind in KINDS])
    for index in generator.choice(len(KINDS), count, p=weights / weights.sum()):
        scatter.add(KINDS[int(index)])
    options = {**layout.provenance.options, "clutter": level}
    provenance = layout.provenance.model_copy(update={"options": options})
    furniture = (scatter.opened.get(placement.id, placement) for placement in layout.placements)
    return layout.replace(placements=(*furniture, *scatter.added), provenance=provenance)


def check_level(level: int) -> None:
    """Check a level of clutter.

    Raises:
        OptionError: it is not 0 to 3.
    """
    if not is_whole(level) or level not in LEVELS:
        raise OptionError(f"level of clutter must be 0 to {LEVELS[-1]}, got {level!r}")


class _Scatter:
    """A layout that is being strewn with loose objects."""

    def __init__(self, layout: Layout, choices: FurnitureRange, generator: np.random.Generator) -> None:
        self.layout, self.choices, self.generator = layout, choices, generator
        self.added: list[Placement] = []
        self.opened: dict[str, Placement] = {}
        self.drawn: Counter[str] = Counter()
        self.furniture = [
            (layout.box(placement.id), layout.asset(placement.id))
            for placement in layout.placements
            if placement.support == FLOOR
            and layout.asset(placement.id).clearance > 0.0
            and layout.asset(placement.id).subtype not in MOVABLE
        ]
        goals = [goal_pose(box)[:2] for box, _ in self.furniture]
        self.goals = np.array(goals, dtype=np.float64).reshape(-1, 2)
        own = [_boxes(layout, placement) for placement in layout.placements]
        self.solids = BoxArray.of([*layout.floor.solids, *itertools.chain.from_iterable(own)])
        """What stands there."""
        entrances = building_of(layout).entrances
        self.barred = BoxArray.of(self._barred(entrances))
        self.closed = self.solids.joined(self.barred)
        """What stands there, and areas that stay clear."""
        self.fronts = BoxArray.of([front_zone(box, asset.clearance) for box, asset in self.furniture])
        low = [box for box in layout.floor.solids if box.z0 < OBSTACLE_HEIGHT]
        self.ways = Ways(layout.floor, entrances, [*low, *layout.obstacles(OBSTACLE_HEIGHT)], goals)
        self.count = Counter(placement.asset for placement in layout.placements)
        self.names = {placement.id for placement in layout.placements}

    def add(self, kind: ClutterKind) -> None:
        """Add an object of a kind at the first of some random poses that is free."""
        if kind.most is not None and self.drawn[kind.asset] >= kind.most:
            return
        asset = self.choices.get(kind.asset)
        for _ in range(TRIES // BATCH):
            boxes = self._boxes(kind, asset)
            for box in itertools.compress(boxes, self._free(boxes, asset)):
                if self._leaves_ways(box):
                    self._put(asset, box)
                    self.drawn[kind.asset] += 1
                    return

    def open(self, placement: Placement) -> None:
        """Open one or two drawers or doors of a piece of furniture, those that have the space."""
        asset, state = self.layout.asset(placement.id), dict(placement.state)
        own = _boxes(self.layout, placement)
        others = self.solids.without(BoxArray.of(own))
        count, opened = int(self.generator.integers(1, 3)), list[OrientedBox]()
        for name, share in draw_openings(asset, self.generator):
            wider = placement.model_copy(update={"state": tuple(sorted({**state, name: share}.items()))})
            boxes = [placed_part(box, placement) for box in protruding(asset, wider.state)]
            if boxes and self._has_space(boxes, others) and self._leaves_ways(*boxes):
                state[name], self.opened[placement.id], opened = share, wider, boxes
                count -= 1
            if count == 0:
                break
        self._stand(opened)

    def _has_space(self, boxes: Sequence[OrientedBox], others: BoxArray) -> bool:
        """Whether open parts overlap nothing and reach into no area that stays clear."""
        parts = BoxArray.of(boxes)
        if not self._inside(parts).all() or _meets(parts, others).any() or _meets(parts, self.barred).any():
            return False
        return not _nearer(parts, self.goals, PART_GAP).any()

    def _put(self, asset: Asset, box: OrientedBox) -> None:
        name = asset.name
        while name == asset.name or name in self.names:
            self.count[asset.name] += 1
            name = f"{asset.name}_{self.count[asset.name]}"
        self.names.add(name)
        self._stand([box])
        self.added.append(Placement(id=name, asset=asset.name, position=(box.x, box.y, 0.0), yaw=box.yaw))

    def _stand(self, boxes: Sequence[OrientedBox]) -> None:
        added = BoxArray.of(boxes)
        self.solids, self.closed = self.solids.joined(added), self.closed.joined(added)

    def _boxes(self, kind: ClutterKind, asset: Asset) -> list[OrientedBox]:
        """Return boxes of an object of a kind at up to `BATCH` random poses."""
        spots = [] if kind.stance == "front" else self._spots(kind, asset)
        poses = [self._before(asset) if kind.stance == "front" else self._somewhere(kind, spots) for _ in range(BATCH)]
        return [
            OrientedBox(
                round(pose[0], 4),
                round(pose[1], 4),
                asset.size.width,
                asset.size.depth,
                round(math.remainder(pose[2], 2.0 * math.pi), 4),
                0.0,
                asset.size.height,
            )
            for pose in poses
            if pose is not None
        ]

    def _before(self, asset: Asset) -> tuple[float, float, float] | None:
        """A pose in front of a random piece of furniture."""
        if not self.furniture:
            return None
        box, _ = self.furniture[int(self.generator.integers(len(self.furniture)))]
        side = float(self.generator.choice([-1.0, 1.0])) if box.depth > 1.0 else 1.0
        reach = box.depth / 2.0 + asset.size.depth / 2.0 + float(self.generator.uniform(*PULLED))
        along = float(self.generator.uniform(-0.5, 0.5)) * box.width
        turn = math.pi if asset.subtype == "seat" and side > 0.0 else 0.0
        return *box.to_world(along, side * reach), box.yaw + turn + self._askew()

    def _spots(self, kind: ClutterKind, asset: Asset) -> list[Point]:
        """Return grid points along the edges of the free floor, or in aisles, at most as many as poses are tried."""
        short, values = asset.size.short / 2.0 + GAP, self.ways.values.ravel()
        fitting = np.flatnonzero((values > short) & (values < (short + PARKED if kind.stance == "edge" else AISLE)))
        if not len(fitting):
            return []
        picks = self.generator.integers(len(fitting), size=BATCH)
        return [(x, y) for x, y in self.ways.points.reshape(-1, 2)[fitting[picks]].tolist()]

    def _somewhere(self, kind: ClutterKind, spots: list[Point]) -> tuple[float, float, float] | None:
        """A pose at the last of some points, which is removed."""
        if not spots:
            return None
        x, y = spots.pop()
        space = self.layout.floor.space_at(x, y)
        if space is None or (space.use == "corridor" and kind.asset != "WetFloorSign"):
            return None
        quarter = float(self.generator.integers(4)) * math.pi / 2.0
        return x, y, space.yaw + quarter + (0.0 if kind.stance == "edge" else self._askew() * 3.0)

    def _askew(self) -> float:
        return float(self.generator.uniform(-ASKEW, ASKEW))

    def _free(self, boxes: Sequence[OrientedBox], asset: Asset) -> list[bool]:
        """Whether each box overlaps nothing and stands in no area that stays clear."""
        if not boxes:
            return []
        stood = BoxArray.of(boxes)
        grown = BoxArray(stood.centre, stood.half + GAP, stood.yaw, stood.z + np.array([0.0, GAP]))
        free = ~_nearer(stood, self.goals, GOAL_GAP)
        free &= ~_meets(grown, self.closed)
        if free.any() and asset.subtype not in LOOSE:
            free &= ~_meets(grown, self.fronts)
            free &= ~_meets(BoxArray.of([front_zone(box, asset.clearance) for box in boxes]), self.solids)
        return (free & self._inside(stood)).tolist() if free.any() else []

    def _inside(self, boxes: BoxArray) -> NDArray[np.bool_]:
        """Whether each footprint is on the floor, shape (n,)."""
        return np.asarray(self.layout.floor.inside(boxes.corners().reshape(-1, 2)).reshape(-1, 4).all(axis=1))

    def _leaves_ways(self, *boxes: OrientedBox) -> bool:
        """Whether ways still join what they joined before, with more obstacles; the ways then include them."""
        return self.ways.add([box for box in boxes if box.z0 < OBSTACLE_HEIGHT])

    def _barred(self, entrances: Iterable[Entrance]) -> list[OrientedBox]:
        """Areas that stay clear: at doors, before safety equipment, around showers, and keep-outs."""
        barred = [entrance.area for entrance in entrances]
        barred += [area.box for area in self.layout.floor.keep_outs]
        for placement in self.layout.placements:
            box, asset = self.layout.box(placement.id), self.layout.asset(placement.id)
            if placement.support not in (FLOOR, WALL):
                continue
            if asset.category == "safety_equipment" and not asset.fume_hood and asset.clearance > 0.0:
                barred.append(front_zone(box, asset.clearance))
            if asset.subtype == "shower":
                side = 2.0 * SHOWER_RADIUS
                barred.append(OrientedBox(box.x, box.y, side, side, box.yaw, 0.0, HEADROOM))
        return barred


def _boxes(layout: Layout, placement: Placement) -> list[OrientedBox]:
    """Return the bounding box of a placement and its open parts."""
    return [layout.box(placement.id), *layout.open_parts(placement.id)]


def _nearer(boxes: BoxArray, points: NDArray[np.float64], gap: float) -> NDArray[np.bool_]:
    """Whether the footprint of each box is nearer than a gap to one of the points (m, 2), shape (n,)."""
    dx, dy = (points[None] - boxes.centre[:, None]).transpose(2, 0, 1)
    cosine, sine = np.cos(boxes.yaw)[:, None], np.sin(boxes.yaw)[:, None]
    along = np.maximum(np.abs(dx * cosine + dy * sine) - boxes.half[:, :1], 0.0)
    across = np.maximum(np.abs(dy * cosine - dx * sine) - boxes.half[:, 1:], 0.0)
    return np.asarray((np.hypot(along, across) < gap).any(axis=1))


def _meets(boxes: BoxArray, others: BoxArray) -> NDArray[np.bool_]:
    """Whether each box overlaps one of the others, shape (n,)."""
    meets = np.zeros(len(boxes), dtype=np.bool_)
    meets[interpenetrating(boxes, others)[0]] = True
    return meets
