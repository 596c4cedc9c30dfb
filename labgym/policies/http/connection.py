"""Requests to a server that nobody vouches for: bounded in time, in size and in number."""

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
"""Bytes of an answer."""
CONNECT_TIMEOUT = 5.0
PASSING = (502, 503, 504)
"""States that a request may be repeated after."""


class ServerError(LabgymError):
    """A server that is down, slow, or answers what it should not."""


class _NotNowError(Exception):
    """The request failed in a way that may pass."""


class Connection:
    """Posts to one server. Each request has a connection of its own: some servers keep none open.

    Args:
        url: of the server, such as http://127.0.0.1:8888; https works, redirects and proxies do not.
        retries: how often a request is repeated whose connection failed. A request that timed out is not: the server
            may still be at it.
        backoff: seconds before the first repetition, doubled before each further one.

    Raises:
        OptionError: the URL is none, or a number is out of range.
    """

    def __init__(self, url: str, retries: int = 3, backoff: float = 0.2) -> None:
        try:
            place = urlsplit(url)
            self._host, self._port = place.hostname, place.port
        except ValueError as error:
            raise OptionError(f"{url[:200]!r} is no URL ({error}); expected http://HOST:PORT") from None
        plain = not (place.query or place.fragment or place.username or place.password)
        if place.scheme not in ("http", "https") or not self._host or not plain:
            raise OptionError(f"{url[:200]!r} is no URL of a server; expected http://HOST:PORT")
        if not (0 <= retries <= 20 and 0.0 <= backoff <= 10.0):
            raise OptionError(f"retries ({retries}) must be 0 to 20 and backoff ({backoff} s) 0 to 10")
        self.url = url.rstrip("/")
        self._secure, self._path = place.scheme == "https", place.path.rstrip("/")
        self._retries, self._backoff = retries, backoff

    def post(self, path: str, content_type: str, body: bytes, timeout: float) -> Any:
        """Send a request and return the JSON that it is answered with.

        Args:
            path: such as "/pointgoal_step".
            content_type, body: what is sent.
            timeout: seconds that one attempt may take from the first byte to the last.

        Raises:
            ServerError: no connection after all retries, no answer in time, an error's status, or no JSON within
                bounds of size, depth and magnitude.
        """
        for attempt in range(self._retries + 1):
            if attempt:
                time.sleep(self._backoff * 2 ** (attempt - 1))
            try:
                return self._attempt(path, content_type, body, timeout)
            except _NotNowError as problem:
                reason = str(problem)
        tries = f"after {self._retries + 1} attempts" if self._retries else "at once"
        raise ServerError(f"{self.url}{path}: {reason}, given up {tries}; is the server running there?")

    def _attempt(self, path: str, content_type: str, body: bytes, timeout: float) -> Any:
        kind = http.client.HTTPSConnection if self._secure else http.client.HTTPConnection
        with closing(kind(self._host or "", self._port, timeout=min(timeout, CONNECT_TIMEOUT))) as connection:
            try:
                connection.connect()
                connection.sock.settimeout(timeout)
            except OSError as error:
                raise _NotNowError(f"no connection ({error.strerror or error})") from None
            with _deadline(connection.sock, timeout) as late:
                try:
                    return self._exchange(connection, path, content_type, body)
                except (OSError, http.client.HTTPException, ServerError) as error:
                    if late.is_set() or isinstance(error, TimeoutError):
                        raise ServerError(
                            f"{self.url}{path}: no whole answer within {timeout:g} s; is it busy, or still loading?"
                        ) from None
                    if isinstance(error, OSError):
                        raise _NotNowError(f"the connection broke ({error.strerror or type(error).__name__})") from None
                    if isinstance(error, ServerError):
                        raise
                    raise ServerError(f"{self.url}{path}: no HTTP in the answer ({type(error).__name__})") from None

    def _exchange(self, connection: http.client.HTTPConnection, path: str, content_type: str, body: bytes) -> Any:
        connection.request("POST", self._path + path, body, {"Content-Type": content_type, "Connection": "close"})
        with connection.getresponse() as response:
            answer = response.read(MAX_ANSWER + 1)
            if len(answer) > MAX_ANSWER:
                raise ServerError(f"{self.url}{path}: an answer of more than {MAX_ANSWER} bytes")
            if response.length:
                raise http.client.IncompleteRead(b"", response.length)
        if response.status in PASSING:
            raise _NotNowError(f"status {response.status}")
        if response.status != 200:
            said = answer[:200].decode("utf-8", "replace")
            raise ServerError(f"{self.url}{path}: status {response.status}, expected 200; it says {said!r}")
        try:
            return parse_json(answer, f"{self.url}{path}")
        except DocumentError as error:
            raise ServerError(f"{error}; expected a JSON answer of the NavDP benchmark's protocol") from None


@contextmanager
def _deadline(sock: socket.socket, seconds: float) -> Iterator[threading.Event]:
    """Cut a connection off after some seconds, even where bytes keep dripping; the event then is set."""
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
