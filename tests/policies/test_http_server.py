from __future__ import annotations

import contextlib
import http.client
import json
import math
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator

import numpy as np
import pytest
import shapely
from laboratories import small_laboratory

from labgym.envs.robot import ROBOT
from labgym.envs.sensors import IMAGE_SHAPE
from labgym.errors import LabgymError, OptionError
from labgym.eval.driving.drive import TransitionDrive, drive_layout
from labgym.geometry import rotate
from labgym.layouts import Layout
from labgym.navigation import goal_pairs, occupancy
from labgym.policies import EpisodeStart, PathTracker, Policy, make_policy
from labgym.policies.grid_planner import GridPlanner
from labgym.policies.http.client import HttpPolicy, enlarged
from labgym.policies.http.fleet import MAX_BATCH
from labgym.policies.http.forms import encode_form
from labgym.policies.http.served import Frame, resampled_view, rolled_out
from labgym.policies.http.server import MAX_BODY, NavigationServer
from labgym.policies.http.wire import encode_color, encode_depth, intrinsic_matrix
from labgym.suites import Suite
from runs.killing import hear_interrupts

K = intrinsic_matrix(640, 360, ROBOT.camera_hfov).tolist()


class Diary(Policy):
    """Records its episodes and observations and drives in an arc."""

    name = "diary"
    observation = "rgbd"
    instances: list[Diary] = []  # noqa: RUF012

    def __init__(self) -> None:
        self.starts: list[EpisodeStart] = []
        self.observations: list[dict[str, np.ndarray]] = []
        Diary.instances.append(self)

    def reset(self, episode):
        self.starts.append(episode)

    def act(self, observation):
        self.observations.append(dict(observation))
        return np.array([0.5, 0.2])


class OnTheMap(Policy):
    """Follows the planner's path on a map that it was given before; knows the drive by its goal."""

    name = "on_the_map"
    observation = "depth"

    def __init__(self, layout: Layout) -> None:
        self._drives = []
        for pair in goal_pairs(layout):
            x, y, yaw = pair.start
            goal = rotate(pair.goal[0] - x, pair.goal[1] - y, -yaw)
            path = GridPlanner(occupancy(layout)).plan(pair.start[:2], pair.goal[:2])
            self._drives.append((goal, np.array([rotate(px - x, py - y, -yaw) for px, py in path])))

    def reset(self, episode):
        self._path = min(self._drives, key=lambda drive: math.dist(drive[0], episode.goal))[1]
        self._tracker = PathTracker(self._path)

    def act(self, observation):
        return self._tracker.action(tuple(observation["odometry"]), float(observation["velocity"][0]))

    def planned_path(self):
        return self._path


@contextlib.contextmanager
def served(make) -> Iterator[NavigationServer]:
    server = NavigationServer(make, port=0)
    thread = threading.Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@pytest.fixture(scope="module")
def diary() -> Iterator[NavigationServer]:
    with served(Diary) as server:
        yield server


def post(server: NavigationServer, path: str, body: bytes, kind: str = "application/json") -> tuple[int, dict]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=120)
    with contextlib.closing(connection):
        connection.request("POST", path, body, {"Content-Type": kind})
        response = connection.getresponse()
        return response.status, json.loads(response.read())


def reset(server: NavigationServer, batch: int = 1, **changes: object) -> tuple[int, dict]:
    content = {"intrinsic": K, "stop_threshold": -3.0, "batch_size": batch, **changes}
    return post(server, "/navigator_reset", json.dumps(content).encode())


def frames(batch: int = 1, state: object = None, **changes: object) -> tuple[bytes, str]:
    pictures = np.zeros((batch, 360, 640, 3), np.uint8)
    pictures[..., 0] = 200
    depth = np.stack([np.full((360, 640), 1.0 + k, np.float32) for k in range(batch)])
    goal = {"goal_x": [2.0 + k for k in range(batch)], "goal_y": [0.5] * batch}
    fields = {"goal_data": json.dumps(goal), "depth_time": "0", "rgb_time": "0"}
    if state is not None:
        fields["state_data"] = json.dumps(state)
    files = {
        "image": ("image.jpg", "image/jpeg", encode_color(pictures)),
        "depth": ("depth.png", "image/png", encode_depth(depth)),
    }
    for name, value in changes.items():
        (files if name in files else fields).pop(name, None)
        if isinstance(value, bytes):
            files[name] = ("x", "image/png", value)
        elif value is not None:
            fields[name] = json.dumps(value)
    kind, body = encode_form(fields, files)
    return body, kind


