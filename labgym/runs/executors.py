"""Executors of shards: this process, local worker processes; each like `concurrent.futures.Executor`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Any, Literal

from labgym.errors import OptionError

ExecutorKind = Literal["local", "dask", "slurm"]


@dataclass(frozen=True)
class ExecutorOptions:
    """Where shards run.

    Attributes:
        kind: local processes, a Dask cluster, or Slurm jobs.
        workers: number of local processes; 1 runs in this process.
        scheduler: address of the Dask scheduler.
    """

    kind: ExecutorKind = "local"
    workers: int = 1
    scheduler: str | None = None

    def __post_init__(self) -> None:
        if isinstance(self.workers, bool) or not isinstance(self.workers, int) or self.workers < 1:
            raise OptionError(f"workers is {self.workers!r}, expected a whole number of at least 1")


@dataclass(frozen=True)
class Workers:
    """An open executor, and what running shards on it requires to know.

    Attributes:
        executor: where calls are submitted.
        in_flight: returns how many calls to submit before waiting for one; the number may change as workers join.
        lost: exceptions of a future whose worker died: the call is submitted again, up to a limit.
    """

    executor: Executor
    in_flight: Callable[[], int]
    lost: tuple[type[BaseException], ...] = ()


def open_executor(options: ExecutorOptions) -> AbstractContextManager[Workers]:
    """Return the workers of an executor as a context, which ends them at once, with the calls that are still running.

    Raises:
        OptionError: the executor does not exist.
    """
    if options.kind not in EXECUTORS:
        raise OptionError(f"executor is {options.kind!r}, expected one of {', '.join(EXECUTORS)}")
    return EXECUTORS[options.kind](options)


class ThisProcess(Executor):
    """Runs each call where it is submitted. Only exceptions are kept in the future: Ctrl-C ends the run."""

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        """Run a call and return its finished future."""
        future: Future[Any] = Future()
        try:
            future.set_result(function(*arguments, **keywords))
        except Exception as error:  # noqa: BLE001 -- the future raises it again
            future.set_exception(error)
        return future


@contextmanager
def _local(options: ExecutorOptions) -> Iterator[Workers]:
    if options.workers == 1:
        yield Workers(ThisProcess(), lambda: 1)
        return
    from labgym.runs.local_pool import LocalPool

    pool = LocalPool(options.workers)
    try:
        yield Workers(pool, lambda: options.workers, (BrokenProcessPool,))
    finally:
        pool.shutdown(cancel_futures=True)


EXECUTORS: dict[str, Callable[[ExecutorOptions], AbstractContextManager[Workers]]] = {"local": _local}
"""Executors by kind."""
