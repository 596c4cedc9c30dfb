"""The thread of this process that draws with OpenGL: a context can be current in one thread at a time only."""

from __future__ import annotations

import os
import threading
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any, TypeVar

import mujoco

from labgym.errors import LabgymError

Result = TypeVar("Result")

_executor: ThreadPoolExecutor | None = None
_starting = threading.Lock()
_here = threading.local()
_dropped: deque[mujoco.Renderer] = deque()
"""Renderers that nobody uses any more; the thread closes them before its next call."""
_inherited: list[object] = []
"""The thread and the renderers of the process that this one was forked from; they can be neither used nor closed."""


def on_render_thread(function: Callable[..., Result], *arguments: Any) -> Result:
    """Return the result of a call that runs on the render thread, whichever thread asks for it.

    Raises:
        LabgymError: this process was forked from one that had drawn; OpenGL would hang.
        Exception: what the call raises.
    """
    if getattr(_here, "drawing", False):
        return function(*arguments)
    return _thread().submit(_called, function, arguments).result()


def drop(renderer: mujoco.Renderer, process: int) -> None:
    """Let the render thread close a renderer; this never waits, so that finalizers may call it.

    Args:
        process: id of the process that made the renderer; a process forked from it cannot close it.
    """
    (_dropped if process == os.getpid() else _inherited).append(renderer)


def _called(function: Callable[..., Result], arguments: tuple[Any, ...]) -> Result:
    _here.drawing = True
    while _dropped:
        _dropped.popleft().close()
    return function(*arguments)


def _thread() -> ThreadPoolExecutor:
    global _executor
    if _inherited:
        raise LabgymError(
            "this process was forked from one that had drawn pictures, and OpenGL works in one of them only: start it "
            "by 'spawn', or fork before the first picture"
        )
    with _starting:
        if _executor is None:
            _executor = ThreadPoolExecutor(1, thread_name_prefix="labgym render")
        return _executor


def _leave_behind() -> None:
    """In a forked process, keep what belongs to the other one from being used or closed."""
    global _executor, _starting
    if _executor is not None:
        _inherited.extend((_executor, *_dropped))
    _dropped.clear()
    _executor, _starting = None, threading.Lock()


os.register_at_fork(after_in_child=_leave_behind)
