"""A space while it is being furnished: what stands where, what stays free, and which ways remain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from labgym.geometry import OrientedBox
from labgym.layouts.brief import Unit
from labgym.layouts.ground import Ground
from labgym.layouts.ground.wide_ways import WideWays
from labgym.layouts.interiors.distances import dry_distances
from labgym.layouts.interiors.lattice import Lattice
from labgym.layouts.interiors.siting import DOOR_STEPS, aloof_options, options_on
from labgym.layouts.interiors.standing import Standing, strips
from labgym.layouts.interiors.supply import Options
from labgym.layouts.placement import WALL
from labgym.layouts.request import Request
from labgym.layouts.rules.zones import INTRUSION, front_zone

EMERGENCY = frozenset({"fire", "eyewash"})
"""Subtypes of pieces that people run to."""


@dataclass
class Interior:
    """The state of a space, in the frame of its ground.

    Attributes:
        feet: footprints of the units placed so far, by id.
        blocks: benches in the open: the outline of each group of them.
        beyond: units of other spaces from which some keep a distance, with their footprints.
    """

    ground: Ground
    standing: Standing = field(init=False)
    ways: WideWays = field(init=False)
    lattice: Lattice = field(init=False)
    units: dict[str, Unit] = field(default_factory=dict)
    feet: dict[str, OrientedBox] = field(default_factory=dict)
    blocks: list[OrientedBox] = field(default_factory=list)
    beyond: list[tuple[Unit, OrientedBox]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.standing = Standing(self.ground)
        self.ways = WideWays(self.ground, [*self.ground.outside, *self.ground.solid, *self.ground.leaves])
        self.lattice = Lattice(self.ground.width, self.ground.depth)
        self.lattice.add(self.standing.building_bounds, self.standing.free_bounds)

    def options(self, unit: Unit) -> Options:
        """Return the free places of a unit along the walls; those of a hood keep the full distance from doors."""
        placed = [*((self.units[unit_id], foot) for unit_id, foot in self.feet.items()), *self.beyond]
        apart = dry_distances(unit, placed)
        if unit.asset.fume_hood:
            return aloof_options(self.standing, unit, apart, least=DOOR_STEPS[0])
        return options_on(self.standing, unit, apart)

    def add(self, placed: Sequence[tuple[Unit, OrientedBox]]) -> bool:
        """Add units that belong together, unless they cut a gate or a place of work off; return whether they were."""
        feet = [foot for _, foot in placed]
        emergency = [foot for unit, foot in placed if unit.front > 0.0 and unit.asset.subtype in EMERGENCY]
        places = [foot for unit, foot in placed if unit.front > 0.0 and unit.asset.subtype not in EMERGENCY]
        if not self.ways.add(feet, places, emergency=emergency):
            return False
        self._record(placed)
        return True

    def add_anyway(self, unit: Unit, foot: OrientedBox) -> bool:
        """Add a unit that stands there whatever it blocks; return whether ways still join all gates."""
        joined = self.ways.add([foot], [foot] if unit.front > 0.0 else [])
        if not joined:
            joined = self.ways.add([foot], [])
        if not joined:
            self.ways.add([foot], [], check=False)
        self._record([(unit, foot)])
        return joined

    def _record(self, placed: Sequence[tuple[Unit, OrientedBox]]) -> None:
        for unit, foot in placed:
            self.standing.add(foot, unit.front, unit.clear)
            fronts = [front_zone(foot, unit.front)] if unit.front > 0.0 else []
            self.lattice.add(strips([foot]), strips(fronts))
            self.units[unit.id] = unit
            self.feet[unit.id] = foot


def fixed_pieces(
    request: Request, required: Sequence[Unit], grounds: Sequence[Ground]
) -> dict[str, list[tuple[Unit, OrientedBox]]]:
    """Return the fixed objects of each space, with their footprints in the frame of its ground.

    Args:
        required: units of the floor; a fixed object that is none of them becomes a unit without a front.
    """
    units = {unit.id: unit for unit in required}
    standing: dict[str, list[tuple[Unit, OrientedBox]]] = {ground.space: [] for ground in grounds}
    for placement in request.fixed:
        asset = request.fixed_asset(placement)
        if placement.support == WALL and asset.size.depth <= INTRUSION:
            continue
        x, y, _ = placement.position
        box = OrientedBox(x, y, asset.size.width, asset.size.depth, placement.yaw)
        space = request.floor.space_at(x, y)
        unit = units.get(placement.id, Unit(placement.id, asset, asset.size.width, asset.size.depth, 0.0))
        for ground in grounds:
            if space is not None and ground.space == space.id:
                standing[ground.space].append((unit, ground.to_ground(box)))
    return standing
