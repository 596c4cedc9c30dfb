"""Free-standing benches: islands, double islands, benches back to back, and where they fit in the open."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from labgym.assets import Asset
from labgym.geometry import OrientedBox, rotate
from labgym.layouts.interiors.interior import Interior
from labgym.layouts.interiors.lattice import CELL, EPSILON
from labgym.layouts.interiors.standing import SIDE_GAP
from labgym.layouts.rules.thresholds import ONE_SIDED
from labgym.layouts.style import FurnitureRange, Style

STEP = 0.2
"""Spacing of the places that are tried along an oblique wall, meters."""

Pose = tuple[float, float, float]


@dataclass(frozen=True)
class Bench:
    """A bench of a block: its pose (x, y, yaw) in the block's frame, whose origin is the middle."""

    asset: Asset
    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class BenchBlock:
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


def island(asset: Asset, count: int = 1) -> BenchBlock:
    """Return one island, or several end to end."""
    pitch = asset.size.width + SIDE_GAP
    benches = tuple(Bench(asset, (k - (count - 1) / 2.0) * pitch, 0.0, 0.0) for k in range(count))
    return BenchBlock(benches, count * pitch - SIDE_GAP, asset.size.depth)


def back_to_back(asset: Asset) -> BenchBlock:
    """Return two wall benches with their backs together."""
    shift = (asset.size.depth + SIDE_GAP) / 2.0
    return BenchBlock(
        (Bench(asset, 0.0, shift, 0.0), Bench(asset, 0.0, -shift, math.pi)), asset.size.width, 4.0 * shift
    )


def blocks_of(
    kind: str, furniture: FurnitureRange, names: tuple[str, ...], benches: tuple[str, ...]
) -> list[BenchBlock]:
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
    room: Interior, block: BenchBlock, style: Style, oblique: bool, wanted: int, generator: np.random.Generator
) -> Pose | None:
    """Return the pose (x, y, yaw) of a block at a free place in the open; None if it fits nowhere.

    It is aligned with the blocks of the space, and the aisles on both of its sides are equally wide, now or when
    `wanted` blocks stand there.

    Args:
        oblique: whether it stands along an oblique wall, if the space has one.
        wanted: number of blocks like it that the space may still get.
    """
    if oblique and not all(segment.straight for segment in room.ground.segments):
        return _along_oblique(room, block, style, generator)
    for quarter in _quarters(room, generator):
        width, depth = (block.depth, block.width) if quarter else (block.width, block.depth)
        gaps = (style.aisle, style.neck) if quarter else (style.neck, style.aisle)
        half = np.array([width / 2.0, depth / 2.0])
        corners, clear = room.lattice.clearances(width, depth, gaps)
        aligned = _aligned(room, corners + half)
        if not aligned.any():
            continue
        uneven = _unevenness(clear, np.array([width, depth]), np.array(gaps), wanted)
        uneven += np.where(aligned, generator.uniform(0.0, CELL / 2.0, len(corners)), np.inf)
        x, y = _snapped(room, corners[int(np.argmin(uneven))] + half)
        return x, y, (math.pi / 2.0 if quarter else 0.0) + math.pi * int(generator.integers(2))
    return None


def _quarters(room: Interior, generator: np.random.Generator) -> list[int]:
    """The quarter turns that are tried: that of the blocks of the space, or both in a random order."""
    if room.blocks:
        return [int(abs(math.sin(room.blocks[0].yaw)) > 0.5)]
    return [int(quarter) for quarter in generator.permutation(2)]


def _aligned(room: Interior, middles: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which middles (n, 2) are in a row or a column with some island of the space, shape (n,); all without one.

    Benches back to back count where there is no island.
    """
    others = _islands(room) or room.blocks
    aligned = np.full(len(middles), not others)
    for other in others:
        aligned |= (np.abs(middles - (other.x, other.y)) <= CELL / 2.0 + EPSILON).any(axis=1)
    return aligned


def _islands(room: Interior) -> list[OrientedBox]:
    units = [unit for unit in room.units.values() if unit.stance == "island" and unit.depth >= ONE_SIDED]
    return [room.feet[unit.id] for unit in units]


def _snapped(room: Interior, middle: NDArray[np.float64]) -> tuple[float, float]:
    """A middle, moved exactly into the rows and columns of the islands of the space."""
    x, y = float(middle[0]), float(middle[1])
    for other in _islands(room) or room.blocks:
        x = other.x if abs(x - other.x) <= CELL / 2.0 + EPSILON else x
        y = other.y if abs(y - other.y) <= CELL / 2.0 + EPSILON else y
    return x, y


def _unevenness(
    clear: NDArray[np.float64], sides: NDArray[np.float64], gaps: NDArray[np.float64], wanted: int
) -> NDArray[np.float64]:
    """How far the clear widths around blocks are from those of equally spaced blocks, meters, shape (n,).

    Args:
        clear: widths (n, 4) before and behind the blocks along x, and along y. sides, gaps: of a block, along x and y.
        wanted: number of blocks; they fill the axis along which more fit first.
    """
    before, behind = clear[:, 0::2], clear[:, 1::2]
    spans = before + behind + sides
    most = np.maximum(np.floor((spans - gaps) / (sides + gaps) + EPSILON), 1.0)
    along = np.minimum(most.max(axis=1), wanted)
    across = np.minimum(most.min(axis=1), np.ceil(wanted / along))
    longer = most[:, 0] > most[:, 1]
    counts = np.where(longer[:, None], np.stack([along, across], axis=1), np.stack([across, along], axis=1))
    even = (spans - counts * sides) / (counts + 1.0)
    uneven = np.minimum(np.abs(before - even), np.abs(behind - even))
    return np.asarray(uneven.sum(axis=1), dtype=np.float64)


def _along_oblique(room: Interior, block: BenchBlock, style: Style, generator: np.random.Generator) -> Pose | None:
    """A pose parallel to an oblique wall, an aisle away from it."""
    gap = max(style.aisle, style.neck)
    boxes = [
        segment.box(float(along), gap + SIDE_GAP, block.width, block.depth)
        for segment in room.ground.segments
        if not segment.straight
        for along in np.arange(0.0, segment.length - block.width, STEP)
    ]
    free: NDArray[np.intp] = np.flatnonzero(room.standing.fit(boxes, gap=gap, wall_gap=gap))
    if not len(free):
        return None
    box = boxes[int(free[int(generator.integers(len(free)))])]
    return box.x, box.y, box.yaw


def _by_size(blocks: list[BenchBlock]) -> list[BenchBlock]:
    return sorted(blocks, key=lambda block: -block.width * block.depth)
