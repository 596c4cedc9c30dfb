"""Units of work in worker processes, with a progress bar; units that the ledger lists as done are skipped."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from labgym.assets import Catalog
from labgym.errors import LabgymError
from labgym.pipeline.ledger import Ledger, results_digest


@dataclass(frozen=True)
class Work:
    """A unit of work.

    Attributes:
        name: its name in the ledger.
        inputs: JSON data that determines the outcome, together with the package's own code.
        function, arguments: the call to make; both are sent to another process.
        files: files or folders that the call writes.
    """

    name: str
    inputs: Any
    function: Callable[..., object]
    arguments: tuple[Any, ...]
    files: tuple[Path, ...]


def work_through(title: str, units: Sequence[Work], ledger: Ledger, processes: int) -> int:
    """Do the units that are not done yet and return their number.

    The outcome does not depend on the number of processes. Ctrl-C stops after the units in progress.

    Raises:
        LabgymError: a unit raised it, or a worker process died.
    """
    code = results_digest(Catalog.load().digest)
    remaining = [unit for unit in units if not ledger.done(unit.name, [code, unit.inputs])]
    with tqdm(total=len(units), initial=len(units) - len(remaining), desc=f"{title:<10}", unit="") as bar:
        for unit in _finished(title, remaining, processes):
            ledger.record(unit.name, [code, unit.inputs], unit.files)
            bar.update()
    return len(remaining)


def _finished(title: str, units: Sequence[Work], processes: int) -> Iterator[Work]:
    """Yield units as they finish."""
    if min(processes, len(units)) <= 1:
        for unit in units:
            unit.function(*unit.arguments)
            yield unit
        return
    # Spawned, not forked: OpenGL contexts and thread pools do not survive a fork.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(processes, len(units)), mp_context=context, initializer=_ignore_interrupts)
    try:
        futures = {pool.submit(unit.function, *unit.arguments): unit for unit in units}
        for future in as_completed(futures):
            future.result()
            yield futures[future]
    except BrokenProcessPool as error:
        raise LabgymError(
            f"a worker process died at the stage {title!r}, perhaps out of memory; finished work is kept: run again "
            "to resume, with fewer --workers if memory is short"
        ) from error
    finally:
        pool.shutdown(cancel_futures=True)


def _ignore_interrupts() -> None:
    """Leave Ctrl-C to the main process, which waits for the units in progress."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
