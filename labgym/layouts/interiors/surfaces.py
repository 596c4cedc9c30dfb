"""Stands the instruments of one or more protocols on the work surfaces of a floor, each apparatus on one surface."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from labgym.assets import Asset
from labgym.layouts.brief import Content, Unit
from labgym.layouts.interiors.distances import burning_at, first_of_role
from labgym.layouts.request import Request
from labgym.layouts.rules.reach import ARM_REACH, SHOULDER_HEIGHT
from labgym.layouts.rules.safety.standing import forbidden
from labgym.layouts.rules.separation import heat_band
from labgym.layouts.stocking import Cabinet, Waiting, home, shelve, stand
from labgym.layouts.tabletop import Arm
from labgym.navigation.plan import STAND_OFF
from labgym.protocols import Protocol

SLACK = 0.02
"""Items stand this much nearer than the reach of the arm, meters, so that rounding never undercuts it."""


def arm_at(furniture: Asset, slot: int = 0) -> Arm:
    """Return the arm of a robot that stands at the goal pose of a piece of furniture, over one of its surfaces."""
    surface = furniture.surfaces[slot]
    front = furniture.size.depth / 2.0 + STAND_OFF
    return Arm(-surface.x, front - surface.y, SHOULDER_HEIGHT - surface.z, ARM_REACH - SLACK)


@dataclass(frozen=True)
class StockedSurfaces:
    """Contents of the units of a floor.

    Attributes:
        contents: by unit id.
        unhooded: instruments that belong into a hood, of which all are full. They stand on benches, or are homeless.
        homeless: instruments without a place.
    """

    contents: dict[str, tuple[Content, ...]]
    unhooded: tuple[str, ...]
    homeless: tuple[str, ...]


def stock_surfaces(
    request: Request, cabinets: Sequence[Cabinet], units: Sequence[Unit], generator: np.random.Generator
) -> StockedSurfaces:
    """Return what each unit holds: reagents in cabinets, instruments on work surfaces.

    The instruments that a protocol uses as one apparatus (its `near` constraints) share a surface. What belongs into a
    hood may stand in any hood of the units. If protocols need an instrument at different places, each place has one,
    as far as the request allows further pieces.

    Raises:
        InfeasibleError: a reagent fits on no shelf.
    """
    contents = {cabinet.id: shelve(request, cabinet, generator) for cabinet in cabinets}
    state = _Stocking(request, {unit.id: unit for unit in units}, contents, generator)
    groups = sorted(_groups(request, units), key=lambda group: (-group.area, group.home, group.names))
    for group in groups:
        state.place(group)
    state.place_rest(units)
    return StockedSurfaces(state.contents, tuple(state.unhooded), tuple(asset.name for asset, _ in state.homeless))


@dataclass(frozen=True)
class _Group:
    """Instruments that stand on one surface: asset names, the unit where they belong, and why each is there."""

    names: tuple[str, ...]
    home: str
    reasons: tuple[str, ...]
    area: float


@dataclass
class _Stocking:
    """Surfaces that are being filled.

    Attributes:
        pool: instruments that the protocols require and that have no place yet, by name.
    """

    request: Request
    units: Mapping[str, Unit]
    contents: dict[str, tuple[Content, ...]]
    generator: np.random.Generator
    unhooded: list[str] = field(default_factory=list)
    homeless: list[Waiting] = field(default_factory=list)
    pool: Counter[str] = field(init=False)

    def __post_init__(self) -> None:
        assets = (self.request.catalog.find(name) for name in self.request.protocol.instruments)
        self.pool = Counter(asset.name for asset in assets if asset.placing != "floor")

    def place(self, group: _Group) -> None:
        """Stand a group on its unit or, if that is a hood, on any hood: where the fewest pieces must be added."""
        options = []
        for order, unit_id in enumerate(self._surfaces(group.home)):
            if not self._belong(unit_id, group.names):
                continue
            present = {content.asset.role for content in self.contents.get(unit_id, ())}
            need = [k for k, name in enumerate(group.names) if name not in present]
            further = [group.names[k] for k in need if not self.pool[group.names[k]]]
            options.append((len(further), order, unit_id, need))
        for added, _, unit_id, need in sorted(options):
            if added and not self._may_add(group.names[k] for k in need if not self.pool[group.names[k]]):
                continue
            if self._stand(unit_id, [(group.names[k], group.reasons[k]) for k in need]):
                return
        if self.units[group.home].asset.fume_hood:
            self.unhooded += [name for name in group.names if self.pool[name]]

    def place_rest(self, units: Sequence[Unit]) -> None:
        """Stand what is still required at its usual unit, else on a bench or a hood with space.

        A heat source then stands on no bench on which a protocol handles flammables.
        """
        first = first_of_role(units)
        places = {place for one in self.request.protocols for place, _ in burning_at(self.request, one)}
        handled = {unit.id for role, unit in first.items() if role in places}
        rest: list[Waiting] = []
        for name in sorted(self.pool.elements()):
            asset = self.request.catalog.get(name)
            unit_id, reason = home(self.request, asset, first)
            able = [each for each in self._surfaces(unit_id) if self._belong(each, [name])]
            if not any(self._stand(each, [(name, reason)]) for each in able):
                rest.append((self.request.furniture.get(name), reason))
        benches = [unit for unit in units if unit.asset.subtype == "workbench" or unit.asset.fume_hood]
        for unit in sorted(benches, key=lambda unit: (unit.id in self.contents, unit.id)):
            present = self.contents.get(unit.id, ())
            hot = [entry for entry in rest if unit.id in handled and heat_band(entry[0], self.request.profile)]
            out = [entry for entry in rest if entry in hot or not self._belong(unit.id, [entry[0].name])]
            added, left = self._fitting(unit.asset, [entry for entry in rest if entry not in out], present)
            self.contents[unit.id] = (*present, *added)
            rest = [*out, *left]
        self.homeless = rest

    def _surfaces(self, unit_id: str) -> list[str]:
        """The units on which something that belongs on a unit may stand, that unit first."""
        if not self.units[unit_id].asset.fume_hood:
            return [unit_id]
        return [unit_id, *(u.id for u in self.units.values() if u.asset.fume_hood and u.id != unit_id)]

    def _belong(self, unit_id: str, names: Iterable[str]) -> bool:
        """Whether instruments may stand on a unit."""
        furniture = self.units[unit_id].asset
        return all(forbidden(self.request.catalog.get(name), furniture) is None for name in names)

    def _stand(self, unit_id: str, pieces: Sequence[tuple[str, str]]) -> bool:
        """Stand instruments on a unit, all or none, and return whether they stand there."""
        waiting = [(self.request.furniture.get(name), reason) for name, reason in pieces]
        present = self.contents.get(unit_id, ())
        added, left = self._fitting(self.units[unit_id].asset, waiting, present)
        if left:
            return False
        self.contents[unit_id] = (*present, *added)
        self.pool -= Counter(name for name, _ in pieces)
        return True

    def _fitting(
        self, furniture: Asset, waiting: Sequence[Waiting], present: Sequence[Content]
    ) -> tuple[tuple[Content, ...], list[Waiting]]:
        arm = arm_at(furniture) if furniture.surfaces else None
        return stand(furniture, waiting, self.request.profile, self.generator, present, arm)

    def _may_add(self, names: Iterable[str]) -> bool:
        """Whether the laboratory may have one more of some instruments than the protocols require."""
        holdings = self.request.holdings
        if holdings is None:
            return True
        placed = [content.asset.name for items in self.contents.values() for content in items]
        return all(holdings.adds(name, [*placed, *self.pool.elements()]) for name in names)


def _groups(request: Request, units: Sequence[Unit]) -> Iterator[_Group]:
    """Yield what each protocol has on each unit: its apparatus, and every other instrument by itself."""
    first, yielded = first_of_role(units), set[tuple[str, tuple[str, ...]]]()
    for protocol in request.protocols:
        own = replace(request, protocol=protocol, several=())
        at: dict[str, dict[str, str]] = defaultdict(dict)
        for name in protocol.instruments:
            asset = request.catalog.find(name)
            if asset.placing != "floor":
                unit_id, reason = home(own, asset, first)
                at[unit_id][asset.name] = reason
        for unit_id, reasons in sorted(at.items()):
            for names in _apparatus(request, protocol, sorted(reasons)):
                if (unit_id, names) not in yielded:
                    yielded.add((unit_id, names))
                    area = sum(_area(request.catalog.get(name)) for name in names)
                    yield _Group(names, unit_id, tuple(reasons[name] for name in names), area)


def _apparatus(request: Request, protocol: Protocol, names: Sequence[str]) -> list[tuple[str, ...]]:
    """Return instruments in groups: those that a protocol requires near each other, directly or by others."""
    group = {name: {name} for name in names}
    for rule in protocol.spatial_constraints:
        if rule.kind != "near":
            continue
        pair = {request.catalog.find(each).name for each in (rule.subject, rule.object)}
        if pair <= group.keys():
            merged = set[str]().union(*(group[name] for name in pair))
            for name in merged:
                group[name] = merged
    return sorted({tuple(sorted(members)) for members in group.values()})


def _area(asset: Asset) -> float:
    return asset.size.width * asset.size.depth
