"""Worker processes end when the process that started them ends, by whatever signal."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from contextlib import suppress
from multiprocessing.process import BaseProcess

PR_SET_PDEATHSIG = 1
"""Option of Linux's prctl: the signal that a process receives when its parent ends."""


def begin_worker() -> None:
    """Tie this process, started by `multiprocessing`, to its parent; call it first in the worker.

    The worker leads a separate process group: Ctrl-C in a terminal reaches the coordinator alone, and the processes
    that the worker starts end with it. A thread waits for the end of a pipe that only the parent holds, and then kills
    the group.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.setpgid(0, 0)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_end_with, args=(parent,), name="parent watch", daemon=True).start()


def end_with_parent(parent: int) -> None:
    """Have the kernel kill this process when its parent ends; on Linux only.

    For processes that run foreign code, which may block every thread. The signal comes already when the thread that
    started this process ends. Not for workers, which could not end their own processes then.

    Args:
        parent: process id of the parent; if it has ended already, this process ends now.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:
            os.kill(os.getpid(), signal.SIGKILL)


def kill_worker(process: BaseProcess) -> None:
    """Kill a worker that called `begin_worker`, and the processes that it started."""
    if process.pid is None:
        return
    with suppress(ProcessLookupError, PermissionError):
        os.killpg(process.pid, signal.SIGKILL)
    with suppress(ValueError, ProcessLookupError):
        process.kill()  # A worker that is still starting has no group yet.


def _end_with(parent: BaseProcess) -> None:
    parent.join()
    os.killpg(0, signal.SIGKILL)
