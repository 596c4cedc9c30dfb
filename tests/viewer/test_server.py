"""The viewer's server answers its own page on loopback, and nobody else."""

from __future__ import annotations

import http.client
import json
from collections.abc import Callable
from typing import Any

import pytest
import trimesh

from labgym.errors import OptionError
from labgym.policies import make_policy
from labgym.scenes.mesh import scene_mesh
from labgym.viewer import Console, Show, ViewerServer
from labgym.viewer.server import MAX_BODY, MAX_STREAMS, PAGE


@pytest.fixture
def server(serve: Callable[[Show], ViewerServer], episodes, suite) -> ViewerServer:
    return serve(Show(episodes, suite, make_policy("straight"), "straight", Console()))


def ask(
    server: ViewerServer, path: str, method: str = "GET", body: bytes | None = None, **headers: str
) -> tuple[int, bytes, Any]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=120)
    try:
        connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
        answer = connection.getresponse()
        return answer.status, answer.read(), answer.headers
    finally:
        connection.close()


def command(server: ViewerServer, body: bytes, **headers: str) -> int:
    named = {"Content_Type": "application/json", "Origin": server.url.rstrip("/"), **headers}
    return ask(server, "/command", "POST", body, **named)[0]


def test_the_page_and_its_parts_are_served_and_may_load_nothing_from_elsewhere(server: ViewerServer) -> None:
    for path in PAGE:
        status, content, headers = ask(server, path)
        assert (status, len(content) > 500) == (200, True), path
        assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert b"http" not in ask(server, "/")[1].replace(b"http-equiv", b"")


def test_the_scene_has_the_surface_of_the_layout(server: ViewerServer, layout) -> None:
    status, content, _ = ask(server, "/episode/0.glb")
    assert status == 200
    scene = trimesh.load(trimesh.util.wrap_as_stream(content), file_type="glb")
    assert scene.area == pytest.approx(scene_mesh(layout).trimesh().area, rel=1e-4)
    robot = trimesh.load(trimesh.util.wrap_as_stream(ask(server, "/robot.glb")[1]), file_type="glb")
    # In glTF y points up; the robot is 1.32 m high and has a radius of 0.27 m.
    (x0, y0, z0), (x1, y1, z1) = robot.bounds
    assert (y0, y1) == (pytest.approx(0.0, abs=0.03), pytest.approx(1.32, abs=0.05))
    assert max(x1 - x0, z1 - z0) == pytest.approx(0.54, abs=0.06)


def test_an_episode_describes_its_drive(server: ViewerServer, episodes) -> None:
    content = json.loads(ask(server, "/episode/1.json")[1])
    pair = episodes[1].assignment.pair
    assert content["goal"] == list(pair.goal)
    assert content["path"][0] == pytest.approx(pair.start[:2], abs=1e-3)
    assert content["path"][-1] == pytest.approx(pair.goal[:2], abs=1e-3)
    assert len(json.loads(ask(server, "/episodes.json")[1])["episodes"]) == len(episodes)


@pytest.mark.parametrize("path", ["/episode/99.json", "/episode/-1.json", "/episode/0.txt", "/../setup.py", "/page/"])
def test_other_paths_do_not_exist(server: ViewerServer, path: str) -> None:
    assert ask(server, path)[0] == 404


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "lab.example"},
        {"Host": "192.168.0.9:8000"},
        {"Host": ""},
        {"Host": "["},
        {"Origin": "http://lab.example"},
        {"Origin": "null"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "same-site"},
    ],
)
def test_requests_of_other_sites_are_refused(server: ViewerServer, headers: dict[str, str]) -> None:
    assert ask(server, "/", **headers)[0] == 403
    assert command(server, b'{"paused": true}', **headers) == 403
    assert not server.show.console.paused


def test_a_tunnel_may_use_another_port(server: ViewerServer) -> None:
    assert ask(server, "/", Host="localhost:9999")[0] == 200
    assert command(server, b"{}", Host="localhost:9999", Origin="http://localhost:9999") == 204


def test_commands_are_taken_whole_or_not_at_all(server: ViewerServer) -> None:
    console = server.show.console
    assert command(server, b'{"paused": true, "speed": 2}') == 204
    assert (console.paused, console.speed) == (True, 2.0)
    for body in (b'{"speed": 1e9}', b'{"paused": false, "shell": "ls"}', b"[", b'{"forward": NaN}', b'{"episode": -1}'):
        assert command(server, body) == 400, body
    assert command(server, b" " * (MAX_BODY + 1)) == 413
    assert command(server, b"{}", Content_Length="\u00b2") == 413
    assert command(server, b"{}", Transfer_Encoding="chunked", Content_Length="2") == 413
    assert command(server, b"{}", Content_Type="text/plain") == 404
    assert ask(server, "/command", "POST", b'{"paused": false}', Content_Type="application/json")[0] == 403
    assert (console.paused, console.speed) == (True, 2.0)


def test_the_number_of_watching_pages_is_limited(server: ViewerServer) -> None:
    open_streams = []
    for _ in range(MAX_STREAMS):
        connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=120)
        connection.request("GET", "/events")
        assert connection.getresponse().status == 200
        open_streams.append(connection)
    assert ask(server, "/events")[0] == 503
    for connection in open_streams:
        connection.close()


def test_a_port_that_is_taken_is_named(server: ViewerServer) -> None:
    with pytest.raises(OptionError, match=str(server.server_port)):
        ViewerServer(server.show, server.server_port)
