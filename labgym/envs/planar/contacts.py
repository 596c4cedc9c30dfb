"""Contacts of the robot with upright solids: which there are, and the forces that MuJoCo's soft constraints give.

A contact is a row of 6 numbers: the unit normal (x, y) from the solid to the robot, the distance of the surfaces
(negative), the distance of the contact point from the robot's axis, the regularization R and the reference
acceleration along the normal. MuJoCo finds two contact points for each solid, one above the other, which act alike:
`PlanarBody.points` counts them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.envs.planar.body import PlanarBody
from labgym.envs.planar.compiled import compiled
from labgym.envs.planar.plan import Cells, Outlines

Array = NDArray[np.float64]

CONTACTS = 16
"""Most solids that the robot touches at a time."""
ITERATIONS = 50
"""Most iterations of Newton's method; it takes 2 to 4."""
HALVINGS = 40
"""Most halvings of a step."""
TOLERANCE = 1e-10
"""Change of the acceleration, in m/s² and rad/s², at which the method stops."""


class ContactBuffers(NamedTuple):
    """Buffers of one thread.

    Attributes:
        contacts: (CONTACTS, 6). start, acceleration, trial, gradient: (3,). hessian: (3, 3).
    """

    contacts: Array
    start: Array
    acceleration: Array
    trial: Array
    gradient: Array
    hessian: Array


def buffers() -> ContactBuffers:
    """Return the buffers of a thread."""
    return ContactBuffers(np.zeros((CONTACTS, 6)), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros(3), np.zeros((3, 3)))


@compiled
def touching(state: Array, cell: int, body: PlanarBody, solids: Outlines, near: Cells, contacts: Array) -> int:
    """Write the contacts of the robot at a state to a buffer (n, 6) and return their number, at most n.

    Args:
        cell: number of the cell that the position is in.
    """
    count = 0
    for place in range(near.first[cell], near.first[cell + 1]):
        outline = near.members[place]
        reach = solids.reach[outline]
        distance, nx, ny = separation(state[0], state[1], reach, solids, outline)
        if distance < reach and count < len(contacts):
            contact = contacts[count]
            depth = reach - distance
            contact[0], contact[1], contact[2], contact[3] = nx, ny, -depth, reach - 0.5 * depth
            _soften(state, body, contact)
            count += 1
    return count


@compiled
def separation(x: float, y: float, limit: float, solids: Outlines, outline: int) -> tuple[float, float, float]:
    """Return the distance of a point from an outline, negative inside, and the unit normal that points away from it.

    At `limit` or more the distance is a lower bound only.
    """
    first, last = solids.first[outline], solids.first[outline + 1]
    side, largest = first, -math.inf
    for k in range(first, last):
        away = (x - solids.corners[k, 0]) * solids.normals[k, 0] + (y - solids.corners[k, 1]) * solids.normals[k, 1]
        if away > largest:
            side, largest = k, away
    nx, ny = solids.normals[side, 0], solids.normals[side, 1]
    if largest >= limit or largest <= 0.0:
        return largest, nx, ny
    nearest = math.inf
    for k in range(first, last):
        dx, dy = x - solids.corners[k, 0], y - solids.corners[k, 1]
        tx, ty = -solids.normals[k, 1], solids.normals[k, 0]
        along = min(max(dx * tx + dy * ty, 0.0), solids.lengths[k])
        dx, dy = dx - along * tx, dy - along * ty
        distance = math.sqrt(dx * dx + dy * dy)
        if distance < nearest:
            nearest, nx, ny = distance, dx / distance, dy / distance
    return nearest, nx, ny


@compiled
def _soften(state: Array, body: PlanarBody, contact: Array) -> None:
    """Write the regularization and the reference acceleration of a contact."""
    share = min(-contact[2] / body.width, 1.0)
    if share >= 1.0:
        impedance = body.deep
    else:
        if share <= body.midpoint:
            rise = share**body.power / body.midpoint ** (body.power - 1.0)
        else:
            rise = 1.0 - (1.0 - share) ** body.power / (1.0 - body.midpoint) ** (body.power - 1.0)
        impedance = body.shallow + rise * (body.deep - body.shallow)
    speed = contact[0] * state[3] + contact[1] * state[4]
    contact[4] = (1.0 - impedance) / impedance * body.mobility
    contact[5] = -body.damping * speed - body.stiffness * impedance * contact[2]


@compiled
def constrained(
    state: Array, fx: float, fy: float, torque: float, body: PlanarBody, count: int, work: ContactBuffers
) -> tuple[float, float, float]:
    """Return the force (x, y) and the torque of contacts, from the other forces and the torque on the robot.

    The acceleration a minimizes (a - a0)' M (a - a0) / 2 + sum of s(J a - r) over the contacts, where a0 is the
    acceleration without contacts, J the Jacobian of a contact, r its reference acceleration and s the cost of an
    elliptic friction cone (MuJoCo's manual, chapter "Computation", section "Constraint model"). Newton's method with
    halved steps finds it.

    Args:
        count: number of contacts in the buffers.
    """
    start, a, trial = work.start, work.acceleration, work.trial
    start[0], start[1], start[2] = fx / body.mass, fy / body.mass, torque / body.inertia
    for k in range(3):
        a[k] = start[k]
    cost = _cost(a, state, body, count, work)
    for _ in range(ITERATIONS):
        x, y, z = _solved(work.hessian, work.gradient)
        if abs(x) + abs(y) + abs(z) < TOLERANCE:
            break
        share = 1.0
        for _ in range(HALVINGS):
            trial[0], trial[1], trial[2] = a[0] - share * x, a[1] - share * y, a[2] - share * z
            lower = _cost(trial, state, body, count, work)
            if lower <= cost:
                break
            share *= 0.5
        cost = lower
        for k in range(3):
            a[k] = trial[k]
    return body.mass * (a[0] - start[0]), body.mass * (a[1] - start[1]), body.inertia * (a[2] - start[2])


@compiled
def _cost(a: Array, state: Array, body: PlanarBody, count: int, work: ContactBuffers) -> float:
    """Return the cost of an acceleration, and write its gradient (3,) and the lower half of its Hessian (3, 3)."""
    gradient, hessian, contacts, start = work.gradient, work.hessian, work.contacts, work.start
    mass, inertia, mu = body.mass, body.inertia, body.friction
    ax, ay, az = a[0], a[1], a[2]
    gx, gy, gz = mass * (ax - start[0]), mass * (ay - start[1]), inertia * (az - start[2])
    cost: float = 0.5 * gx * (ax - start[0]) + 0.5 * gy * (ay - start[1]) + 0.5 * gz * (az - start[2])
    hxx, hyx, hyy, hzx, hzy, hzz = mass, 0.0, mass, 0.0, 0.0, inertia
    for k in range(count):
        nx, ny, rho, weight = contacts[k, 0], contacts[k, 1], contacts[k, 3], body.points / contacts[k, 4]
        # The contact point moves along the tangent (-ny, nx) with -ny vx + nx vy - rho w.
        slip = -ny * state[3] + nx * state[4] - rho * state[5]
        normal = nx * ax + ny * ay - contacts[k, 5]
        along = -ny * ax + nx * ay - rho * az + body.damping * slip
        u, t = mu * normal, mu * abs(along)
        if u >= mu * t:  # it separates
            continue
        if mu * u + t <= 0.0:  # it sticks
            cost += 0.5 * weight * (normal * normal + along * along)
            gn, gt, hnn, hnt, htt = weight * normal, weight * along, weight, 0.0, weight
        else:  # it slides
            scale, beyond = weight / (mu * mu * (1.0 + mu * mu)), u - mu * t
            by_along = -mu * mu if along > 0.0 else mu * mu
            cost += 0.5 * scale * beyond * beyond
            gn, gt = scale * beyond * mu, scale * beyond * by_along
            hnn, hnt, htt = scale * mu * mu, scale * mu * by_along, scale * by_along * by_along
        # The normal moves with (nx, ny, 0), the tangent with (-ny, nx, -rho).
        gx += gn * nx + gt * -ny
        gy += gn * ny + gt * nx
        gz += gt * -rho
        hxx += hnn * nx * nx + hnt * (nx * -ny + -ny * nx) + htt * -ny * -ny
        hyx += hnn * ny * nx + hnt * (ny * -ny + nx * nx) + htt * nx * -ny
        hyy += hnn * ny * ny + hnt * (ny * nx + nx * ny) + htt * nx * nx
        hzx += hnt * (-rho * nx) + htt * -rho * -ny
        hzy += hnt * (-rho * ny) + htt * -rho * nx
        hzz += htt * -rho * -rho
    gradient[0], gradient[1], gradient[2] = gx, gy, gz
    hessian[0, 0], hessian[1, 0], hessian[1, 1] = hxx, hyx, hyy
    hessian[2, 0], hessian[2, 1], hessian[2, 2] = hzx, hzy, hzz
    return cost


@compiled
def _solved(matrix: Array, right: Array) -> tuple[float, float, float]:
    """Return the solution of a symmetric positive definite system of 3 equations, by Cholesky's method."""
    a = math.sqrt(matrix[0, 0])
    b, c = matrix[1, 0] / a, matrix[2, 0] / a
    d = math.sqrt(matrix[1, 1] - b * b)
    e = (matrix[2, 1] - c * b) / d
    f = math.sqrt(matrix[2, 2] - c * c - e * e)
    x = right[0] / a
    y = (right[1] - b * x) / d
    z = (right[2] - c * x - e * y) / f
    z = z / f
    y = (y - e * z) / d
    x = (x - b * y - c * z) / a
    return x, y, z
