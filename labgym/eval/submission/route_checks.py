"""Checks of a route against its row, the robot's limits and what stands fixed on the floor."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from labgym.envs.robot import ROBOT
from labgym.envs.world import World
from labgym.eval.driving.episode_row import Pose, TransitionRow
from labgym.eval.driving.kinematics import SLACK, first_jump, possible_contacts
from labgym.eval.labnav.rules import REST
from labgym.eval.submission.outcome_checks import LiquidClaim, PeopleClaims, liquid_problems, people_problems
from labgym.geometry import wrap_angle
from labgym.suites import Suite

RESOLUTION = 1e-3
"""Poses of routes are rounded to this, meters and radians."""
POSITION_ERROR = RESOLUTION / math.sqrt(2.0) + 1e-9
"""Largest error of a rounded position, meters."""
PENETRATION = 0.15
"""The robot never enters an obstacle deeper than this, meters; the most in 774 published drives is 0.08."""
DEEP = 1.5e-3
"""Depth beyond which a rounded pose surely is in contact, meters."""
PUSHING = replace(ROBOT, v_max=1.35, w_max=2.0, acceleration=15.0, turn_acceleration=40.0)
"""The robot while it pushes things, which stop and turn it as a contact does, but never throw it."""
RESTING_M = REST[0] * ROBOT.control_dt + 0.5 * ROBOT.acceleration * ROBOT.control_dt**2 + 2.0 * RESOLUTION
"""Longest last step of a robot that comes to rest, meters."""
BETWEEN_M = 0.02
"""Largest distance between the points of a step at which the robot is placed on the floor, meters."""
STRIDES = (1, 2, 3, 5, 10, 20, 50, 100)
"""Numbers of steps between the poses whose chords bound the length driven: rounding adds up over short chords."""

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RouteClaims:
    """The figures of a row that its route shows.

    Attributes:
        start, goal: poses at the begin of the route, and of the last drive.
        steps: control steps. path_length: length driven, meters. final_distance: from the goal, meters.
        contacts: control steps with a contact.
        contact_ends: whether the first contact with something fixed ends the drive.
        touched_people: contacts with people, who are not fixed. pushed: whether it pushed things.
        waited: seconds at rest near people. people, liquid: what the row says about them; None in tasks without.
    """

    start: Pose
    goal: Pose
    steps: int
    path_length: float
    final_distance: float
    contacts: int
    contact_ends: bool = False
    touched_people: int = 0
    pushed: bool = False
    waited: float = 0.0
    people: PeopleClaims | None = None
    liquid: LiquidClaim | None = None


def route_problems(
    claims: RouteClaims, poses: Array, fixed: World, control_dt: float = ROBOT.control_dt
) -> Iterator[str]:
    """Yield a sentence for each figure of a row that its route contradicts, and for each motion that is impossible.

    Between two poses the robot is moved along the straight line, so that no thin wall is passed.

    Args:
        claims: of the row.
        poses: (n, 3) x, y and yaw at the start and after each control step; meters and radians, finite.
        fixed: the floor with all that cannot move, prepared for simulation.
        control_dt: duration of a step, seconds.
    """
    if len(poses) != claims.steps + 1:
        yield f"its route has {len(poses)} poses, expected {claims.steps + 1} for {claims.steps} steps"
        return
    first = poses[0] - claims.start
    if max(abs(first[0]), abs(first[1]), abs(wrap_angle(first[2]))) > RESOLUTION:
        yield "its route does not begin at the start"
    away = math.dist(poses[-1, :2], claims.goal[:2])
    if abs(away - claims.final_distance) > POSITION_ERROR:
        yield f"final_distance is {claims.final_distance:.3f} m, but its route ends {away:.3f} m from the goal"
    least = shortest_drive(poses)
    if claims.path_length < least - 1e-9:
        yield f"path_length is {claims.path_length:.3f} m, but its route is at least {least:.3f} m long"
    clearances = fixed.clearances(poses[:, :2])
    possible = possible_contacts(poses, clearances, control_dt, resolution=RESOLUTION)
    if claims.contact_ends:
        possible[:-2] = False
    kicked = possible.copy()
    kicked[-2:] |= claims.touched_people > 0
    robot = PUSHING if claims.pushed else ROBOT
    jump = first_jump(poses, kicked & (claims.contacts > 0), control_dt, robot, RESOLUTION)
    if jump is not None:
        moved = math.dist(poses[jump, :2], poses[jump - 1, :2]) if jump else math.nan
        yield f"its route jumps {moved:.3f} m at step {jump}, which the robot cannot drive in {control_dt:g} s"
    yield from _contact_problems(claims, poses, int(possible.sum()), clearances, fixed)
    moved = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1)
    rested = control_dt * float((moved <= RESTING_M).sum())
    if claims.waited > rested + 1e-9:
        yield f"waited is {claims.waited:g} s, but its robot rests for {rested:g} s"
    if claims.people is not None:
        yield from people_problems(claims.people, poses, control_dt)
    if claims.liquid is not None and (claims.contact_ends or not claims.contacts):
        # A contact, which ends the drive, may stop the robot at once.
        free = len(poses) - 2 if claims.contacts else len(poses)
        yield from liquid_problems(claims.liquid, poses[: max(free, 1)], control_dt)


def lab30_route_problems(row: TransitionRow, poses: Array, suite: Suite, world: World) -> Iterator[str]:
    """Yield a sentence for each problem of the route of a row of lab30, as `route_problems` and by the suite's rules.

    Args:
        row: the row. poses: as for `route_problems`. suite: the rules. world: the layout prepared for simulation.
    """
    claims = RouteClaims(row.start, row.goal, row.steps, row.path_length, row.final_distance, row.contacts)
    yield from route_problems(claims, poses, world, suite.control_dt)
    if len(poses) != row.steps + 1:
        return
    away = np.linalg.norm(poses[:, :2] - row.goal[:2], axis=1)
    yield from _ending_problems(row, poses, away, suite)
    clearance = float(world.clearances(poses[:, :2]).min())
    if abs(clearance - row.min_clearance) > POSITION_ERROR:
        yield f"min_clearance is {row.min_clearance:.3f} m, recomputed {clearance:.3f} m from its route"
    yield from _length_problems(row, poses, suite.control_dt)


def shortest_drive(poses: Array) -> float:
    """Return the least length that a robot with these rounded poses has driven, meters."""
    last = len(poses) - 1
    lengths = [0.0]
    for stride in STRIDES:
        corners = poses[np.append(np.arange(0, last, stride), last), :2]
        chords = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        lengths.append(float(np.maximum(chords - 2.0 * POSITION_ERROR, 0.0).sum()))
    return max(lengths)


def _ending_problems(row: TransitionRow, poses: Array, away: Array, suite: Suite) -> Iterator[str]:
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


def _length_problems(row: TransitionRow, poses: Array, dt: float) -> Iterator[str]:
    chords = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1) + 2.0 * POSITION_ERROR
    reach = np.maximum(ROBOT.v_max * dt, np.maximum(chords, np.concatenate([[0.0], chords[:-1]])))
    if row.path_length > SLACK * float(reach.sum()) + 1e-9:
        yield f"path_length is {row.path_length:.3f} m, but in {row.steps} steps its robot drives {reach.sum():.3f} m"


def _contact_problems(claims: RouteClaims, poses: Array, most: int, clearances: Array, fixed: World) -> Iterator[str]:
    """Yield whether the robot is inside something fixed, drives on after a contact, or hides contacts.

    Args:
        most: greatest number of steps with a contact with something fixed. clearances: of the poses, meters.
    """
    at_poses = fixed.depths(poses, clearances)
    between = np.append(0.0, swept_depths(poses, clearances, fixed))
    depths = np.maximum(at_poses, between)
    if depths.max() > PENETRATION:
        yield f"its robot stands {depths.max():.2f} m inside an obstacle at step {int(np.argmax(depths))}"
    inside = at_poses > DEEP
    if claims.contact_ends:
        early = np.flatnonzero((inside | (between > DEEP + _bulges(poses)))[: -2 if claims.contacts else None])
        if len(early):
            rest = "drives on" if claims.contacts else "has no contact"
            yield f"its robot is {depths[early[0]]:.3f} m inside an obstacle at step {early[0]}, but it {rest}"
        return
    least, most = int((inside[1:] & inside[:-1]).sum()), most + claims.touched_people
    if not least <= claims.contacts <= most:
        yield f"contacts is {claims.contacts}, but along its route {least} to {most} steps have contact"


def swept_depths(poses: Array, clearances: Array, fixed: World) -> Array:
    """Return how deep the robot is inside something fixed between two poses of a route, (n - 1,) meters.

    Args:
        poses: (n, 3). clearances: of the poses, (n,) meters. fixed: the floor.
    """
    moved = np.diff(poses, axis=0)
    chords = np.linalg.norm(moved[:, :2], axis=1)
    depths = np.zeros(len(chords))
    # A point between two poses is nearer than half of the chord to one of them.
    for step in np.flatnonzero((clearances[:-1] + clearances[1:] <= chords) & (chords > BETWEEN_M)):
        shares = np.linspace(0.0, 1.0, math.ceil(chords[step] / BETWEEN_M) + 1)[1:-1, None]
        between = poses[step] + shares * moved[step]
        depths[step] = fixed.depths(between, fixed.clearances(between[:, :2])).max(initial=0.0)
    return depths


def _bulges(poses: Array) -> Array:
    """Return how far the arc of the step to each pose may lie off its chord, (n,) meters; 0 for the first."""
    moved = np.diff(poses, axis=0)
    turned = np.abs((moved[:, 2] + math.pi) % (2.0 * math.pi) - math.pi)
    return np.append(0.0, np.linalg.norm(moved[:, :2], axis=1) * turned / 4.0)
