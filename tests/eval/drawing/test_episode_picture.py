"""The picture of an episode: what its view shows, the part of the floor on its plan, and the command that makes it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from labgym.cli import main
from labgym.envs.labnav.episodes import EpisodeTasks
from labgym.envs.labnav.nuisances import drawn_episode, people_at_start, prepared
from labgym.envs.labnav.tasks import TASKS, config_of
from labgym.envs.point_nav import LabPointNavEnv
from labgym.envs.robot_mesh import robot_mesh
from labgym.errors import OptionError, UnknownNameError
from labgym.eval.drawing.episode_camera import LEAST_PIXELS
from labgym.eval.drawing.episode_picture import EpisodeWorld, check_picture_path, episode_picture
from labgym.eval.drawing.episode_plan import neck_of, route_of
from labgym.eval.drawing.episode_view import spot_of, stage_of
from labgym.navigation import PLANNING_RADIUS, ShortestPaths
from labgym.scenes.cutaway import uppers
from labgym.scenes.mesh import joined, scene_mesh
from labgym.scenes.tracing import trace_view


@pytest.fixture(scope="module")
def worlds():
    """The world of an episode of some tasks."""
    found = {}
    for task in ("people", "aisle", "glass", "moved"):
        layout, episode = drawn_episode(task, 2, 4)
        found[task] = EpisodeWorld.of(task, 2, episode, layout)
    return found


@pytest.mark.parametrize("task", ["people", "glass", "moved"])
def test_the_world_before_the_start_is_that_of_the_environment(worlds, task):
    world = worlds[task]
    layout, episode = drawn_episode(task, 2, 4)
    env = LabPointNavEnv(config=config_of(task, 2, tasks=EpisodeTasks(layout, (episode,))))
    env.reset(seed=episode.seed)
    assert env.state.task.layout.hash == world.task.layout.hash
    assert dict(env.state.task.pushable) == dict(world.task.pushable)
    seen = {body.name: body.pose[:2] for body in env.state.bodies if body.name.startswith("person")}
    drawn = {body.name: body.pose[:2] for body in people_at_start(world.task) if body.name.startswith("person")}
    assert set(seen) == set(drawn)
    for name, place in drawn.items():
        assert math.dist(place, seen[name]) < 0.3  # bodies of one name are torso and legs
    env.close()


def test_equal_seeds_draw_equal_episodes_of_every_task():
    for task in TASKS:
        first, second = drawn_episode(task, 1, 5), drawn_episode(task, 1, 5)
        assert first[1] == second[1]
        assert first[0].id.startswith("floors-val")
    assert drawn_episode("people", 1, 5)[1] != drawn_episode("people", 1, 6)[1]


def test_the_robot_stands_on_its_route_before_the_hard_place(worlds):
    for world in worlds.values():
        route = route_of(world.task)
        spot = spot_of(world.task, route, people_at_start(world.task))
        space = ShortestPaths(world.task.layout, PLANNING_RADIUS - 0.01).space  # the route touches corners
        assert space.holds(np.array([spot.robot[:2]]))[0]
        gap = np.linalg.norm(route - spot.robot[:2], axis=1).min()
        assert gap < np.linalg.norm(np.diff(route, axis=0), axis=1).max()
    pane = next(one for one in worlds["glass"].task.layout.placements if "GlassScreen" in one.asset)
    assert spot_of(worlds["glass"].task, route_of(worlds["glass"].task)).hard == pytest.approx(pane.position[:2])


def test_a_wider_disc_does_not_fit_in_the_neck(worlds):
    task = worlds["aisle"].task
    points = neck_of(task)
    assert len(points)
    assert ShortestPaths(task.layout, 0.34).space.holds(points).all()
    assert not ShortestPaths(task.layout, 0.41).space.holds(points).any()


def test_the_picture_has_plan_and_view(worlds):
    picture = episode_picture(worlds["people"], 320, 240, samples=1)
    assert picture.width == 320 + round(0.62 * 320)
    assert picture.height > 240
    with pytest.raises(OptionError, match="320x240"):
        episode_picture(worlds["people"], 100, 240)
    with pytest.raises(OptionError, match=r"\.png or \.jpg"):
        check_picture_path(Path("a.svg"))


@pytest.mark.parametrize("level", [1, 2, 3])
@pytest.mark.parametrize("task", list(TASKS))
def test_the_view_shows_the_robot_the_goal_and_what_makes_the_episode_hard(task, level):
    layout, episode = drawn_episode(task, level, 6)
    prepared_task = prepared(task, level, episode, layout)
    stage = stage_of(prepared_task, route_of(prepared_task), people_at_start(prepared_task))
    pixels = stage.pixels(stage.best_view(), (450, 280))
    assert set(pixels) == {"robot", "goal"} | ({"subject"} if task != "odometry" else set())
    assert min(pixels.values()) >= LEAST_PIXELS


def test_counted_pixels_are_those_that_change_in_the_picture_without_the_part(worlds):
    task = worlds["people"].task
    stage = stage_of(task, route_of(task), people_at_start(task))
    view = stage.best_view()
    hidden, size = stage.hidden(view), (225, 140)
    goal = stage.parts["goal"]
    others = joined(*(mesh for name, mesh in stage.parts.items() if name != "goal"))
    full, without = (
        trace_view(task.layout, view, *size, 1, added, hidden).astype(int) for added in (joined(others, goal), others)
    )
    changed = (np.abs(full - without).max(axis=2) > 40).sum() * (560 / 140) ** 2
    assert changed == pytest.approx(stage.pixels(view, size)["goal"], rel=0.25)


def test_a_pane_stays_in_the_picture_when_the_nearest_wall_is_cut_away(worlds):
    layout = worlds["glass"].task.layout
    panes = [k for k, one in enumerate(layout.placements) if "GlassScreen" in one.asset]
    mesh = scene_mesh(layout, uppers(layout.floor))
    assert panes
    assert set(panes) <= set(mesh.owner.tolist())


def test_the_robot_of_pictures_has_the_size_of_the_robot():
    vertices = robot_mesh().vertices
    assert np.hypot(*vertices[:, :2].T).max() < 0.32
    assert vertices[:, 2].min() >= -0.01
    assert vertices[:, 2].max() == pytest.approx(1.32, abs=0.05)


def test_the_command_writes_the_picture(tmp_path, capsys):
    out = tmp_path / "episode.jpg"
    size = ["--width", "320", "--height", "240"]
    assert main(["view", "--task", "dock", "--level", "1", "--seed", "2", "--out", str(out), *size]) == 0
    with Image.open(out) as picture:
        assert picture.size[0] == 518
    capsys.readouterr()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--task", "fly"], "LabNav task 'fly' not found"),
        (["--task", "people", "--level", "9"], "level of task 'people' '9' not found"),
        (["--task", "people", "--seed", "-1"], "expected at least 0"),
        (["--task", "people", "--episode", "nowhere/0"], "'nowhere/0' not found"),
        (["--task", "people", "--out", "a.svg"], "must end in .png or .jpg"),
        (["--task", "people", "--width", "10"], "is not between 320x240"),
        (["test-sub_01", "--task", "people"], "LAYOUTS has no effect with --task"),
        (["test-sub_01", "--level", "3"], "--level has no effect without --task"),
    ],
)
def test_bad_input_is_one_line(words, message, capsys):
    assert main(["view", *words]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_conditions_of_another_floor_are_refused():
    layout, episode = drawn_episode("moved", 2, 4)
    other, _ = drawn_episode("moved", 2, 7)
    assert other.id != layout.id
    with pytest.raises((OptionError, UnknownNameError)):
        prepared("moved", 2, episode, other)
