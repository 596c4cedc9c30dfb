from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from labgym.errors import OptionError
from labgym.navigation import OccupancyGrid
from labgym.policies.data import Dataset
from labgym.policies.data.maps import Maps, cost_map
from labgym.policies.grid_planner import clearance_field
from labgym.policies.iplanner.cost_to_go import CostToGo, goals_of

H, RADIUS = 0.05, 0.30


def maps_of(blocked: np.ndarray, origin: tuple[float, float] = (0.0, 0.0)) -> Maps:
    """A room whose border is a wall of 1 m."""
    walled = np.pad(blocked, 20, constant_values=True)
    outer = (origin[0] - 1.0, origin[1] - 1.0)
    return Maps(cost_map(walled), clearance_field(OccupancyGrid(walled)).astype(np.float32), outer, H)


def empty(rows: int = 120, columns: int = 100) -> np.ndarray:
    return np.zeros((rows, columns), dtype=bool)


def divided() -> np.ndarray:
    """A room of 6 x 5 m with a thin wall from y = 0 to y = 3 m at x = 2.5 m."""
    blocked = empty()
    blocked[:60, 50] = True
    return blocked


def at(field: CostToGo, *points: tuple[float, float], goal: int = 0) -> np.ndarray:
    values = field.at(torch.tensor([points], dtype=torch.float32), torch.tensor([goal]))
    return np.asarray(values[0].numpy(), dtype=np.float64)


def gradient(field: CostToGo, x: float, y: float, goal: int = 0) -> np.ndarray:
    point = torch.tensor([[[x, y]]], requires_grad=True)
    field.at(point, torch.tensor([goal])).sum().backward()
    assert point.grad is not None
    return point.grad[0, 0].numpy()


def test_in_an_empty_room_it_is_the_straight_distance_to_each_goal_of_each_layout() -> None:
    maps = maps_of(empty()), maps_of(empty(80, 140), (10.0, -2.0))
    goals = np.array([[1.0, 1.0], [4.0, 5.0]]), np.array([[16.0, 1.5]])
    field = CostToGo(maps, goals)
    rng = np.random.default_rng(0)
    for number, (goal, low, size) in enumerate(
        [(goals[0][0], (0.0, 0.0), (5.0, 6.0)), (goals[0][1], (0, 0), (5, 6)), (goals[1][0], (10.0, -2.0), (7.0, 4.0))]
    ):
        points = np.array(low) + 0.4 + rng.random((50, 2)) * (np.array(size) - 0.8)
        values = at(field, *map(tuple, points.tolist()), goal=number)
        np.testing.assert_allclose(values, np.linalg.norm(points - goal, axis=1), atol=0.09)


def test_it_goes_around_the_end_of_a_wall_as_a_disc() -> None:
    goal, start = (1.5, 1.0), (3.5, 1.0)
    field = CostToGo((maps_of(divided()),), (np.array([goal]),))
    # The taut path of a disc: two tangents to the circle of the planning radius about the end of the wall.
    half, up = 1.0 - H / 2.0, 2.0
    tangent = math.sqrt(half**2 + up**2 - RADIUS**2)
    turn = 2.0 * math.atan2(half, up) - 2.0 * (math.atan2(half, up) - math.asin(RADIUS / math.hypot(half, up)))
    shortest = 2.0 * tangent + RADIUS * (turn + 0.0)
    assert shortest < at(field, start)[0] < shortest + 0.9
    assert at(field, start)[0] > 2.0 * math.hypot(1.0, 2.0)
    # In front of the wall the way leads along it, not at it.
    slope = gradient(field, 3.2, 1.5)
    assert slope[1] < -0.9
    assert abs(slope[0]) < 0.4


