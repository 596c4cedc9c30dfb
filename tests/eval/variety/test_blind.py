"""The blind policy: free where floors are alike, often not where furniture stands at random."""

from __future__ import annotations

import math

import numpy as np
import pytest
from room_sketches import sketch, turned

from labgym.eval.variety.blind import blind_drives, blind_map, distances, is_free, wall_map
from labgym.geometry import OrientedBox

ISLANDS = np.array([[3.0, 3.0, 3.0, 1.5, 0.0], [7.5, 5.0, 1.2, 4.0, 0.0], [1.5, 6.0, 1.8, 0.75, 0.2]])
DRIVES = [((1.0, 1.0), (9.0, 7.0)), ((9.0, 1.0), (1.0, 7.2)), ((5.0, 0.6), (5.0, 7.4)), ((9.3, 5.0), (3.0, 4.5))]


def scattered(rng: np.random.Generator) -> np.ndarray:
    """Nine benches at random, away from the starts and goals."""
    boxes: list[tuple[float, ...]] = []
    ends = np.array([point for drive in DRIVES for point in drive])
    while len(boxes) < 9:
        x, y, yaw = rng.uniform(1.0, 9.0), rng.uniform(1.0, 7.0), rng.uniform(0.0, math.pi)
        if np.linalg.norm(ends - (x, y), axis=1).min() > 1.6:
            boxes.append((x, y, 1.8, 0.75, yaw))
    return np.array(boxes)


def test_on_identical_floors_every_drive_is_free():
    floor = sketch(10.0, 8.0, ISLANDS)
    assert blind_drives(floor, [floor] * 30, DRIVES) == [True] * 4


def test_floors_are_laid_over_each_other_by_their_main_doors():
    others = [turned(10.0, 8.0, ISLANDS)] * 30
    assert blind_drives(sketch(10.0, 8.0, ISLANDS), others, DRIVES) == [True] * 4


def test_on_floors_furnished_at_random_clearly_fewer_drives_are_free():
    rng = np.random.default_rng(0)
    floors = [sketch(10.0, 8.0, scattered(rng)) for _ in range(14)]
    free = [one for k, floor in enumerate(floors) for one in blind_drives(floor, floors[:k] + floors[k + 1 :], DRIVES)]
    straight = [is_free(floor, np.array(drive)) for floor in floors for drive in DRIVES]
    assert 0.2 < np.mean(free) < 0.8
    assert np.mean(free) >= np.mean(straight)


def test_what_other_floors_share_is_avoided_and_what_they_lack_is_run_into():
    bench = np.array([[5.0, 4.0, 2.0, 2.0, 0.0]])
    same, empty = sketch(10.0, 8.0, bench), sketch(10.0, 8.0, np.empty((0, 5)))
    across = [((5.0, 0.6), (5.0, 7.4))]
    assert blind_drives(same, [same] * 30, across) == [True]
    assert blind_drives(same, [empty] * 30, across) == [False]
    assert blind_drives(empty, [same] * 30, across) == [True]


def test_the_risk_is_the_share_of_floors_on_which_the_robot_touches_something():
    bench = np.array([[5.0, 4.0, 2.0, 2.0, 0.0]])
    full, empty = sketch(10.0, 8.0, bench), sketch(10.0, 8.0, np.empty((0, 5)))
    risk = blind_map(full, [full] * 60 + [empty] * 140).risk
    assert risk[40, 50] == pytest.approx(0.3, abs=0.01)
    assert risk[40, 61] == pytest.approx(0.3, abs=0.02)
    assert risk[40, 65] == pytest.approx(0.0, abs=0.01)


def test_who_knows_how_far_from_walls_furniture_stands_drives_between_it():
    """Floors of three widths have benches 0.75 m deep along all walls, and nothing else."""
    floors = []
    for width in (10.0, 12.0, 14.0):
        along = [(width / 2.0, y, width, 0.75, 0.0) for y in (0.375, 7.625)]
        floors.append(sketch(width, 8.0, np.array(along + [(x, 4.0, 0.75, 8.0, 0.0) for x in (0.375, width - 0.375)])))
    known = wall_map(floors[0], floors[1:])
    assert known.risk[5, 50] == pytest.approx(1.0, abs=0.01)
    assert known.risk[20, 50] == pytest.approx(0.0, abs=0.01)
    crossing = [((1.5, 4.0), (8.5, 4.0)), ((2.0, 1.5), (8.0, 6.5))]
    assert blind_drives(floors[0], floors[1:], crossing, wall_map) == [True, True]
    surprise = sketch(10.0, 8.0, np.array([[5.0, 4.0, 1.0, 7.0, 0.0]]))
    assert blind_drives(surprise, floors[1:], crossing, wall_map) == [False, False]


def test_walls_leave_a_way_or_none():
    floor = sketch(10.0, 8.0, np.empty((0, 5)))
    split = np.array(floor.walls)
    split[38:43] = 0.0
    closed = type(floor)(**{**vars(floor), "walls": split})
    assert blind_map(closed, [floor]).paths((5.0, 1.0), [(5.0, 7.0), (8.0, 1.0)])[0] is None
    assert blind_drives(closed, [floor], [((5.0, 1.0), (5.0, 7.0)), ((5.0, 1.0), (8.0, 1.0))]) == [False, True]


def test_a_drive_ends_where_it_succeeds():
    wall = sketch(10.0, 8.0, np.array([[5.0, 4.0, 4.0, 0.2, 0.0]]))
    towards = np.array([[5.0, 1.0], [5.0, 3.45], [5.0, 3.9]])
    assert is_free(wall, towards)
    assert not is_free(wall, np.array([[5.0, 1.0], [5.0, 7.0]]))


def test_distances_from_boxes_are_right_to_seven_centimeters():
    rng = np.random.default_rng(5)
    boxes = [OrientedBox(*row) for row in rng.uniform((1, 1, 0.5, 0.5, 0), (5, 5, 2.0, 1.0, 3), (6, 5))]
    away = distances(boxes, np.zeros(2), (60, 60))
    x, y = np.meshgrid(np.arange(60) * 0.1, np.arange(60) * 0.1)
    expected = np.full(x.shape, np.inf)
    for box in boxes:
        dx, dy = x - box.x, y - box.y
        along, across = dx * np.cos(box.yaw) + dy * np.sin(box.yaw), dy * np.cos(box.yaw) - dx * np.sin(box.yaw)
        outside = np.hypot(np.maximum(abs(along) - box.width / 2, 0), np.maximum(abs(across) - box.depth / 2, 0))
        expected = np.minimum(expected, outside)
    assert np.abs(away - expected).max() < 0.08
