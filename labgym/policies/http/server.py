"""Serve a policy with the NavDP benchmark's protocol, to its clients and to other labgyms."""

from __future__ import annotations

import json
from collections.abc import Callable
from email.message import Message
from http import HTTPStatus
from ipaddress import ip_address
from typing import Any
from urllib.parse import urlsplit

from labgym import __version__
from labgym.errors import DocumentError, one_line
from labgym.policies.http.fleet import Fleet, UnsupportedStepError
from labgym.policies.http.forms import decode_form
from labgym.policies.http.requests import json_object
from labgym.policies.http.slots import BoundedHandler, BoundedServer, Budget
from labgym.policies.http.wire import PATHS, WireError
from labgym.policies.policy import Policy

LOOPBACK_NAME = "localhost"

MAX_BODY = 64 * 1024 * 1024
"""Largest request, bytes."""

MAX_BODIES = 2 * MAX_BODY
"""Largest sum of the sizes of all requests that are read or answered at one time, bytes."""

ANSWER_TIME_S = 30.0
"""Seconds within which a client must read an answer."""


def browser_problem(headers: Message, host: str) -> str | None:
    """Return why a request may be that of a web page, or None.

    Browsers name the page's site in `Origin`, which no client of the protocol does. A page whose name has been made to
    resolve to 127.0.0.1 (DNS rebinding) still shows that name in `Host`; a server on a loopback address therefore
    accepts loopback names only.

    Args:
        headers: headers of the request; names compare without regard to case.
        host: address that the server listens on.
    """
    if "Origin" in headers or "Sec-Fetch-Site" in headers:
        return "requests of web pages are refused (header Origin or Sec-Fetch-Site)"
    name = _host_name(headers.get("Host", ""))
    if name and _is_loopback(host) and name != host.lower() and not _is_loopback(name):
        return f"Host is {name[:80]!r}, expected localhost or 127.0.0.1; use that name, or serve with --host"
    return None


def _host_name(header: str) -> str:
    try:
        return urlsplit(f"//{header.strip()}").hostname or ""
    except ValueError:
        return header.strip().lower()


def _is_loopback(name: str) -> bool:
    try:
        return name.lower() == LOOPBACK_NAME or ip_address(name).is_loopback
    except ValueError:
        return False


class NavigationServer(BoundedServer):
    """Answers the resets and steps of the protocol; one request drives at a time.

    The steps are `/pointgoal_step`, and `/imagegoal_step` and `/nogoal_step` if the policy has these `goal_kinds`;
    others are refused with status 404, as by the benchmark's servers. Each robot of a batch has its own policy.
    `stop_threshold` is accepted and ignored: our policies have their own thresholds. An answer has one trajectory per
    robot, with the value 0. Requests of web browsers are refused.

    Args:
        make: returns a new policy.
        host, port: address to listen on; port 0 takes a free one, which `url` contains.
        seed: random seed of the policies.
        report: receives why a request is refused, in one line, unless the previous one was refused for the same reason:
            the benchmark's clients do not show the answer.

    Raises:
        LabgymError: the policy needs the map, or fails on an empty frame.
        OptionError: the address is not available.
    """

    def __init__(
        self,
        make: Callable[[], Policy],
        host: str = "127.0.0.1",
        port: int = 8888,
        seed: int = 0,
        report: Callable[[str], None] | None = None,
    ) -> None:
        self.fleet = Fleet(make, seed)
        self.budget = Budget(MAX_BODIES)
        self._report, self._reported = report, ""
        super().__init__(host, port, _Handler)

    @property
    def url(self) -> str:
        """URL of the server."""
        host, port = self.server_address[:2]
        return f"http://{host if isinstance(host, str) else host.decode()}:{port}"

    def server_close(self) -> None:
        """Stop listening and close the policies."""
        super().server_close()
        self.fleet.close()

    def report_refusal(self, problem: str) -> None:
        """Report why a request is refused, unless the previous report said the same."""
        if self._report is not None and problem != self._reported:
            self._reported = problem
            self._report(problem)


class _Handler(BoundedHandler):
    server: NavigationServer

    def do_POST(self) -> None:  # noqa: N802
        """Answer a request of the protocol."""
        size = self._size()
        if size is None:
            return
        budget = self.server.budget
        if not budget.take(size):
            self.close_connection = True
            self._refuse(HTTPStatus.SERVICE_UNAVAILABLE, "too many large requests at one time; send it again later")
            return
        try:
            self._post(size)
        finally:
            budget.give_back(size)

    def _post(self, size: int) -> None:
        fleet = self.server.fleet
        try:
            body = self._body(size)
            if self.path == "/navigator_reset":
                fleet.reset(json_object(body, self.path))
                self._answer(HTTPStatus.OK, {"algo": fleet.name})
            elif self.path == "/navigator_reset_env":
                fleet.reset_one(json_object(body, self.path))
                self._answer(HTTPStatus.OK, {"algo": fleet.name})
            elif self.path in PATHS:
                kind = PATHS[self.path]
                fleet.check(self.path, kind)
                self._answer(HTTPStatus.OK, fleet.step(kind, decode_form(self.headers.get("Content-Type", ""), body)))
            else:
                self._refuse(HTTPStatus.NOT_FOUND, "unknown path; POST /navigator_reset, then /pointgoal_step")
        except UnsupportedStepError as error:
            self._refuse(HTTPStatus.NOT_FOUND, str(error))
        except (WireError, DocumentError) as error:
            self._refuse(HTTPStatus.BAD_REQUEST, str(error))
        except OSError:
            self.close_connection = True
        except Exception as error:  # noqa: BLE001 - a policy may raise anything, and the client must learn of it
            self._refuse(HTTPStatus.INTERNAL_SERVER_ERROR, f"policy {fleet.name!r}: {one_line(error, 400)}")

    def do_GET(self) -> None:  # noqa: N802
        """Return the name of the policy and the version."""
        if not self._is_from_browser():
            self._answer(HTTPStatus.OK, {"algo": self.server.fleet.name, "version": __version__})

    def _size(self) -> int | None:
        """Return the size of the request's body; refuse a request without a valid one, or of a web page."""
        if self._is_from_browser():
            return None
        length = self.content_length()
        if length is None:
            problem = "the request has no valid Content-Length"
        elif length > MAX_BODY:
            problem = f"the request has {length} bytes; at most {MAX_BODY} are read"
        else:
            return length
        self.close_connection = True
        self._refuse(HTTPStatus.BAD_REQUEST, problem)
        return None

    def _is_from_browser(self) -> bool:
        problem = browser_problem(self.headers, str(self.server.host))
        if problem is not None:
            self.close_connection = True
            self._refuse(HTTPStatus.FORBIDDEN, problem)
        return problem is not None

    def _body(self, size: int) -> bytes:
        body = self.rfile.read(size)
        if len(body) < size:
            raise ConnectionAbortedError
        self.server.slots.request_complete(self.connection)
        return body

    def _refuse(self, status: HTTPStatus, problem: str) -> None:
        self.server.report_refusal(problem[:500])
        self._answer(status, {"error": problem[:500]})

    def _answer(self, status: HTTPStatus, content: dict[str, Any]) -> None:
        data = json.dumps(content, allow_nan=False).encode()
        self.connection.settimeout(ANSWER_TIME_S)
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        if self.close_connection:
            self.send_header("Connection", "close")
        self.end_headers()
        self.wfile.write(data)
