from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from labgym.errors import OptionError
from labgym.navigation import OccupancyGrid
from labgym.policies.data import Dataset
from labgym.policies.data.maps import Maps, cost_map
from labgym.policies.grid_planner import clearance_field
from labgym.policies.iplanner.config import IPlannerLossOptions
from labgym.policies.iplanner.cost_to_go import CostToGo, CostToGoTargets, goals_of
from labgym.policies.iplanner.network import path_through, path_weights
from labgym.policies.iplanner.train import cost_maps, planning_loss
from labgym.policies.learned.map_stack import to_world

Array = NDArray[np.float64]
Points = Sequence[tuple[float, float]] | Array

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


def at(field: CostToGo, points: Points, goal: int = 0) -> Array:
    values = field.at(torch.tensor(np.array(points, np.float32))[None], torch.tensor([goal]))
    return values[0].numpy().astype(np.float64)


def gradients(field: CostToGo, points: Points) -> Array:
    places = torch.tensor(np.array(points, np.float32))[None].requires_grad_()
    field.at(places, torch.tensor([0])).sum().backward()
    assert places.grad is not None
    return places.grad[0].numpy().astype(np.float64)


def test_in_an_empty_room_it_is_the_straight_distance_to_each_goal_of_each_layout() -> None:
    maps = maps_of(empty()), maps_of(empty(80, 140), (10.0, -2.0))
    goals = np.array([[1.0, 1.0], [4.0, 5.0]]), np.array([[16.0, 1.5]])
    field = CostToGo(maps, goals)
    rng = np.random.default_rng(0)
    for number, (goal, low, size) in enumerate(
        [(goals[0][0], (0.0, 0.0), (5.0, 6.0)), (goals[0][1], (0, 0), (5, 6)), (goals[1][0], (10.0, -2.0), (7.0, 4.0))]
    ):
        points = np.array(low) + 0.4 + rng.random((50, 2)) * (np.array(size) - 0.8)
        np.testing.assert_allclose(at(field, points, goal=number), np.linalg.norm(points - goal, axis=1), atol=0.09)


def test_it_goes_around_the_end_of_a_wall_as_a_disc() -> None:
    field = CostToGo((maps_of(divided()),), (np.array([[1.5, 1.0]]),))

    def round_a_corner(away: float, down: float) -> float:
        """Length from a point to the top of the circle of the planning radius about a corner of the wall."""
        distance = math.hypot(away, down)
        turn = math.pi - math.atan2(away, down) - math.acos(RADIUS / distance)
        return math.sqrt(distance**2 - RADIUS**2) + RADIUS * turn

    shortest = round_a_corner(1.0, 2.0) + H + round_a_corner(0.95, 2.0)
    assert shortest < at(field, [(3.5, 1.0)])[0] < 1.06 * shortest
    # In front of the wall the way leads along it, not at it.
    slope = gradients(field, [(3.2, 1.5)])[0]
    assert slope[1] < -0.9
    assert abs(slope[0]) < 0.4


def test_its_gradient_is_that_of_finite_differences() -> None:
    field = CostToGo((maps_of(divided()),), (np.array([[1.5, 1.0]]),))
    rng = np.random.default_rng(1)
    # Away from the centers of cells, where the slopes of bilinear interpolation change; many are off the map.
    cells = np.column_stack([rng.integers(-30, 130, 60), rng.integers(-30, 150, 60)])
    points = (cells + 0.5 + rng.uniform(0.2, 0.8, (60, 2))) * H
    steps = np.array([[1e-3, 0.0], [0.0, 1e-3]])
    numeric = [(at(field, points + step) - at(field, points - step)) / 2e-3 for step in steps]
    np.testing.assert_allclose(gradients(field, points), np.column_stack(numeric), atol=0.02)


def test_inside_obstacles_and_off_the_map_the_gradient_leads_back_to_the_free_space_at_hand() -> None:
    field = CostToGo((maps_of(divided()),), (np.array([[1.5, 1.0]]),))
    # The disc is free up to 0.3 m from the walls; a goal behind the wall does not pull through it.
    assert gradients(field, [(2.62, 1.51)])[0, 0] < -0.9
    inside, before = at(field, [(2.62, 1.51), (2.9, 1.51)])
    assert inside > before
    points = [(5.6, 3.0), (7.5, 3.0), (2.0, -4.0), (3.0, 9.0)]
    outward = [(1, 0), (1, 0), (0, -1), (0, 1)]
    assert ((gradients(field, points) * outward).sum(axis=1) > 0.7).all()
    near, far = at(field, [(6.0, 3.0), (9.0, 3.0)])
    assert far == pytest.approx(near + 3.0, abs=0.02)


def test_descending_it_reaches_the_goal_from_everywhere() -> None:
    goal = np.array([1.5, 1.0])
    field = CostToGo((maps_of(divided()),), (goal[None],))
    points = np.array([(3.5, 1.0), (4.6, 5.6), (2.8, 0.4), (0.4, 5.5), (5.2, 3.0), (2.62, 1.5)])
    for _ in range(250):
        slopes = gradients(field, points)
        points = points - 0.04 * slopes / np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-9)
    assert np.linalg.norm(points - goal, axis=1).max() < 0.1


def test_a_path_that_descends_the_loss_goes_around_a_wall_that_hides_the_goal() -> None:
    pose, goal, horizon = torch.tensor([[3.5, 1.0, math.pi]]), np.array([[1.5, 1.0]]), 3.0
    maps = (maps_of(divided()),)
    field, one = CostToGo(maps, (goal,)), torch.tensor([0])
    level = field.at(pose[:, None, :2], one)[:, 0] - horizon
    targets = CostToGoTargets(field, one, level, torch.tensor([horizon]))
    # Straight at the wall, and a little to the right, which is the side of its end.
    points = (torch.linspace(0.2, 1.0, 5)[None, :, None] * torch.tensor([0.6, -0.2])).requires_grad_()
    optimizer, weights, costs = torch.optim.Adam([points], lr=0.05), path_weights(6, 51), cost_maps(maps)
    for _ in range(300):
        optimizer.zero_grad()
        path = path_through(points, weights)
        world = to_world(path, pose)
        miss = targets.miss(one, path[:, -1], world[:, -1])
        planning_loss(path, costs.at(world, one), miss, targets.reach, IPlannerLossOptions()).total.backward()
        optimizer.step()
    assert miss.item() < 0.15
    x, y = world[0, -1].tolist()
    assert y > 3.0
    assert x < 3.0
    # The obstacle term is soft: the path may come two cells nearer to the wall's last cell than the planning radius.
    wall = torch.tensor([2.525, 2.975])
    assert (world[0] - wall).norm(dim=1).min() > RADIUS - 2 * H


def test_a_goal_where_the_disc_does_not_fit_is_reached_straight_from_the_nearest_free_cell() -> None:
    field = CostToGo((maps_of(empty()),), (np.array([[0.1, 3.0]]),))
    np.testing.assert_allclose(at(field, [(2.1, 3.0), (1.1, 3.0)]), [2.0, 1.0], atol=0.05)


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
