from __future__ import annotations

import copy
import json
import math
import os
import pickle
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pytest
from PIL import Image

from labgym.envs.robot import ROBOT
from labgym.errors import OptionError
from labgym.eval.driving.drive import drive_layout
from labgym.eval.evaluator import evaluate
from labgym.geometry import rotate
from labgym.layouts import load_published, published
from labgym.policies import EpisodeStart, make_policy
from labgym.policies.http.client import HttpPolicy, SharedFlag, enlarged
from labgym.policies.http.connection import MAX_ANSWER, Connection, ServerError
from labgym.policies.http.forms import decode_form
from labgym.policies.http.wire import decode_color, decode_depth
from labgym.policies.policy import PolicyError
from labgym.policies.process import PolicyProcess, PolicySource
from labgym.suites import Suite

Answer = Callable[[str, bytes, str], tuple[int, bytes]]


class Script:
    """A server with scripted answers that records its requests."""

    def __init__(self, answer: Answer | None = None) -> None:
        self.answer: Answer = answer or straight_ahead
        self.heard: list[tuple[str, bytes, str]] = []

    @property
    def paths(self) -> list[str]:
        return [path for path, _, _ in self.heard]

    def form(self, index: int = -1) -> dict[str, bytes]:
        _, body, kind = self.heard[index]
        return decode_form(kind, body)


def straight_ahead(path: str, body: bytes, kind: str) -> tuple[int, bytes]:
    if path != "/pointgoal_step":
        return 200, b'{"algo": "script"}'
    return 200, steps([[0.1 * k, 0.0, 0.0] for k in range(1, 25)])


def steps(points: object) -> bytes:
    return json.dumps({"trajectory": [points], "all_trajectory": [[points]], "all_values": [[0.0]]}).encode()


@contextmanager
def serving(script: Script) -> Iterator[str]:
    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            script.heard.append((self.path, body, self.headers["Content-Type"]))
            status, data = script.answer(*script.heard[-1])
            self.send_response(status)
            self.send_header("Content-Length", str(len(data)))
            self.end_headers()
            self.wfile.write(data)

        def log_message(self, *arguments: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, args=(0.02,))
    thread.start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


@contextmanager
def raw_server(talk: Callable[[socket.socket], None]) -> Iterator[tuple[str, list[int]]]:
    """A server that does with each connection whatever `talk` does; and how many it had."""
    listener = socket.create_server(("127.0.0.1", 0))
    count = [0]

    def accept() -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            count[0] += 1
            with connection:
                try:
                    talk(connection)
                except OSError:
                    continue

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}", count
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        thread.join(5.0)


def start() -> EpisodeStart:
    return EpisodeStart(goal=(3.0, 1.0), rng=np.random.default_rng(0))


