"""Control steps of many robots, as `labgym.envs.planar.simulation`, for Warp.

One thread steps one robot. Scenes differ in size, so a row of addresses stands for the arrays of a robot's scene.
"""

from __future__ import annotations

import math

from labgym.envs.gpu import wp
from labgym.envs.planar.contacts import CONTACTS, HALVINGS, ITERATIONS, TOLERANCE
from labgym.envs.planar.plan import CELL
from labgym.envs.planar.scene import RADIUS

MOST_CONTACTS = wp.constant(CONTACTS)
MOST_ITERATIONS = wp.constant(ITERATIONS)
MOST_HALVINGS = wp.constant(HALVINGS)
SMALLEST_CHANGE = wp.constant(wp.float64(TOLERANCE))
ZERO, HALF, ONE = wp.constant(wp.float64(0.0)), wp.constant(wp.float64(0.5)), wp.constant(wp.float64(1.0))
FAR = wp.constant(wp.float64(1e30))


@wp.struct
class DeviceRobot:
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


@wp.struct
class DeviceOutlines:
    """Outlines and barriers of the scene of a robot, as `labgym.envs.gpu.scene.DeviceScene`.

    Outline k has the sides from first[k] to first[k + 1] - 1 and touches a robot nearer than reach[k], meters.
    """

    sides: wp.array2d[wp.float64]
    first: wp.array[wp.int32]
    reach: wp.array[wp.float64]
    members: wp.array[wp.int32]


@wp.struct
class DeviceRobots:
    """Arrays of all robots.

    Attributes:
        targets: (n, 2) m/s and rad/s.
        addresses, sizes, plans: of the scenes, as `labgym.envs.gpu.scene.DeviceScene`.
        states: (n, 6) x, y, yaw and their rates in the room frame.
        contacts: (n, CONTACTS, 6) scratch memory.
        poses: (n, 3) yaw in (-pi, pi]. velocities: (n, 2) m/s and rad/s. driven: (n,) meters. touched: (n,) 0 or 1.
        clearances: (n,) meters.
    """

    targets: wp.array2d[wp.float64]
    addresses: wp.array2d[wp.uint64]
    sizes: wp.array2d[wp.int32]
    plans: wp.array2d[wp.float64]
    states: wp.array2d[wp.float64]
    contacts: wp.array3d[wp.float64]
    poses: wp.array2d[wp.float64]
    velocities: wp.array2d[wp.float64]
    driven: wp.array[wp.float64]
    touched: wp.array[wp.int32]
    clearances: wp.array[wp.float64]


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
def impedance(depth: wp.float64, body: DeviceRobot):
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
    scene: DeviceOutlines,
    body: DeviceRobot,
    contacts: wp.array2d[wp.float64],
):
    """Write the contacts of the robot to (n, 6) and return their number, at most n.

    Args:
        begin, end: the outlines within reach are the scene's `members` from `begin` to `end` - 1.
    """
    count = wp.int32(0)
    for place in range(begin, end):
        outline = scene.members[place]
        radius = scene.reach[outline]
        begins = scene.first[outline]
        ends = scene.first[outline + 1]
        distance, nx, ny = separation(position[0], position[1], radius, begins, ends, scene.sides)
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
    a: wp.vec3d, start: wp.vec3d, rate: wp.vec3d, body: DeviceRobot, count: wp.int32, contacts: wp.array2d[wp.float64]
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
def constrained(start: wp.vec3d, rate: wp.vec3d, body: DeviceRobot, count: wp.int32, contacts: wp.array2d[wp.float64]):
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


SIDE = wp.constant(wp.float64(CELL))
CHASSIS = wp.constant(wp.float64(RADIUS))
TWO, PI = wp.constant(wp.float64(2.0)), wp.constant(wp.float64(math.pi))
STRAIGHT = wp.constant(wp.float64(1e-6))
"""Half of the turn below which an arc is as long as its chord, radians."""


@wp.func
def servo(gain: wp.float64, limit: wp.float64, missing: wp.float64):
    """Return the force of a velocity servo and its decrease per velocity, which is 0 at the limit of the force."""
    force = wp.clamp(gain * missing, -limit, limit)
    return force, wp.where(wp.abs(force) >= limit, ZERO, gain)


@wp.func
def clearance(x: wp.float64, y: wp.float64, boxes: wp.array2d[wp.float64]):
    """Return the distance from the chassis at a point to the nearest barrier, meters; 0 if they overlap."""
    nearest = wp.float64(1e30)
    for k in range(boxes.shape[0]):
        dx = x - boxes[k, 0]
        dy = y - boxes[k, 1]
        cosine = boxes[k, 4]
        sine = boxes[k, 5]
        u = wp.max(wp.abs(cosine * dx + sine * dy) - boxes[k, 2], ZERO)
        v = wp.max(wp.abs(cosine * dy - sine * dx) - boxes[k, 3], ZERO)
        nearest = wp.min(nearest, u * u + v * v)
    return wp.max(wp.sqrt(nearest) - CHASSIS, ZERO)


