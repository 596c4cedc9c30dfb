"""The proposer that errs as language models do: habits and relations, no solver, no second look."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from labgym.geometry import OrientedBox, wrap_angle
from labgym.layouts.brief import Unit
from labgym.layouts.interiors.distances import separations_of
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, WALL, Placement, rounded
from labgym.layouts.records import Provenance
from labgym.layouts.request import Request
from labgym.paper.sampler.inventory import list_furniture
from labgym.paper.sampler.rates import Rates, Slips, errors_of
from labgym.paper.sampler.siting import Pose, site_furniture
from labgym.paper.sampler.surfaces import Resting, contents_of, stock_furniture

NOTE = "the sampler proposes only what protocols and safety require"
"""Why its layouts are not fully furnished, for their provenance."""


@dataclass(frozen=True)
class SamplerProposer:
    """Lays a laboratory out as language models do: seeded, offline, deterministic and fallible.

    It knows which furniture a protocol and safety require, along which wall each piece usually stands, what belongs
    near what, in which order the workflow visits the places, and which distances hazards require. It places one piece
    after the other and never revises. What goes wrong is in `Rates`; with all rates 0 the layout has no such fault
    unless the floor is too small for pieces placed one by one.

    Attributes:
        rates: how often each kind of error occurs; by default the calibrated rates.
    """

    rates: Rates = field(default_factory=Rates.calibrated)

    def propose(self, request: Request) -> Layout:
        """Return a layout that may violate rules and lack required assets.

        Raises:
            UnknownNameError: the catalog lacks an asset that the protocol names.
        """
        slips = Slips(request, self.rates)
        inventory = list_furniture(request, slips)
        resting = stock_furniture(request, inventory, slips)
        separations = tuple(separations_of(inventory.cabinets, contents_of(resting), request.profile))
        poses = site_furniture(request, inventory.units, separations, slips)
        return Layout(
            id=f"{request.protocol.id}-{request.floor.name}-{request.seed}"[:80],
            protocols=request.protocols,
            floor=request.floor,
            placements=tuple(_placements(request, inventory.units, poses, resting)),
            catalog=request.catalog,
            provenance=Provenance(
                generator="sampler",
                seed=request.seed,
                options={"furnishing": "required", "note": NOTE, "errors": errors_of(slips)},
            ),
        )


def _placements(
    request: Request, units: Sequence[Unit], poses: Mapping[str, Pose], resting: Mapping[str, Sequence[Resting]]
) -> list[Placement]:
    """Furniture at its poses, fixed objects where they are, and what each piece holds."""
    fixed = {placement.id: placement for placement in request.fixed}
    placements = [fixed[unit.id] if unit.id in fixed else _furniture(unit, poses[unit.id]) for unit in units]
    placements += [placement for placement in request.fixed if placement.support == WALL]
    ids = {placement.id for placement in placements}
    counts: Counter[str] = Counter()
    for unit, carrier in zip(units, placements, strict=False):
        x, y, z = carrier.position
        frame = OrientedBox(x, y, unit.width, unit.depth, carrier.yaw)
        for each in resting.get(unit.id, ()):
            content = each.content
            surface, name = unit.asset.surfaces[content.slot], content.asset.name
            counts[name] += 1
            while f"{name}_{counts[name]}" in ids:
                counts[name] += 1
            placements.append(
                Placement(
                    id=f"{name}_{counts[name]}",
                    asset=name,
                    position=rounded(
                        *frame.to_world(surface.x + content.spot.x, surface.y + content.spot.y), z + each.height
                    ),
                    yaw=round(wrap_angle(carrier.yaw + content.spot.yaw), 9),
                    support=unit.id,
                    slot=content.slot,
                )
            )
    return placements


def _furniture(unit: Unit, pose: Pose) -> Placement:
    x, y, yaw = pose
    return Placement(
        id=unit.id,
        asset=unit.asset.name,
        position=rounded(x, y, 0.0),
        yaw=round(wrap_angle(yaw), 9),
        support=FLOOR,
    )
