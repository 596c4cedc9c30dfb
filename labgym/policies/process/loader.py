"""The process that loads a policy once and forks for each episode, so that episodes share nothing."""

from __future__ import annotations

import contextlib
import gc
import mmap
import os
import pickle
import socket
import sys
from dataclasses import dataclass

from labgym.confinement import linux
from labgym.policies.fingerprint.reads import Reads
from labgym.policies.kernels import pin_torch
from labgym.policies.policy import Policy
from labgym.policies.process.box import Grants, enter
from labgym.policies.process.episode import serve_episode
from labgym.policies.process.facts import encode_error, encode_text, facts_of
from labgym.policies.process.family import descendants, end_of, processes
from labgym.policies.process.room import PrivateRoom
from labgym.policies.process.source import PolicySource
from labgym.policies.process.wire import FACTS, FAILED, Answer, ClosedError, receive_request, send_answer

LOAD, EPISODE, STATUS = b"l", b"e", b"s"
"""Requests to a loader: load a policy; begin an episode on the descriptor sent along; how did the last episode end."""


@dataclass(frozen=True)
class Boxed:
    """The box that a loader enters before it runs code of its policy. It then serves one episode itself.

    Attributes:
        room: private folder and output. grants: files besides the private folder; None if this kernel has no box.
    """

    room: PrivateRoom
    grants: Grants | None


@dataclass(frozen=True)
class LoadRequest:
    """A policy to load, and where.

    Attributes:
        path: `sys.path` for the policy. folder: its working folder.
        source: the policy, pickled, because it may need `path`.
        known: files of the policy's identity, if it was loaded before; None to find them.
    """

    path: tuple[str, ...]
    folder: str
    source: bytes
    known: tuple[str, ...] | None = None


def serve_loader(link: socket.socket, host: int, boxed: Boxed | None) -> None:
    """Load a policy and begin episodes until the evaluator closes the link.

    Args:
        link: to the evaluator. host: process id of the parent.
        boxed: the box of a foreign policy; None for labgym's own.
    """
    linux.die_with_parent(host)
    linux.adopt_orphans()
    linux.prefer_for_out_of_memory()
    linux.give_up_reading_others()
    with contextlib.suppress(ClosedError, OSError):
        _, content, _ = receive_request(link)
        try:
            if boxed is not None:
                boxed.room.settle(link.fileno())
                if boxed.grants is not None:
                    enter(boxed.grants)
            reads = Reads(None if boxed is None else boxed.room.private)
            request: LoadRequest = pickle.loads(content)  # noqa: S301 - from the evaluator
            policy, options = _loaded(request, reads, forks=boxed is None)
            single_use = boxed is not None or linux.thread_count() > 1 or bool(descendants(os.getpid(), processes()))
            files = reads.files_of(policy, options) if request.known is None else reads.know(request.known)
            answer = Answer(FACTS, facts_of(policy, files, reads.sources, single_use).model_dump_json().encode())
        except BaseException as error:  # noqa: BLE001 - whatever the policy raises is reported
            send_answer(link, Answer(FAILED, encode_error(error)))
            return
        send_answer(link, answer)
        printed = mmap.mmap(-1, 1) if boxed is None else bytearray(1)
        _serve_episodes(link, policy, reads, single_use, printed)


def _loaded(request: LoadRequest, reads: Reads, forks: bool) -> tuple[Policy, list[object]]:
    """Return a policy, whose files are recorded while it loads, and its options.

    Args:
        forks: whether the process will be forked for each episode.
    """
    sys.path[:] = request.path
    os.environ["PYTHONPATH"] = os.pathsep.join(path for path in request.path if path)  # of programs that it starts
    with contextlib.suppress(OSError):
        os.chdir(request.folder)
    source: PolicySource = pickle.loads(request.source)  # noqa: S301 - from the evaluator
    reads.begin()
    policy = source.make()
    pin_torch()
    if policy.privileged:
        prepare_for_maps()
    if forks:
        gc.collect()
    gc.freeze()  # the collector would look at all that was imported, again and again while the policy drives
    return policy, list(source.options.values())


def prepare_for_maps() -> None:
    """Import the modules that the map of an episode refers to, once for all episodes."""
    import labgym.layouts  # noqa: F401 - layouts are unpickled in the episodes
    from labgym.assets import Catalog

    Catalog.load()


def _serve_episodes(
    link: socket.socket, policy: Policy, reads: Reads, single_use: bool, printed: mmap.mmap | bytearray
) -> None:
    episode = 0
    while True:
        kind, _, descriptor = receive_request(link)
        if kind == STATUS:
            send_answer(link, Answer(FAILED, encode_text(end_of(episode))))
        elif descriptor is not None:
            _reap()
            with socket.socket(fileno=descriptor) as conversation:
                if single_use:
                    link.close()
                    serve_episode(policy, reads, conversation, printed)
                    return
                episode = _forked(link, policy, reads, conversation, printed)


def _forked(
    link: socket.socket, policy: Policy, reads: Reads, conversation: socket.socket, printed: mmap.mmap | bytearray
) -> int:
    """Return the id of a new process that drives one episode."""
    loader = os.getpid()
    child = os.fork()
    if child:
        return child
    try:
        link.close()
        linux.die_with_parent(loader)
        serve_episode(policy, reads, conversation, printed)
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(0)


def _reap() -> None:
    with contextlib.suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass
