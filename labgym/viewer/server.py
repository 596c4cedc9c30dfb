"""Serves the viewer's page, the scenes and the running episode on loopback, and takes the page's commands."""

from __future__ import annotations

import io
import json
import threading
import time
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path
from socketserver import TCPServer
from typing import Any

from pydantic import ValidationError

from labgym import __version__
from labgym.documents import parse_json
from labgym.errors import DocumentError, LabgymError, OptionError
from labgym.policies.http.slots import Slots, TimedReader
from labgym.scenes.files import glb_bytes
from labgym.viewer.console import Command
from labgym.viewer.episodes import description
from labgym.viewer.origin import foreign_problem
from labgym.viewer.robot_glb import robot_glb
from labgym.viewer.show import Show

HOST = "127.0.0.1"
MAX_BODY = 1024
"""Largest command, bytes."""
MAX_CONNECTIONS = 32
"""Largest number of open connections; beyond it, the one that has waited longest for its request is closed."""
MAX_STREAMS = 6
"""Largest number of pages that watch."""
REQUEST_TIME = 30.0
"""Seconds within which a request must arrive; those before its first byte count."""
ANSWER_TIME = 10.0
"""Seconds within which a page must read a message."""
HEARTBEAT = 1.0
"""Seconds without a control step after which a page receives an empty message."""
SCENES = 4
"""Number of layouts whose scene stays in memory."""

TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
}
PAGE = {"/": "index.html"} | {f"/{name}": name for name in ("viewer.js", "plan.js", "viewer.css", "three.min.js")}
"""File of each path of the page."""
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self' blob:; img-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Content security policy: the page loads nothing from elsewhere."""


class ViewerServer(ThreadingHTTPServer):
    """Answers the page of a show, on 127.0.0.1 only.

    Args:
        show: the episodes and the drive in progress.
        port: port to listen on; 0 takes a free one, which `url` contains.

    Raises:
        OptionError: the port is not available.
    """

    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = MAX_CONNECTIONS

    def __init__(self, show: Show, port: int = 8000) -> None:
        self.show = show
        self.slots, self.streams = Slots(MAX_CONNECTIONS), threading.BoundedSemaphore(MAX_STREAMS)
        self.closing = threading.Event()
        self._scenes: dict[str, bytes] = {}
        self._compiling = threading.Lock()
        if not 0 <= port <= 65535:
            raise OptionError(f"port is {port}, expected 0 to 65535")
        try:
            super().__init__((HOST, port), _Handler)
        except OSError as error:
            raise OptionError(
                f"cannot listen on {HOST}:{port} ({error.strerror or error}); choose another port"
            ) from None

    @property
    def url(self) -> str:
        """URL of the page."""
        return f"http://{HOST}:{self.server_address[1]}/"

    def server_bind(self) -> None:
        """Bind without the name lookup of `HTTPServer`."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = HOST, int(self.server_address[1])

    def scene(self, number: int) -> bytes:
        """Return the scene of an episode's layout as binary glTF; the last ones stay in memory."""
        layout = self.show.episodes[number].layout
        with self._compiling:
            if layout.id not in self._scenes:
                content = glb_bytes(layout)
                while len(self._scenes) >= SCENES:
                    del self._scenes[next(iter(self._scenes))]
                self._scenes[layout.id] = content
            return self._scenes[layout.id]

    def process_request(self, request: Any, client_address: Any) -> None:
        """Accept a connection, or close it if all others are being answered."""
        if not self.slots.enter(request):
            self.shutdown_request(request)
            return
        super().process_request(request, client_address)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve a connection and release its slot."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.slots.leave(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore pages that have disconnected."""

    def server_close(self) -> None:
        """Stop listening and end the streams."""
        self.closing.set()
        super().server_close()


