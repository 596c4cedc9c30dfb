"""A limit on the time of a whole HTTP exchange, connection and headers included."""

from __future__ import annotations

import contextlib
import socket
import threading
from types import TracebackType
from typing import Any, Self

import httpx2

OPENED = (".connect_tcp.complete", ".start_tls.complete")
"""Ends of the names of the client's events that return an open connection."""


class Deadline:
    """Breaks an exchange off when its time is over, also while the server sends headers byte by byte.

    The client's own timeout applies to each read alone. Used as a context manager around each exchange.

    Args:
        seconds: greatest duration of an exchange.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.passed = False
        self._socket: socket.socket | None = None
        self._timer: threading.Timer | None = None

    def __enter__(self) -> Self:
        self.passed = False
        self._timer = threading.Timer(self.seconds, self._break_off)
        self._timer.daemon = True
        self._timer.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        assert self._timer is not None
        self._timer.cancel()

    def watch(self, request: httpx2.Request) -> None:
        """Observe the connection of a request: a hook of the client."""
        request.extensions = {**request.extensions, "trace": self._trace}

    def _trace(self, event: str, info: dict[str, Any]) -> None:
        if event.endswith(OPENED):
            self._socket = info["return_value"].get_extra_info("socket")

    def _break_off(self) -> None:
        self.passed = True
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
