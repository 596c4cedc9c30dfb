"""Executors of shards, each a `concurrent.futures.Executor`: this process, local processes, a Dask cluster, Slurm."""

from __future__ import annotations

import ipaddress
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal
from urllib.parse import urlsplit

from labgym.counts import MAX_PROCESSES, whole_number
from labgym.errors import MissingDependencyError, OptionError

PACKAGES = {"dask": "distributed", "slurm": "submitit"}
"""Package of the executors that are extras of their name."""

ExecutorKind = Literal["local", "dask", "slurm"]


def check_address(address: str) -> str:
    """Return the scheme of a scheduler's address: "tcp" or "tls".

    Anybody who reaches a scheduler can run any code on its workers, so that plain TCP is limited to loopback.

    Raises:
        OptionError: the address is not like tcp://127.0.0.1:8786, or is beyond loopback without TLS.
    """
    try:
        parts = urlsplit(address)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    if parts.scheme not in ("tcp", "tls") or not parts.hostname or not port:
        raise OptionError(f"scheduler is {address[:80]!r}, expected an address such as tcp://127.0.0.1:8786")
    if parts.scheme == "tcp" and not _is_loopback(parts.hostname):
        raise OptionError(
            f"scheduler {address} is not on this machine and has no TLS: anybody who reaches it can run code on its "
            "workers; use tls:// with certificates (docs/scale.md), or an SSH tunnel to 127.0.0.1"
        )
    return parts.scheme


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


@dataclass(frozen=True)
class ExecutorOptions:
    """Where shards run.

    Attributes:
        kind: local processes, a Dask cluster, or Slurm jobs.
        workers: number of local processes, of which 1 means this process, or of Slurm jobs at a time. A Dask cluster
            has as many workers as have joined it.
        scheduler: address of the Dask scheduler, such as tcp://127.0.0.1:8786.
        slurm: parameters of Slurm jobs by submitit's names, such as {"slurm_partition": "cpu", "timeout_min": 60}.
        apart: whether a single local worker is a process too, with one thread for numerical libraries.

    Raises:
        OptionError: the number of workers is not from 1 to 1024, or an option belongs to another executor.
        MissingDependencyError: the executor's package is not installed.
    """

    kind: ExecutorKind = "local"
    workers: int = 1
    scheduler: str | None = None
    slurm: Mapping[str, Any] = field(default_factory=dict)
    apart: bool = False

    def __post_init__(self) -> None:
        if self.kind not in EXECUTORS:
            raise OptionError(f"executor is {self.kind!r}, expected one of {', '.join(EXECUTORS)}")
        whole_number("workers", self.workers, most=MAX_PROCESSES)
        if (self.scheduler is None) == (self.kind == "dask"):
            problem = (
                "requires --scheduler, such as tcp://127.0.0.1:8786" if self.kind == "dask" else "has no scheduler"
            )
            raise OptionError(f"executor {self.kind} {problem}")
        if self.scheduler is not None:
            check_address(self.scheduler)
        if self.kind in PACKAGES and find_spec(PACKAGES[self.kind]) is None:
            raise MissingDependencyError(PACKAGES[self.kind], f"the executor {self.kind}", self.kind)
        if self.slurm and self.kind != "slurm":
            raise OptionError(f"executor {self.kind} takes no parameters of Slurm jobs ({', '.join(self.slurm)})")


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


def open_executor(options: ExecutorOptions, folder: Path | None = None) -> AbstractContextManager[Workers]:
    """Return the workers of an executor as a context, which ends the calls that are still running.

    Args:
        options: which executor.
        folder: folder of the run, which Slurm jobs share; by default the working folder.

    Raises:
        OptionError: the cluster cannot be reached, or its address is not allowed.
        MissingDependencyError: the executor's package is not installed.
    """
    return EXECUTORS[options.kind](options, folder or Path())


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
def _local(options: ExecutorOptions, _: Path) -> Iterator[Workers]:
    if options.workers == 1 and not options.apart:
        yield Workers(ThisProcess(), lambda: 1)
        return
    from labgym.runs.local_pool import LocalPool, WorkerLostError

    pool = LocalPool(options.workers)
    try:
        yield Workers(pool, lambda: options.workers, (WorkerLostError,))
    finally:
        pool.shutdown(cancel_futures=True)


def _dask(options: ExecutorOptions, _: Path) -> AbstractContextManager[Workers]:
    from labgym.runs.dask_cluster import dask_workers

    return dask_workers(str(options.scheduler))


def _slurm(options: ExecutorOptions, folder: Path) -> AbstractContextManager[Workers]:
    from labgym.runs.slurm import slurm_workers

    return slurm_workers(options.workers, options.slurm, folder)


EXECUTORS: dict[str, Callable[[ExecutorOptions, Path], AbstractContextManager[Workers]]] = {
    "local": _local,
    "dask": _dask,
    "slurm": _slurm,
}
"""Executors by kind."""
