"""Checks that the walls, openings and spaces of a floor fit together, and that walls enclose the spaces."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from labgym.geometry import Array, BoxArray, OrientedBox, pairwise_penetration
from labgym.layouts.floor.doorways import Doorway
from labgym.layouts.floor.spaces import CONTACT, OUTSIDE, Space
from labgym.layouts.floor.walls import Wall

OVERLAP = 0.01
"""Depth by which spaces may reach into walls and into each other, meters."""
BLOCKED = 0.05
"""Depth by which walls and columns may reach into a doorway, meters."""
MAX_OPENINGS, MAX_RECTANGLES = 500, 512
"""Largest numbers of openings and of rectangles of all spaces of a floor."""


def check_counts(walls: Sequence[Wall], spaces: Sequence[Space], ids: Iterable[str]) -> None:
    """Check that ids are unique and that there are not too many parts.

    Raises:
        ValueError: names the id, or the number and its limit.
    """
    names: set[str] = set()
    for name in ids:
        if name in names:
            raise ValueError(f"the id {name!r} occurs twice among spaces, columns and keep-outs: rename one")
        names.add(name)
    openings, rectangles = sum(len(w.openings) for w in walls), sum(len(s.region) for s in spaces)
    for what, count, most in (("openings", openings, MAX_OPENINGS), ("rectangles", rectangles, MAX_RECTANGLES)):
        if count > most:
            raise ValueError(f"{count} {what} on one floor; at most {most} are allowed: split the floor")


def check_overlaps(spaces: Sequence[Space], walls: Sequence[OrientedBox]) -> None:
    """Check that spaces overlap neither each other nor walls by more than 1 cm.

    Raises:
        ValueError: names the two and the depth.
    """
    solid = BoxArray.of(walls)
    boxes = [BoxArray.of(space.boxes) for space in spaces]
    for index, (space, region) in enumerate(zip(spaces, boxes, strict=True)):
        for other in range(index + 1, len(spaces)):
            depth = float(pairwise_penetration(region, boxes[other]).max())
            if depth > OVERLAP:
                raise ValueError(
                    f"spaces {space.id!r} and {spaces[other].id!r} overlap by {depth:.2f} m, over {OVERLAP:g} m: "
                    "shrink a region"
                )
        depths = pairwise_penetration(region, solid).max(axis=0)
        if len(depths) and depths.max() > OVERLAP:
            raise ValueError(
                f"space {space.id!r} overlaps wall {depths.argmax()} by {depths.max():.2f} m, over {OVERLAP:g} m: "
                "end its region at the face of the wall"
            )


def check_doorways(doorways: Sequence[Doorway], walls: Sequence[OrientedBox], columns: Sequence[OrientedBox]) -> None:
    """Check that no other wall and no column stands in a doorway.

    Raises:
        ValueError: names the doorway and what blocks it.
    """
    if not doorways:
        return
    depths = pairwise_penetration(
        BoxArray.of([_hole(doorway) for doorway in doorways]), BoxArray.of([*walls, *columns])
    )
    depths[np.arange(len(doorways)), [doorway.wall for doorway in doorways]] = 0.0
    for way, solid in np.argwhere(depths > BLOCKED).tolist():
        doorway = doorways[way]
        what = f"wall {solid}" if solid < len(walls) else f"column {solid - len(walls)}"
        raise ValueError(f"{doorway.opening.label} of wall {doorway.wall} is blocked by {what}: move one of them")


def check_access(spaces: Sequence[Space], doorways: Sequence[Doorway]) -> None:
    """Check that every space has a door or a passage, and that doorways join it with an exit.

    Raises:
        ValueError: names the space.
    """
    for space in spaces:
        if not any(space.id in doorway.spaces for doorway in doorways):
            raise ValueError(f"space {space.id!r} has no door: add a door or a passage to one of its walls")
    if not any(doorway.exit for doorway in doorways):
        raise ValueError("the floor has no exit: add a door to the outside")
    reached = {OUTSIDE}
    for _ in spaces:
        for doorway in doorways:
            if not reached.isdisjoint(doorway.spaces):
                reached.update(doorway.spaces)
    for space in spaces:
        if space.id not in reached:
            raise ValueError(f"no way leads from an exit to space {space.id!r}: add a door or a passage")


def _hole(doorway: Doorway) -> OrientedBox:
    """Return the clear opening of a doorway as a box through its wall."""
    return OrientedBox(doorway.x, doorway.y, doorway.width, doorway.thickness, doorway.yaw, 0.0, doorway.opening.height)


REACH = 1.0
"""A wall belongs to the edge of a space if it is at most this far outside, meters: a region of rectangles leaves wedges
along an oblique wall."""
GAP = 0.10
"""Longest part of an edge without a wall, meters: the ends of the steps of a region along an oblique wall have none."""
THIN = 0.015
"""Two spaces that are nearer than this have no wall between them, meters."""


def check_enclosed(spaces: Sequence[Space], walls: Sequence[OrientedBox]) -> None:
    """Check that a wall lies outside every edge of every space, and between any two spaces.

    Raises:
        ValueError: names the space and the place of the gap.
    """
    wall_corners = BoxArray.of(walls).corners()
    regions = [BoxArray.of(space.boxes).corners() for space in spaces]
    for index, (space, region) in enumerate(zip(spaces, regions, strict=True)):
        start, end = region.reshape(-1, 2), np.roll(region, -1, axis=1).reshape(-1, 2)
        own = _spans(region, start, end, 2.0 * CONTACT)
        covered = np.concatenate([own, _spans(wall_corners, start, end, REACH)], axis=1)
        others = [other for k, other in enumerate(regions) if k != index]
        if others:
            touching = _spans(np.concatenate(others), start, end, THIN)
            _refuse(space, start, end, touching.reshape(len(start), -1, 2), "touches another space", SEPARATE)
        gaps = _gaps(covered, np.linalg.norm(end - start, axis=1))
        _refuse(space, start, end, gaps, f"has no wall within {REACH:g} m", "add a wall or move the edge of the region")


SEPARATE = "put a wall with a passage between them"


def _refuse(space: Space, start: Array, end: Array, spans: Array, problem: str, remedy: str) -> None:
    """Refuse the first edge, of which an interval (e, k, 2) of more than `GAP` has a problem."""
    lengths = np.linalg.norm(end - start, axis=1)
    low, high = np.maximum(spans[..., 0], 0.0), np.minimum(spans[..., 1], lengths[:, None])
    for edge, k in np.argwhere(high - low > GAP)[:1].tolist():
        middle = (low[edge, k] + high[edge, k]) / 2.0 / lengths[edge]
        x, y = (start[edge] + middle * (end[edge] - start[edge])).tolist()
        length = high[edge, k] - low[edge, k]
        raise ValueError(
            f"space {space.id!r} {problem} along {length:.2f} m of its edge near ({x:.2f}, {y:.2f}): {remedy}"
        )


def _spans(polygons: Array, start: Array, end: Array, reach: float) -> Array:
    """Return the intervals of edges before which convex polygons lie, between 1 mm and `reach` outside.

    Args:
        polygons: (n, 4, 2), counter-clockwise.
        start, end: (e, 2), edges of counter-clockwise polygons, whose outside is on the right.

    Returns:
        (e, n, 2): meters from the start of the edge; inf and -inf for a polygon that lies elsewhere.
    """
    along = (end - start) / np.linalg.norm(end - start, axis=1, keepdims=True)
    outward = np.column_stack([along[:, 1], -along[:, 0]])
    offset = polygons[None] - start[:, None, None]
    x, y = np.einsum("enkd,ed->enk", offset, along), np.einsum("enkd,ed->enk", offset, outward)
    next_x, next_y = np.roll(x, -1, axis=2), np.roll(y, -1, axis=2)
    candidates, valid = [x], [(y >= CONTACT) & (y <= reach)]
    for level in (CONTACT, reach):
        crosses = (y - level) * (next_y - level) < 0.0
        step = np.where(crosses, next_y - y, 1.0)
        candidates.append(x + (level - y) / step * (next_x - x))
        valid.append(crosses)
    at, possible = np.concatenate(candidates, axis=2), np.concatenate(valid, axis=2)
    low, high = np.where(possible, at, np.inf).min(axis=2), np.where(possible, at, -np.inf).max(axis=2)
    return np.stack([low, high], axis=2)


def _gaps(spans: Array, lengths: Array) -> Array:
    """Return the intervals of edges of lengths (e,) that intervals (e, n, 2) leave out, shape (e, n + 1, 2)."""
    low = np.clip(spans[..., 0], 0.0, lengths[:, None])
    order = np.argsort(low, axis=1)
    low = np.take_along_axis(low, order, axis=1)
    high = np.take_along_axis(np.maximum(spans[..., 1], 0.0), order, axis=1)
    edge = np.zeros((len(lengths), 1))
    covered = np.concatenate([edge, np.maximum.accumulate(high, axis=1)], axis=1)
    return np.stack([covered, np.concatenate([low, lengths[:, None]], axis=1)], axis=2)
