"""Free-standing benches: islands, double islands, benches back to back, and where they fit in the open."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from labgym.assets import Asset
from labgym.geometry import OrientedBox, rotate
from labgym.layouts.interiors.interior import Interior
from labgym.layouts.interiors.standing import SIDE_GAP
from labgym.layouts.style import Style
from labgym.layouts.variants import Furniture

TRIES = 120
"""Random poses tried for an oblique block."""


@dataclass(frozen=True)
class Bench:
    """A bench of a block: its pose (x, y, yaw) in the block's frame, whose origin is the middle."""

    asset: Asset
    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class Block:
    """Benches that stand together: sides in meters, worked at along the width."""

    benches: tuple[Bench, ...]
    width: float
    depth: float

    def feet(self, x: float, y: float, yaw: float) -> list[OrientedBox]:
        """Return the footprints of the benches if the block's middle and orientation are (x, y, yaw)."""
        feet = []
        for bench in self.benches:
            dx, dy = rotate(bench.x, bench.y, yaw)
            feet.append(OrientedBox(x + dx, y + dy, bench.asset.size.width, bench.asset.size.depth, yaw + bench.yaw))
        return feet


def island(asset: Asset, count: int = 1) -> Block:
    """Return one island, or several end to end."""
    pitch = asset.size.width + SIDE_GAP
    benches = tuple(Bench(asset, (k - (count - 1) / 2.0) * pitch, 0.0, 0.0) for k in range(count))
    return Block(benches, count * pitch - SIDE_GAP, asset.size.depth)


def back_to_back(asset: Asset) -> Block:
    """Return two wall benches with their backs together."""
    shift = (asset.size.depth + SIDE_GAP) / 2.0
    return Block((Bench(asset, 0.0, shift, 0.0), Bench(asset, 0.0, -shift, math.pi)), asset.size.width, 4.0 * shift)


def blocks_of(kind: str, furniture: Furniture, names: tuple[str, ...], benches: tuple[str, ...]) -> list[Block]:
    """Return the blocks of a kind, largest first.

    Args:
        kind: island, double_island or oblique.
        furniture: source of the assets.
        names: free-standing benches. benches: wall benches that may stand back to back.
    """
    islands = [furniture.get(name) for name in names]
    if kind == "double_island":
        return _by_size([island(asset, 2) for asset in islands])
    pairs = [back_to_back(furniture.get(name)) for name in benches]
    return _by_size([*(island(asset) for asset in islands), *(pairs if kind == "oblique" else [])])


def place_block(
    room: Interior, block: Block, style: Style, oblique: bool, generator: np.random.Generator
) -> list[OrientedBox] | None:
    """Return footprints of a block's benches at a free place in the open; None if it fits nowhere."""
    if oblique and style.oblique > 0.0:
        return _oblique(room, block, style, generator)
    for quarter in generator.permutation(2):
        turned = bool(quarter)
        width, depth = (block.depth, block.width) if turned else (block.width, block.depth)
        gaps = (style.aisle, style.neck) if turned else (style.neck, style.aisle)
        corners = room.lattice.corners(width, depth, gaps)
        if not len(corners):
            continue
        if generator.random() < style.tight:
            angle = generator.uniform(0.0, 2.0 * math.pi)
            index = int(np.argmax(corners @ (math.cos(angle), math.sin(angle))))
        else:
            index = int(generator.integers(len(corners)))
        yaw = (math.pi / 2.0 if turned else 0.0) + math.pi * int(generator.integers(2))
        x, y = corners[index]
        return block.feet(float(x) + width / 2.0, float(y) + depth / 2.0, yaw)
    return None


def _oblique(room: Interior, block: Block, style: Style, generator: np.random.Generator) -> list[OrientedBox] | None:
    ground = room.ground
    xs, ys = generator.uniform(0.0, ground.width, TRIES), generator.uniform(0.0, ground.depth, TRIES)
    turns = generator.choice((-1.0, 1.0), TRIES) * style.oblique + generator.integers(4, size=TRIES) * math.pi / 2.0
    boxes = [
        OrientedBox(float(x), float(y), block.width, block.depth, float(yaw))
        for x, y, yaw in zip(xs, ys, turns, strict=True)
    ]
    gap = max(style.aisle, style.neck)
    for box, free in zip(boxes, room.standing.fit(boxes, gap=gap, wall_gap=gap), strict=True):
        if free:
            return block.feet(box.x, box.y, box.yaw)
    return None


def _by_size(blocks: list[Block]) -> list[Block]:
    return sorted(blocks, key=lambda block: -block.width * block.depth)
