"""Work on a stranger's file in a confined process with limits, which answers with plain data."""

from __future__ import annotations

import json
import os
import resource
import select
import signal
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from labgym.confinement import confine, landlock, linux, probe
from labgym.confinement.landlock import PathRule
from labgym.errors import LabgymError

MAX_ANSWER = 2**20
"""Longest answer, bytes of JSON."""


class TrialError(LabgymError):
    """The work crashed, or exceeded a limit."""


def answer_of(work: Callable[[], Any], memory: int, seconds: float) -> Any:
    """Return the answer of some work that runs in a fork of this process, without files, network and other processes.

    Args:
        work: returns JSON data; needs no module that is not imported yet, and no file.
        memory: that it may take in addition to that of this process, bytes. seconds: of time.

    Raises:
        TrialError: it crashed or exceeded a limit.
    """
    reading, writing = os.pipe()
    parent, child = os.getpid(), os.fork()
    if child == 0:
        try:
            os.close(reading)
            _work(work, parent, writing, memory, seconds)
        finally:
            os._exit(0)
    os.close(writing)
    try:
        content = _read(reading, seconds)
    finally:
        os.close(reading)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    try:
        return json.loads(content)
    except ValueError:
        raise TrialError(f"it crashes, or takes more than {memory / 2**20:g} MiB of memory") from None


def _work(work: Callable[[], Any], parent: int, writing: int, memory: int, seconds: float) -> None:
    linux.die_with_parent(parent)
    nothing = os.open(os.devnull, os.O_RDWR)
    for stream in range(3):
        os.dup2(nothing, stream)
    most = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize() + memory
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    resource.setrlimit(resource.RLIMIT_CPU, (int(seconds) + 1, int(seconds) + 1))
    if probe().boxed:
        confine([PathRule(os.devnull, landlock.READ_FILE | landlock.WRITE_FILE)])
    os.write(writing, json.dumps(work()).encode()[:MAX_ANSWER])


def _read(reading: int, seconds: float) -> bytes:
    """Return what a process writes until it ends, within bounds.

    Raises:
        TrialError: it takes too long.
    """
    deadline, parts = time.monotonic() + seconds, [b""]
    while True:
        if not select.select([reading], [], [], max(0.0, deadline - time.monotonic()))[0]:
            raise TrialError(f"it takes longer than {seconds:g} s")
        parts.append(os.read(reading, 1 << 16))
        if not parts[-1] or sum(map(len, parts)) > MAX_ANSWER:
            return b"".join(parts)
