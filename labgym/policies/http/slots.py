"""A server whose connections are bounded in number, and whose requests are bounded in time and size."""

from __future__ import annotations

import io
import socket
import threading
import time
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import TCPServer
from typing import Any

from labgym import __version__
from labgym.errors import OptionError


class Slots:
    """A bounded set of connections; if it is full, the one that has waited longest for its request is closed.

    Clients that send a byte now and then therefore cannot keep others out: a connection holds its slot for certain
    only from the last byte of its request to the answer.

    Args:
        most: largest number of connections.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._lock = threading.Lock()
        self._waiting: dict[socket.socket, None] = {}
        self._answering: set[socket.socket] = set()

    def enter(self, connection: socket.socket) -> bool:
        """Register a new connection; return False if all others are being answered."""
        with self._lock:
            if len(self._waiting) + len(self._answering) >= self._most:
                if not self._waiting:
                    return False
                oldest = next(iter(self._waiting))
                del self._waiting[oldest]
                with suppress(OSError):
                    oldest.shutdown(socket.SHUT_RDWR)
            self._waiting[connection] = None
            return True

    def request_complete(self, connection: socket.socket) -> None:
        """Protect a connection whose request has been read."""
        with self._lock:
            if connection in self._waiting:
                del self._waiting[connection]
                self._answering.add(connection)

    def answered(self, connection: socket.socket) -> None:
        """Let a connection wait for its next request."""
        with self._lock:
            if connection in self._answering:
                self._answering.remove(connection)
                self._waiting[connection] = None

    def leave(self, connection: socket.socket) -> None:
        """Forget a connection."""
        with self._lock:
            self._waiting.pop(connection, None)
            self._answering.discard(connection)


class TimedReader(io.RawIOBase):
    """The bytes of a connection; reading fails after a point in time, even if bytes keep arriving.

    Args:
        connection: the socket.

    Attributes:
        deadline: value of `time.monotonic` after which reading raises TimeoutError.
    """

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self.deadline = 0.0

    def readable(self) -> bool:
        """Return True."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read the next bytes into a buffer.

        Raises:
            TimeoutError: the deadline has passed.
        """
        left = self.deadline - time.monotonic()
        if left <= 0.0:
            raise TimeoutError
        self._connection.settimeout(left)
        return self._connection.recv_into(buffer)


class Budget:
    """Bytes that all requests together may take in memory.

    Args:
        most: largest sum of the requests' sizes.
    """

    def __init__(self, most: int) -> None:
        self._left = most
        self._lock = threading.Lock()

    def take(self, size: int) -> bool:
        """Reserve bytes; return False if too few are left."""
        with self._lock:
            if size > self._left:
                return False
            self._left -= size
            return True

    def give_back(self, size: int) -> None:
        """Release reserved bytes."""
        with self._lock:
            self._left += size


MAX_CONNECTIONS = 32
"""Largest number of open connections; beyond it, the one that has waited longest for its request is closed."""

REQUEST_TIME_S = 30.0
"""Seconds within which a whole request must arrive; those before its first byte count."""


class BoundedServer(ThreadingHTTPServer):
    """Serves each connection in a separate thread.

    Args:
        host, port: address to listen on; port 0 takes a free one.
        handler: answers the requests.

    Raises:
        OptionError: the address is not available.
    """

    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = MAX_CONNECTIONS

    def __init__(self, host: str, port: int, handler: type[BoundedHandler]) -> None:
        self.host, self.slots = host, Slots(MAX_CONNECTIONS)
        if not 0 <= port <= 65535:
            raise OptionError(f"port is {port}, expected 0 to 65535")
        try:
            super().__init__((host, port), handler)
        except OSError as error:
            raise OptionError(
                f"cannot listen on {host}:{port} ({error.strerror or error}); choose another port"
            ) from None

    def server_bind(self) -> None:
        """Bind without the name lookup of `HTTPServer`."""
        TCPServer.server_bind(self)
        self.server_name, self.server_port = str(self.server_address[0]), int(self.server_address[1])

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
        """Ignore clients that have disconnected."""


class BoundedHandler(BaseHTTPRequestHandler):
    """Reads each request in time; a subclass calls `slots.request_complete` after a body, and answers."""

    server: BoundedServer
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
        self._reader.deadline = time.monotonic() + REQUEST_TIME_S
        super().handle_one_request()
        self.server.slots.answered(self.connection)

    def content_length(self) -> int | None:
        """Return the length of the request's body, bytes; None without a valid header, or for a body in chunks."""
        length = self.headers.get("Content-Length", "")
        valid = length.isdecimal() and len(length) <= 12 and "Transfer-Encoding" not in self.headers
        return int(length) if valid else None

    def log_message(self, format: str, *arguments: Any) -> None:  # noqa: A002
        """Log nothing."""