def test_its_gradient_is_that_of_finite_differences() -> None:
    field = CostToGo((maps_of(divided()),), (np.array([[1.5, 1.0]]),))
    rng = np.random.default_rng(1)
    # Away from the centers of cells, where the slopes of bilinear interpolation change.
    cells = np.column_stack([rng.integers(-30, 130, 40), rng.integers(-30, 150, 40)])
    points = (cells + 0.5 + rng.uniform(0.2, 0.8, (40, 2))) * H
    step = 1e-3
    for x, y in points.tolist():
        values = at(field, (x + step, y), (x - step, y), (x, y + step), (x, y - step))
        numeric = (values[0] - values[1]) / (2 * step), (values[2] - values[3]) / (2 * step)
        np.testing.assert_allclose(gradient(field, x, y), numeric, atol=0.02)


def test_inside_obstacles_and_off_the_map_the_gradient_leads_back_to_the_free_space_at_hand() -> None:
    field = CostToGo((maps_of(divided()),), (np.array([[1.5, 1.0]]),))
    # The disc is free up to 0.3 m from the walls; a goal behind the wall does not pull through it.
    on_the_wall = gradient(field, 2.62, 1.51)
    assert on_the_wall[0] < -0.9
    assert at(field, (2.62, 1.51))[0] > at(field, (2.9, 1.51))[0]
    for x, y, outward in [(5.6, 3.0, (1, 0)), (7.5, 3.0, (1, 0)), (2.0, -4.0, (0, -1)), (3.0, 9.0, (0, 1))]:
        assert gradient(field, x, y) @ outward > 0.7, (x, y)
    assert at(field, (9.0, 3.0))[0] == pytest.approx(at(field, (6.0, 3.0))[0] + 3.0, abs=0.02)


def test_descending_it_reaches_the_goal_from_everywhere() -> None:
    goal = np.array([1.5, 1.0])
    field = CostToGo((maps_of(divided()),), (goal[None],))
    for start in [(3.5, 1.0), (4.6, 5.6), (2.8, 0.4), (0.4, 5.5), (5.2, 3.0), (2.62, 1.5)]:
        point = np.array(start)
        for _ in range(400):
            slope = gradient(field, *point.tolist())
            point = point - 0.02 * slope / max(float(np.linalg.norm(slope)), 1e-9)
        assert np.linalg.norm(point - goal) < 0.1, start


def test_a_goal_where_the_disc_does_not_fit_is_reached_straight_from_the_nearest_free_cell() -> None:
    field = CostToGo((maps_of(empty()),), (np.array([[0.1, 3.0]]),))
    np.testing.assert_allclose(at(field, (2.1, 3.0), (1.1, 3.0)), [2.0, 1.0], atol=0.05)


def test_a_map_without_space_for_the_disc_is_refused_with_the_remedy() -> None:
    full = np.ones((20, 20), dtype=bool)
    with pytest.raises(OptionError, match=r"map 1 of the dataset.*labgym data"):
        CostToGo((maps_of(empty()), maps_of(full)), (np.array([[1.0, 1.0]]), np.array([[0.5, 0.5]])))


def test_the_frames_of_a_drive_share_one_goal_and_goals_of_different_layouts_stay_apart() -> None:
    rng = np.random.default_rng(2)
    pose = np.column_stack([rng.uniform(1.0, 4.0, (9, 2)), rng.uniform(-3.0, 3.0, 9)]).astype(np.float32)
    ends = np.array([[2.0, 3.0], [2.0, 3.0], [1.0, 1.0]]).repeat(3, axis=0)
    place = np.array([0, 0, 0, 1, 1, 1, 1, 1, 1])
    cosine, sine, away = np.cos(pose[:, 2]), np.sin(pose[:, 2]), ends - pose[:, :2]
    goal = np.column_stack([cosine * away[:, 0] + sine * away[:, 1], cosine * away[:, 1] - sine * away[:, 0]])
    data = Dataset(
        depth=np.zeros((9, 72, 128), np.uint16),
        pose=pose,
        goal=goal.astype(np.float32),
        path=np.zeros((9, 64, 2), np.float32),
        length=np.ones(9, np.float32),
        place=place,
        drive=np.arange(9),
        maps=(maps_of(empty()), maps_of(empty())),
    )
    goals, field = goals_of(data)
    assert [len(each) for each in goals] == [1, 2]
    np.testing.assert_allclose(np.concatenate(goals)[field], ends, atol=1e-5)
