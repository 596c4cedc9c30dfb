"""Adds objects that no protocol requires: safety equipment on walls, stools, bins, screens, racks, glassware.

An object is added only if it overlaps nothing, keeps doors and robot poses clear, violates no rule and leaves every
route feasible.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from labgym.assets import Asset
from labgym.geometry import BoxArray, OrientedBox, pairwise_distance
from labgym.layouts.fitting import Accept, Keepouts, along_walls, on_floor, on_surface, on_wall, over_door
from labgym.layouts.floor import Space
from labgym.layouts.ground.wide_ways import Passages
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL, Placement
from labgym.layouts.request import Request
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.rules.safety.pieces import OPTIONAL_PIECES
from labgym.layouts.rules.safety.walks import CLASS_B_PREFERRED_M
from labgym.layouts.rules.thresholds import PROTRUSION
from labgym.layouts.rules.zones import HEADROOM
from labgym.layouts.surroundings import door_of

STOOLS = 4
"""Maximum number of stools in a room, or in each space of a floor."""
EXTINGUISHER, EXIT_SIGN = "FireExtinguisher", "ExitSign"
WALL_PLACES = 100
"""Free places on walls for which it is asked whether ways remain wide and lead there."""
MORE_EXTINGUISHERS = 3
"""Most extinguishers that are added to a space for this distance."""
PASSAGE = 0.9
"""Free width that remains next to a stool, meters."""
SEAT_GAP = 0.06
"""Gap between a stool and its furniture, meters."""
LIKELY = 0.85
"""Probability that an accessory of a surface is added; the first one always is."""
ISLAND_ITEMS = (4, 7)
SHELF_ITEMS = (2, 5)
"""Least and greatest number of objects drawn for an island and for a shelf."""


def dress(layout: Layout, before: Assessment, request: Request) -> tuple[Layout, Assessment]:
    """Return the layout with accessories added, and its assessment with navigation.

    Existing objects stay; no violation is added. Deterministic.

    Args:
        before: the assessment of the layout with navigation.
    """
    if before.perfect:
        # Accessories only add violations: a layout without violations at the end had none after any stage.
        dresser = _Dresser(layout, request)
        for stage in dresser.stages:
            stage()
        after = evaluate_layout(dresser.layout, request.protocol, request.rules, navigation=True, earlier=before)
        if after.perfect:
            return dresser.layout, after
    return _dress_in_stages(layout, before, request)


def _dress_in_stages(layout: Layout, before: Assessment, request: Request) -> tuple[Layout, Assessment]:
    """Dress a layout with a check after each stage; a stage that adds a violation adds its objects one by one."""
    protocol, rules = request.protocol, request.rules
    dresser, after = _Dresser(layout, request), before
    for stage in dresser.stages:
        undressed = dresser.layout
        stage()
        after = evaluate_layout(dresser.layout, protocol, rules, navigation=True, earlier=after)
        if after.cost > before.cost or after.fitness < before.fitness - 1e-9:
            dresser.layout, dresser.baseline = undressed, before
            stage()
            after = evaluate_layout(dresser.layout, protocol, rules, navigation=True, earlier=after)
    return dresser.layout, after


class _Dresser:
    """A layout to which objects are added one by one."""

    def __init__(self, layout: Layout, request: Request) -> None:
        self.layout = layout
        self.keepouts = Keepouts.of(layout, request.protocol)
        self.rules, self.profile = request.rules, request.profile
        self.generator = np.random.default_rng([request.seed, len(layout.placements)])
        self.catalog = request.catalog
        self.furniture = request.furniture
        self.habits = request.habits
        self.dressing = request.habits.dressing
        self.protocol = request.protocol
        self.holdings = request.holdings
        self.spaces = layout.floor.spaces
        self._located: dict[str, str | None] = {}
        self.passages = Passages(layout)
        self.baseline: Assessment | None = None
        """Assessment that no addition may worsen; None while additions are checked stage by stage."""

    @property
    def stages(self) -> tuple[Callable[[], None], ...]:
        """The parts of dressing, in order."""
        return self.dress_surfaces, self.dress_walls, self.dress_floor

    def dress_surfaces(self) -> None:
        for furniture in self.layout.placements:
            if self._is_island(furniture):
                self._dress_island(furniture)
            for index, name in enumerate(self.dressing.surfaces.get(self._role(furniture), ())):
                if self.generator.random() < LIKELY or index == 0:
                    self._put_on(name, furniture.id, 0)
            self._fill_shelves(furniture)

    def dress_walls(self) -> None:
        for space in self.spaces:
            for accessory in self.dressing.rooms.get(space.use, ()):
                near = self._point(accessory.near, space)
                if near is not None and not self._is_equipped(accessory.asset, space):
                    self._hang(accessory.asset, near, space)
            if space.use in ("laboratory", "instrument"):
                self._reach_every_place(space)
        self._mark_exits()

    def dress_floor(self) -> None:
        for space in self.spaces:
            for accessory in self.dressing.floor:
                near, asset = self._point(accessory.near, space), self.catalog.get(accessory.asset)
                if near is not None:
                    poses = along_walls(self.layout, asset, near, space.id)[:80]
                    accept = self._keeps_ways(asset, space)
                    self._add(on_floor(self.layout, asset, self.keepouts, poses, in_front=False, accept=accept))
        self._pull_up_stools()

    def _is_equipped(self, name: str, space: Space) -> bool:
        """Whether an asset is safety equipment that a space has already."""
        if self.catalog.get(name).subtype not in ("fire", "sensor"):
            return False
        return any(self._role(p) == name and self._is_in(p, space) for p in self.layout.placements)

    def _hang(self, name: str, near: tuple[float, float], space: Space) -> None:
        asset = self.catalog.get(name)
        accept = self._keeps_ways(asset, space)
        front = asset.clearance if asset.subtype == "fire" else 0.0
        self._add(
            on_wall(
                self.layout, asset, self.keepouts, near, space=space.id, accept=accept, front=front, tries=WALL_PLACES
            )
        )

    def _keeps_ways(self, asset: Asset, space: Space) -> Accept | None:
        """The condition that an object leaves the ways of a space wide; None if it stands in no way.

        A way also leads to each extinguisher.
        """
        emergency = asset.subtype == "fire"
        if (asset.size.depth <= PROTRUSION or asset.mount_height >= HEADROOM) and not emergency:
            return None
        return partial(self.passages.add, space.id, emergency=emergency)

    def _reach_every_place(self, space: Space) -> None:
        """Add extinguishers where a place of work is too far from those of its space in a straight line.

        Within the preferred walk in a straight line, the walk is hardly ever longer than the greatest one.
        """
        for _ in range(MORE_EXTINGUISHERS):
            inside = [p for p in self.layout.placements if self._is_in(p, space)]
            stands = [p.position for p in inside if self.layout.asset(p.id).subtype == "fire"]
            works = [p.position for p in inside if p.support == FLOOR and self.layout.asset(p.id).clearance > 0.0]
            gaps = [min((math.dist(at[:2], one[:2]) for one in stands), default=math.inf) for at in works]
            if not gaps or max(gaps) <= CLASS_B_PREFERRED_M:
                return
            farthest = works[gaps.index(max(gaps))]
            self._hang(EXTINGUISHER, (farthest[0], farthest[1]), space)

    def _mark_exits(self) -> None:
        """Add a sign over every exit (29 CFR 1910.37(b): each exit must be marked)."""
        asset = self.catalog.get(EXIT_SIGN)
        for way in self.layout.floor.doorways:
            if way.exit:
                self._add(over_door(self.layout, asset, way, way.spaces[0]))

    def _add(self, placement: Placement | None) -> None:
        if placement is None or not self._may_add(placement.asset):
            return
        layout = self.layout.replace(placements=(*self.layout.placements, placement))
        if self.baseline is not None:
            after = evaluate_layout(layout, self.protocol, self.rules, navigation=True, earlier=self.baseline)
            if after.cost > self.baseline.cost or after.fitness < self.baseline.fitness - 1e-9:
                return
        self.layout = layout

    def _may_add(self, name: str) -> bool:
        """Whether the laboratory may share one more piece of an asset, and whether it exists or may be bought."""
        placed = [p.asset for p in self.layout.placements]
        if placed.count(name) >= OPTIONAL_PIECES.get(name, math.inf):
            return False
        return self.holdings is None or self.holdings.adds(name, placed)

    def _put_on(self, name: str, support: str, slot: int) -> None:
        asset = self.catalog.get(name)
        self._add(on_surface(self.layout, asset, support, slot, self.profile, self.generator))

    def _drawn(self, names: Sequence[str], least: int, most: int) -> list[str]:
        count = int(self.generator.integers(least, most + 1))
        return [str(name) for name in self.generator.permutation(names)[:count]]

    def _dress_island(self, island: Placement) -> None:
        """Add a reagent shelf along the middle of an empty island, and devices on both sides of it."""
        if not self.layout.children(island.id):
            shelf = self.dressing.island_shelf
            top = self.layout.surface(island.id, 0)
            number = sum(placement.asset == shelf for placement in self.layout.placements)
            rack = Placement(
                id=f"{shelf}_{number + 1}",
                asset=shelf,
                position=(round(top.x, 6), round(top.y, 6), round(top.z0, 6)),
                yaw=top.yaw,
                support=island.id,
                slot=0,
            )
            self._add(rack)
            if rack.id in self.layout.by_id:
                self._fill_shelves(rack)
        for name in self._drawn(self.dressing.islands, *ISLAND_ITEMS):
            self._put_on(name, island.id, 0)

    def _fill_shelves(self, furniture: Placement) -> None:
        names = self.dressing.shelves.get(self._role(furniture))
        if names is not None:
            for slot in range(len(self.layout.asset(furniture.id).surfaces)):
                for name in self._drawn(names, *SHELF_ITEMS):
                    self._put_on(name, furniture.id, slot)

    def _pull_up_stools(self) -> None:
        asset = self.furniture.get(self.dressing.seat)
        size = asset.size
        seats = list(self._seats(SEAT_GAP + size.depth / 2.0))
        pulled: Counter[str | None] = Counter()
        for index in self.generator.permutation(len(seats)):
            x, y, yaw, owner = seats[index]
            box = OrientedBox(x, y, size.width, size.depth, yaw, 0.0, size.height)
            space = self._space_of(self.layout.placement(owner))
            if pulled[space] < STOOLS and self._roomy(box, owner):
                before = self.layout
                self._add(on_floor(self.layout, asset, self.keepouts, [(x, y, yaw)], in_front=True))
                pulled[space] += self.layout is not before

    def _point(self, neighbor: str, space: Space) -> tuple[float, float] | None:
        """Position of the first door, hood or placement of an asset in a space, or None."""
        if neighbor == "door":
            door = door_of(self.layout.floor, space.id)
            if door is not None:
                return door
        placement = next((p for p in self.layout.placements if self._is(p, neighbor) and self._is_in(p, space)), None)
        return None if placement is None else (placement.position[0], placement.position[1])

    def _is(self, placement: Placement, neighbor: str) -> bool:
        asset = self.layout.asset(placement.id)
        return asset.fume_hood if neighbor == "hood" else asset.role == neighbor

    def _is_in(self, placement: Placement, space: Space) -> bool:
        return self._space_of(placement) == space.id

    def _space_of(self, placement: Placement) -> str | None:
        """Id of the space of a placement, None outside all."""
        x, y, _ = placement.position
        if placement.id not in self._located:
            space = self.layout.floor.space_at(x, y)
            self._located[placement.id] = None if space is None else space.id
        return self._located[placement.id]

    def _role(self, placement: Placement) -> str:
        return self.layout.asset(placement.id).role

    def _is_island(self, placement: Placement) -> bool:
        return self.habits.of(self._role(placement)).stance != "wall"

    def _seats(self, reach: float) -> Iterator[tuple[float, float, float, str]]:
        """Yield poses of stools pulled up to islands and desks, with the id of the furniture."""
        layout = self.layout
        for placement in layout.placements:
            box = layout.box(placement.id)
            if self._role(placement) in self.dressing.seated:
                yield (*box.to_world(0.0, box.depth / 2.0 + reach), box.yaw + math.pi, placement.id)
            elif self._is_island(placement):
                for side in (1.0, -1.0):
                    for place in np.linspace(-0.35, 0.35, 4) * box.width:
                        x, y = box.to_world(float(place), side * (box.depth / 2.0 + reach))
                        yield x, y, box.yaw + (math.pi if side > 0.0 else 0.0), placement.id

    def _roomy(self, stool: OrientedBox, owner: str) -> bool:
        """Whether a passage remains between a stool and everything on the floor except its own furniture."""
        layout, seat = self.layout, self.dressing.seat
        others = [
            layout.box(placement.id)
            for placement in layout.placements
            if placement.support == FLOOR and placement.id != owner and self._role(placement) != seat
        ]
        hung = [layout.box(p.id) for p in layout.placements if p.support == WALL]
        low = [box for box in (*hung, *layout.floor.solids) if box.z0 < HEADROOM]
        others = [replace(box, z0=0.0, z1=HEADROOM) for box in (*others, *low)]
        gaps = pairwise_distance(BoxArray.of([stool]), BoxArray.of(others))
        return bool((gaps >= PASSAGE).all())
