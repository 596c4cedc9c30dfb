"""Phase 1 of LabGen: a first layout, room level then surface level."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from typing import Protocol as Interface

import numpy as np

from labgym.geometry import OrientedBox
from labgym.layouts.brief import LEVELS, Brief
from labgym.layouts.briefing import write_brief
from labgym.layouts.floor_plan import Pose, solve
from labgym.layouts.infeasibility import explain
from labgym.layouts.model import FLOOR, Layout, Placement, Provenance
from labgym.layouts.request import Request
from labgym.layouts.walls import choose_walls
from labgym.navigation import goal_pairs
from labgym.protocols import Protocol

ATTEMPTS = 6
"""Briefs tried at each level of furnishing before the next."""
QUICK, THOROUGH = 0.04, 1.0
"""Deterministic search time with walls chosen beforehand, and with walls left to the solver."""
LEAST_DRIVE = 1.0
"""Least distance between the goal poses of consecutive locations, metres: a drive starts well outside its goal."""


class Proposer(Interface):
    """Makes a first layout; the later phases repair and verify it, whoever proposed it."""

    def propose(self, request: Request) -> Layout:
        """Return a layout that holds everything the protocol requires; it may violate rules."""


@dataclass(frozen=True)
class Plan:
    """A furnished brief and a pose for each of its units, from which a layout is assembled."""

    request: Request
    brief: Brief
    poses: dict[str, Pose]

    def layout(self) -> Layout:
        """Return the layout: furniture at its poses with its contents."""
        return _assembled(self)[0]

    def reasons(self) -> dict[str, str]:
        """Return why each placement is there, by placement id."""
        return _assembled(self)[1]


@dataclass(frozen=True)
class ProceduralProposer:
    """Laboratory planning habits, a constraint solver and a seed; offline and deterministic."""

    def propose(self, request: Request) -> Layout:
        """Return a layout without geometric or chemical violations.

        Raises:
            InfeasibleError: the room cannot hold what the protocol requires.
        """
        return self.plan(request).layout()

    def plan(self, request: Request) -> Plan:
        """Return the first plan that the solver finds, trying full furnishing first.

        Raises:
            InfeasibleError: the room cannot hold what the protocol requires.
        """
        room, seed = request.room, request.seed
        entropy = int.from_bytes(hashlib.sha256(request.protocol.id.encode()).digest()[:8], "big")
        for level_index, level in enumerate(LEVELS):
            for attempt in range(ATTEMPTS):
                generator = np.random.default_rng([seed, entropy, level_index, attempt])
                brief = write_brief(request, level, generator)
                poses = solve(choose_walls(brief, room, generator), room, seed, effort=QUICK)
                if poses is not None:
                    plan = Plan(request, brief, poses)
                    if shortest_drive(plan.layout(), request.protocol) >= LEAST_DRIVE:
                        return plan
        generator = np.random.default_rng([seed, entropy])
        brief = write_brief(request, "required", generator)
        poses = solve(brief, room, seed, effort=THOROUGH)
        if poses is None:
            raise explain(request, brief)
        return Plan(request, brief, poses)


def _assembled(plan: Plan) -> tuple[Layout, dict[str, str]]:
    """The layout of a plan, and the reason of each placement by id."""
    placements: list[Placement] = []
    reasons: dict[str, str] = {}
    counts: dict[str, int] = {}
    for unit in plan.brief.units:
        pose = plan.poses[unit.id]
        placements.append(
            Placement(
                id=unit.id, asset=unit.asset.name, position=_rounded(pose.x, pose.y, 0.0), yaw=pose.yaw, support=FLOOR
            )
        )
        reasons[unit.id] = unit.reason
    for unit in plan.brief.units:
        pose = plan.poses[unit.id]
        frame = OrientedBox(pose.x, pose.y, unit.width, unit.depth, pose.yaw)
        for content in plan.brief.contents.get(unit.id, ()):
            surface, name = unit.asset.surfaces[content.slot], content.asset.name
            x, y = frame.to_world(surface.x + content.spot.x, surface.y + content.spot.y)
            counts[name] = counts.get(name, 0) + 1
            placements.append(
                Placement(
                    id=f"{name}_{counts[name]}",
                    asset=name,
                    position=_rounded(x, y, surface.z),
                    yaw=pose.yaw + content.spot.yaw,
                    support=unit.id,
                    slot=content.slot,
                )
            )
            reasons[placements[-1].id] = content.reason
    request = plan.request
    protocol, room, seed = request.protocol, request.room, request.seed
    layout = Layout(
        id=f"{protocol.id}-{room.name}-{seed}"[:80],
        protocols=(protocol,),
        floor=room.floor,
        placements=tuple(placements),
        catalog=request.catalog,
        provenance=Provenance(generator="procedural", seed=seed, options={"furnishing": plan.brief.furnishing}),
    )
    return layout, reasons


def shortest_drive(layout: Layout, protocol: Protocol) -> float:
    """Return the shortest straight-line distance between consecutive goal poses, metres; inf without drives."""
    lengths = [math.dist(pair.start[:2], pair.goal[:2]) for pair in goal_pairs(layout, protocol)]
    return min(lengths, default=math.inf)


def _rounded(x: float, y: float, z: float) -> tuple[float, float, float]:
    return round(x, 6), round(y, 6), round(z, 6)
