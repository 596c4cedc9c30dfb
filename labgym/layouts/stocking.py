"""Cabinets for reagents, and what stands on the surfaces and shelves of furniture that has no place yet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np

from labgym.assets import Asset
from labgym.assets.compatibility import UNCLASSIFIED
from labgym.errors import InfeasibleError
from labgym.layouts.brief import Content, Unit
from labgym.layouts.request import Request
from labgym.layouts.rules.safety.heights import REAGENT_HEIGHT_M
from labgym.layouts.rules.separation import hazard_between
from labgym.layouts.rules.thresholds import CORROSIVE_HEIGHT, Profile
from labgym.layouts.tabletop import Arm, SurfaceItem, SurfaceSpot, pack

LEAST_SHELVES = 0.8
"""Least area of shelves of a cabinet that takes the place of the usual one, relative to it."""


@dataclass(frozen=True)
class Cabinet:
    """A cabinet and the reagents that it stores.

    Attributes:
        id: id of the future placement, or of a fixed one.
    """

    id: str
    asset: Asset
    reagents: tuple[Asset, ...]


def plan_cabinets(request: Request) -> tuple[Cabinet, ...]:
    """Return a small set of cabinets in which no two incompatible reagents share one.

    Reagents of one storage class share a cabinet; the incompatibility graph within the class is colored greedily,
    the reagent with most conflicts first, and each color becomes one cabinet.
    """
    by_class: dict[str, list[Asset]] = {}
    for use in request.protocol.reagents:
        asset = request.catalog.find(use.name)
        storage = asset.chemistry.storage_class if asset.chemistry is not None else "General"
        by_class.setdefault(storage, []).append(asset)
    cabinets: list[Cabinet] = []
    for storage, kind in request.habits.cabinets.items():
        groups = _compatible_groups(by_class.get(storage, []), request.profile, kind.capacity)
        for (cabinet_id, asset), group in zip(_offered(request, storage, kind.asset), groups, strict=False):
            cabinets.append(Cabinet(cabinet_id, asset, tuple(group)))
    return tuple(cabinets)


def _offered(request: Request, storage: str, usual: str) -> Iterator[tuple[str, Asset]]:
    """Yield ids and entries of cabinets for a storage class: fixed ones, then those that exist, then usual ones."""
    least = LEAST_SHELVES * _shelves(request.catalog.get(usual))
    classed = [asset for asset in request.catalog if asset.storage_class == storage and asset.placing == "floor"]
    alike = {usual, *(asset.name for asset in classed if _shelves(asset) >= least)}
    counts: Counter[str] = Counter()
    for placement in request.fixed:
        if placement.asset in alike:
            counts[placement.asset] += 1
            asset = request.catalog.get(usual) if placement.asset == usual else request.fixed_asset(placement)
            yield placement.id, asset
    existing = request.holdings.counts if request.holdings is not None else {}
    for name in sorted(alike, key=lambda name: (name != usual, name)):
        for number in range(counts[name] + 1, existing.get(name, 0) + 1):
            counts[name] = number
            yield f"{name}_{number}", request.catalog.get(name)
    for number in count(counts[usual] + 1):
        yield f"{usual}_{number}", request.catalog.get(usual)


def _shelves(asset: Asset) -> float:
    """Area of an asset's shelves, square meters."""
    return sum(surface.width * surface.depth for surface in asset.surfaces)


def conflict_between(first: Cabinet, second: Cabinet, profile: Profile) -> str | None:
    """Return the hazard of the first incompatible pair across two cabinets, or None."""
    for one in first.reagents:
        for other in second.reagents:
            hazard = hazard_between(one, other, profile.pairs)
            if hazard is not None:
                return f"{one.name} and {other.name}: {hazard.hazard}"
    return None


def _compatible_groups(assets: list[Asset], profile: Profile, capacity: int) -> list[list[Asset]]:
    def clash(one: Asset, other: Asset) -> bool:
        if UNCLASSIFIED in (one.category, other.category):
            return True  # a bottle of unknown content shares no cabinet
        return hazard_between(one, other, profile.pairs) is not None

    degree = {asset.name: sum(clash(asset, other) for other in assets) for asset in assets}
    groups: list[list[Asset]] = []
    for asset in sorted(assets, key=lambda asset: (-degree[asset.name], asset.name)):
        group = next((g for g in groups if len(g) < capacity and not any(clash(asset, other) for other in g)), None)
        if group is None:
            groups.append([asset])
        else:
            group.append(asset)
    return groups