def step(
    server: NavigationServer, batch: int = 1, path: str = "/pointgoal_step", **changes: object
) -> tuple[int, dict]:
    return post(server, path, *frames(batch, **changes))


@pytest.mark.parametrize("batch", [1, 3])
def test_a_batch_is_answered_with_the_protocols_three_arrays(diary, batch):
    assert reset(diary, batch) == (200, {"algo": "diary"})
    status, answer = step(diary, batch)
    assert status == 200
    assert set(answer) == {"trajectory", "all_trajectory", "all_values"}
    assert np.array(answer["trajectory"]).shape == (batch, 24, 3)
    assert np.array(answer["all_trajectory"]).shape == (batch, 1, 24, 3)
    assert np.array(answer["all_values"]).shape == (batch, 1)


def test_each_robot_of_a_batch_has_its_own_policy_and_frames():
    with served(Diary) as server:
        first = Diary.instances[-1]
        reset(server, 2)
        second = Diary.instances[-1]
        step(server, 2)
    assert first is not second
    for k, policy in enumerate((first, second)):
        observations = policy.observations[-1]
        np.testing.assert_allclose(observations["depth"], 1.0 + k, atol=1e-4)
        np.testing.assert_allclose(observations["rgb"].reshape(-1, 3).mean(axis=0), [200, 0, 0], atol=3)
        distance = math.hypot(2.0 + k + ROBOT.camera_forward, 0.5)
        assert observations["goal"][0] == pytest.approx(distance, abs=1e-5)
        assert policy.starts[-1].goal == pytest.approx((2.0 + k + ROBOT.camera_forward, 0.5))
        assert policy.starts[-1].truth is None


def test_a_goal_beyond_the_environments_range_is_moved_nearer_in_the_same_direction():
    with served(Diary) as server:
        policy = Diary.instances[-1]
        reset(server)
        step(server, goal_data={"goal_x": [3000.0], "goal_y": [-4000.0]})
    assert math.hypot(*policy.starts[-1].goal) == pytest.approx(50.0)
    assert math.atan2(*policy.starts[-1].goal[::-1]) == pytest.approx(math.atan2(-4.0, 3.0), abs=1e-4)
    assert policy.observations[-1]["goal"][0] == pytest.approx(50.0)


def state(x: float, y: float, yaw: float) -> dict[str, object]:
    return {
        "robot_pos": [[x, y, 0.0]],
        "robot_quat": [[0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2)]],
        "velocity": [[0.4, -0.2]],
    }


