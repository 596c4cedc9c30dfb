"""Checks of a route against its row, the robot's limits and the scene."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT
from labgym.envs.world import World
from labgym.eval.driving.episode_row import EpisodeRow
from labgym.eval.driving.kinematics import SLACK, first_jump, possible_contacts
from labgym.suites import Suite

RESOLUTION = 1e-3
"""Poses of routes are rounded to this, meters and radians."""
POSITION_ERROR = RESOLUTION / math.sqrt(2.0) + 1e-9
"""Largest error of a rounded position, meters."""
PENETRATION = 0.15
"""The robot never enters an obstacle deeper than this, meters; the most in 774 published drives is 0.08."""
DEEP = 1.5e-3
"""Depth beyond which a rounded pose surely is in contact, meters."""
STRIDES = (1, 2, 3, 5, 10, 20, 50, 100)
"""Numbers of steps between the poses whose chords bound the length driven: rounding adds up over short chords."""

Array = NDArray[np.float64]


def route_problems(row: EpisodeRow, poses: Array, suite: Suite, world: World) -> Iterator[str]:
    """Yield a sentence for each figure of a row that its route contradicts, and for each motion that is impossible.

    Args:
        row: the row.
        poses: (n, 3) x, y and yaw at the start and after each control step; meters and radians, finite.
        suite: the rules.
        world: the layout prepared for simulation.
    """
    if len(poses) != row.steps + 1:
        yield f"its route has {len(poses)} poses, expected {row.steps + 1} for {row.steps} steps"
        return
    if np.abs(poses[0] - row.start).max() > RESOLUTION:
        yield "its route does not begin at the start"
    away = np.linalg.norm(poses[:, :2] - row.goal[:2], axis=1)
    if abs(away[-1] - row.final_distance) > POSITION_ERROR:
        yield f"final_distance is {row.final_distance:.3f} m, but its route ends {away[-1]:.3f} m from the goal"
    yield from _ending_problems(row, poses, away, suite)
    clearances = world.clearances(poses[:, :2])
    if abs(clearances.min() - row.min_clearance) > POSITION_ERROR:
        yield f"min_clearance is {row.min_clearance:.3f} m, recomputed {clearances.min():.3f} m from its route"
    possible = possible_contacts(poses, clearances, suite.control_dt, resolution=RESOLUTION)
    jump = first_jump(poses, possible, suite.control_dt, resolution=RESOLUTION)
    if jump is not None:
        moved = math.dist(poses[jump, :2], poses[jump - 1, :2]) if jump else math.nan
        yield f"its route jumps {moved:.3f} m at step {jump}, which the robot cannot drive in {suite.control_dt:g} s"
    yield from _length_problems(row, poses, suite.control_dt)
    yield from _contact_problems(row, possible, world.depths(poses, clearances))


def shortest_drive(poses: Array) -> float:
    """Return the least length that a robot with these rounded poses has driven, meters."""
    last = len(poses) - 1
    lengths = [0.0]
    for stride in STRIDES:
        corners = poses[np.append(np.arange(0, last, stride), last), :2]
        chords = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        lengths.append(float(np.maximum(chords - 2.0 * POSITION_ERROR, 0.0).sum()))
    return max(lengths)


def _ending_problems(row: EpisodeRow, poses: Array, away: Array, suite: Suite) -> Iterator[str]:
    """Yield whether the episode went on after its end, or ended without a reason."""
    if row.error is not None or row.steps >= suite.max_steps:
        return
    if suite.arrival is None:
        ended = away[-1] <= suite.success_distance + POSITION_ERROR
    else:
        ended = away[-1] <= suite.arrival.distance + POSITION_ERROR or _is_stuck(poses, suite)
    if not ended:
        yield f"it ended after {row.steps} of {suite.max_steps} steps, {away[-1]:.3f} m from the goal, without a reason"
    early = np.flatnonzero(away[:-1] < suite.success_distance - POSITION_ERROR)
    if suite.arrival is None and len(early):
        yield f"its route goes on after the goal was reached at step {early[0]}"


def _is_stuck(poses: Array, suite: Suite) -> bool:
    stuck = suite.stuck
    if stuck is None or len(poses) < stuck.steps:
        return False
    last = poses[-stuck.steps :, :2]
    return bool(np.linalg.norm(last - last[-1], axis=1).max() < stuck.distance + 2.0 * POSITION_ERROR)


def _length_problems(row: EpisodeRow, poses: Array, dt: float) -> Iterator[str]:
    least = shortest_drive(poses)
    if row.path_length < least - 1e-9:
        yield f"path_length is {row.path_length:.3f} m, but its route is at least {least:.3f} m long"
    chords = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1) + 2.0 * POSITION_ERROR
    reach = np.maximum(ROBOT.v_max * dt, np.maximum(chords, np.concatenate([[0.0], chords[:-1]])))
    if row.path_length > SLACK * float(reach.sum()) + 1e-9:
        yield f"path_length is {row.path_length:.3f} m, but in {row.steps} steps its robot drives {reach.sum():.3f} m"


def _contact_problems(row: EpisodeRow, possible: NDArray[np.bool_], depths: Array) -> Iterator[str]:
    if depths.max() > PENETRATION:
        step = int(np.argmax(depths))
        yield f"its robot stands {depths[step]:.2f} m inside an obstacle at step {step}"
    deep = depths > DEEP
    least, most = int((deep[1:] & deep[:-1]).sum()), int(possible.sum())
    if not least <= row.contacts <= most:
        yield f"contacts is {row.contacts}, but along its route {least} to {most} steps have contact"