BENCH_MARGIN = 0.02
"""Margin to the edge for objects other than glass, meters: a centimeter of slip on top of the placing grid."""
SHELF_MARGIN = 0.01
"""Margin to the edge of a shelf, meters: one step of the placing grid."""
UNLIMITED = 1000

Waiting = tuple[Asset, str]
"""An instrument that needs a place, and why it is in the room."""


def home(request: Request, instrument: Asset, units: Mapping[str, Unit]) -> tuple[str, str]:
    """Return the id of an instrument's unit and why: where the protocol puts it, where it is first used, by category.

    Args:
        units: the first unit of each role, by the name of its asset; one with the role of the default home, or any
            other with a surface.
    """
    protocol, habits = request.protocol, request.habits
    constraints = [rule for rule in protocol.spatial_constraints if rule.kind == "on"]
    candidates = [
        (rule.object, f"the protocol puts it on {rule.object}")
        for rule in constraints
        if rule.subject == instrument.name
    ]
    candidates += [
        (step.location, f"step {number} uses it at {step.location}")
        for number, step in enumerate(protocol.steps, 1)
        if instrument.name in step.uses
    ]
    usual = habits.homes.get(instrument.category, habits.default_home)
    candidates.append((usual, f"{instrument.category} instruments stand on {usual}"))
    for location, reason in candidates:
        unit = units.get(location)
        if unit is not None and unit.asset.surfaces:
            return unit.id, reason
    last = units.get(habits.default_home) or next(unit for unit in units.values() if unit.asset.surfaces)
    return last.id, "no better place"


def shelve(request: Request, cabinet: Cabinet, generator: np.random.Generator) -> tuple[Content, ...]:
    """Stand reagents on a cabinet's shelves: tall ones low, corrosives below eye level, the shelves about equally full.

    Raises:
        InfeasibleError: a reagent fits on no shelf.
    """
    assets = sorted(cabinet.reagents, key=lambda asset: (-asset.size.height, asset.name))
    share = max(2, -(-len(assets) // max(len(cabinet.asset.surfaces), 1)))
    contents: list[Content] = []
    homeless: list[str] = []
    for asset in assets:
        spot = _shelf_spot(cabinet.asset, asset, contents, share, generator)
        if spot is None:
            spot = _shelf_spot(cabinet.asset, asset, contents, UNLIMITED, generator)
        if spot is None:
            homeless.append(asset.name)
            continue
        reason = f"reagent of the protocol, storage class {cabinet.asset.storage_class}"
        contents.append(Content(asset, *spot, reason))
    if homeless:
        raise InfeasibleError(
            request.protocol.id, [f"{cabinet.asset.name} has no shelf for {', '.join(homeless)}"], None
        )
    return tuple(contents)


def _shelf_spot(
    cabinet: Asset, asset: Asset, contents: Sequence[Content], most: int, generator: np.random.Generator
) -> tuple[int, SurfaceSpot] | None:
    """The first slot with fewer than `most` containers and space for one more, with the spot on it."""
    corrosive = asset.hazards.corrosive and asset.phase != "gas"  # a cylinder stands on the floor, its valve is its top
    for slot, surface in enumerate(cabinet.surfaces):
        taken = [content.spot for content in contents if content.slot == slot]
        too_high = surface.z > REAGENT_HEIGHT_M or (corrosive and surface.z + asset.size.height > CORROSIVE_HEIGHT)
        if len(taken) >= most or too_high:
            continue
        spots = pack(
            [SurfaceItem.of(asset, SHELF_MARGIN)], surface.width, surface.depth, surface.headroom, generator, taken
        )
        if spots:
            return slot, spots[0]
    return None


def stand(
    furniture: Asset,
    waiting: Sequence[Waiting],
    profile: Profile,
    generator: np.random.Generator,
    present: Sequence[Content] = (),
    arm: Arm | None = None,
) -> tuple[tuple[Content, ...], list[Waiting]]:
    """Stand instruments on a work surface next to what is present.

    Glassware keeps `profile.glass` from the edges where the surface allows it. With an arm, spots in its reach are
    preferred.

    Returns:
        Contents, and the instruments that did not fit.
    """
    if not furniture.surfaces:
        return (), list(waiting)
    surface = furniture.surfaces[0]
    items = [
        SurfaceItem.of(asset, profile.glass if asset.hazards.glass_container else BENCH_MARGIN) for asset, _ in waiting
    ]
    taken = [content.spot for content in present]
    spots = pack(items, surface.width, surface.depth, surface.headroom, generator, taken, arm)
    contents = tuple(Content(waiting[index][0], 0, spot, waiting[index][1]) for index, spot in sorted(spots.items()))
    return contents, [entry for index, entry in enumerate(waiting) if index not in spots]
