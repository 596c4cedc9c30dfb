"""Episodes on floors of several rooms: poses, contacts, lengths and drives from room to room."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from labgym.envs import LabPointNavEnv
from labgym.envs.robot import ROBOT
from labgym.envs.world import World
from labgym.errors import OptionError
from labgym.geometry import OrientedBox, to_world
from labgym.layouts import Layout
from labgym.layouts.floor import Floor
from labgym.layouts.floors import draw_floor
from labgym.navigation import ShortestPaths


def middle(floor: Floor, space: int) -> tuple[float, float]:
    """The middle of the first rectangle of a space."""
    one = floor.spaces[space]
    part = one.region[0]
    x, y = to_world([((part.x0 + part.x1) / 2.0, (part.y0 + part.y1) / 2.0)], one.frame)[0].tolist()
    return x, y


@pytest.fixture(scope="module")
def suite() -> Layout:
    return Layout(id="suite", floor=draw_floor("suite", 1).floor, placements=())


@pytest.mark.parametrize("family", ["ell", "double", "suite", "refit"])
def test_the_robot_touches_something_where_its_clearance_is_zero_and_nowhere_else(family):
    floor = draw_floor(family, 0).floor
    world = World(Layout(id="floor", floor=floor, placements=()))
    x0, y0, x1, y1 = floor.bounds
    rng = np.random.default_rng(0)
    points = rng.uniform((x0, y0), (x1, y1), (4000, 2))
    points = points[floor.inside(points)]
    clearances = world.clearances(points)
    touching = points[clearances == 0.0][:60]
    clear = points[(clearances > 1e-3) & (clearances < 0.3)][:60]
    assert len(touching) > 20
    assert len(clear) > 20
    for x, y in clear:
        assert world.clear_at((x, y, rng.uniform(-math.pi, math.pi)))
    deep = [(x, y) for x, y in touching if np.hypot(*(np.array([x, y]) - points[clearances > 0.0]).T).min() > 0.02]
    for x, y in deep:
        assert not world.clear_at((x, y, rng.uniform(-math.pi, math.pi)))


def test_a_drive_between_rooms_has_the_length_of_the_shortest_path(suite):
    start, goal = (*middle(suite.floor, 4), 0.0), (*middle(suite.floor, 2), 0.0)
    env = LabPointNavEnv(layout=suite)
    _, info = env.reset(options={"start": start, "goal": goal})
    exact = ShortestPaths(suite).path(start, goal).length
    assert info["shortest_path_length"] == pytest.approx(exact, abs=1e-9)
    assert exact > math.dist(start[:2], goal[:2]) + 0.1
    assert not info["collision"]
    assert info["clearance"] == pytest.approx(nearest(suite.floor.solids, start) - ROBOT.chassis_radius)


def nearest(boxes: tuple[OrientedBox, ...], point: tuple[float, ...]) -> float:
    """Distance from a point to the nearest box that the robot does not pass under."""
    gaps = []
    for box in boxes:
        if box.z0 < 1.4:
            x, y = box.to_local(*point[:2])
            gaps.append(math.hypot(max(abs(x) - box.width / 2.0, 0.0), max(abs(y) - box.depth / 2.0, 0.0)))
    return min(gaps)


@pytest.mark.parametrize("distance_to_go", ["grid", "exact"])
def test_progress_along_the_shortest_path_adds_up_to_its_length(suite, distance_to_go):
    start, goal = middle(suite.floor, 4), middle(suite.floor, 2)
    world, path = World(suite), ShortestPaths(suite).path(start, goal)
    field = world.to_go((*goal, 0.0), distance_to_go)
    lengths = [field.at(*point) for point in path.points]
    assert all(later <= earlier + 0.05 for earlier, later in pairwise(lengths))
    assert lengths[-1] == pytest.approx(0.0, abs=0.05)
    allowed = 1e-6 if distance_to_go == "exact" else 0.083 * path.length + 0.1
    assert path.length - 0.05 <= lengths[0] <= path.length + allowed


def test_a_pose_in_no_room_is_refused_with_the_names_of_the_rooms(suite):
    env = LabPointNavEnv(layout=suite)
    x0, y0, _, _ = suite.floor.bounds
    with pytest.raises(OptionError, match=r"none of the floor's spaces.*corridor"):
        env.reset(options={"start": (x0 - 1.0, y0, 0.0), "goal": middle(suite.floor, 1)})
