"""Assembles a layout from furniture with its contents and a pose for each piece."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from labgym.assets import Asset, Catalog
from labgym.geometry import OrientedBox
from labgym.layouts.brief import Brief
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, Placement
from labgym.layouts.records import Provenance
from labgym.layouts.request import Request


@dataclass(frozen=True)
class Pose:
    """Center of a footprint in the floor's frame, meters, and yaw, radians."""

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class Plan:
    """A furnished brief and a pose for each of its units, from which a layout is assembled.

    Attributes:
        note: why the room is not fully furnished; empty if it is.
        options: further facts for the layout's provenance.
    """

    request: Request
    brief: Brief
    poses: Mapping[str, Pose]
    note: str = ""
    options: Mapping[str, Any] = field(default_factory=dict)

    def layout(self) -> Layout:
        """Return the layout: furniture at its poses with its contents."""
        return _assembled(self)[0]

    def reasons(self) -> dict[str, str]:
        """Return why each placement is there, by placement id."""
        return _assembled(self)[1]


def _assembled(plan: Plan) -> tuple[Layout, dict[str, str]]:
    """The layout of a plan, and the reason of each placement by id."""
    placements: list[Placement] = []
    reasons: dict[str, str] = {}
    counts: dict[str, int] = {}
    fixed = plan.brief.fixed
    for unit in plan.brief.units:
        pose = plan.poses[unit.id]
        position = _rounded(pose.x, pose.y, 0.0)
        placement = Placement(id=unit.id, asset=unit.asset.name, position=position, yaw=pose.yaw, support=FLOOR)
        placements.append(_in_role(fixed.get(unit.id, placement), unit.asset, plan.request.catalog))
        reasons[unit.id] = unit.reason
    for placement_id in plan.brief.wall_assets:
        placements.append(fixed[placement_id])
        reasons[placement_id] = "fixed by the request"
    for unit in plan.brief.units:
        pose = plan.poses[unit.id]
        frame = OrientedBox(pose.x, pose.y, unit.width, unit.depth, pose.yaw)
        for content in plan.brief.contents.get(unit.id, ()):
            surface, name = unit.asset.surfaces[content.slot], content.asset.name
            x, y = frame.to_world(surface.x + content.spot.x, surface.y + content.spot.y)
            counts[name] = counts.get(name, 0) + 1
            while f"{name}_{counts[name]}" in fixed:
                counts[name] += 1
            placement = Placement(
                id=f"{name}_{counts[name]}",
                asset=name,
                position=_rounded(x, y, surface.z),
                yaw=pose.yaw + content.spot.yaw,
                support=unit.id,
                slot=content.slot,
            )
            placements.append(_in_role(placement, content.asset, plan.request.catalog))
            reasons[placements[-1].id] = content.reason
    request, level = plan.request, plan.brief.furnishing
    layout = Layout(
        id=f"{request.protocol.id}-{request.floor.name}-{request.seed}"[:80],
        protocols=request.protocols,
        floor=request.floor,
        placements=tuple(placements),
        catalog=request.catalog,
        provenance=Provenance(
            generator="procedural",
            seed=request.seed,
            options={**plan.options, "furnishing": level, **({} if level == "full" else {"note": plan.note})},
        ),
    )
    return layout, reasons


def _in_role(placement: Placement, asset: Asset, catalog: Catalog) -> Placement:
    """A placement that names the role of its asset, if that is not the asset's own."""
    own = catalog.get(placement.asset).role
    return placement if asset.role == own else placement.model_copy(update={"role": asset.role})


def _rounded(x: float, y: float, z: float) -> tuple[float, float, float]:
    return round(x, 6), round(y, 6), round(z, 6)
