"""Frames between the evaluator and the processes of a policy.

Requests to a policy may carry any object, pickled. Answers of a policy are never unpickled: a status byte and a bounded
number of raw bytes, which the evaluator validates.
"""

from __future__ import annotations

import socket
import struct
import time
from dataclasses import dataclass

REQUEST = struct.Struct("<cQ")
"""Header of a request: kind and number of bytes that follow."""
ANSWER = struct.Struct("<cI")
"""Header of an answer: status and number of bytes that follow."""
ACTION = struct.Struct("<2f")
"""An action: forward and turn, float32."""

DECISION = struct.Struct("<?2f")
"""A decision: whether the policy stops, and an action, which counts if it does not."""

OK, FACTS, ACTING, DECIDED, PATH, FAILED = b"K", b"F", b"A", b"D", b"P", b"E"
SIZES = {OK: 0, ACTING: ACTION.size, DECIDED: DECISION.size}
"""Sizes of the answers of an episode by status, bytes."""
POINT = struct.Struct("<2d")
"""A point of a planned path: x and y, meters."""
MAX_POINTS = 10_000
MAX_BYTES = {**SIZES, FACTS: 2**20, PATH: MAX_POINTS * POINT.size, FAILED: 16_384}
"""Largest answer by status, bytes."""


class ClosedError(Exception):
    """The other process closed its end."""


class GarbageError(Exception):
    """The other process sent bytes that are not an answer."""


@dataclass(frozen=True)
class Answer:
    """An answer of unknown truth.

    Attributes:
        status: `OK`, `FACTS`, `ACTING`, `DECIDED`, `PATH` or `FAILED`.
        content: as many bytes as the status allows.
    """

    status: bytes
    content: bytes = b""


def send_request(link: socket.socket, kind: bytes, content: bytes = b"", descriptor: int | None = None) -> None:
    """Send a request, and a file descriptor with it.

    Raises:
        OSError: the other process closed its end, or the socket's timeout passed.
    """
    request = REQUEST.pack(kind, len(content)) + content
    sent = 0 if descriptor is None else socket.send_fds(link, [request], [descriptor])
    # A loader may close its end once it has the request: even an empty message more would fail.
    if sent < len(request):
        link.sendall(request[sent:])


def receive_request(link: socket.socket) -> tuple[bytes, bytes, int | None]:
    """Return kind, content and file descriptor of the next request.

    Raises:
        ClosedError: the evaluator closed its end.
    """
    header, descriptors, _, _ = socket.recv_fds(link, REQUEST.size, 1)
    if not header:
        raise ClosedError
    kind, size = REQUEST.unpack(header + _received(link, REQUEST.size - len(header)))
    return kind, _received(link, size), descriptors[0] if descriptors else None


def send_answer(link: socket.socket, answer: Answer) -> None:
    """Send an answer."""
    link.sendall(ANSWER.pack(answer.status, len(answer.content)) + answer.content)


def receive_answer(link: socket.socket, seconds: float) -> Answer:
    """Return the next answer of a process that is not trusted.

    Raises:
        TimeoutError: no whole answer came within the time limit.
        ClosedError: the process closed its end.
        GarbageError: the bytes are not an answer.
    """
    deadline = time.monotonic() + seconds
    status, size = ANSWER.unpack(_received(link, ANSWER.size, deadline))
    if size > MAX_BYTES.get(status, -1):
        raise GarbageError(f"status {status!r} with {size} bytes is not an answer")
    return Answer(status, _received(link, size, deadline))


def _received(link: socket.socket, size: int, deadline: float | None = None) -> bytes:
    """Return exactly `size` bytes."""
    parts = []
    while size:
        if deadline is not None:
            left = deadline - time.monotonic()
            if left <= 0.0:
                raise TimeoutError
            link.settimeout(left)
        try:
            part = link.recv(min(size, 1 << 20))
        except ConnectionError:
            raise ClosedError from None
        if not part:
            raise ClosedError
        parts.append(part)
        size -= len(part)
    return b"".join(parts)
