"""Optimal reciprocal collision avoidance (ORCA): what each of several discs may do so that none touches another.

Van den Berg, Guy, Lin and Manocha, "Reciprocal n-body collision avoidance", Robotics Research 2011, sections 4 and 5.
Each disc names the neighbors that it avoids: half of the people in a laboratory do not see the robot. `pyrvo` has no
visibility by agent, computes in single precision, and requires `ir-sim`; the tests compare trajectories with it.

A half-plane (x, y, least) permits the velocities v with (x, y) . v >= least, where (x, y) is a unit vector. Everything
is plain arithmetic in double precision and in a fixed order, so equal arguments give equal bits.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.machine_code import entry, inner

Array = NDArray[np.float64]
Vector = tuple[float, float]

PARALLEL = 1e-10
"""Lines whose directions differ by less than this sine count as parallel."""
ROUNDING = 1e-9
"""Excess over a half-plane that counts as rounding, m/s."""
SLACK = ROUNDING * 1e-3


class Disc(NamedTuple):
    """A disc that moves.

    Attributes:
        x, y: center, meters. vx, vy: velocity, m/s. radius: meters.
    """

    x: float
    y: float
    vx: float
    vy: float
    radius: float


class OrcaRobot(NamedTuple):
    """The robot, as people see it.

    Attributes:
        x, y: center, meters. vx, vy: velocity, m/s. radius: meters.
        share: part of the avoidance that people take over. still: whether nobody may come near to it.
    """

    x: float
    y: float
    vx: float
    vy: float
    radius: float
    share: float
    still: bool


class Avoidance(NamedTuple):
    """The parameters of ORCA.

    Attributes:
        radius: of a person, meters. gap: least distance to a robot that is still, meters.
        horizon: time for which velocities keep discs apart, seconds.
        horizon_walls: time for which they keep discs off obstacles, seconds.
        reach: neighbors farther than this are ignored, meters.
        dt: duration of a step, seconds; discs that overlap separate within it.
        neighbors: number of the nearest neighbors that count.
    """

    radius: float
    gap: float
    horizon: float = 2.0
    horizon_walls: float = 0.5
    reach: float = 5.0
    dt: float = 0.1
    neighbors: int = 10


@inner
def away_from(wx: float, wy: float, radius: float, horizon: float) -> tuple[float, float, float]:
    """Return the velocities that keep a disc off a convex obstacle for a time; rest is among them (section 5.4).

    The half-plane touches the velocity obstacle where it is nearest to rest: the speed towards the obstacle's nearest
    point is at most the gap over the horizon. No velocity of the half-plane reaches the obstacle, since the line
    through that point separates all of it from the disc.

    Args:
        wx, wy: from the disc's center to the nearest point of the obstacle, meters.
        radius: of the disc, meters. horizon: seconds.
    """
    distance = math.sqrt(wx * wx + wy * wy)
    if distance == 0.0:
        return 1.0, 0.0, -math.inf
    gap = distance - radius
    if gap < 0.0:
        gap = 0.0
    return -wx / distance, -wy / distance, -gap / horizon


@inner
def reciprocal(
    disc: Array, other: Array, radius: float, share: float, horizon: float, dt: float
) -> tuple[float, float, float]:
    """Return the velocities of a disc by which it does its share to stay clear of another one.

    Let u be the smallest change of the relative velocity that takes it to the boundary of the velocity obstacle, a cone
    cut off by a disc, and n the outward normal there. The half-plane is n . (v - (v_disc + share u)) >= 0.

    Args:
        disc, other: (4,) x, y, vx, vy. radius: sum of both radii, meters.
        share: part of the avoidance that the disc takes over: 1/2 if the other one does the same, 1 if it does nothing.
        horizon: time without contact, seconds. dt: time in which discs that overlap separate, seconds.
    """
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
    # The legs of the cone are the tangents of the disc around the relative position.
    leg = math.sqrt(square - radius * radius)
    if px * wy - py * wx > 0.0:
        nx, ny = -(px * radius + py * leg) / square, (px * leg - py * radius) / square
    else:
        nx, ny = (-px * radius + py * leg) / square, -(px * leg + py * radius) / square
    return nx, ny, nx * disc[2] + ny * disc[3] - share * (nx * vx + ny * vy)


@inner
def _on_line(number: int, fastest: float, planes: Array) -> tuple[bool, float, float]:
    """Return whether the earlier half-planes and the greatest speed permit a part of a half-plane's line, and the part.

    Places on the line are the distances along (-y, x) from the point nearest to rest.
    """
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
def nearest_velocity(px: float, py: float, fastest: float, planes: Array, count: int) -> tuple[float, float, int]:
    """Return the velocity nearest to a preferred one that the first `count` half-planes permit, and their number.

    If none does, return one that the first k permit, and k, the greatest such number.

    Args:
        px, py: the preferred velocity, m/s. fastest: greatest speed, m/s. planes: in the order in which they are added.
    """
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
def fastest_velocity(tx: float, ty: float, fastest: float, planes: Array, count: int) -> tuple[bool, float, float]:
    """Return whether the first `count` half-planes permit a velocity, and the one that is the greatest along (tx, ty).

    Args:
        tx, ty: unit vector. fastest: greatest speed, m/s.
    """
    x, y = tx * fastest, ty * fastest
    for k in range(count):
        nx, ny, least = planes[k, 0], planes[k, 1], planes[k, 2]
        if nx * x + ny * y < least - SLACK:
            permitted, low, high = _on_line(k, fastest, planes)
            if not permitted:
                return False, x, y
            slope = ty * nx - tx * ny
            along = high if slope > 0.0 else low
            x, y = least * nx - along * ny, least * ny + along * nx
    return True, x, y


@inner
def least_forbidden(
    x: float, y: float, fastest: float, planes: Array, hard: int, count: int, first: int
) -> tuple[float, float]:
    """Return a velocity that hard half-planes permit and whose greatest violation of a soft one is least.

    The violation t is a third coordinate of the program: with soft half-plane i added, the least t is on its plane
    t = least_i - n_i . v, where the earlier ones become half-planes of v again.

    Args:
        x, y: a velocity that the hard half-planes and the first soft ones permit. fastest: greatest speed, m/s.
        planes: of which the first `hard` are hard, up to `count`. first: number of soft ones that permit the velocity.
    """
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
        possible, ax, ay = fastest_velocity(nx, ny, fastest, mixed, size)
        if possible:  # else by rounding alone: the velocity so far is as good
            x, y = ax, ay
            violation = least - nx * x - ny * y
    return x, y


@inner
def permitted_velocity(
    px: float, py: float, fastest: float, planes: Array, hard: int, count: int
) -> tuple[float, float]:
    """Return the velocity nearest to a preferred one that all half-planes permit, m/s.

    If none does, it is one that the hard half-planes permit and whose greatest violation of a soft one is least
    (sections 5.2 and 5.3).

    Args:
        px, py: m/s. fastest: greatest speed, m/s.
        planes: of which the first `hard` are hard and permit rest, up to `count`.
    """
    x, y, met = nearest_velocity(px, py, fastest, planes, count)
    if met < hard:  # by rounding alone: all hard half-planes permit rest
        return 0.0, 0.0
    if met < count:
        return least_forbidden(x, y, fastest, planes, hard, count, met - hard)
    return x, y


@inner
def _toward(
    x: float, y: float, boxes: tuple[Array, Array, Array, Array], k: int, reach: float
) -> tuple[bool, float, float]:
    """Return whether rectangle k is within reach of a point, and the vector to its nearest point, meters."""
    center, half, cosine, sine = boxes
    dx, dy = x - center[k, 0], y - center[k, 1]
    along, across = dx * cosine[k] + dy * sine[k], dy * cosine[k] - dx * sine[k]
    width, depth = half[k, 0], half[k, 1]
    along = along - (-width if along < -width else width if along > width else along)
    across = across - (-depth if across < -depth else depth if across > depth else across)
    near = along * along + across * across < reach * reach
    return near, across * sine[k] - along * cosine[k], -along * sine[k] - across * cosine[k]


@entry
def nearest_walls(discs: Array, boxes: tuple[Array, Array, Array, Array], fastest: float, rules: Avoidance) -> Array:
    """Return the vectors from people to the nearest point of a rectangle (n, 2), meters; inf without one in reach.

    Args:
        discs, boxes, fastest, rules: as of `velocities`.
    """
    result = np.full((len(discs), 2), np.inf)
    reach = rules.radius + fastest * rules.horizon_walls
    for one in range(len(discs)):
        least = np.inf
        for k in range(len(boxes[2])):
            near, wx, wy = _toward(discs[one, 0], discs[one, 1], boxes, k, reach)
            if near and wx * wx + wy * wy < least:
                least = wx * wx + wy * wy
                result[one, 0], result[one, 1] = wx, wy
    return result


@inner
def _walls(
    disc: Array,
    robot: OrcaRobot,
    fastest: float,
    boxes: tuple[Array, Array, Array, Array],
    rules: Avoidance,
    planes: Array,
) -> int:
    """Write the half-planes of the rectangles within reach of a disc and of a robot at rest; return their number."""
    reach, count = rules.radius + fastest * rules.horizon_walls, 0
    for k in range(len(boxes[2])):
        near, wx, wy = _toward(disc[0], disc[1], boxes, k, reach)
        if near:
            planes[count] = away_from(wx, wy, rules.radius, rules.horizon_walls)
            count += 1
    if robot.still:
        apart = rules.radius + robot.radius + rules.gap
        planes[count] = away_from(robot.x - disc[0], robot.y - disc[1], apart, rules.dt)
        count += 1
    return count


@entry
def off_walls(
    discs: Array,
    wanted: Array,
    robot: OrcaRobot,
    boxes: tuple[Array, Array, Array, Array],
    fastest: float,
    rules: Avoidance,
) -> Array:
    """Return the velocities (n, 2) nearest to wanted ones by which people enter no rectangle and no robot at rest, m/s.

    Args:
        discs, robot, boxes, fastest, rules: as of `velocities`. wanted: (n, 2) m/s.
    """
    result = np.empty((len(discs), 2))
    planes = np.empty((len(boxes[2]) + 1, 3))
    for one in range(len(discs)):
        count = _walls(discs[one], robot, fastest, boxes, rules, planes)
        result[one] = permitted_velocity(wanted[one, 0], wanted[one, 1], fastest, planes, count, count)
    return result


@entry
def velocities(
    discs: Array,
    preferred: Array,
    avoids: NDArray[np.bool_],
    robot: OrcaRobot,
    boxes: tuple[Array, Array, Array, Array],
    fastest: float,
    rules: Avoidance,
) -> Array:
    """Return the next velocities of people (n, 2), m/s.

    Args:
        discs: (n, 4) x, y, vx, vy, m and m/s. preferred: (n, 2) velocities alone, m/s.
        avoids: (n,) who avoids the robot. robot: where it is.
        boxes: centers (m, 2), halves (m, 2), cosines (m,) and sines (m,) of rectangles. fastest: m/s.
        rules: the parameters.
    """
    people = len(discs)
    result = np.empty((people, 2))
    planes = np.empty((len(boxes[2]) + people + 2, 3))
    squares, order = np.empty(people + 1), np.empty(people + 1, dtype=np.int64)
    machine = np.array([robot.x, robot.y, robot.vx, robot.vy])
    for one in range(people):
        disc = discs[one]
        hard = _walls(disc, robot, fastest, boxes, rules, planes)
        near = 0
        for k in range(people + 1):
            if k == one or (k == people and not avoids[one]):
                continue
            other = machine if k == people else discs[k]
            dx, dy = other[0] - disc[0], other[1] - disc[1]
            square = dx * dx + dy * dy
            if square < rules.reach * rules.reach:
                place = near
                while place > 0 and squares[place - 1] > square:
                    squares[place], order[place] = squares[place - 1], order[place - 1]
                    place -= 1
                squares[place], order[place] = square, k
                near += 1
        count = hard
        for place in range(min(near, rules.neighbors)):
            k = order[place]
            if k == people:
                planes[count] = reciprocal(
                    disc, machine, rules.radius + robot.radius, robot.share, rules.horizon, rules.dt
                )
            else:
                planes[count] = reciprocal(disc, discs[k], rules.radius + rules.radius, 0.5, rules.horizon, rules.dt)
            count += 1
        result[one] = permitted_velocity(preferred[one, 0], preferred[one, 1], fastest, planes, hard, count)
    return result
