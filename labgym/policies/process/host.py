"""The host: imports labgym's policies once, forks a loader for each policy, watches their memory and ends them.

It runs no code of a policy: what loaders and episodes do cannot change how they are ended.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import json
import os
import select
import signal
import socket
import time
from collections.abc import Iterable
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

from labgym.confinement import linux
from labgym.policies.fingerprint.sources import is_installed_file
from labgym.policies.process.box import Grants, Protection, probe, system_rules
from labgym.policies.process.family import Process, descendants, end_of, kill_all, kill_group, processes, resident_bytes
from labgym.policies.process.loader import Boxed, prepare_for_maps, serve_loader
from labgym.policies.process.room import PrivateRoom, remove_left_rooms
from labgym.policies.process.source import MAPS
from labgym.policies.process.wire import FACTS, Answer, ClosedError, receive_request, send_answer

START, END, STOP, STATUS = b"t", b"n", b"p", b"s"
"""Requests to the host: start a loader on the descriptor sent along; end the episode of a loader; end a loader; how did
a loader end."""
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
    remove_left_rooms()
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
        self._rooms: dict[int, PrivateRoom] = {}
        """Rooms of the boxed loaders."""

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
        for loader in self._limits:
            kill_group(loader)
        kill_all(lambda table: descendants(os.getpid(), table))
        for room in self._rooms.values():
            room.remove()

    def _answer(self, kind: bytes, content: bytes, descriptor: int | None) -> None:
        request = json.loads(content)
        if kind == START and descriptor is not None:
            value: Any = self._start(descriptor, **request)
        elif kind == STATUS:
            value = end_of(request)
        else:
            value = self._exceeded.pop(request, 0)
            if request in self._limits:
                self._end(request, with_loader=kind == STOP)
        send_answer(self._link, Answer(FACTS, json.dumps(value).encode()))

    def _start(
        self, descriptor: int, memory: int, modules: list[str], grants: dict[str, Any] | None, quiet: bool
    ) -> list[Any]:
        """Return the id of a new loader, and the level of its box, "" for a loader of labgym's own policies."""
        _import_shared(modules, installed=grants is not None)
        host, level, room = os.getpid(), Protection(0, seccomp=False), None
        if grants is not None:
            level, room = probe(), PrivateRoom(quiet)
            system_rules()  # once for all loaders
            gc.freeze()
        child = os.fork()
        if child:
            _lead_group(child)
            os.close(descriptor)
            self._limits[child] = memory
            if room is not None:
                self._rooms[child] = room
            return [child, "" if room is None else str(level)]
        try:
            _lead_group(0)
            self._link.close()
            boxed = None
            if grants is not None and room is not None:
                inside = Grants.from_json({**grants, "private": str(room.private)})
                boxed = Boxed(room, inside if level.boxed else None)
            serve_loader(socket.socket(fileno=descriptor), host, boxed)
        finally:
            os._exit(0)

    def _end(self, loader: int, with_loader: bool) -> None:
        """Kill the descendants of a loader, and orphans that no loader adopted."""

        def selected(table: dict[int, Process]) -> set[int]:
            strays = {pid for pid, each in table.items() if each.parent == os.getpid() and pid not in self._limits}
            family = {*descendants(loader, table), *strays, *([loader] if with_loader else [])}
            return family.union(*(descendants(stray, table) for stray in strays))

        if with_loader or loader in self._rooms:
            kill_group(loader)
        kill_all(selected)
        if with_loader:
            del self._limits[loader]
            room = self._rooms.pop(loader, None)
            if room is not None:
                room.remove()
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
                kill_group(loader)
                kill_all(lambda table, loader=loader: {*descendants(loader, table), loader})  # type: ignore[misc]
        return max(WATCH_SECONDS, WATCH_SHARE * (time.perf_counter() - begin))


def _lead_group(process: int) -> None:
    """Make a new loader, or with 0 this process, the leader of a process group, which a boxed process cannot leave."""
    with contextlib.suppress(OSError):  # both processes do it, in either order
        os.setpgid(process, process)


def _import_shared(modules: Iterable[str], installed: bool) -> None:
    """Import modules that processes of policies need, once for all of them; they report what is missing.

    Args:
        modules: names. installed: whether to leave out those that are not installed, which a policy may have brought.
    """
    for module in modules:
        if installed and not _is_installed(module):
            continue
        with contextlib.suppress(Exception):
            importlib.import_module(module)
            if module == MAPS:
                prepare_for_maps()


def _is_installed(module: str) -> bool:
    spec = PathFinder.find_spec(module.partition(".")[0])
    return spec is not None and spec.origin is not None and is_installed_file(Path(spec.origin))
