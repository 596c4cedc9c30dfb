"""Requests to an untrusted server, bounded in time, size and number."""

from __future__ import annotations

import http.client
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from typing import Any
from urllib.parse import urlsplit

from labgym.documents import parse_json
from labgym.errors import DocumentError, LabgymError, OptionError

MAX_ANSWER = 8 * 1024 * 1024
"""Largest answer, bytes."""
CONNECT_TIMEOUT_S = 5.0
TRANSIENT_STATUSES = (502, 503, 504)
"""Status codes after which a request is repeated."""


class ServerError(LabgymError):
    """A server that is down, slow, or gives an invalid answer."""


class StatusError(ServerError):
    """An answer with an error status."""


class _TransientError(Exception):
    """The request failed, but may succeed if repeated.

    Args:
        reason: why it failed.
        sent: whether the server may have received it.
    """

    def __init__(self, reason: str, sent: bool) -> None:
        super().__init__(reason)
        self.sent = sent


class Connection:
    """Posts requests to one server. Each request opens a new connection, because some servers close theirs.

    Args:
        url: URL of the server, such as http://127.0.0.1:8888; https works, redirects and proxies do not.
        retries: number of repetitions after a failed connection. A request that timed out is not repeated: the server
            may still be processing it. Nor is one that changes the server's state and may have reached it.
        backoff: seconds before the first repetition, doubled before each further one.

    Raises:
        OptionError: the URL is invalid, or a number is out of range.
    """

    def __init__(self, url: str, retries: int = 3, backoff: float = 0.2) -> None:
        try:
            place = urlsplit(url)
            self._host, self._port = place.hostname, place.port
            (self._host or "").encode("idna")
        except ValueError as error:
            raise OptionError(f"{url[:200]!r} is not a URL ({error}); expected http://HOST:PORT") from None
        plain = not (place.query or place.fragment or place.username or place.password)
        blank = not url.isprintable() or " " in url
        if place.scheme not in ("http", "https") or not self._host or not plain or blank:
            raise OptionError(f"{url[:200]!r} is not the URL of a server; expected http://HOST:PORT")
        if not (0 <= retries <= 20 and 0.0 <= backoff <= 10.0):
            raise OptionError(f"retries is {retries} and backoff {backoff} s; expected 0 to 20 and 0 to 10 s")
        self.url = url.rstrip("/")
        self._secure, self._path = place.scheme == "https", place.path.rstrip("/")
        self._retries, self._backoff = retries, backoff

    def post(self, path: str, content_type: str, body: bytes, timeout: float, idempotent: bool = True) -> Any:
        """Send a request and return the JSON of the answer.

        Args:
            path: such as "/pointgoal_step".
            content_type, body: content type and body of the request.
            timeout: time limit of one attempt, from the first byte to the last, seconds.
            idempotent: whether the request may reach the server twice. If not, it is repeated only while no connection
                could be opened.

        Raises:
            ServerError: no connection after all retries, a broken one, no answer in time, a status other than 200, or
                an answer that is not JSON within the bounds of size, depth and magnitude.
        """
        for attempt in range(self._retries + 1):
            if attempt:
                time.sleep(self._backoff * 2 ** (attempt - 1))
            try:
                return self._attempt(path, content_type, body, timeout)
            except _TransientError as problem:
                reason = str(problem)
                if problem.sent and not idempotent:
                    raise ServerError(
                        f"{self.url}{path}: {reason}; the request may have reached the server and is not repeated"
                    ) from None
        attempts = f"{self._retries + 1} attempts" if self._retries else "1 attempt"
        raise ServerError(f"{self.url}{path}: {reason} after {attempts}; is the server running there?")

    def _attempt(self, path: str, content_type: str, body: bytes, timeout: float) -> Any:
        kind = http.client.HTTPSConnection if self._secure else http.client.HTTPConnection
        with closing(kind(self._host or "", self._port, timeout=min(timeout, CONNECT_TIMEOUT_S))) as connection:
            try:
                connection.connect()
                connection.sock.settimeout(timeout)
            except OSError as error:
                raise _TransientError(f"no connection ({error.strerror or error})", sent=False) from None
            with _deadline(connection.sock, timeout) as late:
                try:
                    return self._exchange(connection, path, content_type, body)
                except (OSError, http.client.HTTPException, ServerError) as error:
                    if late.is_set() or isinstance(error, TimeoutError):
                        raise ServerError(
                            f"{self.url}{path}: no complete answer within {timeout:g} s; is the server busy or loading?"
                        ) from None
                    if isinstance(error, OSError):
                        raise _TransientError(
                            f"the connection broke ({error.strerror or type(error).__name__})", sent=True
                        ) from None
                    if isinstance(error, ServerError):
                        raise
                    raise ServerError(f"{self.url}{path}: the answer is not HTTP ({type(error).__name__})") from None

    def _exchange(self, connection: http.client.HTTPConnection, path: str, content_type: str, body: bytes) -> Any:
        connection.request("POST", self._path + path, body, {"Content-Type": content_type, "Connection": "close"})
        with connection.getresponse() as response:
            length = response.getheader("Content-Length")
            if length is not None and not (length.isascii() and length.isdecimal()):
                raise ServerError(f"{self.url}{path}: the answer has the Content-Length {length[:40]!r}")
            answer = response.read(MAX_ANSWER + 1)
            if len(answer) > MAX_ANSWER:
                raise ServerError(f"{self.url}{path}: the answer has more than {MAX_ANSWER} bytes")
            if response.length:
                raise http.client.IncompleteRead(b"", response.length)
        if response.status in TRANSIENT_STATUSES:
            raise _TransientError(f"status {response.status}", sent=True)
        if response.status != 200:
            text = answer[:200].decode("utf-8", "replace")
            reason = "expected 200" if response.status != 404 else "the server does not have this request"
            raise StatusError(f"{self.url}{path}: status {response.status}, {reason}; answer: {text!r}")
        try:
            return parse_json(answer, f"{self.url}{path}")
        except DocumentError as error:
            raise ServerError(f"{error}; expected a JSON answer of the NavDP benchmark's protocol") from None


@contextmanager
def _deadline(sock: socket.socket, seconds: float) -> Iterator[threading.Event]:
    """Cut a connection after some seconds, even if bytes keep arriving; then the event is set."""
    late = threading.Event()

    def cut() -> None:
        late.set()
        with suppress(OSError):
            sock.shutdown(socket.SHUT_RDWR)

    timer = threading.Timer(seconds, cut)
    timer.daemon = True
    timer.start()
    try:
        yield late
    finally:
        timer.cancel()
