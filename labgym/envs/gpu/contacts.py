"""Contacts of a robot with upright solids, as `labgym.envs.planar.contacts`, for Warp.

A contact is a row of 6 numbers: the unit normal (x, y) from the solid to the robot, the distance of the surfaces
(negative), the distance of the contact point from the robot's axis, the regularization R and the reference
acceleration along the normal.
"""

from __future__ import annotations

from labgym.envs.gpu.backend import wp
from labgym.envs.planar.contacts import CONTACTS, HALVINGS, ITERATIONS, TOLERANCE

MOST_CONTACTS = wp.constant(CONTACTS)
MOST_ITERATIONS = wp.constant(ITERATIONS)
MOST_HALVINGS = wp.constant(HALVINGS)
SMALLEST_CHANGE = wp.constant(wp.float64(TOLERANCE))
ZERO, HALF, ONE = wp.constant(wp.float64(0.0)), wp.constant(wp.float64(0.5)), wp.constant(wp.float64(1.0))
FAR = wp.constant(wp.float64(1e30))


@wp.struct
class Robot:
    """Inertia, servos and contact of the robot; the fields of `labgym.envs.planar.contacts.Body`."""

    timestep: wp.float64
    mass: wp.float64
    inertia: wp.float64
    forward_gain: wp.float64
    grip_gain: wp.float64
    turn_gain: wp.float64
    forward_limit: wp.float64
    grip_limit: wp.float64
    turn_limit: wp.float64
    v_min: wp.float64
    v_max: wp.float64
    w_max: wp.float64
    friction: wp.float64
    stiffness: wp.float64
    damping: wp.float64
    shallow: wp.float64
    deep: wp.float64
    width: wp.float64
    midpoint: wp.float64
    power: wp.float64
    mobility: wp.float64
    points: wp.float64


@wp.func
def separation(
    x: wp.float64, y: wp.float64, limit: wp.float64, first: wp.int32, last: wp.int32, sides: wp.array2d[wp.float64]
):
    """Return the distance of a point from an outline, negative inside, and the unit normal that points away from it.

    At `limit` or more the distance is a lower bound only.

    Args:
        first, last: the outline's sides are those from `first` to `last` - 1.
        sides: (m, 5) first corner, outward unit normal and length of each side.
    """
    side = wp.int32(first)
    largest = wp.float64(-FAR)
    for k in range(first, last):
        away = (x - sides[k, 0]) * sides[k, 2] + (y - sides[k, 1]) * sides[k, 3]
        if away > largest:
            side = k
            largest = away
    nx = sides[side, 2]
    ny = sides[side, 3]
    if largest >= limit or largest <= ZERO:
        return largest, nx, ny
    nearest = wp.float64(FAR)
    for k in range(first, last):
        tx = -sides[k, 3]
        ty = sides[k, 2]
        dx = x - sides[k, 0]
        dy = y - sides[k, 1]
        along = wp.clamp(dx * tx + dy * ty, ZERO, sides[k, 4])
        dx = dx - along * tx
        dy = dy - along * ty
        distance = wp.sqrt(dx * dx + dy * dy)
        if distance < nearest:
            nearest = distance
            nx = dx / distance
            ny = dy / distance
    return nearest, nx, ny


@wp.func
def impedance(depth: wp.float64, body: Robot):
    """Return the impedance of a contact at a depth in meters."""
    share = depth / body.width
    rise = ONE - wp.pow(ONE - share, body.power) / wp.pow(ONE - body.midpoint, body.power - ONE)
    if share <= body.midpoint:
        rise = wp.pow(share, body.power) / wp.pow(body.midpoint, body.power - ONE)
    if share >= ONE:
        rise = wp.float64(ONE)
    return body.shallow + rise * (body.deep - body.shallow)


@wp.func
def touching(
    position: wp.vec3d,
    rate: wp.vec3d,
    begin: wp.int32,
    end: wp.int32,
    members: wp.array[wp.int32],
    first: wp.array[wp.int32],
    reach: wp.array[wp.float64],
    sides: wp.array2d[wp.float64],
    body: Robot,
    contacts: wp.array2d[wp.float64],
):
    """Write the contacts of the robot to (n, 6) and return their number, at most n.

    Args:
        begin, end: the outlines within reach are `members` from `begin` to `end` - 1.
    """
    count = wp.int32(0)
    for place in range(begin, end):
        outline = members[place]
        radius = reach[outline]
        distance, nx, ny = separation(position[0], position[1], radius, first[outline], first[outline + 1], sides)
        if distance < radius and count < MOST_CONTACTS:
            depth = radius - distance
            stiff = impedance(depth, body)
            speed = nx * rate[0] + ny * rate[1]
            contacts[count, 0] = nx
            contacts[count, 1] = ny
            contacts[count, 2] = -depth
            contacts[count, 3] = radius - HALF * depth
            contacts[count, 4] = (ONE - stiff) / stiff * body.mobility
            contacts[count, 5] = body.stiffness * stiff * depth - body.damping * speed
            count += 1
    return count


@wp.func
def cost_of(
    a: wp.vec3d, start: wp.vec3d, rate: wp.vec3d, body: Robot, count: wp.int32, contacts: wp.array2d[wp.float64]
):
    """Return the cost of an acceleration, its gradient and its Hessian; `labgym.envs.planar.contacts` defines it."""
    inertia = wp.vec3d(body.mass, body.mass, body.inertia)
    gradient = wp.cw_mul(inertia, a - start)
    cost = HALF * wp.dot(gradient, a - start)
    hessian = wp.diag(inertia)
    mu = body.friction
    for k in range(count):
        nx = contacts[k, 0]
        ny = contacts[k, 1]
        rho = contacts[k, 3]
        weight = body.points / contacts[k, 4]
        across = wp.vec3d(nx, ny, ZERO)
        tangent = wp.vec3d(-ny, nx, -rho)
        normal = wp.dot(across, a) - contacts[k, 5]
        along = wp.dot(tangent, a) + body.damping * wp.dot(tangent, rate)
        u = mu * normal
        t = mu * wp.abs(along)
        if u < mu * t:  # else it separates
            if mu * u + t <= ZERO:  # it sticks
                cost += HALF * weight * (normal * normal + along * along)
                gradient += weight * (normal * across + along * tangent)
                hessian += weight * (wp.outer(across, across) + wp.outer(tangent, tangent))
            else:  # it slides
                scale = weight / (mu * mu * (ONE + mu * mu))
                beyond = u - mu * t
                slope = mu * across - mu * mu * wp.sign(along) * tangent
                cost += HALF * scale * beyond * beyond
                gradient += scale * beyond * slope
                hessian += scale * wp.outer(slope, slope)
    return cost, gradient, hessian


@wp.func
def constrained(start: wp.vec3d, rate: wp.vec3d, body: Robot, count: wp.int32, contacts: wp.array2d[wp.float64]):
    """Return the acceleration (x, y, yaw) under contacts from that without, by Newton's method with halved steps."""
    a = wp.vec3d(start[0], start[1], start[2])
    cost, gradient, hessian = cost_of(a, start, rate, body, count, contacts)
    for _ in range(MOST_ITERATIONS):
        change = wp.inverse(hessian) * gradient
        if wp.abs(change[0]) + wp.abs(change[1]) + wp.abs(change[2]) < SMALLEST_CHANGE:
            break
        share = wp.float64(ONE)
        for _halving in range(MOST_HALVINGS):
            lower, gradient, hessian = cost_of(a - share * change, start, rate, body, count, contacts)
            if lower <= cost:
                break
            share *= HALF
        cost = lower
        a = a - share * change
    return a