@wp.kernel(enable_backward=False)
def drive(
    body: DeviceRobot,
    checks: wp.int32,
    steps: wp.int32,
    robots: DeviceRobots,
):
    """Advance each robot by one control step towards its target, and measure.

    Args:
        checks: contact checks of a control step. steps: physics steps between two of them.
    """
    robot = wp.tid()
    addresses = robots.addresses
    sizes = robots.sizes
    plans = robots.plans
    scene = DeviceOutlines()
    scene.sides = wp.array(ptr=addresses[robot, 0], shape=(sizes[robot, 0], 5), dtype=wp.float64)
    scene.first = wp.array(ptr=addresses[robot, 1], shape=(sizes[robot, 1],), dtype=wp.int32)
    scene.reach = wp.array(ptr=addresses[robot, 2], shape=(sizes[robot, 2],), dtype=wp.float64)
    cells = wp.array(ptr=addresses[robot, 3], shape=(sizes[robot, 3],), dtype=wp.int32)
    scene.members = wp.array(ptr=addresses[robot, 4], shape=(sizes[robot, 4],), dtype=wp.int32)
    boxes = wp.array(ptr=addresses[robot, 5], shape=(sizes[robot, 5], 6), dtype=wp.float64)
    columns = wp.int32(plans[robot, 2])
    rows = wp.int32(plans[robot, 3])
    v = wp.clamp(robots.targets[robot, 0], body.v_min, body.v_max)
    w = wp.clamp(robots.targets[robot, 1], -body.w_max, body.w_max)
    position = wp.vec3d(robots.states[robot, 0], robots.states[robot, 1], robots.states[robot, 2])
    rate = wp.vec3d(robots.states[robot, 3], robots.states[robot, 4], robots.states[robot, 5])
    h = body.timestep
    length = wp.float64(0.0)
    touches = wp.int32(0)
    for _check in range(checks):
        before = wp.vec3d(position[0], position[1], position[2])
        count = wp.int32(0)
        for _step in range(steps):
            cosine = wp.cos(position[2])
            sine = wp.sin(position[2])
            forward, forward_drag = servo(
                body.forward_gain, body.forward_limit, v - (cosine * rate[0] + sine * rate[1])
            )
            grip, grip_drag = servo(body.grip_gain, body.grip_limit, sine * rate[0] - cosine * rate[1])
            turn, turn_drag = servo(body.turn_gain, body.turn_limit, w - rate[2])
            count = 0
            column = wp.int32(wp.floor((position[0] - plans[robot, 0]) / SIDE))
            row = wp.int32(wp.floor((position[1] - plans[robot, 1]) / SIDE))
            if column >= 0 and column < columns and row >= 0 and row < rows:
                cell = row * columns + column
                begin = cells[cell]
                end = cells[cell + 1]
                if end > begin:
                    count = touching(position, rate, begin, end, scene, body, robots.contacts[robot])
            if count > 0:
                start = wp.vec3d(
                    (cosine * forward - sine * grip) / body.mass,
                    (sine * forward + cosine * grip) / body.mass,
                    turn / body.inertia,
                )
                change = constrained(start, rate, body, count, robots.contacts[robot]) - start
                forward += body.mass * (cosine * change[0] + sine * change[1])
                grip += body.mass * (cosine * change[1] - sine * change[0])
                turn += body.inertia * change[2]
            ahead = h * forward / (body.mass + h * forward_drag)
            aside = h * grip / (body.mass + h * grip_drag)
            about = h * turn / (body.inertia + h * turn_drag)
            rate = rate + wp.vec3d(cosine * ahead - sine * aside, sine * ahead + cosine * aside, about)
            position = position + h * rate
        if count > 0:
            touches = 1
        dx = position[0] - before[0]
        dy = position[1] - before[1]
        chord = wp.sqrt(dx * dx + dy * dy)
        half = (position[2] - before[2]) / TWO
        if wp.abs(half) < STRAIGHT:
            length += chord
        else:
            length += chord * half / wp.sin(half)
    for k in range(3):
        robots.states[robot, k] = position[k]
        robots.states[robot, 3 + k] = rate[k]
    robots.poses[robot, 0] = position[0]
    robots.poses[robot, 1] = position[1]
    turns = (PI - position[2]) / (TWO * PI)
    robots.poses[robot, 2] = PI - TWO * PI * (turns - wp.floor(turns))
    robots.velocities[robot, 0] = wp.cos(position[2]) * rate[0] + wp.sin(position[2]) * rate[1]
    robots.velocities[robot, 1] = rate[2]
    robots.driven[robot] = length
    robots.touched[robot] = touches
    robots.clearances[robot] = clearance(position[0], position[1], boxes)
