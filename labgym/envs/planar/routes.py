"""Exact lengths of shortest paths to a goal, as `labgym.navigation.LengthsTo`, compiled.

The length is the least one over all visible contacts, so it does not depend on the order in which they are tried.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.envs.distance_to_go import DistanceToGo, ExactDistanceToGo
from labgym.envs.planar.compiled import compiled, entry, floats, integers, points, row_of
from labgym.envs.planar.ground import PlanarGround, Routes, ground_of, routes_of
from labgym.envs.world import World

Array = NDArray[np.float64]
Index = NDArray[np.int64]

ARRAYS = len(PlanarGround._fields) + len(Routes._fields)
QUARTER = math.pi / 2.0
ON_QUARTER = math.sqrt(0.5) - 1e-9
"""Least component of a normal along the middle of its quarter."""
RESERVE = 1e-9
"""Reserve for rounding by which a bound must exceed a length to rule a contact out, meters."""


class CompiledDistanceToGo:
    """An `ExactDistanceToGo` whose lengths are compiled; they agree to rounding.

    Args:
        ground: of the layout. routes: to the goal.
    """

    reachable = True

    def __init__(self, ground: PlanarGround, routes: Routes) -> None:
        self.arrays = (*ground, *routes)
        self.ground, self.routes, self._hint = ground, routes, np.zeros(1, np.int64)

    def at(self, x: float, y: float) -> float:
        """Return the remaining driving distance from a point of the floor, meters."""
        return float(_length(x, y, self.ground, self.routes, self._hint))


def compiled_to_go(world: World, to_go: DistanceToGo) -> DistanceToGo:
    """Return driving distances whose exact lengths are compiled; others as they are."""
    if not isinstance(to_go, ExactDistanceToGo):
        return to_go
    ground: PlanarGround = world.derived("planar ground", lambda _: ground_of(world.paths))
    routes = routes_of(to_go.lengths)
    return to_go if routes is None else CompiledDistanceToGo(ground, routes)


class RouteLengths:
    """The remaining distances of many robots, each in its layout.

    Args:
        count: number of robots.

    Attributes:
        to_go: (n,) meters; NaN of robots without exact lengths.
    """

    def __init__(self, count: int) -> None:
        self.to_go = np.full(count, np.nan)
        self._rows = np.zeros((count, 2 * ARRAYS), dtype=np.int64)
        self._hints = np.zeros(count, dtype=np.int64)
        # The arrays that addresses point to must live as long as they are used.
        self._arrays: list[tuple[NDArray[np.generic], ...]] = [()] * count

    def place(self, robot: int, to_go: CompiledDistanceToGo | None, poses: Array) -> None:
        """Set the goal of a robot and measure its distance; poses (n, 3) are those of all robots."""
        self._arrays[robot] = () if to_go is None else to_go.arrays
        self._rows[robot] = 0 if to_go is None else row_of(to_go.arrays)
        self._hints[robot], self.to_go[robot] = 0, math.nan
        self.measure(robot, robot + 1, poses)

    def measure(self, first: int, last: int, poses: Array) -> None:
        """Measure the distances of the robots from `first` to `last` - 1 at their poses, (n, 3) of all robots."""
        _lengths(first, last, poses, self._rows, self._hints, self.to_go)


@entry
def _lengths(first: int, last: int, poses: Array, rows: Index, hints: Index, to_go: Array) -> None:
    for k in range(first, last):
        row = rows[k]
        if row[0] == 0:
            continue
        ground = PlanarGround(
            floats(row, 0),
            points(row, 1),
            points(row, 2),
            points(row, 3),
            points(row, 4),
            points(row, 5),
            points(row, 6),
            points(row, 7),
            points(row, 8),
            floats(row, 9),
            integers(row, 10),
            points(row, 11),
            points(row, 12),
            points(row, 13),
        )
        routes = Routes(
            floats(row, 14), integers(row, 15), floats(row, 16), floats(row, 17), points(row, 18), floats(row, 19)
        )
        to_go[k] = length_at(poses[k, 0], poses[k, 1], ground, routes, hints[k : k + 1])


@entry
def _length(x: float, y: float, ground: PlanarGround, routes: Routes, hint: Index) -> float:
    return length_at(x, y, ground, routes, hint)


@compiled
def length_at(x: float, y: float, ground: PlanarGround, routes: Routes, hint: Index) -> float:
    """Return the length from a point on the floor to the goal, meters.

    Args:
        hint: (1,) a corner that is tried first; the last one of the path found, afterwards. It changes the time alone.
    """
    px, py = x, y
    if not _free(x, y, ground):
        px, py = _nearest_free(x, y, ground)
    length = _from_free(px, py, ground, routes, hint)
    if length == math.inf:
        length = math.hypot(px - routes.goal[0], py - routes.goal[1])
        for k in range(len(routes.length)):
            length = min(length, math.hypot(routes.node[k, 0] - px, routes.node[k, 1] - py) + routes.length[k])
    return math.hypot(x - px, y - py) + length


@compiled
def _free(x: float, y: float, ground: PlanarGround) -> bool:
    """Whether the disc fits at a point on the floor."""
    tolerance, bounds = ground.limits[1], ground.bounds
    if x < bounds[0, 0] - tolerance or y < bounds[0, 1] - tolerance:
        return False
    if x > bounds[1, 0] + tolerance or y > bounds[1, 1] + tolerance:
        return False
    least = ground.limits[0] - tolerance
    for k in range(len(ground.half)):
        dx, dy = x - ground.center[k, 0], y - ground.center[k, 1]
        cosine, sine = ground.axis[k, 0], ground.axis[k, 1]
        u = max(abs(cosine * dx + sine * dy) - ground.half[k, 0], 0.0)
        v = max(abs(cosine * dy - sine * dx) - ground.half[k, 1], 0.0)
        if u < least and v < least and math.sqrt(u * u + v * v) < least:
            return False
    return True


@compiled
def _nearest_free(x: float, y: float, ground: PlanarGround) -> tuple[float, float]:
    """Return the point of the boundary of the free positions that is nearest to a point; itself without a boundary."""
    best, px, py = math.inf, x, y
    for k in range(len(ground.starts)):
        qx, qy = _on_side(x, y, k, ground)
        away = (qx - x) ** 2 + (qy - y) ** 2
        if away < best:
            best, px, py = away, qx, qy
    for k in range(len(ground.corner)):
        gap = _gap(x, y, k, ground)
        if gap > 0.0 and gap * gap >= best:
            continue
        for arc in range(ground.first[k], ground.first[k + 1]):
            qx, qy = _on_arc(x, y, k, arc, ground)
            away = (qx - x) ** 2 + (qy - y) ** 2
            if away < best:
                best, px, py = away, qx, qy
    return px, py


@compiled
def _on_side(x: float, y: float, side: int, ground: PlanarGround) -> tuple[float, float]:
    """Return the point of a straight side that is nearest to a point."""
    ax, ay = ground.starts[side, 0], ground.starts[side, 1]
    dx, dy = ground.ends[side, 0] - ax, ground.ends[side, 1] - ay
    along = ((x - ax) * dx + (y - ay) * dy) / max(dx * dx + dy * dy, 1e-300)
    along = min(max(along, 0.0), 1.0)
    return ax + along * dx, ay + along * dy


@compiled
def _gap(x: float, y: float, corner: int, ground: PlanarGround) -> float:
    """Return a lower bound of the distance from a point to the arcs around a corner."""
    dx, dy = x - ground.corner[corner, 0], y - ground.corner[corner, 1]
    bound: float = abs(math.sqrt(dx * dx + dy * dy) - ground.limits[0]) - RESERVE
    return bound


@compiled
def _on_arc(x: float, y: float, corner: int, arc: int, ground: PlanarGround) -> tuple[float, float]:
    """Return the point of an arc around a corner that is nearest to a point."""
    cx, cy, begin, radius = ground.corner[corner, 0], ground.corner[corner, 1], ground.begin[corner], ground.limits[0]
    middle = (ground.span[arc, 0] + ground.span[arc, 1]) / 2.0
    half = (ground.span[arc, 1] - ground.span[arc, 0]) / 2.0
    angle = (math.atan2(y - cy, x - cx) - begin - middle + math.pi) % (2.0 * math.pi) - math.pi
    angle = begin + middle + min(max(angle, -half), half)
    return cx + radius * math.cos(angle), cy + radius * math.sin(angle)


@compiled
def _from_free(x: float, y: float, ground: PlanarGround, routes: Routes, hint: Index) -> float:
    """Return the length from a free point; inf without a path."""
    if _joined(x, y, routes.goal[0], routes.goal[1], ground):
        return math.hypot(x - routes.goal[0], y - routes.goal[1])
    count = len(ground.corner)
    best, chosen = math.inf, 0
    if count == 0:
        return best
    guess = min(hint[0], count - 1)
    best = _through(x, y, guess, best, ground, routes)
    if best < math.inf:
        chosen = guess
    for corner in range(count):
        if corner != guess:
            through = _through(x, y, corner, best, ground, routes)
            if through < best:
                best, chosen = through, corner
    hint[0] = chosen
    return best


@compiled
def _through(x: float, y: float, corner: int, best: float, ground: PlanarGround, routes: Routes) -> float:
    """Return the least length over the contacts of the tangents at a corner, if it is below `best`; else `best`."""
    radius = ground.limits[0]
    cx, cy = ground.corner[corner, 0], ground.corner[corner, 1]
    dx, dy = x - cx, y - cy
    distance = math.sqrt(dx * dx + dy * dy)
    if distance < radius - 1e-7 or distance - radius + routes.least[corner] - RESERVE >= best:
        return best
    ux, uy = dx / distance, dy / distance
    along = min(radius / distance, 1.0)
    across = math.sqrt(1.0 - along * along)
    for side in (1.0, -1.0):
        nx, ny = along * ux - side * across * uy, along * uy + side * across * ux
        if nx * ground.middle[corner, 0] + ny * ground.middle[corner, 1] < ON_QUARTER:
            continue
        angle = math.atan2(ny, nx) - ground.begin[corner]
        turn = min(max((angle + 1.0) % (2.0 * math.pi) - 1.0, 0.0), QUARTER)
        rest = _along_arc(corner, turn, ground, routes)
        if rest >= best:
            continue
        qx, qy = cx + radius * nx, cy + radius * ny
        length = math.hypot(qx - x, qy - y) + rest
        if length < best and _joined(x, y, qx, qy, ground):
            best = length
    return best


@compiled
def _along_arc(corner: int, turn: float, ground: PlanarGround, routes: Routes) -> float:
    """Return the length from a place on a corner to the goal, along its arc to a neighbor; inf if no arc is there."""
    slack = ground.limits[2]
    for arc in range(ground.first[corner + 1] - 1, ground.first[corner] - 1, -1):
        if ground.span[arc, 0] > turn + slack:
            continue
        if turn > ground.span[arc, 1] + slack:
            return math.inf
        first, last = routes.first[arc], routes.first[arc + 1]
        low, high = first, last
        while low < high:
            middle = (low + high) // 2
            if routes.turn[middle] < turn:
                low = middle + 1
            else:
                high = middle
        least = math.inf
        if low > first:
            least = routes.length[low - 1] + ground.limits[0] * abs(turn - routes.turn[low - 1])
        if low < last:
            least = min(least, routes.length[low] + ground.limits[0] * abs(turn - routes.turn[low]))
        return least
    return math.inf


@compiled
def _joined(ax: float, ay: float, bx: float, by: float, ground: PlanarGround) -> bool:
    """Whether the disc fits along a segment whose ends are within the bounds."""
    radius = ground.limits[0] - ground.limits[1]
    low_x, high_x, low_y, high_y = (
        min(ax, bx) - radius,
        max(ax, bx) + radius,
        min(ay, by) - radius,
        max(ay, by) + radius,
    )
    for k in range(len(ground.half)):
        if ground.low[k, 0] > high_x or ground.high[k, 0] < low_x:
            continue
        if ground.low[k, 1] > high_y or ground.high[k, 1] < low_y:
            continue
        cosine, sine = ground.axis[k, 0], ground.axis[k, 1]
        dx, dy = ax - ground.center[k, 0], ay - ground.center[k, 1]
        ux, uy = cosine * dx + sine * dy, cosine * dy - sine * dx
        dx, dy = bx - ground.center[k, 0], by - ground.center[k, 1]
        vx, vy = cosine * dx + sine * dy, cosine * dy - sine * dx
        if _near(ux, uy, vx, vy, ground.half[k, 0], ground.half[k, 1], radius):
            return False
    return True


@compiled
def _near(ax: float, ay: float, bx: float, by: float, hx: float, hy: float, radius: float) -> bool:
    """Whether a segment comes nearer than a radius to a rectangle around the origin with half extents hx and hy."""
    if min(ax, bx) - hx >= radius or -max(ax, bx) - hx >= radius:
        return False
    if min(ay, by) - hy >= radius or -max(ay, by) - hy >= radius:
        return False
    dx, dy = bx - ax, by - ay
    squared = max(dx * dx + dy * dy, 1e-300)
    # The line's distance from the rectangle along its normal.
    if abs(ax * dy - ay * dx) - hx * abs(dy) - hy * abs(dx) >= (radius + RESERVE) * math.sqrt(squared):
        return False
    limit = radius * radius
    u, v = max(abs(ax) - hx, 0.0), max(abs(ay) - hy, 0.0)
    if u * u + v * v < limit:
        return True
    u, v = max(abs(bx) - hx, 0.0), max(abs(by) - hy, 0.0)
    if u * u + v * v < limit:
        return True
    for corner in range(4):
        ox = (hx if corner % 3 else -hx) - ax
        oy = (hy if corner >= 2 else -hy) - ay
        share = min(max((ox * dx + oy * dy) / squared, 0.0), 1.0)
        ox, oy = ox - share * dx, oy - share * dy
        if ox * ox + oy * oy < limit:
            return True
    return _crosses(ax, ay, dx, dy, hx, hy)


@compiled
def _crosses(ax: float, ay: float, dx: float, dy: float, hx: float, hy: float) -> bool:
    """Whether a segment crosses a rectangle around the origin."""
    dx = dx if abs(dx) >= 1e-300 else 1e-300
    dy = dy if abs(dy) >= 1e-300 else 1e-300
    first, second = (-hx - ax) / dx, (hx - ax) / dx
    enter, leave = min(first, second), max(first, second)
    first, second = (-hy - ay) / dy, (hy - ay) / dy
    enter, leave = max(enter, min(first, second)), min(leave, max(first, second))
    return max(enter, 0.0) <= min(leave, 1.0)
