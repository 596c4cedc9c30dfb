"""A Dask cluster that runs shards: workers join and leave while a run goes on."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager
from typing import Any

from labgym.errors import LabgymError, OptionError, optional_package
from labgym.runs.blobs import Blob, dumps, loads
from labgym.runs.executors import Workers, check_address

CONNECT_SECONDS = 30
SHARDS_PER_WORKER = 3
"""Shards submitted for each worker: one runs, the others are on their way, so that no worker waits for the network."""
CERTIFICATES = ("ca-file", "client.cert", "client.key")
"""Settings of Dask (`distributed.comm.tls`) that a connection over TLS requires."""


class ClusterLostError(LabgymError):
    """The connection to the scheduler ended, or the cluster gave up on a shard."""


@contextmanager
def dask_workers(address: str) -> Iterator[Workers]:
    """Connect to a scheduler and yield its workers; at the end, shards that have not begun are cancelled.

    Raises:
        OptionError: the address is not one of a scheduler, is beyond loopback without TLS, or does not answer.
        MissingDependencyError: Dask is not installed.
    """
    with optional_package("distributed", "the executor dask", "dask"):
        import distributed
    with _connected(distributed, address) as client:
        if not client.scheduler_info()["workers"]:
            sys.stderr.write(f"no worker has joined {address} yet: dask worker {address} --nthreads 1\n")
        executor = DaskExecutor(client, address)
        yield Workers(executor, lambda: SHARDS_PER_WORKER * max(1, len(client.scheduler_info()["workers"])))


class DaskExecutor(Executor):
    """Submits calls to a cluster. A call of a worker that dies runs on another one.

    Args:
        client: a `distributed.Client`.
        address: address of its scheduler, for messages.
    """

    def __init__(self, client: Any, address: str) -> None:
        self._client = client
        self._executor = client.get_executor(pure=False)
        self._address = address
        self._blobs: dict[str, Any] = {}

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        """Run a call on a worker."""
        outcome: Future[Any] = Future()
        # Pickled here, so that the scheduler passes on bytes and does not read layouts.
        digests: dict[str, Any] = {}

        def share(blob: Blob) -> None:
            if blob.digest not in self._blobs:
                # A task and not `scatter`: it runs again if the workers that hold its result die.
                self._blobs[blob.digest] = self._client.submit(bytes, blob.content, key=f"blob-{blob.digest}")
            digests[blob.digest] = self._blobs[blob.digest]

        remote = self._executor.submit(_call, dumps((function, arguments, keywords), share), digests)
        remote.add_done_callback(lambda future: _transfer(future, outcome, self._address))
        return outcome


@contextmanager
def _connected(distributed: Any, address: str) -> Iterator[Any]:
    security = _security(distributed) if check_address(address) == "tls" else None
    try:
        client = distributed.Client(address, timeout=CONNECT_SECONDS, security=security, set_as_default=False)
    except (OSError, ValueError) as error:  # TimeoutError is an OSError.
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise OptionError(f"scheduler {address} does not answer ({reason}); start one: dask scheduler") from None
    try:
        yield client
    finally:
        client.close(timeout=CONNECT_SECONDS)


def _security(distributed: Any) -> Any:
    import dask

    missing = [name for name in CERTIFICATES if not dask.config.get(f"distributed.comm.tls.{name}", None)]
    if missing:
        variable = "DASK_DISTRIBUTED__COMM__TLS__" + missing[0].replace(".", "__").replace("-", "_").upper()
        raise OptionError(f"a tls:// scheduler requires certificates: {variable} is not set (docs/scale.md)")
    return distributed.Security(require_encryption=True)


def _call(pickled: bytes, blobs: dict[str, bytes]) -> Any:
    """Run a call on a worker, which must have one thread: a shard has its process for itself.

    Args:
        pickled: the call.
        blobs: content by digest; Dask replaces the futures that were submitted.
    """
    import distributed

    worker = distributed.get_worker()
    if worker.state.nthreads != 1:
        raise OptionError(
            f"Dask worker {worker.address} has {worker.state.nthreads} threads, expected 1: start workers with "
            "dask worker --nthreads 1 --nworkers N"
        )
    function, arguments, keywords = loads(pickled, blobs.__getitem__)
    return function(*arguments, **keywords)


def _transfer(remote: Future[Any], outcome: Future[Any], address: str) -> None:
    """Give a future the outcome of the cluster's, with errors of the cluster in one line."""
    from distributed import KilledWorker

    try:
        error = remote.exception()
    except CancelledError:
        error = ClusterLostError(
            f"the connection to the scheduler {address} ended; finished shards are kept: run again to resume"
        )
    if isinstance(error, KilledWorker):
        error = ClusterLostError(
            f"the cluster at {address} gave up on a shard, because each worker that ran it died, perhaps out of "
            "memory; finished shards are kept: run again to resume"
        )
    if isinstance(error, RuntimeError) and "deserialization of the task graph" in str(error):
        error = ClusterLostError(f"the scheduler {address} cannot import labgym: install the same version there")
    if error is None:
        outcome.set_result(remote.result())
    else:
        outcome.set_exception(error)
