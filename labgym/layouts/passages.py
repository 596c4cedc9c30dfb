"""Whether ways out stay wide in the spaces of a furnished floor while accessories are added."""

from __future__ import annotations

from labgym.geometry import OrientedBox
from labgym.layouts.ground.wide_ways import WideWays
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR
from labgym.layouts.rules.thresholds import MOVABLE
from labgym.layouts.surroundings import grounds


class Passages:
    """The ways of each space between its doors and its places of work; built for a space when it is first asked for."""

    def __init__(self, layout: Layout) -> None:
        """Start with the furniture of a layout."""
        self._layout = layout
        self._grounds = {ground.space: ground for ground in grounds(layout.floor)}
        self._ways: dict[str, WideWays | None] = {}

    def add(self, space: str, box: OrientedBox, emergency: bool = False) -> bool:
        """Add an object unless it cuts a door or a place of work off from a way out; return whether it was added.

        In a space whose furniture already does so, every object is added.

        Args:
            emergency: whether a way has to lead to the object too, and to remain.
        """
        if space not in self._ways:
            self._ways[space] = self._furnished(space)
        ways, foot = self._ways[space], self._grounds[space].to_ground(box)
        return ways is None or ways.add([foot], [], emergency=[foot] if emergency else [])

    def _furnished(self, space: str) -> WideWays | None:
        ground, layout = self._grounds[space], self._layout
        ways = WideWays(ground, [*ground.outside, *ground.solid, *ground.leaves])
        feet, places, hung = [], [], []
        for placement in layout.placements:
            asset, at = layout.asset(placement.id), layout.floor.space_at(*placement.position[:2])
            if at is None or at.id != space:
                continue
            if asset.subtype == "fire":
                hung.append(ground.to_ground(layout.box(placement.id)))
            elif placement.support == FLOOR and asset.subtype not in MOVABLE:
                feet.append(ground.to_ground(layout.box(placement.id)))
                places += [feet[-1]] if asset.clearance > 0.0 else []
        ways.add(feet, places, check=False)
        if not ways.joined:
            return None
        for extinguisher in hung:
            ways.add([extinguisher], [], emergency=[extinguisher])
        return ways
