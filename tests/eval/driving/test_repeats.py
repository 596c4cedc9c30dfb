"""Repeated episodes with a seeded jitter of the start."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
import shapely
from episode_rows import read_routes
from laboratories import put, small_laboratory

from labgym.cli.app import main
from labgym.errors import OptionError
from labgym.eval.driving.assignments import assignment_between, assignments, episode_keys, jittered_start
from labgym.eval.driving.drive import drive_layout, drive_pair
from labgym.eval.driving.episode_row import TransitionRow
from labgym.eval.driving.files import read_rows
from labgym.eval.evaluator import evaluate
from labgym.geometry import wrap_angle
from labgym.layouts import Layout
from labgym.navigation import OBSTACLE_HEIGHT, goal_pairs, shortest_path
from labgym.policies import make_policy
from labgym.suites import Jitter, Suite, load_suite

LAYOUT = small_laboratory("first")
JITTERED = Suite(name="mine", layouts=("first",), repeats=3, jitter=Jitter())


def test_every_pair_is_driven_as_often_as_the_suite_says_in_order() -> None:
    keys = episode_keys(LAYOUT, JITTERED)
    assert keys == tuple(f"first/{pair}/{repeat}" for pair in range(3) for repeat in range(3))
    assert [f"first/{one.pair.index}/{one.repeat}" for one in assignments(LAYOUT, JITTERED)] == list(keys)


def test_the_published_suites_start_every_episode_once_exactly_at_the_pair() -> None:
    for name in ("test", "val", "navdp_compat"):
        suite = load_suite(name)
        assert (suite.repeats, suite.jitter) == (1, None)
    (layout, *_) = load_suite("lab30").load_layouts()
    for assignment, pair in zip(assignments(layout, load_suite("lab30")), goal_pairs(layout), strict=True):
        assert assignment.pair == pair
        assert assignment.options == {"pair": pair.index}


def test_starts_are_uniform_in_the_disc_and_the_angle() -> None:
    pair = goal_pairs(LAYOUT)[1]
    jitter = Jitter(distance=0.05, angle=10.0)
    starts = np.array([jittered_start(LAYOUT, pair, repeat, jitter) for repeat in range(300)])
    away = np.linalg.norm(starts[:, :2] - pair.start[:2], axis=1)
    turned = np.array([wrap_angle(yaw - pair.start[2]) for yaw in starts[:, 2]])
    assert away.max() <= 0.05
    assert np.abs(turned).max() <= math.radians(10.0)
    # Uniform in a disc: the squared radius is uniform. Standard error of a mean of 300: 1 / sqrt(12 * 300) = 0.017.
    assert np.mean((away / 0.05) ** 2) == pytest.approx(0.5, abs=0.07)
    assert np.mean(np.abs(turned) / math.radians(10.0)) == pytest.approx(0.5, abs=0.07)
    assert np.abs((starts[:, :2] - pair.start[:2]).mean(axis=0)).max() < 0.006
    assert len(np.unique(starts[:, 0])) == 300


def test_starts_depend_on_layout_pair_repeat_and_the_suites_seed_alone() -> None:
    pair, other = goal_pairs(LAYOUT)[:2]
    start = jittered_start(LAYOUT, pair, 1, Jitter())
    assert start == jittered_start(LAYOUT.replace(id="renamed"), pair, 1, Jitter())
    moved = small_laboratory("first", 0.01)
    offsets = {
        tuple(np.round(np.subtract(jittered_start(layout, drive, repeat, jitter)[:2], drive.start[:2]), 9))
        for layout, drive, repeat, jitter in (
            (LAYOUT, pair, 1, Jitter()),
            (LAYOUT, pair, 2, Jitter()),
            (LAYOUT, other, 1, Jitter()),
            (LAYOUT, pair, 1, Jitter(seed=1)),
            (moved, goal_pairs(moved)[0], 1, Jitter()),
        )
    }
    assert len(offsets) == 5
    for seed in (0, 7):
        drives = drive_layout(make_policy("straight"), LAYOUT, JITTERED, "straight", seed)
        assert [drive.row.start for drive in drives] == [one.pair.start for one in assignments(LAYOUT, JITTERED)]


def test_a_jittered_robot_stands_clear_of_everything_even_when_obstacles_are_near() -> None:
    pair = goal_pairs(LAYOUT)[0]
    x, y, _ = pair.start
    # A stool 5 cm from the robot: half of a disc of 10 cm is blocked.
    crowded = LAYOUT.replace(placements=(*LAYOUT.placements, put("Stool", "LabStool", x, y - 0.56)))
    boxes = [shapely.Polygon(box.corners()) for box in crowded.obstacles(OBSTACLE_HEIGHT)]
    free = min(box.distance(shapely.Point(x, y)) for box in boxes)
    assert 0.30 < free < 0.40
    distances = []
    for repeat in range(60):
        start = jittered_start(crowded, pair, repeat, Jitter(distance=0.1))
        distances.append(min(box.distance(shapely.Point(start[:2])) for box in boxes))
        assert shortest_path(crowded, start, pair.goal) is not None
    assert min(distances) >= 0.30 - 1e-6
    assert min(distances) < 0.31


def test_a_pair_without_a_path_keeps_its_start() -> None:
    pair = goal_pairs(LAYOUT)[0]
    walled = LAYOUT.replace(placements=(*LAYOUT.placements, put("Stool", "LabStool", *pair.goal[:2])))
    assert shortest_path(walled, pair.start, pair.goal) is None
    assert jittered_start(walled, pair, 0, Jitter()) == pair.start


def test_rows_have_the_jittered_start_its_own_shortest_length_and_a_route_from_there(tmp_path) -> None:
    report = evaluate("astar", [LAYOUT], out=tmp_path, progress=False, repeats=2, jitter=Jitter())
    assert report.summary.expected == report.summary.episodes == 6
    assert report.summary.complete
    assert report.summary.suite.repeats == 2
    assert report.summary.suite.jitter == Jitter()
    pairs = goal_pairs(LAYOUT)
    assert [row.key for row in report.rows] == [f"first/{pair}/{repeat}" for pair in range(3) for repeat in range(2)]
    for row in report.rows:
        assert row.start != pairs[row.pair].start
        assert math.dist(row.start[:2], pairs[row.pair].start[:2]) <= 0.02
        assert row.goal == pairs[row.pair].goal
        assert report.routes[row.key][0] == pytest.approx(row.start, abs=5.1e-4)
        assert row.shortest_path_length == pytest.approx(shortest_path(LAYOUT, row.start, row.goal).length)
    assert len({row.path_length for row in report.rows}) == 6
    assert read_rows(tmp_path / "episodes.jsonl") == report.rows
    assert read_routes(tmp_path / "routes.jsonl") == report.routes
    again = evaluate("astar", [LAYOUT], out=tmp_path, progress=False, repeats=2, jitter=Jitter())
    assert again.rows == report.rows


def test_results_with_and_without_repeats_never_share_a_suite_name() -> None:
    suite = load_suite("test")
    labels = {
        one.label
        for one in (
            suite,
            suite.repeated(5),
            suite.repeated(5, Jitter()),
            suite.repeated(5, Jitter(distance=0.03)),
            suite.repeated(None, Jitter()),
        )
    }
    assert len(labels) == 5
    assert suite.repeated() is suite.repeated(1) is suite
    Suite.parse(suite.repeated(5, Jitter()).to_json())
    for repeats in (0, -1, 1001, 2.0, "2"):
        with pytest.raises(OptionError, match=r"repeats is .* from 1 to 1000"):
            suite.repeated(repeats)


def test_rows_and_routes_from_before_repeats_are_read_as_repeat_0(tmp_path) -> None:
    row = drive_pair("straight", LAYOUT).row
    data = row.model_dump(mode="json")
    del data["repeat"]
    (tmp_path / "episodes.jsonl").write_text(json.dumps(data) + "\n")
    (tmp_path / "routes.jsonl").write_text('{"layout": "first", "pair": 0, "poses": [[1.0, 2.0, 0.0]]}\n')
    assert read_rows(tmp_path / "episodes.jsonl") == (row,)
    assert TransitionRow.model_validate(data).repeat == 0
    assert read_routes(tmp_path / "routes.jsonl") == {"first/0/0": ((1.0, 2.0, 0.0),)}


def test_one_drive_between_two_points() -> None:
    row = drive_pair("astar", LAYOUT, start=(1.2, 5.0, 0.0), goal=(5.0, 1.5)).row
    assert row.success
    assert (row.pair, row.start, row.goal) == (-1, (1.2, 5.0, 0.0), (5.0, 1.5, 0.0))
    expected = shortest_path(LAYOUT, (1.2, 5.0), (5.0, 1.5))
    assert row.shortest_path_length == pytest.approx(expected.length)
    pair = goal_pairs(LAYOUT)[1]
    assert assignment_between(LAYOUT, 1, goal=(5.0, 1.5)).pair.start == pair.start
    with pytest.raises(OptionError, match="would touch an obstacle"):
        drive_pair("astar", LAYOUT, start=(3.2, 3.3, 0.0))


def test_the_command_line_repeats_jitters_and_drives_between_points(tmp_path, capsys) -> None:
    path = LAYOUT.save(tmp_path / "first.json")
    out = tmp_path / "out"
    assert (
        main(["eval", "--policy", "straight", "--layouts", str(path), "--repeats", "2", "--jitter", "--out", str(out)])
        == 0
    )
    assert len(read_rows(out / "episodes.jsonl")) == 6
    suite = json.loads((out / "summary.json").read_text())["suite"]
    assert (suite["repeats"], suite["jitter"]) == (2, {"distance": 0.02, "angle": 2.0, "seed": 0})
    assert main(["record", str(path), "--start", "1,x,0", "--out", str(tmp_path / "a.mp4")]) == 2
    assert "--start '1,x,0' must be numbers" in capsys.readouterr().err


def test_a_suite_file_can_repeat(tmp_path) -> None:
    suite = load_suite("test").model_copy(
        update={"name": "mine", "layouts": ("test-alk_03",), "repeats": 2, "jitter": Jitter(), "max_steps": 3}
    )
    path = suite.save(tmp_path / "mine.json")
    report = evaluate("straight", path, progress=False)
    layout: Layout = suite.load_layouts()[0]
    assert [row.key for row in report.rows] == list(episode_keys(layout, suite))
    assert {row.suite for row in report.rows} == {suite.label}
