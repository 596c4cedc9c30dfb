"""The velocities of a crowd compiled by numba, which the extra `fast` installs: those of `Walls` and `Orca`, sooner.

Every operation is that of `walls`, `orca` and `half_planes`, in the same order and without fast math. So the bits are
the same; the tests compare them.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry, inner

Array = NDArray[np.float64]
PARALLEL, ROUNDING = 1e-10, 1e-9
"""As in `half_planes`; here, because the machine code on disk is renewed when this file changes."""
SLACK = ROUNDING * 1e-3


@inner
def _away_from(wx: float, wy: float, radius: float, horizon: float) -> tuple[float, float, float]:
    """Return `orca.away_from`."""
    distance = math.sqrt(wx * wx + wy * wy)
    if distance == 0.0:
        return 1.0, 0.0, -math.inf
    gap = distance - radius
    if gap < 0.0:
        gap = 0.0
    return -wx / distance, -wy / distance, -gap / horizon


@inner
def _reciprocal(
    disc: Array, other: Array, radius: float, share: float, horizon: float, dt: float
) -> tuple[float, float, float]:
    """Return `orca.reciprocal`; discs are x, y, vx, vy, and `radius` is the sum of both radii."""
    px, py, vx, vy = other[0] - disc[0], other[1] - disc[1], disc[2] - other[2], disc[3] - other[3]
    square = px * px + py * py
    apart = square > radius * radius
    time = horizon if apart else dt
    wx, wy = vx - px / time, vy - py / time
    ahead = wx * px + wy * py
    size = wx * wx + wy * wy
    if not apart or (ahead < 0.0 and ahead * ahead > radius * radius * size):
        length = math.sqrt(size)
        if length > 0.0:
            nx, ny = wx / length, wy / length
        else:
            distance = math.sqrt(square)
            if distance > 0.0:
                nx, ny = -px / distance, -py / distance
            else:
                nx, ny = 1.0, 0.0
        return nx, ny, nx * disc[2] + ny * disc[3] + share * (radius / time - length)
    leg = math.sqrt(square - radius * radius)
    if px * wy - py * wx > 0.0:
        nx, ny = -(px * radius + py * leg) / square, (px * leg - py * radius) / square
    else:
        nx, ny = (-px * radius + py * leg) / square, -(px * leg + py * radius) / square
    return nx, ny, nx * disc[2] + ny * disc[3] - share * (nx * vx + ny * vy)


@inner
def _on_line(number: int, fastest: float, planes: Array) -> tuple[bool, float, float]:
    """Return whether there is the interval of `half_planes._on_line`, and the interval."""
    nx, ny, least = planes[number, 0], planes[number, 1], planes[number, 2]
    square = fastest * fastest - least * least
    if square < 0.0:
        return False, 0.0, 0.0
    high = math.sqrt(square)
    low = -high
    for k in range(number):
        x, y, other = planes[k, 0], planes[k, 1], planes[k, 2]
        slope, rest = y * nx - x * ny, other - least * (x * nx + y * ny)
        if abs(slope) <= PARALLEL:
            if rest > ROUNDING:
                return False, 0.0, 0.0
        elif slope > 0.0:
            if rest / slope > low:
                low = rest / slope
        elif rest / slope < high:
            high = rest / slope
        if low > high + ROUNDING:
            return False, 0.0, 0.0
    return True, low, high if high > low else low


@inner
def _nearest_velocity(px: float, py: float, fastest: float, planes: Array, count: int) -> tuple[float, float, int]:
    """Return `half_planes.nearest_velocity` for the first `count` planes."""
    speed = math.sqrt(px * px + py * py)
    if speed <= fastest:
        x, y = px, py
    else:
        x, y = px * fastest / speed, py * fastest / speed
    for number in range(count):
        nx, ny, least = planes[number, 0], planes[number, 1], planes[number, 2]
        if nx * x + ny * y < least - SLACK:
            permitted, low, high = _on_line(number, fastest, planes)
            if not permitted:
                return x, y, number
            along = px * -ny + py * nx
            if low > along:
                along = low
            if high < along:
                along = high
            x, y = least * nx - along * ny, least * ny + along * nx
    return x, y, count


@inner
def _least_forbidden(
    x: float, y: float, fastest: float, planes: Array, hard: int, count: int, first: int
) -> tuple[float, float]:
    """Return `half_planes.least_forbidden`: of `count` planes the first `hard` are hard; `first` is a soft one's."""
    violation = 0.0
    mixed = np.empty((count, 3))
    mixed[:hard] = planes[:hard]
    for number in range(first, count - hard):
        nx, ny, least = planes[hard + number, 0], planes[hard + number, 1], planes[hard + number, 2]
        if least - nx * x - ny * y <= violation + SLACK:
            continue
        size = hard
        for k in range(hard, hard + number):
            dx, dy = planes[k, 0] - nx, planes[k, 1] - ny
            length = math.sqrt(dx * dx + dy * dy)
            if length > PARALLEL:
                mixed[size, 0], mixed[size, 1] = dx / length, dy / length
                mixed[size, 2] = (planes[k, 2] - least) / length
                size += 1
        # `half_planes.fastest_velocity` along the plane's normal
        ax, ay, possible = nx * fastest, ny * fastest, True
        for k in range(size):
            mx, my, bound = mixed[k, 0], mixed[k, 1], mixed[k, 2]
            if mx * ax + my * ay < bound - SLACK:
                permitted, low, high = _on_line(k, fastest, mixed)
                if not permitted:
                    possible = False
                    break
                slope = ny * mx - nx * my
                along = high if slope > 0.0 else low
                ax, ay = bound * mx - along * my, bound * my + along * mx
        if possible:
            x, y = ax, ay
            violation = least - nx * x - ny * y
    return x, y


