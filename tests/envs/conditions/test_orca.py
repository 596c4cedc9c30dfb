"""ORCA: closed forms, independent solvers of its programs, the situations of its paper, and `pyrvo`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from labgym.envs.conditions import orca
from labgym.envs.conditions.orca import Avoidance, OrcaRobot, velocities

RULES = Avoidance(radius=0.3, gap=0.01)
NO_WALLS = np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0)
NO_ROBOT = OrcaRobot(0.0, 0.0, 0.0, 0.0, 0.0, 0.5, False)


class Disc(NamedTuple):
    """A disc of the tests: place and velocity."""

    x: float
    y: float
    vx: float = 0.0
    vy: float = 0.0


class HalfPlane(NamedTuple):
    """The velocities v with (x, y) . v >= least."""

    x: float
    y: float
    least: float


def rows(*planes):
    return np.array([each for group in planes for each in group], dtype=np.float64).reshape(-1, 3)


def nearest_velocity(preferred, fastest, planes):
    x, y, met = orca.nearest_velocity(*preferred, fastest, rows(planes), len(planes))
    return (x, y), met


def permitted_velocity(preferred, fastest, hard, soft):
    return orca.permitted_velocity(*preferred, fastest, rows(hard, soft), len(hard), len(hard) + len(soft))


def fastest_velocity(toward, fastest, planes):
    permitted, x, y = orca.fastest_velocity(*toward, fastest, rows(planes), len(planes))
    return (x, y) if permitted else None


def least_forbidden(start, fastest, hard, soft, first=0):
    return orca.least_forbidden(*start, fastest, rows(hard, soft), len(hard), len(hard) + len(soft), first)


def away_from(wall, radius, horizon):
    return HalfPlane(*orca.away_from(*wall, radius, horizon))


def reciprocal(disc, other, share=0.5):
    """The half-plane for two discs with a radius of 0.3 m, a horizon of 2 s and steps of 0.1 s."""
    return HalfPlane(*orca.reciprocal(np.array(disc), np.array(other), 0.6, share, 2.0, 0.1))


def plane(angle, least):
    return HalfPlane(math.cos(angle), math.sin(angle), least)


def random_planes(rng, count, low=-1.0, high=0.3):
    return [
        plane(*each) for each in np.column_stack([rng.uniform(-math.pi, math.pi, count), rng.uniform(low, high, count)])
    ]


def violation(velocity, planes):
    return max((p.least - p.x * velocity[0] - p.y * velocity[1] for p in planes), default=-math.inf)


# Half-planes


def test_without_half_planes_the_preferred_velocity_is_limited_to_the_greatest_speed():
    assert nearest_velocity((0.3, -0.4), 1.0, []) == ((0.3, -0.4), 0)
    assert nearest_velocity((3.0, 4.0), 1.0, [])[0] == pytest.approx((0.6, 0.8))


def test_one_half_plane_projects_the_preferred_velocity():
    for angle, least in ((0.3, 0.2), (2.0, -0.1), (-1.0, 0.6)):
        one = plane(angle, least)
        preferred = np.array([-0.3 * one.x, -0.3 * one.y])
        (x, y), met = nearest_velocity(tuple(preferred), 1.0, [one])
        foot = preferred + (least - preferred @ one[:2]) * np.array(one[:2])
        assert met == 1
        assert (x, y) == pytest.approx(tuple(foot), abs=1e-12)


def test_a_half_plane_beyond_the_greatest_speed_is_not_met():
    assert nearest_velocity((0.0, 0.0), 1.0, [plane(0.0, 0.5), plane(1.0, 1.01)])[1] == 1


def test_the_nearest_velocity_is_that_of_a_quadratic_solver():
    rng = np.random.default_rng(1)
    for _ in range(30):
        planes = random_planes(rng, int(rng.integers(1, 9)), high=-0.05)  # rest is permitted
        preferred = rng.normal(0.0, 1.0, 2)
        mine, met = nearest_velocity(tuple(preferred), 1.0, planes)
        assert met == len(planes)
        solved = minimize(
            lambda v, p=preferred: ((v - p) ** 2).sum(),
            np.zeros(2),
            jac=lambda v, p=preferred: 2.0 * (v - p),
            constraints=[
                {"type": "ineq", "fun": lambda v, a=planes: np.array(a)[:, :2] @ v - np.array(a)[:, 2]},
                {"type": "ineq", "fun": lambda v: 1.0 - v @ v},
            ],
            method="SLSQP",
            options={"ftol": 1e-14, "maxiter": 300},
        )
        assert violation(mine, planes) < 1e-9
        assert math.hypot(*mine) < 1.0 + 1e-9
        assert ((mine - preferred) ** 2).sum() <= solved.fun + 1e-6
        assert mine == pytest.approx(tuple(solved.x), abs=1e-3)


def test_the_least_forbidden_velocity_has_the_violation_of_a_linear_program():
    """The disc of speeds is that of scipy's program as a polygon of 180 sides, so it may be better by 2e-4 at most."""
    rng = np.random.default_rng(2)
    angles = np.arange(180) * (2.0 * math.pi / 180)
    around = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(180)])
    infeasible = 0
    for _ in range(50):
        hard = random_planes(rng, int(rng.integers(0, 4)), high=0.0)
        soft = random_planes(rng, int(rng.integers(3, 9)), low=-0.5, high=0.9)
        mine = permitted_velocity(tuple(rng.normal(0.0, 1.0, 2)), 1.0, hard, soft)
        assert violation(mine, hard) < 1e-9
        assert math.hypot(*mine) < 1.0 + 1e-9
        a, b = np.array(soft), np.array([*hard]).reshape(-1, 3)
        solved = linprog(
            (0.0, 0.0, 1.0),
            A_ub=np.concatenate(
                [np.column_stack([-a[:, :2], -np.ones(len(a))]), np.column_stack([-b[:, :2], np.zeros(len(b))]), around]
            ),
            b_ub=np.concatenate([-a[:, 2], -b[:, 2], np.ones(180)]),
            bounds=[(None, None), (None, None), (0.0, None)],
        )
        infeasible += solved.fun > 1e-6
        assert violation(mine, soft) == pytest.approx(solved.fun, abs=4e-4) or violation(mine, soft) < solved.fun
    assert infeasible > 10