def test_the_clients_pose_becomes_odometry_from_the_start_of_the_episode():
    with served(Diary) as server:
        policy = Diary.instances[-1]
        reset(server)
        begun = len(policy.starts)
        step(server, state=state(5.0, 2.0, math.pi / 2))
        step(server, state=state(5.0, 3.0, math.pi))
        assert policy.observations[-2]["odometry"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
        assert policy.observations[-1]["odometry"] == pytest.approx([1.0, 0.0, math.pi / 2])
        assert policy.observations[-1]["velocity"] == pytest.approx([0.4, -0.2])
        assert len(policy.starts) == begun + 1
        post(server, "/navigator_reset_env", b'{"env_id": 0}')
        step(server, state=state(5.0, 3.0, math.pi))
        assert policy.observations[-1]["odometry"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-12)
        assert len(policy.starts) == begun + 2


class Explorer(Diary):
    """A diary that drives to all kinds of goals."""

    name = "explorer"
    goal_kinds = ("point", "image", "none")


def test_a_step_without_a_goal_has_none_and_begins_an_episode():
    with served(Explorer) as server:
        policy = Diary.instances[-1]
        reset(server)
        for _ in range(2):
            status, answer = step(server, path="/nogoal_step", state=state(0.0, 0.0, 0.0), goal_data=None)
            assert status == 200
        explored = len(policy.starts)
        step(server, state=state(0.0, 0.0, 0.0))
    assert np.array(answer["trajectory"]).shape == (1, 24, 3)
    assert policy.starts[-2].goal_kind == "none"
    assert "goal" not in policy.observations[-2]
    assert len(policy.starts) == explored + 1
    assert policy.starts[-1].goal_kind == "point"
    assert "goal" in policy.observations[-1]


@pytest.mark.parametrize("shape", [(360, 640), (180, 320)])
def test_the_picture_of_a_goal_is_seen_as_by_our_camera(shape):
    rows = np.arange(shape[0]) * 256 // shape[0]
    pictures = np.zeros((2, *shape, 3), np.uint8)
    pictures[0, ..., 1] = rows[:, None]
    pictures[1, ..., 2] = 200
    with served(Explorer) as server:
        first = Diary.instances[-1]
        reset(server, 2)
        second = Diary.instances[-1]
        status, _ = step(server, 2, path="/imagegoal_step", goal_data=None, goal=encode_color(pictures))
    assert status == 200
    assert first.starts[-1].goal_kind == "image"
    seen = first.observations[-1]["goal_image"]
    assert seen.shape == (*IMAGE_SHAPE, 3)
    np.testing.assert_allclose(seen[..., 1].mean(axis=1), (np.arange(72) + 0.5) / 72 * 256, atol=6)
    np.testing.assert_allclose(second.observations[-1]["goal_image"][..., 2], 200, atol=3)
    assert "goal" not in first.observations[-1]


@pytest.mark.parametrize("path", ["/nogoal_step", "/imagegoal_step"])
def test_a_step_that_the_policy_does_not_know_is_refused_with_those_that_it_does(path):
    refusals: list[str] = []
    server = NavigationServer(Diary, port=0, report=refusals.append)
    thread = threading.Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    try:
        reset(server)
        answers = [step(server, path=path, goal_data=None) for _ in range(2)]
        status, _ = step(server)
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
    sentence = f"policy 'diary' has no {path}; it answers /pointgoal_step"
    assert answers == [(404, {"error": sentence})] * 2
    assert refusals == [sentence]
    assert status == 200


class Arrived(Diary):
    name = "arrived"

    def stop(self, observation):
        return observation["goal"][0] < 3.0


def test_a_policy_that_has_arrived_stands_still():
    with served(Arrived) as server:
        reset(server)
        _, near = step(server)
        _, far = step(server, goal_data={"goal_x": [5.0], "goal_y": [0.0]})
    assert not np.array(near["trajectory"]).any()
    assert np.array(far["trajectory"]).any()


def test_a_step_to_an_image_without_its_picture_is_refused():
    with served(Explorer) as server:
        reset(server)
        status, answer = step(server, path="/imagegoal_step", goal_data=None)
    assert status == 400
    assert "has no goal" in answer["error"]


def test_a_robot_cannot_be_reset_before_the_camera_is_known():
    with served(Diary) as server:
        status, answer = post(server, "/navigator_reset_env", b'{"env_id": 0}')
    assert status == 400
    assert "navigator_reset first" in answer["error"]


def test_without_a_pose_every_frame_begins_a_new_episode():
    with served(Diary) as server:
        policy = Diary.instances[-1]
        reset(server)
        begun = len(policy.starts)
        for _ in range(3):
            step(server)
        assert len(policy.starts) == begun + 3


def test_a_step_before_the_first_reset_says_what_is_missing():
    with served(Diary) as server:
        status, answer = step(server)
    assert status == 400
    assert "navigator_reset" in answer["error"]


@pytest.mark.parametrize(
    "changes",
    [
        {"image": None},
        {"depth": None},
        {"goal_data": None},
        {"image": b"no picture"},
        {"depth": b"no picture"},
        {"depth": encode_depth(np.ones((1, 36, 64)))},
        {"goal_data": {"goal_x": [1.0]}},
        {"goal_data": {"goal_x": [1.0, 2.0], "goal_y": [1.0, 2.0]}},
        {"goal_data": {"goal_x": ["a"], "goal_y": [0.0]}},
        {"goal_data": {"goal_x": [1e8], "goal_y": [0.0]}},
        {"goal_data": {"goal_x": [float("nan")], "goal_y": [0.0]}},
        {"goal_data": [1, 2]},
        {"state": {"robot_pos": [[0, 0, 0]], "robot_quat": [[0, 0, 1]]}},
        {"state": {"robot_pos": "here", "robot_quat": [[0, 0, 0, 1]]}},
    ],
)
def test_a_bad_step_is_refused_in_one_line_and_the_next_is_answered(diary, changes):
    reset(diary)
    status, answer = step(diary, **changes)
    assert status == 400
    assert list(answer) == ["error"]
    assert "\n" not in answer["error"]
    assert step(diary)[0] == 200


@pytest.mark.parametrize(
    "changes",
    [
        {"intrinsic": None},
        {"intrinsic": [[1, 2], [3, 4]]},
        {"intrinsic": [[0, 0, 0], [0, 0, 0], [0, 0, 1]]},
        {"intrinsic": [["a"] * 3] * 3},
        {"batch_size": 0},
        {"batch_size": MAX_BATCH + 1},
        {"batch_size": 10**9},
        {"batch_size": 1.5},
        {"batch_size": True},
    ],
)
def test_a_bad_reset_is_refused(diary, changes):
    status, answer = reset(diary, **changes)
    assert status == 400
    assert "error" in answer


@pytest.mark.parametrize("index", [b"-1", b"1", b'"0"', b"null", b"1e3"])
def test_a_reset_of_a_missing_robot_is_refused(diary, index):
    reset(diary, 1)
    assert post(diary, "/navigator_reset_env", b'{"env_id": ' + index + b"}")[0] == 400


@pytest.mark.parametrize("body", [b"", b"[]", b"{", b"[" * 100_000, b"\xff", b'{"intrinsic": NaN}'])
def test_a_body_that_is_not_a_json_object_is_refused(diary, body):
    assert post(diary, "/navigator_reset", body)[0] == 400


def test_other_paths_and_content_types_are_refused(diary):
    assert post(diary, "/shutdown", b"{}")[0] == 404
    assert post(diary, "/pointgoal_step", b"{}")[0] == 400


@pytest.mark.parametrize(
    "header",
    [
        b"",
        b"Content-Length: -1\r\n",
        b"Content-Length: %d\r\n" % (MAX_BODY + 1),
        b"Content-Length: 99999999999999999999\r\n",
        b"Content-Length: 4\r\nTransfer-Encoding: chunked\r\n",
    ],
)
def test_a_body_without_length_or_too_long_is_refused_unread(diary, header):
    with socket.create_connection(("127.0.0.1", diary.server_port), timeout=120) as connection:
        connection.sendall(b"POST /pointgoal_step HTTP/1.1\r\nHost: localhost\r\n" + header + b"\r\n")
        answer = b""
        while chunk := connection.recv(65536):
            answer += chunk
    assert answer.startswith(b"HTTP/1.1 400 ")


def test_a_client_that_disconnects_does_not_disturb_others(diary):
    for _ in range(3):
        with socket.create_connection(("127.0.0.1", diary.server_port), timeout=120) as connection:
            connection.sendall(b"POST /pointgoal_step HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000\r\n\r\nabc")
    reset(diary)
    assert step(diary)[0] == 200


class Moody(Diary):
    name = "moody"

    def act(self, observation):
        if len(self.starts) > 1:
            raise RuntimeError("not\ntoday")
        return np.zeros(2)


def test_a_policys_failure_is_reported_to_the_client():
    with served(Moody) as server:
        reset(server)
        status, answer = step(server)
    assert status == 500
    assert answer["error"] == "policy 'moody': RuntimeError: not today"


class Ranger(Diary):
    name = "ranger"

    def act(self, observation):
        return observation["lidar"][:2]


@pytest.mark.parametrize(
    ("make", "reason"),
    [(Ranger, "needs 'lidar'"), (lambda: make_policy("astar"), "needs the map")],
)
def test_policies_that_cannot_be_served_are_refused_at_the_start(make, reason):
    with pytest.raises(LabgymError, match=reason):
        NavigationServer(make, port=0)


def test_a_port_that_is_taken_or_invalid_is_named():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(OptionError, match=str(port)):
            NavigationServer(Diary, port=port)
    with pytest.raises(OptionError, match="70000"):
        NavigationServer(Diary, port=70000)


@pytest.mark.parametrize(("v", "w"), [(0.5, 0.4), (0.5, -0.4), (1.0, 1.5), (0.2, -1.5), (-0.2, 0.3)])
def test_a_command_rolls_out_along_its_circle(v, w):
    points = rolled_out(v, w)[:, :2] + (ROBOT.camera_forward, 0.0)
    radius = v / w
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 1] - radius), abs(radius), rtol=1e-9)
    assert np.linalg.norm(points[0]) == pytest.approx(2.0 * abs(radius * math.sin(w * ROBOT.control_dt / 2.0)))
    assert points[0, 0] * v > 0.0


