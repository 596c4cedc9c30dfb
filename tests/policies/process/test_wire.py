from __future__ import annotations

import os
import socket

import pytest

from labgym.policies.process.wire import receive_request, send_request


class Receiver:
    """The other end of a link, which closes once it has received a request, as a loader for one episode does."""

    def __init__(self) -> None:
        self.link, theirs = socket.socketpair()
        self.link.settimeout(10.0)
        self.request: tuple[bytes, bytes, int | None] | None = None
        receiver = self

        class Sending(socket.socket):
            def sendmsg(self, *arguments):
                sent = super().sendmsg(*arguments)
                receiver.request = receive_request(receiver.link)
                receiver.link.close()
                return sent

        self.sender = Sending(fileno=theirs.detach())


@pytest.mark.parametrize("content", [b"", b"content"])
def test_a_request_with_a_descriptor_arrives_in_one_message(content):
    receiver, (reading, writing) = Receiver(), os.pipe()
    with receiver.sender:
        send_request(receiver.sender, b"e", content, reading)
    assert receiver.request is not None
    kind, received, descriptor = receiver.request
    assert (kind, received) == (b"e", content)
    assert descriptor is not None
    os.write(writing, b"x")
    assert os.read(descriptor, 1) == b"x"
    for each in (reading, writing, descriptor):
        os.close(each)


def test_a_long_request_with_a_descriptor_arrives_whole():
    ours, theirs = socket.socketpair()
    ours.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    ours.settimeout(10.0)
    reading, writing = os.pipe()
    content = os.urandom(100_000)
    if os.fork() == 0:
        try:
            send_request(ours, b"e", content, reading)
        finally:
            os._exit(0)
    kind, received, descriptor = receive_request(theirs)
    os.wait()
    assert (kind, received) == (b"e", content)
    for each in (reading, writing, descriptor):
        os.close(each)
    ours.close(), theirs.close()
