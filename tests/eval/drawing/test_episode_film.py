"""The film of an episode: its size, its panel, and what the map shows."""

from __future__ import annotations

import numpy as np
import pytest
from labnav_suites import draw_suite

from labgym.eval.drawing.episode_film import HOLD, FilmPanel, episode_film
from labgym.eval.drawing.episode_plan import PERSON, ROBOT_COLOR, UNSEEING, dense, nose, people_of, route_of
from labgym.eval.labnav.replay import drive_again
from labgym.navigation import ShortestPaths
from labgym.navigation.lengths import length_to_disc
from labgym.scenes import MissingRendererError


@pytest.fixture(scope="module")
def shown():
    part = draw_suite("people", 2, "floors-val", 1, 1, seed=3)
    return drive_again("still", part, part.episodes[0], seconds=0.1)


def has(picture, color):
    red, green, blue = (int(color[k : k + 2], 16) for k in (1, 3, 5))
    return bool((picture == (red, green, blue)).all(axis=2).any())


def test_the_map_shows_the_robot_and_people_of_both_kinds(shown):
    panel = FilmPanel(shown, 330, 540)
    shot = shown.shots[0]
    roles = shown.task.conditions["people"]["people"]
    people = people_of(shown.task, shot.bodies)
    assert [person.pose[:2] for person in people] == [pytest.approx(role["start"]) for role in roles]
    assert [person.yields for person in people] == [role["yields"] for role in roles]
    picture = panel.picture(0, shot, np.zeros((72, 128, 3), np.uint8))
    assert picture.shape == (540, 330, 3)
    for color in (PERSON, UNSEEING, ROBOT_COLOR):
        assert has(picture, color)


def test_the_route_on_the_map_is_the_shortest_path_to_the_goal(shown):
    route = route_of(shown.task)
    length = np.linalg.norm(np.diff(route, axis=0), axis=1).sum()
    pair = shown.task.pair
    expected = length_to_disc(ShortestPaths(shown.task.layout), pair.start, pair.goal, 0.36)
    assert length - 0.36 == pytest.approx(expected, abs=0.03)
    assert np.linalg.norm(np.diff(dense(route), axis=0), axis=1).max() <= 0.05 + 1e-9


def test_a_nose_points_along_the_heading():
    tip, *base = nose((1.0, 2.0, np.pi / 2.0), 0.3)
    assert tip == pytest.approx((1.0, 2.6))
    assert sorted(x for x, _ in base) == pytest.approx([0.775, 1.225])


def test_a_film_has_a_picture_for_each_control_step_and_a_pause_at_the_end(shown):
    try:
        pictures = list(episode_film(shown, 480, 270))
    except MissingRendererError:
        pytest.skip("no OpenGL here")
    assert len(pictures) == len(shown.shots) + HOLD
    assert {picture.shape for picture in pictures} == {(270, 480, 3)}
    assert not np.array_equal(pictures[0], pictures[-1])
