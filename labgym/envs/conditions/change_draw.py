"""Draws changes of a floor on the shortest route of its map, so that a way round exists."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from labgym.assets.articulation import footing, protruding
from labgym.envs.conditions.change_list import Added, Moved, Opened, Turned, changed
from labgym.envs.robot import ROBOT
from labgym.envs.tasks import Task
from labgym.envs.world import world_of
from labgym.geometry import Array, BoxArray, OrientedBox, pairwise_distance, pairwise_penetration
from labgym.layouts.clutter.kinds import draw_openings, openable
from labgym.layouts.clutter.ways import RADII, Ways
from labgym.layouts.placement import FLOOR, placed_part
from labgym.navigation import OBSTACLE_HEIGHT, PLANNING_RADIUS

Change = Added | Moved | Opened | Turned

KINDS = ("stool", "trolley", "carton", "part", "door")
"""Kinds of changes: a thing that stands there, furniture with a part open, a door between rooms that is shut."""
ASSETS = {"stool": ("LabStool",), "trolley": ("ServiceTrolley",), "carton": ("Carton", "SmallCarton")}
MASSES = {"LabStool": 8.0, "ServiceTrolley": 30.0, "Carton": 8.0, "SmallCarton": 4.0}
"""Masses of things, kg."""
ALREADY = 0.5
"""Probability that a change moves a thing of the map, if there is one, and does not add another."""
STUCK = 0.5
"""Probability that a carton is fixed (too heavy to push)."""
TRIES = 24
"""Poses tried for each thing."""
GAP = 0.03
"""Least gap of a thing to everything else, meters."""
ROOM = 0.60
"""Least distance of a change from the start and from the goals, meters: twice the planning disc."""
ASIDE = 0.30
"""Greatest distance of the middle of a thing from the route, meters."""
SAMPLE = 0.05
"""Spacing of points on the route, meters."""
AHEAD = 3.0
"""A late thing may come once the robot has driven to this distance from it along the route, or before, meters."""


def draw_changes(
    task: Task,
    rng: np.random.Generator,
    *,
    spacing: float,
    most: int,
    kinds: Sequence[str],
    pushable: bool = True,
    late: bool = False,
    detour: float = 3.0,
) -> tuple[Change, ...]:
    """Return changes, at most one for each `spacing` meters of the route, in its order.

    Args:
        task: layout and drives. spacing: meters. most: largest number of changes. kinds: those that are drawn.
        pushable: whether things can be pushed. late: whether every second thing comes while the robot drives.
        detour: largest ratio of lengths of the shortest path with and without the changes.
    """
    pairs = (task.pair, *task.following)
    paths = [world_of(task.layout).paths.path(pair.start[:2], pair.goal[:2]) for pair in pairs]
    route = sampled([path.points for path in paths if path is not None])
    if not len(route):
        return ()
    site = _Site(task, route)
    length = len(route) * SAMPLE
    number = min(most, max(1, round(length / spacing)))
    drawn: list[Change] = []
    for k in range(number):
        stretch = route[len(route) * k // number : len(route) * (k + 1) // number]
        kind = kinds[int(rng.integers(len(kinds)))]
        others = [kinds[int(pick)] for pick in rng.permutation(len(kinds))]
        for each in (kind, *(other for other in others if other != kind)):
            change = next(site.candidates(each, stretch, rng, pushable, len(drawn)), None)
            if change is not None:
                if late and isinstance(change, Added) and change.mass is not None and len(drawn) % 2 == 1:
                    latest = max((len(route) * k // number) * SAMPLE - AHEAD, 0.0)
                    change = change.model_copy(update={"after": round(float(rng.uniform(0.0, latest)), 2)})
                drawn.append(change)
                break
    before = [math.inf if path is None else path.length for path in paths]
    while drawn and not _passable(task, drawn, [detour * length for length in before]):
        drawn.pop(int(rng.integers(len(drawn))))
    return tuple(drawn)


def _passable(task: Task, changes: Sequence[Change], longest: Sequence[float]) -> bool:
    """Whether the exact shortest paths of all drives exist among changes and are not too long."""
    world = world_of(changed(task.layout, changes))
    pairs = (task.pair, *task.following)
    return all(world.shortest_length(pair) <= limit for pair, limit in zip(pairs, longest, strict=True))


def sampled(lines: Sequence[Array]) -> Array:
    """Return points on polylines, each (k, 2), `SAMPLE` apart, (n, 2)."""
    pieces = []
    for line in lines:
        along = np.concatenate([[0.0], np.hypot(*np.diff(line, axis=0).T).cumsum()])
        at = np.arange(0.0, along[-1], SAMPLE)
        pieces.append(np.column_stack([np.interp(at, along, line[:, axis]) for axis in (0, 1)]))
    return np.concatenate(pieces) if pieces else np.zeros((0, 2))


class _Site:
    """A floor to which changes are added, one after the other."""

    def __init__(self, task: Task, route: Array) -> None:
        self.layout, self.route = task.layout, route
        layout = self.layout
        self.boxes = {p.id: [layout.box(p.id), *layout.open_parts(p.id)] for p in layout.placements}
        self.added: list[OrientedBox] = []
        self.names = {placement.id for placement in layout.placements}
        self.changed: set[str] = set()
        ends = [task.pair.start[:2], *(pair.goal[:2] for pair in (task.pair, *task.following))]
        self.ends = BoxArray.of([OrientedBox(x, y, 0.0, 0.0, 0.0, 0.0, 0.0) for x, y in ends])
        low = [box for box in layout.floor.solids if box.z0 < OBSTACLE_HEIGHT]
        self.ways = Ways(layout.floor, (), [*low, *layout.obstacles(OBSTACLE_HEIGHT)], ends, RADII[-1:])

    def candidates(
        self, kind: str, stretch: Array, rng: np.random.Generator, pushable: bool, number: int
    ) -> Iterator[Change]:
        """Yield changes of a kind on a stretch of the route that leave ways; one that is taken is part of the site."""
        if kind == "door":
            yield from self._doors(stretch, rng)
        elif kind == "part":
            yield from self._parts(stretch, rng)
        else:
            yield from self._things(kind, stretch, rng, pushable, number)

    def _things(
        self, kind: str, stretch: Array, rng: np.random.Generator, pushable: bool, number: int
    ) -> Iterator[Change]:
        names = ASSETS[kind]
        asset = names[int(rng.integers(len(names)))]
        fixed = not pushable or (kind == "carton" and rng.random() < STUCK)
        mass = None if fixed else MASSES[asset]
        there = [placement.id for placement in self.layout.all_of(asset) if self._loose(placement.id)]
        name = there[int(rng.integers(len(there)))] if there and rng.random() < ALREADY else None
        size = (self.layout.catalog.get(asset) if name is None else self.layout.asset(name)).size
        for _ in range(TRIES):
            x, y = stretch[int(rng.integers(len(stretch)))] + rng.uniform(-ASIDE, ASIDE, 2)
            yaw = float(rng.uniform(-math.pi, math.pi))
            pose = round(float(x), 3), round(float(y), 3), round(yaw, 3)
            box = OrientedBox(*pose[:2], size.width, size.depth, pose[2], 0.0, size.height)
            if self._take([box], stretch, name):
                if name is not None:
                    self.changed.add(name)
                    yield Moved(placement=name, pose=pose, mass=mass)
                else:
                    yield Added(id=self._new(asset, number), asset=asset, pose=pose, mass=mass)

    def _loose(self, name: str) -> bool:
        """Whether a thing of the map stands empty on castors or feet that slide, where it is on the map."""
        placement = self.layout.placement(name)
        stands = placement.support == FLOOR and footing(self.layout.asset(name)) is not None
        return stands and not self.layout.children(name) and name not in self.changed

    def _new(self, asset: str, number: int) -> str:
        name = f"{asset}_new_{number + 1}"
        while name in self.names:
            name += "x"
        self.names.add(name)
        return name

    def _parts(self, stretch: Array, rng: np.random.Generator) -> Iterator[Change]:
        near = BoxArray.of([OrientedBox(x, y, 0.0, 0.0, 0.0, 0.0, 0.0) for x, y in stretch[::4].tolist()])
        furniture = [placement for placement in openable(self.layout) if placement.id not in self.changed]
        if not furniture:
            return
        flat = BoxArray.of([replace(self.layout.box(each.id), z0=0.0, z1=0.0) for each in furniture])
        reach = pairwise_distance(flat, near).min(axis=1)
        for pick in rng.permutation(np.flatnonzero(reach < 1.0)).tolist():
            placement = furniture[pick]
            asset = self.layout.asset(placement.id)
            for name, share in draw_openings(asset, rng):
                state = {**dict(placement.state), name: share}
                opened = placement.model_copy(update={"state": tuple(sorted(state.items()))})
                boxes = [placed_part(box, opened) for box in protruding(asset, opened.state)]
                fresh = [box for box in boxes if box not in self.boxes[placement.id]]
                if fresh and self._take(fresh, stretch, placement.id, keeps=True):
                    self.changed.add(placement.id)
                    yield Opened(placement=placement.id, state={name: share})

    def _doors(self, stretch: Array, rng: np.random.Generator) -> Iterator[Change]:
        floor = self.layout.floor
        ways = [way for way in floor.doorways if way.opening.kind == "door" and not way.exit]
        for pick in rng.permutation(len(ways)).tolist():
            way = ways[pick]
            wall, opening = floor.walls[way.wall], way.opening
            name = f"door {pick}"
            if name in self.changed:
                continue
            low, high = opening.span
            leaf = wall.piece(low, high, 0.0, opening.height)
            if opening.state == "open" and self._blocks([leaf], stretch) and self._leaves_ways([leaf]):
                self.changed.add(name)
                yield Turned(wall=way.wall, opening=wall.openings.index(opening), state="closed")

    def _take(self, boxes: Sequence[OrientedBox], stretch: Array, own: str | None, keeps: bool = False) -> bool:
        """Add boxes if they stand free on the floor, in the way, and leave ways.

        Args:
            own: the placement that they belong to, which they may overlap. keeps: whether it stays where it is.
        """
        flat = BoxArray.of([replace(box, z0=0.0, z1=0.0) for box in boxes])
        if not self.layout.floor.inside(flat.corners().reshape(-1, 2)).all():
            return False
        if float(pairwise_distance(flat, self.ends).min()) < ROOM or not self._blocks(boxes, stretch):
            return False
        gap = 0.0 if keeps else GAP
        grown = [replace(b, width=b.width + 2 * gap, depth=b.depth + 2 * gap) for b in boxes]
        others = [box for name, own_boxes in self.boxes.items() if name != own for box in own_boxes]
        others += [*self.layout.floor.solids, *self.added]
        if (pairwise_penetration(BoxArray.of(grown), BoxArray.of(others)) > 0.0).any() or not self._leaves_ways(boxes):
            return False
        self.added += boxes
        if own is not None and not keeps:
            self.boxes[own] = []
        return True

    def _blocks(self, boxes: Sequence[OrientedBox], stretch: Array) -> bool:
        """Whether the disc that drives a stretch of the route touches boxes below its height."""
        flat = [replace(box, z0=0.0, z1=0.0) for box in boxes if box.z0 < min(OBSTACLE_HEIGHT, ROBOT.height)]
        if not flat:
            return False
        points = BoxArray.of([OrientedBox(x, y, 0.0, 0.0, 0.0, 0.0, 0.0) for x, y in stretch.tolist()])
        return float(pairwise_distance(BoxArray.of(flat), points).min()) < PLANNING_RADIUS

    def _leaves_ways(self, boxes: Sequence[OrientedBox]) -> bool:
        """Whether ways join start and goals on a grid, if they did before; they then include the boxes."""
        return self.ways.add([box for box in boxes if box.z0 < OBSTACLE_HEIGHT])