def test_a_straight_command_rolls_out_straight_for_as_long_as_it_takes():
    points = rolled_out(0.8, 0.0)
    np.testing.assert_allclose(points[:, 0] + ROBOT.camera_forward, 0.08 * np.arange(1, 25))
    np.testing.assert_allclose(points[:, 1:], 0.0, atol=1e-12)


@pytest.mark.parametrize("w", [-1.5, -0.3, 0.3, 1.5])
def test_a_turn_in_place_becomes_a_trajectory_to_its_side(w):
    points = rolled_out(0.0, w)[:, :2] + (ROBOT.camera_forward, 0.0)
    bearings = np.arctan2(points[:, 1], points[:, 0])
    np.testing.assert_allclose(bearings, bearings[0])
    assert np.sign(bearings[0]) == np.sign(w)
    assert 0.5 <= abs(bearings[0]) <= math.pi / 2


def test_standing_still_is_a_trajectory_at_the_lens():
    assert not rolled_out(0.0, 0.0).any()


def test_a_frame_that_was_enlarged_comes_back_as_it_was():
    rng = np.random.default_rng(5)
    depth = rng.uniform(0.2, 6.0, IMAGE_SHAPE).astype(np.float32)
    depth[0, 0] = 10.0
    colour = rng.integers(0, 256, (*IMAGE_SHAPE, 3)).astype(np.uint8)
    large, far = enlarged({"depth": depth.ravel(), "rgb": colour})
    sent = Frame(large, np.minimum(far, np.float32(6.5535)), (1.0, 0.0), np.array(K))
    observations, back = resampled_view(sent)
    np.testing.assert_array_equal(observations, colour)
    np.testing.assert_array_equal(back, depth)


