"""Limits of the policy server against slow clients, many clients and web pages."""

from __future__ import annotations

import http.client
import socket
import threading
import time
from contextlib import suppress

import pytest

from labgym.policies import make_policy
from labgym.policies.http import slots
from labgym.policies.http.requests import MAX_JSON
from labgym.policies.http.server import NavigationServer
from labgym.policies.http.slots import MAX_CONNECTIONS, Budget


@pytest.fixture(scope="module")
def server():
    with NavigationServer(lambda: make_policy("straight"), port=0) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        yield server
        server.shutdown()
        thread.join()


def answer(server, headers, method="GET", path="/", body=b""):
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=120)
    connection.putrequest(method, path, skip_host=True)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders(body)
    response = connection.getresponse()
    return response.status, response.read().decode()


def dripping(server):
    connection = socket.create_connection(("127.0.0.1", server.server_port), timeout=120)
    connection.sendall(b"POST /navigator_reset HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n{")
    return connection


def test_clients_that_send_a_byte_now_and_then_keep_nobody_out(server):
    slow = [dripping(server) for _ in range(3 * MAX_CONNECTIONS)]
    status, _ = answer(server, {"Host": "127.0.0.1"})
    assert status == 200
    for connection in slow:
        connection.close()


def test_a_request_that_never_ends_is_cut_although_bytes_keep_arriving(server, monkeypatch):
    monkeypatch.setattr(slots, "REQUEST_TIME_S", 1.0)
    connection, sent = dripping(server), 1
    with suppress(ConnectionError):
        while sent < 99:  # of 100 bytes
            connection.sendall(b" ")
            sent += 1
            time.sleep(0.25)
    assert sent < 99
    connection.close()


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "127.0.0.1", "Origin": "http://page.example"},
        {"Host": "127.0.0.1", "Origin": "null"},
        {"Host": "127.0.0.1", "sec-fetch-site": "same-origin"},
        {"Host": "page.example:8888"},
        {"Host": "127.0.0.1.page.example"},
        {"Host": "[::1"},
    ],
)
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_requests_of_web_pages_are_refused(server, headers, method):
    body = b"{}" if method == "POST" else b""
    status, text = answer(server, {**headers, "Content-Length": str(len(body))}, method, "/navigator_reset", body)
    assert status == 403
    assert "error" in text


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost:8888", "LOCALHOST", "[::1]:8888", "127.0.0.2"])
def test_loopback_names_are_accepted(server, host):
    assert answer(server, {"Host": host})[0] == 200


def test_a_large_json_request_is_refused_before_it_is_parsed(server):
    body = b"[" + b"[]," * MAX_JSON + b"[]]"
    status, text = answer(
        server, {"Host": "localhost", "Content-Length": str(len(body))}, "POST", "/navigator_reset", body
    )
    assert status == 400
    assert f"at most {MAX_JSON} are read" in text


def test_requests_beyond_the_memory_of_the_server_are_told_to_come_again(server, monkeypatch):
    monkeypatch.setattr(server, "budget", Budget(10))
    status, text = answer(server, {"Host": "localhost", "Content-Length": "11"}, "POST", "/navigator_reset", b" " * 11)
    assert status == 503
    assert "later" in text
    status, _ = answer(server, {"Host": "localhost", "Content-Length": "2"}, "POST", "/navigator_reset_env", b"{}")
    assert status == 400  # no env_id; the bytes of the first request have been given back