@inner
def _walls(
    x: float,
    y: float,
    reach: float,
    boxes: tuple[Array, Array, Array, Array],
    radius: float,
    horizon: float,
    planes: Array,
) -> int:
    """Write the planes of `Walls.near` at a point and return their number."""
    center, half, cosine, sine = boxes
    count = 0
    for k in range(len(cosine)):
        dx, dy = x - center[k, 0], y - center[k, 1]
        along, across = dx * cosine[k] + dy * sine[k], dy * cosine[k] - dx * sine[k]
        width, depth = half[k, 0], half[k, 1]
        along = along - (-width if along < -width else width if along > width else along)
        across = across - (-depth if across < -depth else depth if across > depth else across)
        if along * along + across * across < reach * reach:
            wx, wy = across * sine[k] - along * cosine[k], -along * sine[k] - across * cosine[k]
            planes[count] = _away_from(wx, wy, radius, horizon)
            count += 1
    return count


@entry
def velocities(
    discs: Array,
    preferred: Array,
    yields: NDArray[np.bool_],
    robot: tuple[float, float, float, float, float],
    rests: bool,
    still: bool,
    boxes: tuple[Array, Array, Array, Array],
    fastest: float,
    radius: float,
    gap: float,
    most: int,
    terms: tuple[float, float, float, float],
) -> Array:
    """Return the next velocities of people (n, 2), m/s.

    Args:
        discs: (n, 4) x, y, vx, vy, m and m/s. preferred: (n, 2) velocities alone, m/s.
        yields: (n,) who avoids the robot while it moves. robot: x, y, vx, vy, radius.
        rests: whether everybody avoids the robot. still: whether nobody may come near to it.
        boxes: centers (m, 2), halves (m, 2), cosines (m,) and sines (m,) of rectangles. fastest: m/s.
        radius: of people, meters. gap: least distance to a robot at rest, meters. most: number of neighbors that count.
        terms: horizon, horizon of walls, reach (as `Orca`), and dt, seconds and meters.
    """
    horizon, horizon_walls, reach, dt = terms
    people = len(discs)
    result = np.empty((people, 2))
    planes = np.empty((len(boxes[2]) + people + 2, 3))
    squares, order = np.empty(people + 1), np.empty(people + 1, dtype=np.int64)
    machine = np.array([robot[0], robot[1], robot[2], robot[3]])
    far = radius + fastest * horizon_walls
    for one in range(people):
        disc = discs[one]
        hard = _walls(disc[0], disc[1], far, boxes, radius, horizon_walls, planes)
        if still:
            planes[hard] = _away_from(robot[0] - disc[0], robot[1] - disc[1], radius + robot[4] + gap, dt)
            hard += 1
        near = 0
        for k in range(people + 1):
            if k == one or (k == people and not (rests or yields[one])):
                continue
            other = machine if k == people else discs[k]
            dx, dy = other[0] - disc[0], other[1] - disc[1]
            square = dx * dx + dy * dy
            if square < reach * reach:
                place = near
                while place > 0 and squares[place - 1] > square:
                    squares[place], order[place] = squares[place - 1], order[place - 1]
                    place -= 1
                squares[place], order[place] = square, k
                near += 1
        count = hard
        for place in range(min(near, most)):
            k = order[place]
            if k == people:
                planes[count] = _reciprocal(disc, machine, radius + robot[4], 1.0 if rests else 0.5, horizon, dt)
            else:
                planes[count] = _reciprocal(disc, discs[k], radius + radius, 0.5, horizon, dt)
            count += 1
        x, y, met = _nearest_velocity(preferred[one, 0], preferred[one, 1], fastest, planes, count)
        if met < hard:
            x, y = 0.0, 0.0
        elif met < count:
            x, y = _least_forbidden(x, y, fastest, planes, hard, count, met - hard)
        result[one, 0], result[one, 1] = x, y
    return result