def test_images_of_a_wider_camera_are_cropped_to_our_field_of_view():
    wide = intrinsic_matrix(640, 360, math.radians(100.0))
    columns = np.broadcast_to(np.arange(640, dtype=np.float32), (360, 640)) / 1000.0
    frame = Frame(np.zeros((360, 640, 3), np.uint8), columns, (1.0, 0.0), wide)
    _, observations = resampled_view(frame)
    half = math.tan(math.radians(34.0)) * wide[0, 0]
    assert observations[0, 0] * 1000.0 == pytest.approx(320.0 - half * 127 / 128, abs=1.0)
    assert observations[0, -1] * 1000.0 == pytest.approx(320.0 + half * 127 / 128, abs=1.0)


def apart(one: TransitionDrive, other: TransitionDrive) -> float:
    """The greatest distance from a place on one route to the other, metres."""
    lines = [shapely.LineString([pose[:2] for pose in drive.route]) for drive in (one, other)]
    return float(lines[0].hausdorff_distance(lines[1]))


def test_a_planner_drives_the_same_routes_over_http_as_directly():
    layout, suite = small_laboratory("served"), Suite(name="short", max_steps=200)
    direct = drive_layout(OnTheMap(layout), layout, suite, "direct", 0)
    with served(lambda: OnTheMap(layout)) as server:
        remote = drive_layout(HttpPolicy(server.url), layout, suite, "remote", 0)
    assert len(direct) == len(remote) == len(goal_pairs(layout))
    for here, there in zip(direct, remote, strict=True):
        assert here.row.success
        assert there.row.success
        assert there.row.error is None
        assert apart(here, there) < 0.10
        assert there.row.path_length == pytest.approx(here.row.path_length, rel=0.03)
        assert there.planning_ms > 0.0


@pytest.mark.slow
def test_a_planner_with_a_map_arrives_over_http_as_without():
    layout, suite = small_laboratory("served"), Suite(name="short", max_steps=300)
    with served(lambda: make_policy("online_map")) as server:
        remote = drive_layout(HttpPolicy(server.url), layout, suite, "remote", 0)
    assert all(drive.row.success for drive in remote)
    assert all(drive.row.contacts == 0 for drive in remote)


def test_a_policy_without_a_path_drives_nearly_the_same_routes_over_http():
    layout = small_laboratory("served")
    suite = Suite(name="short", max_steps=15)
    direct = drive_layout(make_policy("straight"), layout, suite, "direct", 0)
    with served(lambda: make_policy("straight")) as server:
        remote = drive_layout(HttpPolicy(server.url, replan=1), layout, suite, "remote", 0)
    for here, there in zip(direct, remote, strict=True):
        assert there.row.error is None
        assert apart(here, there) < 0.25


def test_the_command_serves_until_ctrl_c():
    command = [sys.executable, "-m", "labgym.cli", "serve", "straight", "--port", "0", "--options", "turn_in_place=0.4"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=hear_interrupts
    ) as process:
        line = process.stdout.readline()
        policy = HttpPolicy(line.split(" at ")[1].partition(";")[0])
        policy.reset(EpisodeStart(goal=(3.0, 0.0), rng=np.random.default_rng(0)))
        process.send_signal(signal.SIGINT)
        _, complaint = process.communicate(timeout=300)
    assert line.startswith("Serving straight at http://127.0.0.1:")
    assert (process.returncode, complaint) == (0, "")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [(("astar",), "map"), (("strait",), "straight"), (("straight", "--options", "colour=red"), "colour")],
)
def test_the_command_reports_in_one_line_why_it_cannot_serve(capsys, arguments, reason):
    from labgym.cli import main

    assert main(["serve", *arguments, "--port", "0"]) == 2
    complaint = capsys.readouterr().err
    assert complaint.count("\n") == 1
    assert reason in complaint
