"""Running shards on workers with the same code; finished ones are kept, and none runs twice."""

from __future__ import annotations

import socket
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

from labgym.errors import LabgymError
from labgym.progress import progress_bar
from labgym.runs.executors import ExecutorOptions, Workers, open_executor
from labgym.runs.folder import RunFolder
from labgym.runs.identity import code_digest

Digests = Mapping[str, Callable[[], str]]
"""Functions of modules, each of which returns a digest, by the name that a refusal prints."""

MAX_DEATHS = 3
"""Number of workers that may die of the same shard."""


@dataclass(frozen=True)
class Guard:
    """The digests of the coordinator.

    Attributes:
        digests: name, function and the coordinator's digest.
    """

    digests: tuple[tuple[str, Callable[[], str], str], ...]

    @classmethod
    def of(cls, digests: Digests) -> Guard:
        """Return the guard of this process: its code and further digests."""
        functions: dict[str, Callable[[], str]] = {"code": code_digest, **digests}
        return cls(tuple((name, function, function()) for name, function in functions.items()))

    def call(self, function: Callable[..., Any], arguments: tuple[Any, ...]) -> Any:
        """Return the result of a call if this process has the coordinator's digests.

        Raises:
            LabgymError: a digest differs.
        """
        for name, digest, expected in self.digests:
            if (own := digest()) != expected:
                raise LabgymError(
                    f"the worker on {socket.gethostname()} has another {name} (digest {own[:12]}, expected "
                    f"{expected[:12]}): install the same version of labgym and the same assets there"
                )
        return function(*arguments)


@dataclass(frozen=True)
class ShardOutput:
    """Output of a shard.

    Attributes:
        files: content by path relative to the run's folder; files below `shards/` are merged at the end.
        record: small JSON data, which the ledger keeps.
    """

    files: Mapping[str, bytes] = field(default_factory=dict)
    record: Any = None


@dataclass(frozen=True)
class Shard:
    """An independent piece of a run.

    Attributes:
        name: its name in the ledger, unique in the run.
        function, arguments: the call to make; both are pickled and sent to a worker.
        size: units of the progress bar.
        inputs: JSON data that decides the output in addition to the run's identity; a shard whose inputs changed runs
            again.
    """

    name: str
    function: Callable[..., ShardOutput]
    arguments: tuple[Any, ...] = ()
    size: int = 1
    inputs: Any = None


class DeadlyShardError(LabgymError):
    """Several workers died of the same shard.

    Attributes:
        shard: name of the shard.
        deaths: number of workers that died.
    """

    def __init__(self, shard: str, deaths: int) -> None:
        self.shard, self.deaths = shard, deaths
        super().__init__(
            f"{deaths} workers died while they ran shard {shard!r}, perhaps out of memory; finished shards "
            "are kept: run again to resume, with fewer workers if memory is short (a script that uses workers must "
            "start below `if __name__ == '__main__':`)"
        )


def run_shards(
    shards: Iterable[Shard],
    folder: RunFolder | None,
    executor: ExecutorOptions | None = None,
    title: str = "",
    unit: str = "",
    guard: Digests | None = None,
    *,
    total: int | None = None,
    progress: bool = True,
) -> Iterator[tuple[Shard, ShardOutput]]:
    """Yield each shard with its output when it is finished, in any order.

    Workers return bytes, and only this process writes. A shard that the folder holds is checked by its hashes and
    yielded without running. Stopping early (an error, Ctrl-C, SIGTERM, or a consumer that closes the iterator) ends
    the workers at once; finished shards are kept.

    Args:
        shards: the shards, taken from the iterable as workers become free.
        folder: where outputs are written; None writes nothing.
        executor: where shards run; by default in this process.
        title, unit: label and unit of the progress bar.
        guard: functions of modules that return digests, by name, in addition to the digest of the code; a worker
            with another digest than this process is refused.
        total: sum of the sizes for the progress bar; by default that of a sequence of shards.
        progress: whether to show a progress bar.

    Raises:
        LabgymError: two shards have the same name, or a worker has another code or catalog.
        DeadlyShardError: `MAX_DEATHS` workers died of the same shard.
        Exception: as the shard.
    """
    if total is None and isinstance(shards, Sequence):
        total = sum(shard.size for shard in shards)
    run = _Run(iter(shards), folder, executor or ExecutorOptions(), guard or {})
    with progress_bar(desc=title, total=total, unit=unit, disable=not progress) as bar, run.stack:
        for shard, output, ran in run:
            if not ran and not bar.disable:
                bar.initial += shard.size  # The bar's rate counts only shards that ran.
            bar.update(shard.size)
            yield shard, output


class _Run:
    """The shards of a run between their source and the executor, which is opened for the first that must run."""

    def __init__(
        self, source: Iterator[Shard], folder: RunFolder | None, executor: ExecutorOptions, digests: Digests
    ) -> None:
        self.stack = ExitStack()
        self._source, self._folder, self._executor, self._digests = source, folder, executor, digests
        self._workers: Workers | None = None
        self._guard: Guard | None = None
        self._names: set[str] = set()
        self._running: dict[Future[ShardOutput], Shard] = {}
        self._again: deque[Shard] = deque()
        self._deaths: Counter[str] = Counter()

    def __iter__(self) -> Iterator[tuple[Shard, ShardOutput, bool]]:
        """Yield each shard with its output and whether it ran now."""
        exhausted = False
        while True:
            while not exhausted and (self._workers is None or len(self._running) < self._workers.in_flight()):
                shard = self._again.popleft() if self._again else next(self._source, None)
                if shard is None:
                    exhausted = True
                elif (output := self._stored(shard)) is not None:
                    yield shard, output, False
                else:
                    self._submit(shard)
            if not self._running:
                return
            done, _ = wait(self._running, return_when=FIRST_COMPLETED)
            for future in done:
                shard = self._running.pop(future)
                if self._lost(future, shard):
                    self._again.append(shard)
                    exhausted = False
                else:
                    yield shard, self._kept(shard, future.result()), True

    def _stored(self, shard: Shard) -> ShardOutput | None:
        """Return the output of a shard that the folder holds; each new name must be unique."""
        if shard.name in self._deaths:
            return None
        if shard.name in self._names:
            raise LabgymError(f"two shards have the name {shard.name!r}; names of shards must be unique")
        self._names.add(shard.name)
        stored = None if self._folder is None else self._folder.output(shard.name, shard.inputs)
        return None if stored is None else ShardOutput(*stored)

    def _submit(self, shard: Shard) -> None:
        if self._workers is None or self._guard is None:
            self._guard = Guard.of(self._digests)
            self._workers = self.stack.enter_context(
                open_executor(self._executor, None if self._folder is None else self._folder.path)
            )
        future = self._workers.executor.submit(self._guard.call, shard.function, shard.arguments)
        self._running[future] = shard

    def _lost(self, future: Future[ShardOutput], shard: Shard) -> bool:
        """Return whether a shard must run again because its worker died."""
        error = future.exception()
        if self._workers is None or not isinstance(error, self._workers.lost):
            return False
        self._deaths[shard.name] += 1
        if self._deaths[shard.name] < MAX_DEATHS:
            return True
        raise DeadlyShardError(shard.name, self._deaths[shard.name]) from error

    def _kept(self, shard: Shard, output: ShardOutput) -> ShardOutput:
        if self._folder is not None:
            self._folder.put(shard.name, shard.inputs, output.files, output.record)
        return output
