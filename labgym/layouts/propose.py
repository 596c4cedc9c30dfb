"""Phase 1 of LabGen: a first layout, room level then surface level."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from typing import Protocol as Interface

import numpy as np

from labgym.assets import Catalog
from labgym.geometry import OrientedBox
from labgym.layouts.briefing import StockedBrief, write_brief
from labgym.layouts.floor_plan import Pose, solve
from labgym.layouts.furnishing import LEVELS, Furnishing
from labgym.layouts.infeasibility import explain
from labgym.layouts.model import FLOOR, Layout, Placement, Provenance, Room
from labgym.layouts.rules.thresholds import Profile
from labgym.layouts.walls import choose_walls
from labgym.navigation import goal_pairs
from labgym.protocols import Protocol

ATTEMPTS = 6
"""Briefs tried at each level of furnishing before the next."""
QUICK, THOROUGH = 0.04, 1.0
"""Deterministic search time with walls chosen beforehand, and with walls left to the solver."""


LEAST_DRIVE = 1.0
"""Least distance between the goal poses of consecutive locations, metres: a drive that starts well outside its goal."""


class Proposer(Interface):
    """Makes a first layout; what comes after repairs and verifies it, whoever proposed it."""

    def propose(self, protocol: Protocol, room: Room, profile: Profile, seed: int) -> Layout:
        """Return a layout that holds everything the protocol requires, good or not."""


@dataclass(frozen=True)
class ProceduralProposer:
    """Rules of laboratory planning, a constraint solver and a seed: no network, the same bytes every time."""

    def propose(self, protocol: Protocol, room: Room, profile: Profile, seed: int) -> Layout:
        """Return a layout without geometric or chemical violations.

        Raises:
            InfeasibleError: the room cannot hold what the protocol requires.
        """
        entropy = int.from_bytes(hashlib.sha256(protocol.id.encode()).digest()[:8], "big")
        for level_index, level in enumerate(LEVELS):
            for attempt in range(ATTEMPTS):
                generator = np.random.default_rng([seed, entropy, level_index, attempt])
                stocked = write_brief(protocol, room, profile, level, generator)
                poses = solve(choose_walls(stocked.brief, room, generator), room, seed, effort=QUICK)
                if poses is not None:
                    layout = _assembled(protocol, room, seed, level, stocked, poses)
                    if shortest_drive(layout, protocol) >= LEAST_DRIVE:
                        return layout
        generator = np.random.default_rng([seed, entropy])
        stocked = write_brief(protocol, room, profile, "required", generator)
        poses = solve(stocked.brief, room, seed, effort=THOROUGH)
        if poses is None:
            raise explain(protocol, room, profile, stocked.brief)
        return _assembled(protocol, room, seed, "required", stocked, poses)


def _assembled(
    protocol: Protocol, room: Room, seed: int, level: Furnishing, stocked: StockedBrief, poses: dict[str, Pose]
) -> Layout:
    """Put furniture at its poses and its stock on it."""
    catalog = Catalog.load()
    placements: list[Placement] = []
    counts: dict[str, int] = {}
    for unit in stocked.brief.units:
        pose = poses[unit.id]
        placements.append(
            Placement(id=unit.id, asset=unit.asset, position=_rounded(pose.x, pose.y, 0.0), yaw=pose.yaw, support=FLOOR)
        )
    for unit in stocked.brief.units:
        pose, furniture = poses[unit.id], catalog.get(unit.asset)
        frame = OrientedBox(pose.x, pose.y, unit.width, unit.depth, pose.yaw)
        for item in stocked.stock.get(unit.id, ()):
            surface = furniture.surfaces[item.slot]
            x, y = frame.to_world(surface.x + item.spot.x, surface.y + item.spot.y)
            counts[item.asset] = counts.get(item.asset, 0) + 1
            placements.append(
                Placement(
                    id=f"{item.asset}_{counts[item.asset]}",
                    asset=item.asset,
                    position=_rounded(x, y, surface.z),
                    yaw=pose.yaw + item.spot.yaw,
                    support=unit.id,
                    slot=item.slot,
                )
            )
    provenance = Provenance(generator="procedural", seed=seed, options={"furnishing": level})
    return Layout(
        id=f"{protocol.id}-{room.name}-{seed}"[:80],
        protocol=protocol.id,
        room=room,
        placements=tuple(placements),
        provenance=provenance,
    )


def shortest_drive(layout: Layout, protocol: Protocol) -> float:
    """Return the least distance as the crow flies of the protocol's drives, metres; inf where there are none."""
    lengths = [math.dist(pair.start[:2], pair.goal[:2]) for pair in goal_pairs(layout, protocol)]
    return min(lengths, default=math.inf)


def _rounded(x: float, y: float, z: float) -> tuple[float, float, float]:
    return round(x, 6), round(y, 6), round(z, 6)
