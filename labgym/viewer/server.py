"""Serves the viewer's page, the scenes and the running episode on loopback, and takes the page's commands."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from email.message import Message
from http import HTTPStatus
from importlib.resources import files
from pathlib import Path
from urllib.parse import urlsplit

from pydantic import ValidationError

from labgym.documents import parse_json
from labgym.errors import DocumentError, LabgymError
from labgym.policies.http.slots import BoundedHandler, BoundedServer
from labgym.scenes.files import glb_bytes
from labgym.viewer.console import Command
from labgym.viewer.glb import robot_glb
from labgym.viewer.show import PacedShow

HOST = "127.0.0.1"

MAX_BODY = 1024
"""Largest command, bytes."""

MAX_STREAMS = 6
"""Largest number of pages that watch."""

ANSWER_TIME_S = 10.0
"""Seconds within which a page must read a message."""

HEARTBEAT_S = 1.0
"""Seconds without a control step after which a page receives an empty message."""

MOST_SCENES = 4
"""Number of layouts whose scene stays in memory."""

TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
}

PAGE = {"/": ("labgym.viewer", "page/index.html"), "/three.min.js": ("labgym.eval.reports", "templates/three.min.js")}
PAGE |= {f"/{name}": ("labgym.viewer", f"page/{name}") for name in ("viewer.js", "plan.js", "viewer.css")}
"""Package and file of each path of the page."""

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self' blob:; img-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Content security policy: the page loads nothing from elsewhere."""

LOOPBACK = ("127.0.0.1", "localhost", "::1")


def foreign_problem(headers: Message, changes: bool) -> str | None:
    """Return why a request may come from another site's page, or None.

    A page whose name has been made to resolve to 127.0.0.1 (DNS rebinding) still shows that name in `Host`. Browsers
    name the page of a request in `Origin`, and its relation to the server in `Sec-Fetch-Site`.

    Args:
        headers: headers of the request.
        changes: whether the request changes something; it then must name its origin.
    """
    host = headers.get("Host", "").strip().lower()
    try:
        name = urlsplit(f"//{host}").hostname
    except ValueError:
        name = None
    if name not in LOOPBACK:
        return f"Host is {host[:80]!r}, expected 127.0.0.1 or localhost"
    origin = headers.get("Origin")
    if origin is None and changes:
        return "a command needs the header Origin"
    if origin is not None and origin.lower() != f"http://{host}":
        return f"Origin is {origin[:80]!r}, expected http://{host[:80]}"
    if headers.get("Sec-Fetch-Site", "same-origin") not in ("same-origin", "none"):
        return "requests of other sites are refused (header Sec-Fetch-Site)"
    return None


class ViewerServer(BoundedServer):
    """Answers the page of a show, on 127.0.0.1 only.

    Args:
        show: the episodes and the drive in progress.
        port: port to listen on; 0 takes a free one, which `url` contains.

    Raises:
        OptionError: the port is not available.
    """

    def __init__(self, show: PacedShow, port: int = 8000) -> None:
        self.show = show
        self.streams = threading.BoundedSemaphore(MAX_STREAMS)
        self.closing = threading.Event()
        self._scenes: dict[str, bytes] = {}
        self._compiling = threading.Lock()
        super().__init__(HOST, port, _Handler)

    @property
    def url(self) -> str:
        """URL of the page."""
        return f"http://{HOST}:{self.server_address[1]}/"

    def scene(self, number: int) -> bytes:
        """Return the scene of an episode's layout as binary glTF; the last ones stay in memory."""
        layout = self.show.layout(number)
        with self._compiling:
            if layout.hash not in self._scenes:
                content = glb_bytes(layout)
                while len(self._scenes) >= MOST_SCENES:
                    del self._scenes[next(iter(self._scenes))]
                self._scenes[layout.hash] = content
            return self._scenes[layout.hash]

    def server_close(self) -> None:
        """Stop listening and end the streams."""
        self.closing.set()
        super().server_close()