def test_the_fastest_velocity_along_a_direction_is_that_of_a_linear_program():
    rng = np.random.default_rng(3)
    for _ in range(60):
        planes = random_planes(rng, int(rng.integers(2, 7)), low=-0.6, high=0.4)
        angle = rng.uniform(-math.pi, math.pi)
        toward = math.cos(angle), math.sin(angle)
        mine = fastest_velocity(toward, 5.0, planes)
        a = np.array(planes)
        solved = linprog(-np.array(toward), A_ub=-a[:, :2], b_ub=-a[:, 2], bounds=[(None, None)] * 2)
        if solved.status == 2:
            assert mine is None
        elif solved.status == 0 and np.hypot(*solved.x) < 5.0:
            assert np.dot(mine, toward) == pytest.approx(-solved.fun, abs=1e-7)


def test_opposite_half_planes_without_a_gap_permit_motion_between_them():
    hard = [plane(math.pi / 2.0, 0.0), HalfPlane(-0.0, -1.0, 0.0)]
    assert permitted_velocity((0.7, 0.4), 1.0, hard, []) == pytest.approx((0.7, 0.0))


def test_least_forbidden_between_two_opposite_demands_is_halfway():
    soft = [HalfPlane(1.0, 0.0, 0.5), HalfPlane(-1.0, 0.0, 0.1)]
    x, _ = least_forbidden((0.5, 0.0), 1.0, [], soft, 1)
    assert x == pytest.approx(0.2)


# One pair of discs, one wall


def test_a_disc_straight_ahead_is_approached_at_the_gap_over_the_horizon():
    """The velocity 1 m/s is 0.3 m/s short of the middle of the cut-off disc: the way out is backwards."""
    ahead = Disc(2.6, 0.0)
    mine = reciprocal(Disc(0.0, 0.0, 1.1, 0.0), ahead, 1.0)
    assert (mine.x, mine.y, mine.least) == pytest.approx((-1.0, 0.0, -(2.6 - 0.6) / 2.0))
    half = reciprocal(Disc(0.0, 0.0, 1.1, 0.0), ahead)
    assert half.least == pytest.approx(-(1.1 + 1.0) / 2.0)


