from __future__ import annotations

import json
import os
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

from labgym.llm import LanguageModel, LanguageModelConfig

os.environ.setdefault("OMP_NUM_THREADS", "1")  # torch, in every worker and what it starts: threads would wait busily

KEY = "sk-loopback-0123456789"

# No test is judged by a clock: a loaded machine draws examples slowly.
settings.register_profile("labgym", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("labgym")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of tests/fuzz."""
    group = parser.getgroup("fuzz", "cases of tests/fuzz")
    group.addoption("--fuzz-cases", type=int, default=5, help="number of cases per loader")
    group.addoption("--fuzz-seed", type=int, default=0, help="random seed of the cases")
    group.addoption("--fuzz-first", type=int, default=0, help="number of the first case; 0 is the valid file")
    group.addoption("--fuzz-out", default="", help="folder for the cases that fail; default: the temporary folder")


LONG = Path(__file__).with_name("long_tests.txt")
"""The tests that `make test` leaves to `make test-long`; `.ci/long_tests` chooses them by their measured times."""


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the long tests, and as slow all cases of a test but the number that its mark `cases` states."""
    long = set(LONG.read_text(encoding="utf-8").split())
    for item in items:
        if item.nodeid.partition("[")[0] in long:
            item.add_marker("long")
    tests: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("cases"):
            tests.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for cases in tests.values():
        kept = cases[0].get_closest_marker("cases").args[0]
        every = {round(number * (len(cases) - 1) / max(1, kept - 1)) for number in range(kept)}
        for number, case in enumerate(cases):
            if number not in every:
                case.add_marker("slow")


@dataclass
class Loopback:
    """An OpenAI-compatible server on loopback that does what a test scripts, reply by reply; the last one is kept."""

    script: list[Callable[[BaseHTTPRequestHandler], None]] = field(default_factory=list)
    requests: list[dict[str, Any]] = field(default_factory=list)
    headers: list[dict[str, str]] = field(default_factory=list)
    released: threading.Event = field(default_factory=threading.Event)
    url: str = ""

    def says(self, text: str, **fields: Any) -> None:
        """Reply with a completion of that text."""
        message = {"role": "assistant", "content": text} | fields.pop("message", {})
        choice = {"index": 0, "message": message, "finish_reason": fields.pop("finish_reason", "stop")}
        usage = {"prompt_tokens": 100, "completion_tokens": 20, "total_tokens": 120}
        self.sends(200, {"id": "c", "object": "chat.completion", "choices": [choice], "usage": usage} | fields)

    def sends(self, status: int, body: Any, **headers: str) -> None:
        """Reply with that status and body."""
        raw = body if isinstance(body, bytes) else json.dumps(body).encode()

        def reply(handler: BaseHTTPRequestHandler) -> None:
            handler.send_response(status)
            handler.send_header("Content-Type", "application/json")
            handler.send_header("Content-Length", str(len(raw)))
            for name, value in headers.items():
                handler.send_header(name.replace("_", "-"), value)
            handler.end_headers()
            handler.wfile.write(raw)

        self.script.append(reply)

    def does(self, action: Callable[[BaseHTTPRequestHandler], None]) -> None:
        """Do something odd."""
        self.script.append(action)


@pytest.fixture
def loopback(monkeypatch: pytest.MonkeyPatch) -> Iterator[Loopback]:
    for name in ("HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "http_proxy", "https_proxy", "all_proxy"):
        monkeypatch.delenv(name, raising=False)
    state = Loopback()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            state.requests.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
            state.headers.append({name.lower(): value for name, value in self.headers.items()} | {"path": self.path})
            state.script[min(len(state.requests), len(state.script)) - 1](self)

        def log_message(self, *arguments: object) -> None:
            pass

    class Server(ThreadingHTTPServer):
        daemon_threads = True

        def handle_error(self, request: object, client_address: object) -> None:
            pass  # a client that hangs up is what some tests are about

    server = Server(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True)
    thread.start()
    state.url = f"http://127.0.0.1:{server.server_port}/v1"
    yield state
    state.released.set()
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.fixture
def waits() -> list[float]:
    """The seconds that the model of a test waited between its tries."""
    return []


@pytest.fixture
def model_at(loopback: Loopback, waits: list[float]) -> Callable[..., LanguageModel]:
    """Return a maker of clients of the loopback server."""

    def make(**fields: Any) -> LanguageModel:
        given = {"base_url": loopback.url, "model": "test-model", "api_key": KEY, "timeout": 60.0} | fields
        return LanguageModel(LanguageModelConfig.model_validate(given), sleep=waits.append)

    return make


@pytest.fixture
def call(tmp_path, monkeypatch, capsys):
    """Run the command line in an empty folder; returns exit code, standard output and standard error."""
    from labgym.cli import main

    monkeypatch.chdir(tmp_path)

    def run(*arguments: object) -> tuple[int, str, str]:
        code = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run
