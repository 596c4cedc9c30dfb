"""Worker processes end when the process that started them ends, by whatever signal."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from contextlib import suppress
from multiprocessing.process import BaseProcess

PERIOD = 1.0
"""Time between two looks at the parent, seconds."""


def begin_worker() -> None:
    """Tie this process, started by `multiprocessing`, to its parent; call it first in the worker.

    The worker leads a separate process group: Ctrl-C in a terminal reaches the coordinator alone, and the processes
    that the worker starts end with it. A thread waits for the end of a pipe that the parent holds, or for another
    process to become this one's parent (processes that the parent forked hold the pipe too), and then kills the group.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.setpgid(0, 0)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), name="parent watch", daemon=True).start()


def kill_worker(process: BaseProcess) -> None:
    """Kill a worker that called `begin_worker`, and the processes that it started."""
    if process.pid is None:
        return
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    with suppress(ValueError, ProcessLookupError):
        process.kill()  # A worker that is still starting has no group yet.


def _end_with(parent: BaseProcess) -> None:
    while os.getppid() == parent.pid and parent.is_alive():
        parent.join(PERIOD)
    os.killpg(0, signal.SIGKILL)
