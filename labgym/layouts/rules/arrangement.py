"""A layout unrolled once into arrays, so that every rule can look at all objects together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.errors import LabgymError, check_name
from labgym.geometry import BoxArray, OrientedBox, rotate
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL, PartStates, Placement, placed_box
from labgym.layouts.rules.building import Building, building_of
from labgym.layouts.rules.thresholds import LOOSE, MOVABLE

BUILDING = frozenset({"opening", "robot"})
"""Categories that are not objects of the layout: doors and windows belong to the room, the robot to the episode."""

Fact = TypeVar("Fact")
BY_ASSET = ("index", "by_role", "reagents", "hoods", "showers")
"""Properties that depend on the assets of the objects alone."""
BY_SUPPORT = ("_carriers", "roots", "supported", "standing", "standing_fast", "workplaces")
"""Properties that depend on the assets of the objects and on what carries each."""


@dataclass(frozen=True)
class Solids:
    """Solid boxes of n objects: those of object k are the rows `starts[k]` to `starts[k] + counts[k]`.

    Not every row belongs to an object: the bounding box of a hollow or open object is a row, but not one of its solids.
    """

    boxes: BoxArray
    starts: NDArray[np.intp]
    counts: NDArray[np.intp]


@dataclass(frozen=True)
class Replacement:
    """The state of an arrangement before some of its objects moved.

    Attributes:
        local: the local facts of that state, by name and row.
        rows: rows of the objects that have moved since.
        bounds: least and greatest coordinates of all objects then, as `Arrangement.bounds`.
    """

    local: dict[str, dict[int, Any]]
    rows: NDArray[np.intp]
    bounds: tuple[NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True)
class Arrangement:
    """The objects of a layout: its placements without doors, windows and robots, in the layout's order.

    Attributes:
        placements, assets: of the n objects.
        boxes: bounding boxes, n rows.
        others: placements that are no objects.
    """

    layout: Layout
    placements: tuple[Placement, ...]
    assets: tuple[Asset, ...]
    boxes: BoxArray
    others: tuple[Placement, ...] = ()
    _facts: dict[str, dict[int, Any]] = field(default_factory=dict, compare=False, repr=False)
    """Facts that this or an earlier state has found (`facts`), by name and row."""
    _carried: dict[str, dict[int, Any]] = field(default_factory=dict, compare=False, repr=False)
    """Those that depend on what carries the object, too."""
    local: dict[str, dict[int, Any]] = field(default_factory=dict, compare=False, repr=False)
    """Facts that depend on the objects around (`local_facts`), by name and row; collisions, in their order."""
    replacement: Replacement | None = field(default=None, compare=False, repr=False)

    @classmethod
    def of(cls, layout: Layout, earlier: Arrangement | None = None) -> Arrangement:
        """Unroll a layout.

        Args:
            earlier: another state of the layout, from which objects that have not changed are taken over.

        Raises:
            UnknownNameError: a placement's asset does not exist.
        """
        replaced = None if earlier is None else earlier._replaced(layout)
        if replaced is not None:
            return replaced
        pairs = [(placement, layout.asset(placement.id)) for placement in layout.placements]
        objects = [(placement, asset) for placement, asset in pairs if asset.category not in BUILDING]
        others = tuple(placement for placement, asset in pairs if asset.category in BUILDING)
        kept: dict[int, int] = {}
        if earlier is not None and earlier.layout.catalog is layout.catalog:
            there = earlier.index
            kept = {
                row: old
                for row, (placement, _) in enumerate(objects)
                if (old := there.get(placement.id)) is not None and earlier.placements[old] is placement
            }
        new = [row for row in range(len(objects)) if row not in kept]
        boxes = BoxArray.of([placed_box(*objects[row]) for row in new])
        facts: dict[str, dict[int, Any]] = {}
        if earlier is not None and kept:
            boxes = earlier.boxes.merged(list(kept), list(kept.values()), boxes, new)
            if earlier.layout.floor is layout.floor:
                facts = {
                    name: {row: known[old] for row, old in kept.items() if old in known}
                    for name, known in earlier._facts.items()
                }
        return cls(layout, tuple(p for p, _ in objects), tuple(a for _, a in objects), boxes, others, facts)

    def _replaced(self, layout: Layout) -> Arrangement | None:
        """Return the arrangement of a layout with the same objects, some of which stand otherwise; None of another."""
        old = self.layout
        if old.catalog is not layout.catalog or len(old.placements) != len(layout.placements):
            return None
        pairs = [(one, other) for one, other in zip(old.placements, layout.placements, strict=True) if one is not other]
        if any((one.id, one.asset, one.role) != (other.id, other.asset, other.role) for one, other in pairs):
            return None
        if any(one.id not in self.index for one, _ in pairs):
            return None
        placements, assets = list(self.placements), list(self.assets)
        changed = [self.index[one.id] for one, _ in pairs]
        for row, (_, other) in zip(changed, pairs, strict=True):
            placements[row], assets[row] = other, layout.asset(other.id)
        kept = np.delete(np.arange(len(self)), np.array(changed, dtype=np.intp))
        boxes = BoxArray.of([placed_box(placements[row], assets[row]) for row in changed])
        boxes = self.boxes.merged(kept, kept, boxes, changed)
        facts, carried = {}, {}
        if old.floor is layout.floor:
            facts = {name: _without(known, changed) for name, known in self._facts.items()}
            moved = np.flatnonzero(self._on_any(changed)).tolist() if self._carried else []
            carried = {name: _without(known, moved) for name, known in self._carried.items()}
        rows = np.array(changed, dtype=np.intp)
        before = Replacement(self.local, rows, self.bounds) if old.floor is layout.floor else None
        new = Arrangement(
            layout, tuple(placements), tuple(assets), boxes, self.others, facts, carried, replacement=before
        )
        shared = [*BY_ASSET, *(BY_SUPPORT if all(one.support == other.support for one, other in pairs) else ())]
        new.__dict__.update((name, self.__dict__[name]) for name in shared if name in self.__dict__)
        return new

    def _on_any(self, rows: Sequence[int]) -> NDArray[np.bool_]:
        """Return which objects are some objects, or stand on or in one of them at any depth, shape (n,)."""
        found = np.zeros(len(self), dtype=np.bool_)
        found[list(rows)] = True
        while (found[self._carriers] & ~found).any():
            found |= found[self._carriers]
        return found

    @cached_property
    def _carriers(self) -> NDArray[np.intp]:
        """Row of the object on or in which each object stands, its own on the floor and on walls, shape (n,)."""
        supports = [self.index.get(placement.support, row) for row, placement in enumerate(self.placements)]
        return np.array(supports, dtype=np.intp)

    def __len__(self) -> int:
        return len(self.placements)

    @cached_property
    def index(self) -> dict[str, int]:
        """Row of each placement id."""
        return {placement.id: row for row, placement in enumerate(self.placements)}

    @cached_property
    def building(self) -> Building:
        """The rooms, walls and doors of the layout."""
        return building_of(self.layout)

    @cached_property
    def spaces(self) -> list[int]:
        """Index of the space that each object is in, n values."""
        return self.facts("space", range(len(self)), lambda rows: self.building.spaces(self.take(rows)).tolist())

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """Corners of the footprints in the room frame, shape (n, 4, 2)."""
        return self.boxes.corners()

    def solids(self, chosen: Sequence[int]) -> Solids:
        """Return the solid boxes of some objects."""
        rows = np.array(chosen, dtype=np.intp)
        base = self.boxes.take(rows)
        starts, counts = np.arange(len(rows)), np.ones(len(rows), dtype=np.intp)
        several = [
            k for k, row in enumerate(chosen) if self.assets[row].cavity is not None or self.placements[row].state
        ]
        if not several:
            return Solids(base, starts, counts)
        shells = [_shell(self.assets[chosen[k]], self.placements[chosen[k]].state) for k in several]
        counts[several] = [len(shell) for shell in shells]
        starts[several] = len(rows) + np.cumsum(counts[several]) - counts[several]
        owner = np.repeat(np.array(several), counts[several])
        yaw = base.yaw[owner]
        local = np.concatenate([shell.centre for shell in shells])
        x = np.cos(yaw) * local[:, 0] - np.sin(yaw) * local[:, 1]
        y = np.sin(yaw) * local[:, 0] + np.cos(yaw) * local[:, 1]
        z = np.concatenate([shell.z for shell in shells]) + base.z[owner, :1]
        boxes = BoxArray(
            np.concatenate([base.centre, base.centre[owner] + np.column_stack([x, y])]),
            np.concatenate([base.half, *(shell.half for shell in shells)]),
            np.concatenate([base.yaw, yaw + np.concatenate([shell.yaw for shell in shells])]),
            np.concatenate([base.z, z]),
        )
        return Solids(boxes, starts, counts)

    @cached_property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Least and greatest coordinates of the objects with their open parts, (n, 3) each, meters."""
        low = np.column_stack([self.corners.min(axis=1), self.boxes.z[:, 0]])
        high = np.column_stack([self.corners.max(axis=1), self.boxes.z[:, 1]])
        for row, part in self.open_parts:
            x0, y0, x1, y1 = part.bounds()
            low[row], high[row] = np.minimum(low[row], (x0, y0, part.z0)), np.maximum(high[row], (x1, y1, part.z1))
        return low, high

    @cached_property
    def open_parts(self) -> list[tuple[int, OrientedBox]]:
        """Boxes of open drawers and doors outside the bounding boxes, each with the row of its object."""
        return [
            (row, part)
            for row, placement in enumerate(self.placements)
            if placement.state
            for part in self.layout.open_parts(placement.id)
        ]

    @cached_property
    def supported(self) -> list[int]:
        """Rows of the objects that stand on or in another object."""
        return [row for row, placement in enumerate(self.placements) if placement.support not in (FLOOR, WALL)]

    @cached_property
    def roots(self) -> list[int]:
        """Row of the floor or wall object that finally carries each object, n values."""
        carriers = self._carriers
        while (carriers[carriers] != carriers).any():
            carriers = carriers[carriers]
        roots: list[int] = carriers.tolist()
        return roots

    @cached_property
    def reagents(self) -> list[int]:
        """Rows of the reagents."""
        return [row for row, asset in enumerate(self.assets) if asset.kind == "reagent"]

    @cached_property
    def by_role(self) -> dict[str, tuple[int, ...]]:
        """Rows of each role; variants count as the asset whose role they have."""
        rows: dict[str, list[int]] = {}
        for row, asset in enumerate(self.assets):
            rows.setdefault(asset.role, []).append(row)
        return {role: tuple(own) for role, own in rows.items()}

    @cached_property
    def hoods(self) -> list[int]:
        """Rows of the fume hoods."""
        return [row for row, asset in enumerate(self.assets) if asset.fume_hood]

    @cached_property
    def showers(self) -> list[int]:
        """Rows of the emergency showers."""
        return [row for row, asset in enumerate(self.assets) if asset.subtype == "shower"]

    @cached_property
    def standing(self) -> list[int]:
        """Rows of the floor and wall objects."""
        return [row for row, placement in enumerate(self.placements) if placement.support in (FLOOR, WALL)]

    @cached_property
    def standing_fast(self) -> list[int]:
        """Rows of the floor and wall objects that are not loose."""
        return [row for row in self.standing if self.assets[row].subtype not in LOOSE]

    @cached_property
    def workplaces(self) -> list[int]:
        """Rows of the floor furniture with a clearance in front, at which people work; movable objects do not count."""
        return [
            row
            for row, (placement, asset) in enumerate(zip(self.placements, self.assets, strict=True))
            if placement.support == FLOOR and asset.clearance > 0.0 and asset.subtype not in MOVABLE
        ]

    def facts(
        self, name: str, rows: Sequence[int], find: Callable[[list[int]], Sequence[Fact]], carried: bool = False
    ) -> list[Fact]:
        """Return a fact of each of some objects; facts that an earlier arrangement has found are kept.

        Args:
            find: returns the facts of some rows; the fact of an object depends on no other object.
            carried: whether it may depend on what carries the object, at any depth.
        """
        facts: dict[int, Fact] = (self._carried if carried else self._facts).setdefault(name, {})
        new = [row for row in rows if row not in facts]
        if new:
            facts.update(zip(new, find(new), strict=True))
        return [facts[row] for row in rows]

    def local_facts(
        self,
        name: str,
        rows: Sequence[int],
        areas: NDArray[np.float64],
        find: Callable[[list[int]], Sequence[Fact]],
    ) -> list[Fact]:
        """Return a fact of each of some objects; those around which nothing has moved are kept.

        Args:
            areas: x0, y0, x1, y1 of the area of each, (rows, 4) meters: the fact depends only on the object, on objects
                whose bounds meet the area, and on their ids, not on rows.
            find: returns the facts of some rows.
        """
        facts: dict[int, Fact] = self.local.setdefault(name, {})
        before = self.replacement
        known = {} if before is None else before.local.get(name, {})
        if before is not None and known:
            still = ~np.isin(np.array(rows, dtype=np.intp), before.rows)
            for bounds in (before.bounds, self.bounds):
                low, high = (ends[before.rows, :2] for ends in bounds)
                apart = (low > areas[:, None, 2:]).any(axis=2) | (high < areas[:, None, :2]).any(axis=2)
                still &= np.asarray(apart).all(axis=1)
            kept = (row for row, stays in zip(rows, still.tolist(), strict=True) if stays and row in known)
            facts.update((row, known[row]) for row in kept if row not in facts)
        new = [row for row in rows if row not in facts]
        if new:
            facts.update(zip(new, find(new), strict=True))
        return [facts[row] for row in rows]

    def box(self, row: int) -> OrientedBox:
        """Return an object's bounding box."""
        return self.layout.box(self.placements[row].id)

    def assembled(self, first: int, second: int) -> bool:
        """Whether two objects belong to one assembled apparatus."""
        apparatus = self.layout.apparatus(self.placements[first].id)
        return apparatus is not None and apparatus == self.layout.apparatus(self.placements[second].id)

    def surface(self, row: int) -> OrientedBox:
        """Return the surface that a supported object stands on, as a flat box at its height.

        Raises:
            UnknownNameError: the support does not exist.
            LabgymError: the support has no such slot.
        """
        placement = self.placements[row]
        carrier = self.row(placement.support)
        surfaces = self.assets[carrier].surfaces
        if placement.slot is None or placement.slot >= len(surfaces):
            raise LabgymError(
                f"{placement.id!r} names slot {placement.slot} of {placement.support!r}, which has {len(surfaces)}"
            )
        surface, base = surfaces[placement.slot], self.placements[carrier]
        dx, dy = rotate(surface.x, surface.y, base.yaw)
        x, y, z = base.position
        return OrientedBox(x + dx, y + dy, surface.width, surface.depth, base.yaw, z + surface.z, z + surface.z)

    def take(self, rows: list[int]) -> BoxArray:
        """Return the bounding boxes of some objects."""
        return self.boxes.take(rows)

    def row(self, placement_id: str) -> int:
        """Return the row of a placement.

        Raises:
            UnknownNameError: no object has that id.
        """
        check_name("placement", placement_id, self.index)
        return self.index[placement_id]


def _without(known: dict[int, Fact], rows: Sequence[int]) -> dict[int, Fact]:
    """Return facts without those of some rows."""
    facts = known.copy()
    for row in rows:
        facts.pop(row, None)
    return facts


@lru_cache(maxsize=1024)
def _shell(asset: Asset, state: PartStates) -> BoxArray:
    """Solid boxes of an asset in its own frame; only those of open doors are turned in it."""
    if not state:
        return BoxArray.of(asset.solids())
    from labgym.assets.articulation import posed_solids

    return BoxArray.of(posed_solids(asset, state))
