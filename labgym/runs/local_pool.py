"""A pool of local worker processes in which the death of a worker costs one task."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from typing import Any

from labgym.runs.orphans import begin_worker, kill_worker

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")
"""Set to 1 in workers: the cores are shared by processes, and sums do not depend on the number of cores."""


class LocalPool(Executor):
    """Worker processes, each with one task at a time, so that the task of a dead worker is known.

    A worker that dies is replaced when the next task is submitted; its future raises BrokenProcessPool.

    Args:
        workers: number of processes.
    """

    def __init__(self, workers: int) -> None:
        self._slots = [_Slot() for _ in range(workers)]

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        """Run a call in a worker that is idle; wait for one if none is."""
        while not (idle := [slot for slot in self._slots if slot.idle]):
            wait([slot.task for slot in self._slots if slot.task is not None], return_when=FIRST_COMPLETED)
        return idle[0].submit(function, *arguments, **keywords)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers: after their tasks, or at once with `cancel_futures`."""
        for slot in self._slots:
            slot.shutdown(wait, cancel_futures)


class _Slot:
    """A worker process, started with its first task."""

    def __init__(self) -> None:
        self.task: Future[Any] | None = None
        self._pool: ProcessPoolExecutor | None = None

    @property
    def idle(self) -> bool:
        return self.task is None or self.task.done()

    def submit(self, function: Callable[..., Any], *arguments: Any, **keywords: Any) -> Future[Any]:
        if self.task is not None and isinstance(_error(self.task), BrokenProcessPool):
            self.shutdown(wait=True, cancel_futures=True)
        try:
            self.task = self._submit(function, *arguments, **keywords)
        except BrokenProcessPool:  # It died while it was idle.
            self.shutdown(wait=True, cancel_futures=True)
            self.task = self._submit(function, *arguments, **keywords)
        return self.task

    def _submit(self, function: Callable[..., Any], *arguments: Any, **keywords: Any) -> Future[Any]:
        if self._pool is None:
            # Spawned, not forked: OpenGL contexts and thread pools do not survive a fork.
            context = multiprocessing.get_context("spawn")
            self._pool = ProcessPoolExecutor(1, mp_context=context, initializer=begin_worker)
        with _one_thread():
            return self._pool.submit(function, *arguments, **keywords)

    def shutdown(self, wait: bool, cancel_futures: bool) -> None:
        if self._pool is None:
            return
        if cancel_futures:
            for process in list((self._pool._processes or {}).values()):
                kill_worker(process)
        self._pool.shutdown(wait, cancel_futures=cancel_futures)
        self._pool = None


def _error(task: Future[Any]) -> BaseException | None:
    return task.exception() if task.done() and not task.cancelled() else None


@contextmanager
def _one_thread() -> Iterator[None]:
    """Set the thread variables for processes that start in this context."""
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
