"""Adds objects that no protocol requires: safety equipment on walls, stools, bins, screens, racks, glassware.

An object is added only if it overlaps nothing, keeps doors and robot poses clear, violates no rule and leaves every
route feasible.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from labgym.geometry import BoxArray, OrientedBox, pairwise_distance
from labgym.layouts.fitting import Keepouts, along_walls, on_floor, on_surface, on_wall
from labgym.layouts.model import FLOOR, Layout, Placement
from labgym.layouts.request import Request
from labgym.layouts.rules.objective import Assessment, evaluate_layout
from labgym.layouts.surroundings import main_door

STOOLS = 4
"""Maximum number of stools."""
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
        after = evaluate_layout(dresser.layout, request.protocol, request.profile, navigation=True, earlier=before)
        if after.perfect:
            return dresser.layout, after
    return _dress_in_stages(layout, before, request)


def _dress_in_stages(layout: Layout, before: Assessment, request: Request) -> tuple[Layout, Assessment]:
    """Dress a layout with a check after each stage; a stage that adds a violation adds its objects one by one."""
    protocol, profile = request.protocol, request.profile
    dresser, after = _Dresser(layout, request), before
    for stage in dresser.stages:
        undressed = dresser.layout
        stage()
        after = evaluate_layout(dresser.layout, protocol, profile, navigation=True, earlier=after)
        if after.cost > before.cost or after.fitness < before.fitness - 1e-9:
            dresser.layout, dresser.baseline = undressed, before
            stage()
            after = evaluate_layout(dresser.layout, protocol, profile, navigation=True, earlier=after)
    return dresser.layout, after


class _Dresser:
    """A layout to which objects are added one by one."""

    def __init__(self, layout: Layout, request: Request) -> None:
        self.layout = layout
        self.keepouts = Keepouts.of(layout, request.protocol)
        self.profile = request.profile
        self.generator = np.random.default_rng([request.seed, len(layout.placements)])
        self.catalog = request.catalog
        self.habits = request.habits
        self.dressing = request.habits.dressing
        self.protocol = request.protocol
        self.holdings = request.holdings
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
            for index, name in enumerate(self.dressing.surfaces.get(furniture.asset, ())):
                if self.generator.random() < LIKELY or index == 0:
                    self._put_on(name, furniture.id, 0)
            self._fill_shelves(furniture)

    def dress_walls(self) -> None:
        for accessory in self.dressing.walls:
            near = self._point(accessory.near)
            if near is not None:
                self._add(on_wall(self.layout, self.catalog.get(accessory.asset), self.keepouts, near))

    def dress_floor(self) -> None:
        for accessory in self.dressing.floor:
            near, asset = self._point(accessory.near), self.catalog.get(accessory.asset)
            if near is not None:
                poses = along_walls(self.layout, asset, near)[:80]
                self._add(on_floor(self.layout, asset, self.keepouts, poses, in_front=False))
        self._pull_up_stools()

    def _add(self, placement: Placement | None) -> None:
        if placement is None or not self._may_add(placement.asset):
            return
        layout = self.layout.replace(placements=(*self.layout.placements, placement))
        if self.baseline is not None:
            after = evaluate_layout(layout, self.protocol, self.profile, navigation=True, earlier=self.baseline)
            if after.cost > self.baseline.cost or after.fitness < self.baseline.fitness - 1e-9:
                return
        self.layout = layout

    def _may_add(self, name: str) -> bool:
        """Whether one more piece of an asset exists or may be bought."""
        return self.holdings is None or self.holdings.adds(name, (p.asset for p in self.layout.placements))

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
        names = self.dressing.shelves.get(furniture.asset)
        if names is not None:
            for slot in range(len(self.catalog.get(furniture.asset).surfaces)):
                for name in self._drawn(names, *SHELF_ITEMS):
                    self._put_on(name, furniture.id, slot)

    def _pull_up_stools(self) -> None:
        asset = self.catalog.get(self.dressing.seat)
        size = asset.size
        seats = list(self._seats(SEAT_GAP + size.depth / 2.0))
        pulled = 0
        for index in self.generator.permutation(len(seats)):
            x, y, yaw, owner = seats[index]
            box = OrientedBox(x, y, size.width, size.depth, yaw, 0.0, size.height)
            if pulled < STOOLS and self._roomy(box, owner):
                before = self.layout
                self._add(on_floor(self.layout, asset, self.keepouts, [(x, y, yaw)], in_front=True))
                pulled += self.layout is not before

    def _point(self, neighbor: str) -> tuple[float, float] | None:
        """Position of the first door or of the first placement of an asset, or None."""
        if neighbor == "door":
            door = main_door(self.layout.floor)
            if door is not None:
                return door
        placement = self.layout.find(neighbor)
        return None if placement is None else (placement.position[0], placement.position[1])

    def _is_island(self, placement: Placement) -> bool:
        return self.habits.of(placement.asset).stance != "wall"

    def _seats(self, reach: float) -> Iterator[tuple[float, float, float, str]]:
        """Yield poses of stools pulled up to islands and desks, with the id of the furniture."""
        layout = self.layout
        for placement in layout.placements:
            box = layout.box(placement.id)
            if placement.asset in self.dressing.seated:
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
            if placement.support == FLOOR and placement.id != owner and placement.asset != seat
        ]
        gaps = pairwise_distance(BoxArray.of([stool]), BoxArray.of(others))
        return bool((gaps >= PASSAGE).all())
