"""The host: imports labgym's policies once, forks a loader for each policy, watches their memory and ends them.

It runs no code of a policy: what loaders and episodes do cannot change how they are ended.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import select
import signal
import socket
import time

from labgym.policies.process import linux
from labgym.policies.process.family import Process, descendants, kill_all, processes, resident_bytes
from labgym.policies.process.loader import serve_loader
from labgym.policies.process.wire import FACTS, Answer, ClosedError, receive_request, send_answer

START, END, STOP = b"t", b"n", b"p"
"""Requests to the host: start a loader on the descriptor sent along; end the episode of a loader; end a loader."""
WATCH_SECONDS = 0.25
"""Time between two looks at the memory of loaders and episodes, seconds."""
WATCH_SHARE = 50
"""Pause after a look at the memory of all processes, as a multiple of the look's duration."""


def serve_host(link: socket.socket) -> None:
    """Serve the evaluator until it closes the link or dies, then end all loaders and episodes."""
    os.dup2(2, 1)  # what policies print must not mix with the evaluator's output
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        # A signal to a whole job is the evaluator's to handle; programs that a policy starts get the default back.
        signal.signal(number, lambda *_: None)
    linux.adopt_orphans()
    linux.deny_readers()
    host = _Host(link, os.getppid())
    try:
        with contextlib.suppress(ClosedError, OSError):
            host.serve()
    finally:
        host.end_everything()


class _Host:
    """The state of the host.

    Args:
        link: to the evaluator.
        evaluator: process id of the evaluator.
    """

    def __init__(self, link: socket.socket, evaluator: int) -> None:
        self._link, self._evaluator = link, evaluator
        self._limits: dict[int, int] = {}
        """Largest memory in bytes by the process id of the loader."""
        self._exceeded: dict[int, int] = {}
        """Memory of the families that were ended for it."""

    def serve(self) -> None:
        """Answer requests until the evaluator dies."""
        poll = select.poll()
        poll.register(self._link, select.POLLIN)
        wait = 1.0
        while os.getppid() == self._evaluator:
            if poll.poll(1e3 * wait):
                self._answer(*receive_request(self._link))
            else:
                wait = self._watch() if self._limits else 1.0
            wait = min(wait, 1.0) if self._limits else 1.0

    def end_everything(self) -> None:
        """Kill all descendants."""
        kill_all(lambda table: descendants(os.getpid(), table))

    def _answer(self, kind: bytes, content: bytes, descriptor: int | None) -> None:
        if kind == START and descriptor is not None:
            limit, *modules = json.loads(content)
            for module in modules:
                with contextlib.suppress(Exception):  # the loader reports it
                    importlib.import_module(module)
            send_answer(self._link, Answer(FACTS, json.dumps(self._start(descriptor, limit)).encode()))
            return
        number = int(content)
        exceeded = self._exceeded.pop(number, 0)
        if number in self._limits:
            self._end(number, with_loader=kind == STOP)
        send_answer(self._link, Answer(FACTS, json.dumps(exceeded).encode()))

    def _start(self, descriptor: int, limit: int) -> int:
        host = os.getpid()
        child = os.fork()
        if child:
            os.close(descriptor)
            self._limits[child] = limit
            return child
        try:
            self._link.close()
            serve_loader(socket.socket(fileno=descriptor), host)
        finally:
            os._exit(0)

    def _end(self, loader: int, with_loader: bool) -> None:
        """Kill the descendants of a loader, and orphans that no loader adopted."""

        def selected(table: dict[int, Process]) -> set[int]:
            strays = {pid for pid, each in table.items() if each.parent == os.getpid() and pid not in self._limits}
            family = {*descendants(loader, table), *strays, *([loader] if with_loader else [])}
            return family.union(*(descendants(stray, table) for stray in strays))

        kill_all(selected)
        if with_loader:
            del self._limits[loader]
        self._reap()

    def _reap(self) -> None:
        """Collect ended children; a loader stays a zombie until it is stopped, so that its number is not used again."""
        for pid, process in processes().items():
            if process.parent == os.getpid() and process.ended and pid not in self._limits:
                with contextlib.suppress(ChildProcessError):
                    os.waitpid(pid, os.WNOHANG)

    def _watch(self) -> float:
        """End families that use more memory than their limit; return the seconds until the next look."""
        begin = time.perf_counter()
        table = processes()
        for loader, limit in self._limits.items():
            family = descendants(loader, table)
            own, others = resident_bytes({loader}, table), resident_bytes(family, table)
            if max(own, others) > limit:
                self._exceeded[loader] = max(own, others)
                kill_all(lambda table, loader=loader: {*descendants(loader, table), loader})  # type: ignore[misc]
        return max(WATCH_SECONDS, WATCH_SHARE * (time.perf_counter() - begin))
