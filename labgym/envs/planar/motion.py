"""The motion of the robot in physics steps, as MuJoCo takes them: servos, soft contacts, integrator `implicitfast`.

The state is (6,): x, y and yaw in meters and radians, their rates in m/s and rad/s, all in the room frame.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from labgym.envs.planar.body import Body
from labgym.envs.planar.compiled import compiled
from labgym.envs.planar.contacts import Work, constrained, touching
from labgym.envs.planar.plan import CELL, Cells, Outlines

Array = NDArray[np.float64]


@compiled
def advance(state: Array, v: float, w: float, steps: int, body: Body, solids: Outlines, near: Cells, work: Work) -> int:
    """Advance a state by physics steps towards target velocities.

    With M the inertia, D the derivative of the servo forces by the velocities and h the step, the velocity changes by
    h (M - h D)^-1 f in each, where f are the forces of servos and contacts; then the position moves with the new
    velocity.

    Args:
        v, w: targets within the limits of the body, m/s and rad/s.
        steps: number of physics steps.
        work: buffers.

    Returns:
        the number of contacts at the position before the last step.
    """
    h, cell_first = body.timestep, near.first
    x, y, yaw, dx, dy, turning = state[0], state[1], state[2], state[3], state[4], state[5]
    count = 0
    for _ in range(steps):
        cosine, sine = math.cos(yaw), math.sin(yaw)
        forward, forward_drag = _servo(body.forward_gain, body.forward_limit, v - (cosine * dx + sine * dy))
        grip, grip_drag = _servo(body.grip_gain, body.grip_limit, sine * dx - cosine * dy)
        turn, turn_drag = _servo(body.turn_gain, body.turn_limit, w - turning)
        cell = cell_at(x, y, near)
        count = 0
        if cell >= 0 and cell_first[cell + 1] > cell_first[cell]:
            state[0], state[1], state[2], state[3], state[4], state[5] = x, y, yaw, dx, dy, turning
            count = touching(state, cell, body, solids, near, work.contacts)
        if count > 0:
            along_x, along_y = cosine * forward - sine * grip, sine * forward + cosine * grip
            fx, fy, torque = constrained(state, along_x, along_y, turn, body, count, work)
            forward, grip, turn = forward + cosine * fx + sine * fy, grip + cosine * fy - sine * fx, turn + torque
        ahead = h * forward / (body.mass + h * forward_drag)
        aside = h * grip / (body.mass + h * grip_drag)
        dx += cosine * ahead - sine * aside
        dy += sine * ahead + cosine * aside
        turning += h * turn / (body.inertia + h * turn_drag)
        x += h * dx
        y += h * dy
        yaw += h * turning
    state[0], state[1], state[2], state[3], state[4], state[5] = x, y, yaw, dx, dy, turning
    return count


@compiled
def cell_at(x: float, y: float, near: Cells) -> int:
    """Return the number of the cell at a point, -1 outside of the grid."""
    column, row = math.floor((x - near.corner[0]) / CELL), math.floor((y - near.corner[1]) / CELL)
    if not (0 <= column < near.shape[0] and 0 <= row < near.shape[1]):
        return -1
    return int(row) * int(near.shape[0]) + int(column)


@compiled
def _servo(gain: float, limit: float, missing: float) -> tuple[float, float]:
    """Return the force of a velocity servo and its decrease per velocity, which is 0 at the limit of the force."""
    force = gain * missing
    if force >= limit:
        return limit, 0.0
    if force <= -limit:
        return -limit, 0.0
    return force, gain
