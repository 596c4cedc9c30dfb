"""The connections of a server: bounded in number, each request bounded in time."""

from __future__ import annotations

import io
import socket
import threading
import time
from contextlib import suppress
from typing import Any


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