class _Handler(BoundedHandler):
    server: ViewerServer

    def do_GET(self) -> None:  # noqa: N802
        """Answer with a file of the page, a scene, an episode, or the stream of the drive."""
        if self._refused(changes=False):
            return
        path = self.path.partition("?")[0]
        if path in PAGE:
            package, name = PAGE[path]
            self._answer(HTTPStatus.OK, files(package).joinpath(name).read_bytes(), _type(name))
        elif path == "/robot.glb":
            self._answer(HTTPStatus.OK, robot_glb(), "model/gltf-binary")
        elif path == "/episodes.json":
            show = self.server.show
            content = {"episodes": show.labels, "driver": show.label, "person": show.waits, "suite": show.suite_label}
            self._json(content)
        elif path == "/events":
            self._stream()
        elif path.startswith("/shape/"):
            self._shape(path)
        else:
            self._episode_part(path)

    def do_POST(self) -> None:  # noqa: N802
        """Take a command."""
        if self._refused(changes=True):
            return
        length = self.content_length()
        if length is None or length > MAX_BODY:
            self._problem(HTTPStatus.REQUEST_ENTITY_TOO_LARGE, f"a command needs Content-Length, at most {MAX_BODY}")
            return
        body = self.rfile.read(length)
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

    def _episode_part(self, path: str) -> None:
        """Answer with /episode/N.json or /episode/N.glb."""
        stem, _, kind = path.removeprefix("/episode/").partition(".")
        show = self.server.show
        if not (path.startswith("/episode/") and stem.isdecimal() and len(stem) < 7 and int(stem) < len(show.labels)):
            self._problem(HTTPStatus.NOT_FOUND, "no such page")
            return
        try:
            if kind == "glb":
                self._answer(HTTPStatus.OK, self.server.scene(int(stem)), "model/gltf-binary")
            elif kind == "json":
                self._json(show.description(int(stem)))
            else:
                self._problem(HTTPStatus.NOT_FOUND, "no such page")
        except LabgymError as error:
            self._problem(HTTPStatus.INTERNAL_SERVER_ERROR, str(error))

    def _shape(self, path: str) -> None:
        """Answer with /shape/N.glb."""
        stem, _, kind = path.removeprefix("/shape/").partition(".")
        known = kind == "glb" and stem.isdecimal() and len(stem) < 7
        content = self.server.show.shape(int(stem)) if known else None
        if content is None:
            self._problem(HTTPStatus.NOT_FOUND, "no such page")
        else:
            self._answer(HTTPStatus.OK, content, "model/gltf-binary")

    def _stream(self) -> None:
        """Send the moments of the drive as server-sent events until the page leaves; late pages skip moments."""
        server, show = self.server, self.server.show
        if not server.streams.acquire(blocking=False):
            self._problem(HTTPStatus.SERVICE_UNAVAILABLE, f"{MAX_STREAMS} pages watch already")
            return
        show.console.enter()
        try:
            self.close_connection = True
            self.connection.settimeout(ANSWER_TIME_S)
            self._head(HTTPStatus.OK, "text/event-stream", None)
            number = 0
            while not server.closing.is_set():
                number, moment = show.next_moment(number, HEARTBEAT_S)
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
        self.connection.settimeout(ANSWER_TIME_S)
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


def run_viewer(show: PacedShow, port: int, first: int = 0, opened: Callable[[str], None] = lambda _: None) -> None:
    """Serve a show on loopback and drive it in this thread until an exception such as KeyboardInterrupt ends it.

    Args:
        port: port to listen on; 0 takes a free one.
        first: number of the first episode.
        opened: receives the URL of the page.

    Raises:
        OptionError: the port is not available.
    """
    with ViewerServer(show, port) as server:
        thread = threading.Thread(target=server.serve_forever, name="viewer", daemon=True)
        thread.start()
        try:
            opened(server.url)
            show.run(first)
        finally:
            server.shutdown()
            thread.join()