def observation(pose: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(3)
    distance, bearing = math.hypot(3.0, 1.0), math.atan2(1.0, 3.0)
    x = np.linspace(0, 255, 128)
    picture = np.broadcast_to(np.stack([x, 255 - x, 0 * x + 40], axis=-1), (72, 128, 3))
    return {
        "goal": np.array([distance, math.cos(bearing), math.sin(bearing)], np.float32),
        "velocity": np.array([0.25, -0.5], np.float32),
        "odometry": np.array(pose),
        "depth": rng.uniform(0.3, 10.0, 72 * 128).astype(np.float32),
        "rgb": picture.astype(np.uint8),
    }


def drive_once(url: str, **options: object) -> np.ndarray:
    policy = HttpPolicy(url, backoff=0.01, **options)
    policy.reset(start())
    return policy.act(observation())


def test_camera_images_and_intrinsics_have_the_benchmarks_format():
    script = Script()
    with serving(script) as url:
        drive_once(url)
    reset = json.loads(script.heard[0][1])
    assert set(reset) == {"intrinsic", "stop_threshold", "batch_size"}
    assert reset["batch_size"] == 1
    assert reset["intrinsic"][0][0] == pytest.approx(320.0 / math.tan(math.radians(34.0)))
    form = script.form()
    picture, depth = decode_color(form["image"], 1)[0], decode_depth(form["depth"], 1)[0]
    view = observation()
    assert picture.shape == (360, 640, 3)
    assert np.abs(picture[2::5, 2::5].astype(int) - view["rgb"]).max() <= 6
    expected = np.minimum(np.floor(view["depth"].reshape(72, 128) * np.float32(10000.0)) / 10000.0, 6.5535)
    np.testing.assert_allclose(depth[2::5, 2::5], expected, atol=1e-6)
    np.testing.assert_array_equal(depth, np.repeat(np.repeat(depth[2::5, 2::5], 5, axis=0), 5, axis=1))


def test_the_goal_is_in_the_cameras_ground_frame_and_the_state_is_the_odometry():
    script = Script()
    with serving(script) as url:
        policy = HttpPolicy(url)
        policy.reset(start())
        policy.act(observation((1.0, 2.0, 0.6)))
    goal = json.loads(script.form()["goal_data"])
    assert goal["goal_x"] == pytest.approx([3.0 - ROBOT.camera_forward], abs=1e-5)
    assert goal["goal_y"] == pytest.approx([1.0], abs=1e-5)
    state = json.loads(script.form()["state_data"])
    assert state["robot_pos"] == [[1.0, 2.0, 0.0]]
    assert state["robot_quat"] == [[0.0, 0.0, pytest.approx(math.sin(0.3)), pytest.approx(math.cos(0.3))]]


def test_the_state_is_left_out_if_it_is_not_requested():
    script = Script()
    with serving(script) as url:
        drive_once(url, send_state=False)
    assert set(script.form()) == {"image", "depth", "goal_data", "depth_time", "rgb_time"}


def test_the_server_is_reset_once_and_later_episodes_reset_the_robot():
    script = Script()
    with serving(script) as url:
        policy = HttpPolicy(url, replan=2)
        for _ in range(2):
            policy.reset(start())
            for _ in range(3):
                policy.act(observation())
    step = "/pointgoal_step"
    assert script.paths == ["/navigator_reset", step, step, "/navigator_reset_env", step, step]
    assert json.loads(script.heard[3][1]) == {"env_id": 0}


def test_after_a_failure_the_server_is_reset():
    script = Script(lambda path, *rest: (500, b"{}") if path == "/pointgoal_step" else (200, b'{"algo": "x"}'))
    with serving(script) as url:
        policy = HttpPolicy(url, backoff=0.01)
        for _ in range(2):
            policy.reset(start())
            with pytest.raises(ServerError):
                policy.act(observation())
    assert script.paths == ["/navigator_reset", "/pointgoal_step"] * 2


@pytest.mark.parametrize("width", [2, 3])
def test_a_trajectory_is_followed_in_the_start_frame(width):
    def to_the_left(path: str, body: bytes, kind: str) -> tuple[int, bytes]:
        if path != "/pointgoal_step":
            return straight_ahead(path, body, kind)
        return 200, steps([[0.02, 0.1 * k, 1.0][:width] for k in range(1, 25)])

    with serving(Script(to_the_left)) as url:
        forward, turn = drive_once(url)
    assert forward == 0.0
    assert turn > 0.5
    with serving(Script()) as url:
        forward, turn = drive_once(url)
    assert forward > 0.5
    assert turn == pytest.approx(0.0, abs=1e-9)


def test_a_server_that_was_restarted_is_reset():
    def forgotten(path: str, body: bytes, kind: str) -> tuple[int, bytes]:
        return (500, b"not loaded") if path == "/navigator_reset_env" else straight_ahead(path, body, kind)

    script = Script(forgotten)
    with serving(script) as url:
        policy = HttpPolicy(url)
        for _ in range(2):
            policy.reset(start())
    assert script.paths == ["/navigator_reset", "/navigator_reset_env", "/navigator_reset"]


def test_an_evaluation_resets_the_server_once_although_each_episode_has_a_process():
    script, layout = Script(), load_published("test", published("test")[0])
    with serving(script) as url:
        process = PolicyProcess(PolicySource.named(url, {"replan": 10}))
        try:
            drives = drive_layout(process, layout, Suite(name="brief", max_steps=2), "http", 0)
        finally:
            process.close()
    assert [drive.row.error for drive in drives] == [None] * len(drives)
    step = "/pointgoal_step"
    assert script.paths == ["/navigator_reset", step] + ["/navigator_reset_env", step] * (len(drives) - 1)
    assert len(drives) > 1


def test_a_policy_that_failed_in_one_process_resets_the_server_in_the_next():
    script = Script(lambda path, *rest: (500, b"{}") if path == "/pointgoal_step" else (200, b'{"algo": "x"}'))
    with serving(script) as url:
        process = PolicyProcess(PolicySource.named(url))
        try:
            for _ in range(2):
                process.reset(start())
                with pytest.raises(PolicyError):
                    process.act(observation())
        finally:
            process.close()
    assert script.paths == ["/navigator_reset", "/pointgoal_step"] * 2


def test_a_shared_flag_is_that_of_all_forks_and_a_copy_is_not_set():
    flag = SharedFlag()
    child = os.fork()
    if not child:
        flag.set(True)
        os._exit(0)
    os.waitpid(child, 0)
    assert flag
    assert not pickle.loads(pickle.dumps(flag))
    assert not copy.deepcopy(flag)


@pytest.mark.parametrize("step", ["nogoal", "imagegoal"])
def test_steps_without_a_goal_point_have_the_benchmarks_fields(step, tmp_path):
    picture = np.zeros((90, 160, 3), np.uint8)
    picture[..., 0] = 250
    Image.fromarray(picture).save(tmp_path / "view.png")
    options = {"goal_image": str(tmp_path / "view.png")} if step == "imagegoal" else {}
    script = Script(lambda path, *rest: straight_ahead(path.replace(step, "pointgoal"), *rest))
    with serving(script) as url:
        forward, _ = drive_once(url, step=step, send_state=False, **options)
    assert script.paths == ["/navigator_reset", f"/{step}_step"]
    assert set(script.form()) == {"image", "depth", "depth_time", "rgb_time", *(["goal"] if options else [])}
    if options:
        sent = decode_color(script.form()["goal"], 1)[0]
        assert sent.shape == (360, 640, 3)
        np.testing.assert_allclose(sent.reshape(-1, 3).mean(axis=0), [250, 0, 0], atol=3)
    assert forward > 0.5


@pytest.mark.parametrize(
    "options", [{"step": "pixelgoal"}, {"step": "imagegoal"}, {"goal_image": "a.png"}, {"approach": -1.0}]
)
def test_a_step_that_cannot_be_sent_is_refused(options):
    with pytest.raises(OptionError):
        HttpPolicy("http://127.0.0.1:8888", **options)


def test_a_picture_of_the_goal_that_cannot_be_read_is_named(tmp_path):
    (tmp_path / "view.png").write_bytes(b"no picture")
    with pytest.raises(OptionError, match=r"view\.png"):
        HttpPolicy("http://127.0.0.1:8888", step="imagegoal", goal_image=str(tmp_path / "view.png"))


def test_a_step_that_the_server_does_not_have_is_named():
    script = Script(lambda path, *rest: (404, b"<html>") if "step" in path else straight_ahead(path, *rest))
    with serving(script) as url, pytest.raises(ServerError, match="/nogoal_step: status 404, the server does not have"):
        drive_once(url, step="nogoal")


def test_the_evaluator_learns_the_latency_of_a_server():
    process = PolicyProcess(PolicySource.named("http://127.0.0.1:8888", {"latency": 0.12}))
    try:
        assert (process.latency, process.stops) == (0.12, False)
    finally:
        process.close()


def test_a_latency_is_declared_by_an_option():
    assert HttpPolicy("http://127.0.0.1:8888").latency == 0.0
    assert HttpPolicy("http://127.0.0.1:8888", latency=0.12).latency == 0.12
    with pytest.raises(OptionError, match="latency"):
        HttpPolicy("http://127.0.0.1:8888", latency=-0.1)


def towards_the_goal(path: str, body: bytes, kind: str) -> tuple[int, bytes]:
    """Answer with 24 points on the line from the lens to the goal."""
    if path != "/pointgoal_step":
        return straight_ahead(path, body, kind)
    goal = json.loads(decode_form(kind, body)["goal_data"])
    ends = np.array([goal["goal_x"][0], goal["goal_y"][0], 0.0])
    return 200, steps((np.arange(1, 25)[:, None] / 24.0 * ends).tolist())


@pytest.mark.parametrize("distance", [0.05, 0.12, 0.19, 0.21, 0.4, 1.0])
@pytest.mark.parametrize("bearing", [0.0, 0.8, math.pi])
def test_the_robots_axis_reaches_a_goal_however_near_it_is(distance, bearing):
    goal = np.array([distance * math.cos(bearing), distance * math.sin(bearing)])
    x, y, yaw, v, w = 0.0, 0.0, 0.0, 0.0, 0.0
    view = observation()
    with serving(Script(towards_the_goal)) as url:
        policy = HttpPolicy(url)
        policy.reset(start())
        for _ in range(60):
            ahead, left = rotate(goal[0] - x, goal[1] - y, -yaw)
            away, angle = math.hypot(ahead, left), math.atan2(left, ahead)
            view["goal"] = np.array([away, math.cos(angle), math.sin(angle)], np.float32)
            view["odometry"], view["velocity"] = np.array([x, y, yaw]), np.array([v, w], np.float32)
            v, w = ROBOT.twist(*policy.act(view))
            yaw += 0.05 * w
            x, y = x + 0.1 * v * math.cos(yaw), y + 0.1 * v * math.sin(yaw)
            yaw += 0.05 * w
    assert math.dist((x, y), goal) < 0.05
    assert (v, w) == (0.0, 0.0)


def test_a_trajectory_shorter_than_the_lens_is_ahead_is_followed():
    def short(path: str, body: bytes, kind: str) -> tuple[int, bytes]:
        points = [[0.15 * k / 24, 0.0, 0.0] for k in range(1, 25)]
        return (200, steps(points)) if path == "/pointgoal_step" else straight_ahead(path, body, kind)

    with serving(Script(short)) as url:
        forward, turn = drive_once(url)
    assert forward > 0.1
    assert turn == pytest.approx(0.0, abs=1e-9)


def test_a_trajectory_without_length_stops_the_robot():
    def stay(path: str, body: bytes, kind: str) -> tuple[int, bytes]:
        return (200, steps([[0.0, 0.0, 0.0]] * 24)) if path == "/pointgoal_step" else straight_ahead(path, body, kind)

    with serving(Script(stay)) as url:
        assert drive_once(url) == pytest.approx([0.0, 0.0])


BROKEN = {
    "empty": b"",
    "html": b"<html>Internal Server Error</html>",
    "list": b"[]",
    "no key": b'{"all_values": []}',
    "text": b'{"trajectory": "left"}',
    "null": b'{"trajectory": null}',
    "ragged": b'{"trajectory": [[[0, 0, 0], [1, 1]]]}',
    "no batch": json.dumps({"trajectory": [[0.1, 0.0, 0.0]]}).encode(),
    "batch of two": json.dumps({"trajectory": [[[0.1, 0.0, 0.0]]] * 2}).encode(),
    "one column": json.dumps({"trajectory": [[[0.1]]]}).encode(),
    "four columns": json.dumps({"trajectory": [[[0.1, 0, 0, 0]]]}).encode(),
    "no points": b'{"trajectory": [[]]}',
    "many points": steps([[0.0, 0.0]] * 5000),
    "nan": b'{"trajectory": [[[NaN, 0, 0]]]}',
    "infinite": b'{"trajectory": [[[1e999, 0, 0]]]}',
    "far": b'{"trajectory": [[[1e6, 0, 0]]]}',
    "null inside": b'{"trajectory": [[[null, 0, 0]]]}',
    "objects": b'{"trajectory": [[[{}, 0, 0]]]}',
    "deep": b'{"trajectory": ' + b"[" * 50_000 + b"]" * 50_000 + b"}",
    "huge integer": b'{"trajectory": [[[' + b"9" * 10_000 + b", 0]]]}",
    "not utf-8": b'{"trajectory": "\xff\xfe"}',
    "huge": b" " * (MAX_ANSWER + 1),
}


@pytest.mark.parametrize("kind", BROKEN)
def test_an_invalid_trajectory_is_a_one_line_error(kind):
    script = Script(lambda path, *rest: (200, BROKEN[kind] if path == "/pointgoal_step" else b'{"algo": "x"}'))
    with serving(script) as url, pytest.raises(ServerError) as caught:
        drive_once(url)
    message = str(caught.value)
    assert f"{url}/pointgoal_step" in message
    assert "\n" not in message
    assert len(message) < 600
    assert script.paths == ["/navigator_reset", "/pointgoal_step"]


@pytest.mark.parametrize("answer", [b"{}", b'{"algo": 3}', b"[]", b'"navdp"', b"oops"])
def test_a_reset_that_names_no_algorithm_is_an_error(answer):
    with serving(Script(lambda *_: (200, answer))) as url, pytest.raises(ServerError, match="navigator_reset"):
        HttpPolicy(url).reset(start())


@pytest.mark.parametrize("status", [301, 400, 404, 418, 500])
def test_an_error_status_is_reported_with_the_servers_answer(status):
    script = Script(lambda *_: (status, b'{"error": "no GPU"}'))
    with serving(script) as url, pytest.raises(ServerError, match=f"status {status}.*no GPU"):
        HttpPolicy(url).reset(start())
    assert len(script.heard) == 1


def test_a_server_that_comes_up_late_is_waited_for():
    script = Script()
    script.answer = lambda *heard: (503, b"") if len(script.heard) <= 2 else straight_ahead(*heard)
    with serving(script) as url:
        HttpPolicy(url, retries=2, backoff=0.01).reset(start())
    assert len(script.heard) == 3


def test_the_number_of_retries_is_limited():
    script = Script(lambda *_: (503, b""))
    with serving(script) as url, pytest.raises(ServerError, match=r"503.*3 attempts"):
        HttpPolicy(url, retries=2, backoff=0.01).reset(start())
    assert len(script.heard) == 3


def test_a_server_that_is_down_is_named_with_the_remedy():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        url = f"http://127.0.0.1:{listener.getsockname()[1]}"
    with pytest.raises(ServerError, match=rf"{url}/navigator_reset: no connection.*is the server running"):
        HttpPolicy(url, retries=1, backoff=0.01).reset(start())


def test_a_server_that_hangs_up_is_retried_a_limited_number_of_times():
    with raw_server(lambda connection: None) as (url, count), pytest.raises(ServerError, match="broke"):
        HttpPolicy(url, retries=2, backoff=0.01).reset(start())
    assert count[0] == 3


def test_a_step_that_may_have_arrived_is_sent_once():
    asked: list[bytes] = []

    def talk(connection: socket.socket) -> None:
        head = connection.recv(65536)
        asked.append(head.partition(b" HTTP")[0])
        if b"reset" in asked[-1]:
            connection.sendall(b'HTTP/1.1 200 OK\r\nContent-Length: 13\r\n\r\n{"algo": "x"}')
        # A step finds its connection closed after a part of it was read.

    with raw_server(talk) as (url, _), pytest.raises(ServerError, match="is not repeated"):
        drive_once(url, retries=3)
    assert asked == [b"POST /navigator_reset", b"POST /pointgoal_step"]


@pytest.mark.parametrize("status", [502, 503, 504])
def test_a_step_is_not_repeated_after_an_error_of_a_gateway(status):
    script = Script(lambda path, *rest: (status, b"") if "step" in path else straight_ahead(path, *rest))
    with serving(script) as url, pytest.raises(ServerError, match=f"status {status}; .* is not repeated"):
        drive_once(url, retries=3)
    assert script.paths == ["/navigator_reset", "/pointgoal_step"]


def test_a_step_is_repeated_while_nothing_listens():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    served: list[bytes] = []

    def serve_late() -> None:
        time.sleep(0.3)
        with socket.create_server(("127.0.0.1", port)) as late:
            connection, _ = late.accept()
            with connection:
                served.append(connection.recv(65536))
                connection.sendall(b"HTTP/1.1 200 OK\r\nContent-Length: 2\r\n\r\n{}")

    thread = threading.Thread(target=serve_late)
    thread.start()
    try:
        answer = Connection(f"http://127.0.0.1:{port}", 8, 0.05).post(
            "/pointgoal_step", "text/plain", b"x", 5.0, idempotent=False
        )
    finally:
        thread.join()
    assert (answer, len(served)) == ({}, 1)


def test_an_answer_that_is_not_http_is_an_error():
    def talk(connection: socket.socket) -> None:
        connection.recv(65536)
        connection.sendall(b"SSH-2.0-OpenSSH_9.6\r\n\r\n")

    with raw_server(talk) as (url, _), pytest.raises(ServerError):
        HttpPolicy(url, retries=0).reset(start())


def test_a_truncated_answer_is_an_error():
    def talk(connection: socket.socket) -> None:
        connection.recv(65536)
        connection.sendall(b'HTTP/1.1 200 OK\r\nContent-Length: 1000\r\n\r\n{"algo": "x"}')

    with raw_server(talk) as (url, _), pytest.raises(ServerError, match="answer"):
        HttpPolicy(url, retries=0).reset(start())


@pytest.mark.parametrize("drip", [b"", b"X-Slow: 1\r\n"])
def test_a_server_that_is_slow_or_drips_times_out_and_is_not_retried(drip):
    gone = threading.Event()

    def talk(connection: socket.socket) -> None:
        connection.recv(65536)
        connection.sendall(b"HTTP/1.1 200 OK\r\n")
        while not gone.wait(0.05):
            connection.sendall(drip)

    with raw_server(talk) as (url, count):
        with pytest.raises(ServerError, match=r"no complete answer within 0\.4 s"):
            HttpPolicy(url, reset_timeout=0.4).reset(start())
        gone.set()
        assert count[0] == 1


@pytest.mark.parametrize(
    "url",
    [
        "http://",
        "ftp://127.0.0.1:8888",
        "127.0.0.1:8888",
        "http://127.0.0.1:port",
        "http://127.0.0.1:99999",
        "http://user:secret@127.0.0.1:8888",
        "http://127.0.0.1:8888/?a=1",
        "http://[::1",
        "http://a b",
        "http://host\0",
        f"http://{'a' * 300}",
        "http://127.0.0.1:8888/two words",
    ],
)
def test_an_invalid_url_is_refused_before_anything_is_sent(url):
    with pytest.raises(OptionError):
        Connection(url)


@pytest.mark.parametrize("options", [{"replan": 0}, {"step_timeout": 0.0}, {"retries": -1}, {"backoff": 1e9}])
def test_an_option_out_of_range_is_refused(options):
    with pytest.raises(OptionError):
        make_policy("http://127.0.0.1:8888", **options)


def test_a_url_names_a_policy():
    policy = make_policy("http://127.0.0.1:8888", step_timeout=3.0)
    assert isinstance(policy, HttpPolicy)
    assert policy.observation == "rgbd"
    assert not policy.privileged


def test_two_workers_cannot_share_a_server():
    with pytest.raises(OptionError, match="workers=1"):
        evaluate("http://127.0.0.1:8888", [load_published("test", published("test")[0])], workers=2, progress=False)


def test_an_evaluation_records_the_servers_latency_and_failure():
    script = Script()

    def third_fails(path: str, body: bytes, kind: str) -> tuple[int, bytes]:
        time.sleep(0.05)
        third = path == "/pointgoal_step" and script.paths.count(path) == 3
        return (500, b'{"error": "out of memory"}') if third else straight_ahead(path, body, kind)

    script.answer = third_fails
    layout = load_published("test", published("test")[0])
    suite = Suite(name="brief", max_steps=4)
    with serving(script) as url:
        policy = HttpPolicy(url, replan=1)
        drives = drive_layout(policy, layout, suite, "http", 0)
    rows = [drive.row for drive in drives]
    assert "out of memory" in rows[0].error
    assert [row.error for row in rows[1:]] == [None] * (len(rows) - 1)
    assert all(drive.planning_ms >= 50.0 for drive in drives)


def test_pictures_are_enlarged_by_whole_pixels():
    view = observation()
    picture, depth = enlarged(view)
    assert picture.shape == (360, 640, 3)
    np.testing.assert_array_equal(depth[2::5, 2::5], view["depth"].reshape(72, 128))
    np.testing.assert_array_equal(picture[2::5, 2::5], view["rgb"])
