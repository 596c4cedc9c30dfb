"""Drives of a floor: which pairs are accepted, and their measures in rooms with a closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from labgym.geometry import OrientedBox
from labgym.navigation import RouteMeasures, draw_drives
from labgym.navigation.drives import DETOUR, SHORTEST, STRAIGHT, acceptance

RADIUS = 0.30


def measures(length: float, detour: float) -> RouteMeasures:
    return RouteMeasures(length, length / detour, 1.0, 1.0)


def partition(x0: float, x1: float) -> list[OrientedBox]:
    """A wall 0.2 m thick across an 8 m room at y = 4, with one gap."""
    return [OrientedBox(x0 / 2.0, 4.0, x0, 0.2), OrientedBox((x1 + 8.0) / 2.0, 4.0, 8.0 - x1, 0.2)]


@pytest.mark.parametrize(
    ("drive", "probability"),
    [
        (None, 0.0),
        (measures(1.99, 1.5), 0.0),
        (measures(2.0, 1.5), 1.0),
        (measures(9.0, 1.1), 1.0),
        (measures(9.0, 1.09), STRAIGHT),
        (measures(2.0, 1.0), STRAIGHT),
    ],
)
def test_short_pairs_are_refused_detours_accepted_and_straight_ones_thinned(drive, probability):
    assert acceptance(drive) == probability


def test_the_measures_of_a_drive_through_a_door_have_a_closed_form(make_plan):
    plan = make_plan(*partition(6.0, 6.9))
    (one,) = draw_drives(plan, {}, {"a": (1.0, 1.0, 0.0), "b": (1.0, 7.0, 0.0)}, 1, np.random.default_rng(0))
    assert one.accepted
    # Tangent from (1, 1) to the circle of 0.30 m around the wall's corner (6, 3.9), the arc to its side, and back.
    dx, dy = 5.0, 2.9
    away = math.hypot(dx, dy)
    tangent = math.sqrt(away**2 - RADIUS**2)
    # The path turns from the tangent's direction to straight up, follows the side of the gap for 0.2 m, and goes on.
    heading = math.atan2(dy, dx) - math.asin(RADIUS / away)
    arc = RADIUS * (math.pi / 2.0 - heading)
    length = 2.0 * (tangent + arc) + 0.2
    assert one.measures.length == pytest.approx(length, abs=1e-6)
    assert one.measures.detour == pytest.approx(length / 6.0, abs=1e-6)
    assert one.measures.neck == pytest.approx(0.9)
    assert one.measures.widest_neck == pytest.approx(0.9)


def test_every_pair_is_tried_once_and_entries_are_starts_only(make_plan):
    plan = make_plan(*partition(3.0, 4.0))
    goals = {"a": (1.0, 1.0, 0.0), "b": (1.0, 7.0, 0.0), "c": (7.0, 7.0, 0.0), "beside c": (7.0, 7.0, 1.0)}
    tried = draw_drives(plan, {"entry": (4.0, 1.0, 0.0)}, goals, 100, np.random.default_rng(1))
    pairs = [(one.pair.start_location, one.pair.goal_location) for one in tried]
    names = ("entry", *goals)
    every = {(s, g) for s in names for g in goals if s != g and {s, g} != {"c", "beside c"}}
    assert len(pairs) == len(set(pairs))
    assert set(pairs) == every
    accepted = [one.pair.index for one in tried if one.accepted]
    assert accepted == list(range(len(accepted)))
    assert {one.pair.index for one in tried if not one.accepted} <= {-1}


def test_accepted_pairs_are_long_enough_and_straight_ones_are_thinned_at_the_stated_rate(make_plan):
    rng = np.random.default_rng(2)
    goals = {str(k): (float(x), float(y), 0.0) for k, (x, y) in enumerate(rng.uniform(0.4, 7.6, (22, 2)))}
    tried = draw_drives(make_plan(), {}, goals, 10**6, rng)
    assert all(one.measures.length >= SHORTEST for one in tried if one.accepted)
    straight = [one for one in tried if one.measures.length >= SHORTEST and one.measures.detour < DETOUR]
    assert len(straight) > 300
    assert np.mean([one.accepted for one in straight]) == pytest.approx(STRAIGHT, abs=0.07)


def test_drawing_stops_at_the_number_of_drives_and_repeats_with_the_generator(make_plan):
    plan = make_plan(*partition(3.0, 4.0))
    rng = np.random.default_rng(3)
    goals = {str(k): (float(x), float(y), 0.0) for k, (x, y) in enumerate(rng.uniform(0.5, 7.5, (12, 2)))}
    first, again = (draw_drives(plan, {}, goals, 5, np.random.default_rng(4)) for _ in range(2))
    assert first == again
    assert sum(one.accepted for one in first) == 5
    assert first[-1].accepted


def test_a_pair_without_a_path_is_tried_and_not_accepted(make_plan):
    plan = make_plan(OrientedBox(4.0, 4.0, 8.0, 0.2))
    tried = draw_drives(plan, {}, {"a": (1.0, 1.0, 0.0), "b": (1.0, 7.0, 0.0)}, 5, np.random.default_rng(0))
    assert [one.measures for one in tried] == [None, None]
    assert not any(one.accepted for one in tried)