class _Handler(BaseHTTPRequestHandler):
    server: ViewerServer
    server_version = f"labgym/{__version__}"
    sys_version = ""
    protocol_version = "HTTP/1.1"

    def setup(self) -> None:
        """Read the connection with a time limit for each request."""
        super().setup()
        self.rfile.close()
        self._reader = TimedReader(self.connection)
        self.rfile = io.BufferedReader(self._reader)

    def handle_one_request(self) -> None:
        """Read a request within its time limit and answer it."""
        self._reader.deadline = time.monotonic() + REQUEST_TIME
        super().handle_one_request()
        self.server.slots.answered(self.connection)

    def do_GET(self) -> None:
        """Answer with a file of the page, a scene, an episode, or the stream of the drive."""
        if self._refused(changes=False):
            return
        path = self.path.partition("?")[0]
        if path in PAGE:
            name = PAGE[path]
            self._answer(HTTPStatus.OK, files("labgym.viewer").joinpath("page", name).read_bytes(), _type(name))
        elif path == "/robot.glb":
            self._answer(HTTPStatus.OK, robot_glb(), "model/gltf-binary")
        elif path == "/episodes.json":
            show = self.server.show
            labels = [episode.label for episode in show.episodes]
            self._json({"episodes": labels, "driver": show.label, "person": show.waits, "suite": show.suite.label})
        elif path == "/events":
            self._stream()
        else:
            self._episode_part(path)

    def do_POST(self) -> None:
        """Take a command."""
        if self._refused(changes=True):
            return
        length = self.headers.get("Content-Length", "")
        if not length.isdigit() or int(length) > MAX_BODY:
            self._problem(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"a command needs Content-Length, at most {MAX_BODY}")
            return
        body = self.rfile.read(int(length))
        self.server.slots.request_complete(self.connection)
        if self.path != "/command" or self.headers.get_content_type() != "application/json":
            self._problem(HTTPStatus.NOT_FOUND, "commands are JSON for /command")
            return
        try:
            command = Command.model_validate(parse_json(body, "command"))
        except (ValidationError, DocumentError):
            self._problem(HTTPStatus.BAD_REQUEST, "not a command")
            return
        self.server.show.console.command(command)
        self._answer(HTTPStatus.NO_CONTENT, b"", "application/json")

    def log_message(self, *_: Any) -> None:
        """Log nothing."""

    def _episode_part(self, path: str) -> None:
        """Answer with /episode/N.json or /episode/N.glb."""
        stem, _, kind = path.removeprefix("/episode/").partition(".")
        show = self.server.show
        if not (path.startswith("/episode/") and stem.isdecimal() and len(stem) < 7 and int(stem) < len(show.episodes)):
            self._problem(HTTPStatus.NOT_FOUND, "no such page")
            return
        try:
            if kind == "glb":
                self._answer(HTTPStatus.OK, self.server.scene(int(stem)), "model/gltf-binary")
            elif kind == "json":
                self._json(description(show.episodes[int(stem)], show.suite.success_distance))
            else:
                self._problem(HTTPStatus.NOT_FOUND, "no such page")
        except LabgymError as error:
            self._problem(HTTPStatus.INTERNAL_SERVER_ERROR, str(error))

    def _stream(self) -> None:
        """Send the moments of the drive as server-sent events until the page leaves; late pages skip moments."""
        server, show = self.server, self.server.show
        if not server.streams.acquire(blocking=False):
            self._problem(HTTPStatus.SERVICE_UNAVAILABLE, f"{MAX_STREAMS} pages watch already")
            return
        show.console.enter()
        try:
            self.close_connection = True
            self.connection.settimeout(ANSWER_TIME)
            self._head(HTTPStatus.OK, "text/event-stream", None)
            number = 0
            while not server.closing.is_set():
                number, moment = show.next_moment(number, HEARTBEAT)
                line = ": \n\n" if moment is None else f"data: {json.dumps(moment.record())}\n\n"
                self.wfile.write(line.encode())
        except OSError:
            return
        finally:
            show.console.leave()
            server.streams.release()

    def _refused(self, changes: bool) -> bool:
        problem = foreign_problem(self.headers, changes)
        if problem is not None:
            self._problem(HTTPStatus.FORBIDDEN, problem)
        elif not changes:
            self.server.slots.request_complete(self.connection)
        return problem is not None

    def _json(self, content: object) -> None:
        self._answer(HTTPStatus.OK, json.dumps(content).encode(), "application/json")

    def _problem(self, status: HTTPStatus, words: str) -> None:
        self.close_connection = True
        self._answer(status, f"{words}\n".encode(), "text/plain; charset=utf-8")

    def _answer(self, status: HTTPStatus, content: bytes, kind: str) -> None:
        self.connection.settimeout(ANSWER_TIME)
        self._head(status, kind, len(content))
        self.wfile.write(content)

    def _head(self, status: HTTPStatus, kind: str, length: int | None) -> None:
        self.send_response(status)
        self.send_header("Content-Type", kind)
        if length is not None:
            self.send_header("Content-Length", str(length))
        for name, value in (
            ("Cache-Control", "no-store"),
            ("Content-Security-Policy", POLICY),
            ("Cross-Origin-Resource-Policy", "same-origin"),
            ("Referrer-Policy", "no-referrer"),
            ("X-Content-Type-Options", "nosniff"),
            *((("Connection", "close"),) if self.close_connection else ()),
        ):
            self.send_header(name, value)
        self.end_headers()


def _type(name: str) -> str:
    return TYPES[Path(name).suffix]