def test_the_change_of_velocity_is_the_shortest_out_of_the_velocity_obstacle():
    """Against samples of the definition: v is in the obstacle if the discs touch within the horizon."""
    rng = np.random.default_rng(4)
    angles, times = np.arange(360) * (math.pi / 180.0), np.linspace(0.02, 2.0, 200)
    around = np.column_stack([np.cos(angles), np.sin(angles)])

    def touches(velocities, place):
        return (np.linalg.norm(velocities[:, None] * times[:, None] - place, axis=-1) < 0.6).any(axis=1)

    for _ in range(10):
        angle, distance = rng.uniform(-math.pi, math.pi), rng.uniform(0.8, 2.0)
        place = distance * np.array([math.cos(angle), math.sin(angle)])
        velocity = place * rng.uniform(0.6, 1.0) + rng.normal(0.0, 0.05, 2)
        mine = reciprocal(Disc(0.0, 0.0, *velocity), Disc(*place), 1.0)
        change = mine.least - (mine.x * velocity[0] + mine.y * velocity[1])
        assert touches(velocity + (change - 0.02) * around, place).all()
        assert not touches(velocity + (change + 0.02) * np.array([mine[:2]]), place).any()


def test_two_discs_change_their_velocities_by_opposite_amounts():
    one, other = Disc(0.0, 0.0, 0.9, 0.1), Disc(1.5, 0.2, -0.8, 0.0)
    mine = reciprocal(one, other)
    theirs = reciprocal(other, one)
    assert (theirs.x, theirs.y) == pytest.approx((-mine.x, -mine.y))
    change = mine.least - (mine.x * one.vx + mine.y * one.vy)
    assert theirs.least - (theirs.x * other.vx + theirs.y * other.vy) == pytest.approx(change)


def test_discs_that_overlap_part_within_one_step():
    one, other = Disc(0.0, 0.0), Disc(0.5, 0.0)
    mine = reciprocal(one, other)
    assert (mine.x, mine.y, mine.least) == pytest.approx((-1.0, 0.0, 0.5))
    alike = reciprocal(one, Disc(0.0, 0.0))
    assert alike.least == pytest.approx(3.0)


def test_a_wall_limits_the_speed_towards_it_alone():
    wall = away_from((0.0, -0.8), 0.3, 0.5)
    assert (wall.x, wall.y, wall.least) == pytest.approx((0.0, 1.0, -1.0))
    assert away_from((0.2, 0.0), 0.3, 0.5).least == 0.0
    assert permitted_velocity((0.8, -0.5), 1.0, [away_from((0.0, -0.3), 0.3, 0.5)], []) == pytest.approx((0.8, 0.0))


# Crowds


def run(places, goals, steps, speed=1.0):
    """Return the places of discs over time, (steps + 1, n, 2)."""
    places, goals = np.array(places, dtype=float), np.array(goals, dtype=float)
    discs, track = np.hstack([places, np.zeros_like(places)]), [np.array(places)]
    for _ in range(steps):
        offsets = goals - discs[:, :2]
        preferred = offsets / np.maximum(np.linalg.norm(offsets, axis=1) / speed, 0.1)[:, None]
        avoids = np.zeros(len(discs), dtype=bool)
        discs[:, 2:] = velocities(discs, preferred, avoids, NO_ROBOT, NO_WALLS, speed, RULES)
        discs[:, :2] += 0.1 * discs[:, 2:]
        track.append(discs[:, :2].copy())
    return np.array(track)


def closest(track):
    gaps = np.linalg.norm(track[:, :, None] - track[:, None], axis=-1)
    return gaps[:, ~np.eye(track.shape[1], dtype=bool)].min()


def test_two_discs_that_cross_never_touch_and_arrive():
    # Discs that mirror each other exactly yield to each other forever, so one starts 0.02 m behind.
    track = run([(-3.0, 0.0), (0.0, -3.02)], [(3.0, 0.0), (0.0, 3.0)], 120)
    assert closest(track) > 0.6 - 1e-6
    np.testing.assert_allclose(track[-1], [(3.0, 0.0), (0.0, 3.0)], atol=0.05)


