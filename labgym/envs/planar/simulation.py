"""The motion and the physics of one robot by the planar kernel; the interface of `labgym.envs.simulation`.

Physics steps are those of MuJoCo: servos, soft contacts, integrator `implicitfast`. The state is (6,): x, y and yaw in
meters and radians, their rates in m/s and rad/s, all in the room frame.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from labgym.envs.conditions.cast import RADIUS
from labgym.envs.conditions.passing import TICK, Company, moves, pass_by, rested
from labgym.envs.planar.body import PlanarBody
from labgym.envs.planar.compiled import compiled, entry
from labgym.envs.planar.contacts import ContactBuffers, buffers, constrained, touching
from labgym.envs.planar.plan import CELL, Cells, Index, Outlines, PlanarPlan
from labgym.envs.planar.scene import Beams, beams, scan
from labgym.envs.robot import ROBOT
from labgym.envs.sensors import LIDAR_RAYS, RANGE
from labgym.envs.simulation import CHECK_STEPS, Pose, RobotMotion, arc
from labgym.geometry import Array


class StepInputs(NamedTuple):
    """Parameters of a robot's motion besides its state and its commands.

    Attributes:
        body: inertia and servos. solids, near: outlines in its way, and the cells that name those within reach.
        work: buffers.
    """

    body: PlanarBody
    solids: Outlines
    near: Cells
    work: ContactBuffers


@compiled
def advance(state: Array, v: float, w: float, steps: int, around: StepInputs) -> tuple[int, int]:
    """Advance a state by physics steps towards target velocities.

    With M the inertia, D the derivative of the servo forces by the velocities and h the step, the velocity changes by
    h (M - h D)^-1 f in each, where f are the forces of servos and contacts; then the position moves with the new
    velocity.

    Args:
        v, w: targets within the limits of the body, m/s and rad/s.
        steps: number of physics steps.

    Returns:
        the number of contacts at the position before the last step, and the largest one before any.
    """
    body, solids, near, work = around
    h, cell_first = body.timestep, near.first
    x, y, yaw, dx, dy, turning = state[0], state[1], state[2], state[3], state[4], state[5]
    count, most = 0, 0
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
            most = max(most, count)
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
    return count, most


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


TICK_S = 0.1
"""Time after which people choose new velocities, seconds; see `labgym.envs.conditions.intentions.DT`."""
REACH = ROBOT.chassis_radius + RADIUS
"""Distance between the centers of the robot and of a person who touch, meters."""
CHECK_INTERVAL = CHECK_STEPS * ROBOT.timestep
"""Time between two checks for contacts, seconds."""


class PlanarSimulation(RobotMotion):
    """One robot in the plan of a scene; nothing else moves.

    Args:
        plan: the scene. body: the robot's inertia and servos.
        control_dt: duration of a control step, seconds.

    Attributes:
        pose: (x, y, yaw) in the room frame; yaw in (-pi, pi].
        velocity: forward velocity, m/s, and turn rate, rad/s.
    """

    def __init__(self, plan: PlanarPlan, body: PlanarBody, control_dt: float = ROBOT.control_dt) -> None:
        self._plan = plan
        self._checks = round(control_dt / CHECK_INTERVAL)
        self._steps = round(CHECK_INTERVAL / body.timestep)
        self._state, self._around = np.zeros(6), StepInputs(body, plan.solids, plan.near, buffers())
        self._beams = beams(LIDAR_RAYS)
        self.place((0.0, 0.0, 0.0))

    def place(self, pose: Pose) -> None:
        """Put the robot at rest at (x, y, yaw)."""
        self._state[:3], self._state[3:] = pose, 0.0
        self._read()

    def resume(self, position: Array, rates: Array) -> None:
        """Take over a state of motion: x, y and yaw, and their rates in the room frame, each (3,)."""
        self._state[:3], self._state[3:] = position, rates
        self._read()

    def drive(self, *command: float) -> tuple[float, bool]:
        """Apply a target twist in m/s and rad/s for one control step.

        Returns:
            the length driven in meters, as the sum of arcs between contact checks, and whether the robot touched
            anything.
        """
        v, w = command
        driven, touched = _drive(self._state, v, w, self._checks, self._steps, self._around)
        self._read()
        return driven, touched

    @property
    def timestep(self) -> float:
        """Duration of a physics step, seconds."""
        return CHECK_INTERVAL / self._steps

    def drive_among(self, time: float, company: Company, *command: float) -> tuple[float, tuple[str, ...]]:
        """Apply a target twist in m/s and rad/s for one control step, and check contacts after each physics step.

        Args:
            time: of the episode, seconds. company: people and docking, which advance.

        Returns:
            the length driven, meters, and the names of what the robot touched, in that order.
        """
        v, w = command
        first = np.zeros(1 + len(company.before), dtype=np.int64)
        pace = (self._checks, self._steps)
        driven = _drive_among(self._state, (v, w), pace, self._around, time, company, first)
        self._read()
        return driven, touched_names(first)

    def substep(self, *command: float) -> tuple[str, ...]:
        """Advance by one physics step towards a target twist; return ("obstacle",) if the robot touches one."""
        v, w = command
        _, touched = _drive(self._state, v, w, 1, 1, self._around)
        self._read()
        return ("obstacle",) if touched else ()

    @property
    def depth(self) -> float:
        """The depth of the deepest contact at the present position, meters; 0 without contacts."""
        return float(_depth(self._state, self._around))

    def scan(self) -> NDArray[np.float32]:
        """Return the ranges (180,) of the lidar, meters, as `labgym.envs.sensors.Lidar`."""
        ranges = np.empty(LIDAR_RAYS, np.float32)
        _scan(self._state, self._plan.walls, self._beams, RANGE, ranges)
        return ranges

    def _read(self) -> None:
        self._move(*self._state.tolist())


_arc = compiled(arc)


@compiled
def control_step(state: Array, v: float, w: float, checks: int, steps: int, around: StepInputs) -> tuple[float, bool]:
    """Advance a state (6,) by one control step; return the length driven and whether the robot touched anything."""
    body = around.body
    v, w = min(max(v, body.v_min), body.v_max), min(max(w, -body.w_max), body.w_max)
    driven, touched = 0.0, False
    for _ in range(checks):
        x, y, yaw = state[0], state[1], state[2]
        touched = advance(state, v, w, steps, around)[0] > 0 or touched
        driven += _arc(math.hypot(state[0] - x, state[1] - y), state[2] - yaw)
    return driven, touched


@compiled
def company_step(
    state: Array,
    command: tuple[float, float],
    pace: tuple[int, int],
    around: StepInputs,
    time: float,
    company: Company,
    first: Index,
) -> float:
    """Advance a state (6,) by one control step among people; return the length driven, meters.

    Args:
        command: target twist, m/s and rad/s.
        pace: numbers of checks and of steps, as of `control_step`; contacts are checked after each physics step.
        time: of the episode at the begin, seconds.
        company: people and docking, which are measured after each physics step.
        first: (1 + n,) rank of what the robot touched, by the first physics step in which it did; 0 for nothing. First
            obstacles, then each person.
    """
    body, (before, after, sums, resting) = around.body, company
    v, w = min(max(command[0], body.v_min), body.v_max), min(max(command[1], -body.w_max), body.w_max)
    checks, steps = pace
    if len(before) > 0 or len(resting) > 0:
        checks, steps = checks * steps, 1
    dt, driven, rank = body.timestep, 0.0, 0
    first[:] = 0
    for step in range(1, checks + 1):
        x, y, yaw = state[0], state[1], state[2]
        _, count = advance(state, v, w, steps, around)
        driven += _arc(math.hypot(state[0] - x, state[1] - y), state[2] - yaw)
        if count > 0 and first[0] == 0:
            rank += 1
            first[0] = rank
        if len(before) == 0 and len(resting) == 0:
            continue
        cosine, sine = math.cos(state[2]), math.sin(state[2])
        forward, left = cosine * state[3] + sine * state[4], cosine * state[4] - sine * state[3]
        if len(resting) > 0:
            resting[0] = rested(resting[0], forward, left, state[5], dt)
        if len(before) == 0:
            continue
        share = min((time + step * dt - sums[TICK] * TICK_S) / TICK_S, 1.0)
        person, distance = pass_by(state[0], state[1], share, dt, before, after, sums)
        if distance < REACH and first[1 + person] == 0 and moves(forward, left):
            rank += 1
            first[1 + person] = rank
    return driven


def touched_names(first: Index) -> tuple[str, ...]:
    """Return the names of what the robot touched in a control step, in that order, from the ranks of `company_step`."""
    ranks = first.tolist()
    if not any(ranks):
        return ()
    names = ("obstacle", *(f"person {number}" for number in range(1, len(ranks))))
    return tuple(name for rank, name in sorted(zip(ranks, names, strict=True)) if rank)


@entry
def _drive_among(
    state: Array,
    command: tuple[float, float],
    pace: tuple[int, int],
    around: StepInputs,
    time: float,
    company: Company,
    first: Index,
) -> float:
    return company_step(state, command, pace, around, time, company, first)


@entry
def _drive(state: Array, v: float, w: float, checks: int, steps: int, around: StepInputs) -> tuple[float, bool]:
    return control_step(state, v, w, checks, steps, around)


@entry
def _depth(state: Array, around: StepInputs) -> float:
    body, solids, near, work = around
    deepest = 0.0
    cell = cell_at(state[0], state[1], near)
    if cell >= 0:
        for k in range(touching(state, cell, body, solids, near, work.contacts)):
            deepest = max(deepest, -work.contacts[k, 2])
    return deepest


@entry
def _scan(state: Array, walls: Outlines, beams: Beams, reach: float, ranges: NDArray[np.float32]) -> None:
    scan(state[0], state[1], state[2], walls, beams, reach, ranges)
