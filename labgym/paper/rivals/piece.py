"""Objects of a rival's scene, the layout that they make, and the random numbers of a request."""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from labgym.assets import Asset
from labgym.geometry import OrientedBox, wrap_angle
from labgym.layouts.model import Layout
from labgym.layouts.placement import FLOOR, Placement
from labgym.layouts.records import Provenance
from labgym.layouts.request import Request
from labgym.paper.rivals.chamber import Chamber, Pose


@dataclass(frozen=True)
class RivalPiece:
    """An object: its asset, and its pose in the frame of the space.

    Attributes:
        x, y, z: center of its bottom face, meters. yaw: radians.
        support: "floor", "wall" or the id of the piece that carries it. slot: index of that piece's surface.
    """

    id: str
    asset: Asset
    x: float
    y: float
    yaw: float
    z: float = 0.0
    support: str = FLOOR
    slot: int | None = None

    @property
    def box(self) -> OrientedBox:
        """Its bounding box in the frame of the space."""
        size = self.asset.size
        return OrientedBox(self.x, self.y, size.width, size.depth, self.yaw, self.z, self.z + size.height)

    def surface(self, slot: int) -> OrientedBox:
        """Return one of its surfaces as a box without height in the frame of the space."""
        surface = self.asset.surfaces[slot]
        x, y = self.box.to_world(surface.x, surface.y)
        height = self.z + surface.z
        return OrientedBox(x, y, surface.width, surface.depth, self.yaw, height, height)


def named(counts: Counter[str], asset: Asset) -> str:
    """Return the next free id of an asset and count it: LabBench_1, LabBench_2."""
    counts[asset.name] += 1
    return f"{asset.name}_{counts[asset.name]}"


def layout_of(
    request: Request, rooms: Sequence[tuple[Chamber, Sequence[RivalPiece]]], generator: str, options: Mapping[str, Any]
) -> Layout:
    """Return the layout that the pieces of some spaces make, with the fixed objects of the request.

    Args:
        rooms: each space with its pieces, whose ids are unique.
        generator: name of the rival. options: facts for the layout's provenance.
    """
    placements = [*request.fixed]
    for chamber, pieces in rooms:
        placements += [_placement(chamber, piece) for piece in pieces]
    return Layout(
        id=f"{request.protocol.id}-{request.floor.name}-{generator.replace('+', '-plus')}-{request.seed}"[:80],
        protocols=request.protocols,
        floor=request.floor,
        placements=tuple(placements),
        catalog=request.catalog,
        provenance=Provenance(generator=generator, seed=request.seed, options=dict(options)),
    )


def _placement(chamber: Chamber, piece: RivalPiece) -> Placement:
    pose: Pose = (piece.x, piece.y, piece.yaw)
    x, y, yaw = chamber.ground.to_floor(pose)
    return Placement(
        id=piece.id,
        asset=piece.asset.name,
        position=(round(x, 6), round(y, 6), round(piece.z, 6)),
        yaw=round(wrap_angle(yaw), 9),
        support=piece.support,
        slot=piece.slot,
    )


def quarter(turns: int) -> float:
    """Return the yaw of a number of quarter turns, in (-pi, pi]."""
    return wrap_angle(turns * math.pi / 2.0)


def generator_of(request: Request, stream: int) -> np.random.Generator:
    """Return the random generator of a request's seed, its protocol and a sub-stream."""
    entropy = int.from_bytes(hashlib.sha256(request.protocol.id.encode()).digest()[:8], "big")
    return np.random.default_rng([request.seed, entropy, stream])


def numbers_in_use(request: Request) -> Counter[str]:
    """Return the greatest number in the ids of fixed objects, by asset: LabBench_2 uses the numbers up to 2."""
    counts: Counter[str] = Counter()
    for placement in request.fixed:
        name, _, number = placement.id.rpartition("_")
        if number.isdecimal():
            counts[name] = max(counts[name], int(number))
    return counts