def test_two_discs_head_on_pass_each_other_symmetrically():
    track = run([(-3.0, 0.02), (3.0, -0.02)], [(3.0, 0.0), (-3.0, 0.0)], 120)
    assert closest(track) > 0.6 - 1e-6
    np.testing.assert_allclose(track[:, 0], -track[:, 1], atol=1e-9)
    np.testing.assert_allclose(track[-1], [(3.0, 0.0), (-3.0, 0.0)], atol=0.05)


def test_a_circle_without_disturbance_stays_symmetric_for_its_first_seconds():
    count = 6
    angles = np.arange(count) * 2.0 * math.pi / count
    places = 4.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    track = run(places, -places, 30)
    turned = track @ np.array([[0.5, math.sqrt(0.75)], [-math.sqrt(0.75), 0.5]])
    np.testing.assert_allclose(turned, np.roll(track, -1, axis=1), atol=1e-6)
    assert closest(track) > 0.6 - 1e-6


@pytest.mark.parametrize("avoided", [True, False])
def test_a_person_who_takes_all_of_the_share_avoids_a_robot_that_sees_nothing(avoided):
    disc, gaps = np.array([[-3.0, 0.05, 0.0, 0.0]]), []
    for step in range(60):
        robot = OrcaRobot(3.0 - 0.1 * step, 0.0, -1.0, 0.0, 0.3, 1.0, False)
        disc[:, 2:] = velocities(disc, np.array([[1.0, 0.0]]), np.array([avoided]), robot, NO_WALLS, 1.0, RULES)
        disc[:, :2] += 0.1 * disc[:, 2:]
        gaps.append(math.dist(disc[0, :2], (robot.x - 0.1, robot.y)))
    assert (min(gaps) > 0.6 - 1e-6) == avoided


# Another implementation


def reference(places, goals, steps, speed=1.0, radius=0.3):
    pyrvo = pytest.importorskip("pyrvo")
    simulator = pyrvo.RVOSimulator(0.1, 5.0, 10, 2.0, 0.5, radius, speed)
    for place in places:
        simulator.add_agent(tuple(place))
    track = [np.array(places, dtype=float)]
    for _ in range(steps):
        for number, (place, goal) in enumerate(zip(track[-1], goals, strict=True)):
            offset = np.array(goal) - place
            simulator.set_agent_pref_velocity(number, tuple(offset / max(np.linalg.norm(offset) / speed, 0.1)))
        simulator.do_step()
        positions = [simulator.get_agent_position(k) for k in range(len(places))]
        track.append(np.array([(each.x, each.y) for each in positions]).reshape(-1, 2))
    return np.array(track)


@pytest.mark.parametrize("count", [3, 8])
def test_trajectories_are_those_of_pyrvo(count):
    """Discs of a circle that exchange their places, the paper's figure 6: they meet in a dense knot.

    pyrvo computes in single precision; in the knot, differences grow.
    """
    angles = np.arange(count) * 2.0 * math.pi / count
    places = 4.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    places += np.random.default_rng(0).uniform(-0.01, 0.01, places.shape)
    mine, theirs = run(places, -places, 80), reference(places, -places, 80)
    assert np.abs(mine - theirs).max() < 1e-3
    assert closest(mine) > 0.6 - 1e-6


@pytest.mark.parametrize("angle", [0.3, 1.2, 2.5, -0.4, -1.7, -2.8])
def test_nobody_comes_nearer_to_a_robot_at_rest_than_the_gap_from_any_side(angle):
    toward = -np.array([math.cos(angle), math.sin(angle)])
    apart = RULES.radius + 0.27 + RULES.gap
    person = np.array([1.0, 2.0]) - (apart + 0.02) * toward
    robot = OrcaRobot(1.0, 2.0, 0.0, 0.0, 0.27, 1.0, True)
    discs = np.array([[*person, 0.0, 0.0]])
    (reached,) = velocities(discs, toward[None], np.zeros(1, dtype=bool), robot, NO_WALLS, 1.0, RULES)
    assert reached == pytest.approx(0.02 / RULES.dt * toward)
