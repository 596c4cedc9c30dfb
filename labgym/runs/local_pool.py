"""A pool of local worker processes in which the death of a worker costs one task."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.reduction import ForkingPickler
from multiprocessing.util import Finalize
from queue import Empty, SimpleQueue
from threading import Lock, Thread
from typing import Any

from labgym.errors import LabgymError

PARENT_CHECK_S = 1.0
"""Time between two looks at the parent, seconds."""

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")
"""Set to 1 in workers: the cores are shared by processes, and sums do not depend on the number of cores."""


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
        parent.join(PARENT_CHECK_S)
    os.killpg(0, signal.SIGKILL)


def serve(pipe: Connection) -> None:
    """Run the calls that come through a pipe, until it ends.

    An answer is a pair: whether the call returned, and its result or else its exception, with the traceback as a note.
    """
    begin_worker()
    os.set_inheritable(pipe.fileno(), False)  # Else a process that a task leaves behind would keep the pipe open.
    while True:
        try:
            task = pipe.recv_bytes()
        except EOFError:
            return
        pipe.send_bytes(_answer(task))


def _answer(task: bytes) -> memoryview:
    try:
        function, arguments, keywords = ForkingPickler.loads(task)
        return ForkingPickler.dumps((True, function(*arguments, **keywords)))
    except Exception as error:  # noqa: BLE001 -- the coordinator raises it again
        if not isinstance(error, LabgymError):
            error.add_note(f"in the worker:\n{traceback.format_exc()}")
        return _pickled(error)


def _pickled(error: Exception) -> memoryview:
    try:
        answer = ForkingPickler.dumps((False, error))
        ForkingPickler.loads(answer)
    except Exception:  # noqa: BLE001 -- the exception's class may raise anything when it is pickled
        return ForkingPickler.dumps((False, RuntimeError(f"{type(error).__name__}: {error}")))
    return answer


class WorkerLostError(Exception):
    """A worker died during a task, or the pool was closed."""


Task = tuple[Future[Any], Callable[..., Any], tuple[Any, ...], dict[str, Any]]


class LocalPool(Executor):
    """Worker processes, each with one task at a time and a separate pipe.

    A worker that dies is replaced for the next task; the future of its task raises WorkerLostError. In the pool of the
    standard library, a worker that is killed while it writes a result blocks the reader for ever, because the reader
    also holds the other end of the pipe. A pool that is never shut down does not delay the end of the program.

    Args:
        workers: number of processes.
    """

    def __init__(self, workers: int) -> None:
        self._lock = Lock()
        self._closed = self._killed = False
        self._alive: set[_Worker] = set()
        self._tasks: SimpleQueue[Task | None] = SimpleQueue()
        # At exit, `multiprocessing` joins its processes: these must have been killed by then.
        self._exit = Finalize(None, self._kill, exitpriority=10)
        self._threads = [Thread(target=self._serve, name=f"worker {k}", daemon=True) for k in range(workers)]
        for thread in self._threads:
            thread.start()

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        """Run a call in the next worker that is idle.

        Raises:
            RuntimeError: the pool has been shut down.
        """
        with self._lock:
            if self._closed:
                raise RuntimeError("the pool has been shut down")
            future: Future[Any] = Future()
            self._tasks.put((future, function, arguments, keywords))
            return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the workers: after their tasks, or at once with `cancel_futures`."""
        if sys.is_finalizing():  # The workers have been killed; the threads no longer run and cannot be joined.
            return
        with self._lock:
            self._closed = True
        if cancel_futures:
            self._cancel()
            self._kill()
        for _ in self._threads:
            self._tasks.put(None)
        if wait:
            for thread in self._threads:
                thread.join()
            self._kill()
            self._exit.cancel()

    def _cancel(self) -> None:
        """Cancel the tasks that no worker has begun."""
        with suppress(Empty):
            while True:
                task = self._tasks.get_nowait()
                if task is not None:
                    task[0].cancel()

    def _serve(self) -> None:
        """Run tasks in one worker after the other, until there are no more."""
        worker: _Worker | None = None
        while (task := self._tasks.get()) is not None:
            future, function, arguments, keywords = task
            if not future.set_running_or_notify_cancel():
                continue
            try:
                if worker is None or not worker.alive:
                    self._discard(worker)
                    worker = self._start()
                future.set_result(worker.call(function, arguments, keywords))
            except WorkerLostError as error:
                self._discard(worker)
                worker = None
                future.set_exception(error)
            except Exception as error:  # noqa: BLE001 -- the future raises it again
                future.set_exception(error)

    def _start(self) -> _Worker:
        with self._lock:
            if self._killed:
                raise WorkerLostError("the pool is closed")
            with _one_thread():
                worker = _Worker()
            self._alive.add(worker)
            return worker

    def _discard(self, worker: _Worker | None) -> None:
        if worker is not None:
            worker.kill()
            with self._lock:
                self._alive.discard(worker)

    def _kill(self) -> None:
        with self._lock:
            self._closed = self._killed = True
            for worker in self._alive:
                worker.kill()


class _Worker:
    """A worker process and this end of its pipe. Its own end is closed here, so that its death ends the pipe."""

    def __init__(self) -> None:
        # Spawned, not forked: OpenGL contexts and thread pools do not survive a fork.
        context = multiprocessing.get_context("spawn")
        self._pipe: Connection
        self._pipe, other = context.Pipe()
        self._process = context.Process(target=serve, args=(other,))
        self._process.start()
        other.close()

    @property
    def alive(self) -> bool:
        return self._process.is_alive()

    def call(self, function: Callable[..., Any], arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        """Run a call in the worker and return its result.

        Raises:
            WorkerLostError: the worker died.
            Exception: as the call.
        """
        task = ForkingPickler.dumps((function, arguments, keywords))
        try:
            self._pipe.send_bytes(task)
            done, result = self._pipe.recv()
        except (EOFError, OSError) as error:
            raise WorkerLostError("the worker process died") from error
        if done:
            return result
        raise result

    def kill(self) -> None:
        kill_worker(self._process)
        with suppress(ValueError):
            self._process.join()


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
