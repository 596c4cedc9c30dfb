"""Worker processes that prepare training layouts before environments ask for them.

Which layout an environment gets does not depend on the pool: a layout that is not ready in time, or that a worker could
not make, is made by the environment itself, with the same result.
"""

from __future__ import annotations

import os
import pickle
import secrets
import sys
import threading
import weakref
from collections.abc import Sequence
from concurrent.futures import Future
from contextlib import suppress
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Connection, Listener
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from labgym.counts import MAX_PROCESSES, whole_number
from labgym.envs.layout_files import FOLDER_MB, LayoutFiles
from labgym.envs.parcels import SHARED, Address, Parcel
from labgym.envs.stage import LayoutSenses, LayoutStage
from labgym.envs.training import LayoutSource
from labgym.errors import OptionError
from labgym.runs.local_pool import LocalPool, WorkerLostError

AHEAD = 2
"""Number of layouts that are prepared for each environment beyond the one that it is in."""
LOSSES = 3
"""Number of workers that die one after the other before the pool starts no more."""

Request = bytes
"""A pickled source, number and `LayoutSenses`; equal requests of one client have equal bytes."""


class LayoutPool:
    """Worker processes that prepare the layouts of `split="train"` in the background.

    Pass it to environments in this process or in others, however they are started:

        with LayoutPool(workers=2) as pool:
            envs = make_vec_env("LabPointNav-v0", n_envs=8, env_kwargs={"split": "train", "pool": pool})

    Each environment has `AHEAD` layouts prepared in advance. They wait in memory that the processes share, and that is
    free when the last of them ends. Workers end with the pool or with this process, by whatever signal. As with every
    process that Python spawns, a script starts a pool under `if __name__ == "__main__":`.

    Args:
        workers: number of processes.
        folder: where layouts of "rooms" and "floors" are stored as files, so that another training with the same seed
            does not generate them again; None stores nothing.
        folder_mb: size of the folder; the files used longest ago are removed.

    Raises:
        OptionError: a number of workers that is not from 1 to 1024, or a folder without a size.
    """

    def __init__(
        self, workers: int = 2, folder: str | os.PathLike[str] | None = None, folder_mb: float = FOLDER_MB
    ) -> None:
        workers = whole_number("workers", workers, most=MAX_PROCESSES)
        self._files = None if folder is None else LayoutFiles(Path(folder).absolute(), folder_mb)
        self._workers = LocalPool(workers)
        self._losses = 0
        self._closed = False
        self._open: set[Connection] = set()
        self._orders: weakref.WeakSet[_Order] = weakref.WeakSet()
        self._key = secrets.token_bytes(32)
        # In Linux's abstract namespace: no file is left, whatever ends this process.
        address = f"\0labgym-{secrets.token_hex(16)}" if sys.platform == "linux" else None
        self._listener = Listener(address, "AF_UNIX", authkey=self._key)
        self._address: str = self._listener.address
        _pools.add(self)
        threading.Thread(target=self._accept, name="layout pool", daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def __reduce__(self) -> tuple[Any, ...]:
        # In another process, the pool is reached through its address.
        return PoolAddress, (self._address, self._key)

    def connect(self) -> PoolClient:
        """Return a connection for one environment."""
        return PoolClient(self._address, self._key)

    def close(self) -> None:
        """End the workers; environments that still use the pool go on without it."""
        if self._closed:
            return
        self._closed = True
        with suppress(OSError, EOFError, AuthenticationError):
            Client(self._address, "AF_UNIX", self._key).close()  # wakes the thread that accepts
        self._listener.close()
        self._workers.shutdown(cancel_futures=True)
        for connection in list(self._open):
            with suppress(OSError):
                connection.close()

    def _accept(self) -> None:
        while not self._closed:
            try:
                connection = self._listener.accept()
            except (OSError, EOFError, AuthenticationError):
                continue
            self._open.add(connection)
            threading.Thread(target=self._serve, args=(connection,), name="layout client", daemon=True).start()

    def _serve(self, connection: Connection) -> None:
        """Answer one environment until it disconnects: with the stage that it takes, None if it has to make it."""
        ready: dict[Request, _Order] = {}
        try:
            while not self._closed:
                wanted, following = connection.recv()
                order = ready.pop(wanted, None)
                for request in [request for request in ready if request not in following]:
                    ready.pop(request).withdraw()
                ready.update({request: self._begin(request) for request in following if request not in ready})
                stage = None if order is None else order.stage()
                connection.send(stage.address if isinstance(stage, Parcel) else stage)
                connection.recv()  # The environment has opened the parcel.
                if order is not None:
                    order.withdraw()
        except (OSError, EOFError, TypeError, RuntimeError):
            pass  # The environment has ended, or the pool has been closed.
        finally:
            for order in ready.values():
                order.withdraw()
            self._open.discard(connection)
            with suppress(OSError):
                connection.close()

    def _begin(self, request: Request) -> _Order:
        if self._losses >= LOSSES:
            return _Order(None)
        future = self._workers.submit(prepare, request, self._files)
        future.add_done_callback(self._count)
        order = _Order(future)
        self._orders.add(order)
        return order

    def _count(self, future: Future[Address | bytes]) -> None:
        if not future.cancelled():
            self._losses = self._losses + 1 if isinstance(future.exception(), WorkerLostError) else 0

    def _leave(self) -> None:
        """Close what a forked process has inherited, so that the others notice when this pool's process ends."""
        self._closed = True
        with suppress(OSError):
            self._listener.close()
        for connection in self._open:
            with suppress(OSError):
                connection.close()
        for order in list(self._orders):
            order.close()


class _Order:
    """A stage that a worker makes for one environment.

    Args:
        future: the worker's answer; None if no worker makes the stage.
    """

    def __init__(self, future: Future[Address | bytes] | None) -> None:
        self._future = future
        self._stage: Future[Parcel | bytes | None] = Future()
        self._parcel: Parcel | None = None
        if future is None:
            self._stage.set_result(None)
        else:
            future.add_done_callback(self._receive)

    def stage(self) -> Parcel | bytes | None:
        """Return the stage when it is finished, None if it is not begun or its worker failed."""
        return None if self._future is None or self._future.cancel() else self._stage.result()

    def withdraw(self) -> None:
        """Free what the worker has made or will make."""
        if self._future is not None:
            self._future.cancel()
        self._stage.add_done_callback(lambda _: self.close())

    def close(self) -> None:
        """Close the parcel in this process; without a lock, which a forked process could not release."""
        if self._parcel is not None:
            self._parcel.close()

    def _receive(self, future: Future[Address | bytes]) -> None:
        """Open what a worker has made; until this returns, the worker begins nothing else."""
        stage: Parcel | bytes | None = None
        if not future.cancelled() and future.exception() is None:
            result = future.result()
            with suppress(OSError):
                stage = result if isinstance(result, bytes) else Parcel.at(result)
        self._parcel = stage if isinstance(stage, Parcel) else None
        self._stage.set_result(stage)


class PoolAddress:
    """A pool in another process."""

    def __init__(self, address: str, key: bytes) -> None:
        self._address, self._key = address, key

    def connect(self) -> PoolClient:
        """Return a connection for one environment."""
        return PoolClient(self._address, self._key)


class PoolClient:
    """The connection of one environment to a pool; a copy of it, or a forked process, connects anew."""

    def __init__(self, address: str, key: bytes) -> None:
        self._address, self._key = address, key
        self._connection: Connection | None = None
        self._process = 0
        self._lost = False

    def __reduce__(self) -> tuple[Any, ...]:
        return PoolClient, (self._address, self._key)

    def take(self, source: LayoutSource, numbers: Sequence[int], senses: LayoutSenses) -> LayoutStage | None:
        """Return the stage of the first number, None if the environment has to make it.

        Args:
            source: makes the layouts.
            numbers: number of the layout that is wanted now, and of those that will be wanted next.
            senses: what the environment reads.
        """
        wanted, *following = (pickle.dumps((source, number, senses)) for number in numbers)
        return self._ask((wanted, following))

    def close(self) -> None:
        """Disconnect; the next `take` connects again."""
        if self._connection is not None:
            with suppress(OSError):
                self._connection.close()
        self._connection = None

    def _ask(self, message: tuple[Request, list[Request]]) -> LayoutStage | None:
        if self._process != os.getpid():
            self.close()
            self._process, self._lost = os.getpid(), False
        if self._lost:
            return None
        try:
            if self._connection is None:
                self._connection = Client(self._address, "AF_UNIX", self._key)
            self._connection.send(message)
            answer: Address | bytes | None = self._connection.recv()
            stage = _opened(answer)
            self._connection.send(None)
            return stage
        except (OSError, EOFError, AuthenticationError):
            self._lost = True
            self.close()
            return None
        except BaseException:  # An answer that comes after an interrupt would be taken for that of the next request.
            self.close()
            raise


def prepare(request: Request, files: LayoutFiles | None = None) -> Address | bytes:
    """Return where the stage of a request is, or the pickled stage; runs in a worker."""
    from labgym.envs.world import World

    global _latest
    source, number, senses = pickle.loads(request)  # noqa: S301 -- from a client that has the key
    layout = source(number) if files is None else files.layout(source, number)
    stage = World(layout).stage(senses)
    if not SHARED:
        return pickle.dumps(stage, protocol=pickle.HIGHEST_PROTOCOL)
    _latest = Parcel.of(stage)
    return _latest.address


_latest: Parcel | None = None
"""The parcel that this worker made last: the pool has opened it when the worker begins the next one."""


def _opened(answer: Address | bytes | None) -> LayoutStage | None:
    """Return the stage of an answer; None without a stage, or if this process cannot open it."""
    if answer is None:
        return None
    if isinstance(answer, bytes):
        stage: LayoutStage = pickle.loads(answer)  # noqa: S301 -- from the pool, which has the key
        return stage
    try:
        return Parcel.at(answer).stage()
    except OSError:
        return None


def check_sendable(source: LayoutSource) -> None:
    """Check that a source can be sent to the workers of a pool.

    Raises:
        OptionError: it cannot be pickled, such as a lambda.
    """
    try:
        pickle.dumps(source)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise OptionError(f"training cannot be sent to a pool ({error}): pass a function of a module") from None


_pools: weakref.WeakSet[LayoutPool] = weakref.WeakSet()


def _leave_all() -> None:
    for pool in list(_pools):
        pool._leave()


os.register_at_fork(after_in_child=_leave_all)
