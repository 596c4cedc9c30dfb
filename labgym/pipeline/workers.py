"""Units of work spread over processes, with a progress bar, skipping what a ledger knows to be done."""

from __future__ import annotations

import multiprocessing
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tqdm import tqdm

from labgym.pipeline.ledger import Ledger, code_digest


@dataclass(frozen=True)
class Work:
    """One unit.

    Attributes:
        name: its name in the ledger.
        inputs: JSON data that decides its outcome, besides the package's own code.
        function, arguments: what to call; both cross to another process.
        files: what it leaves, files or folders.
    """

    name: str
    inputs: Any
    function: Callable[..., object]
    arguments: tuple[Any, ...]
    files: tuple[Path, ...]


def work_through(title: str, units: Sequence[Work], ledger: Ledger, processes: int) -> int:
    """Do the units that are not done yet and return how many there were.

    The outcome does not depend on the number of processes. Ctrl-C stops after the units that are under way.
    """
    code = code_digest()
    waiting = [unit for unit in units if not ledger.done(unit.name, [code, unit.inputs])]
    with tqdm(total=len(units), initial=len(units) - len(waiting), desc=f"{title:<10}", unit="") as bar:
        for unit in _finished(waiting, processes):
            ledger.record(unit.name, [code, unit.inputs], unit.files)
            bar.update()
    return len(waiting)


def _finished(units: Sequence[Work], processes: int) -> Iterator[Work]:
    """Yield units as they are finished."""
    if min(processes, len(units)) <= 1:
        for unit in units:
            unit.function(*unit.arguments)
            yield unit
        return
    # Spawned, not forked: OpenGL contexts and thread pools do not survive a fork.
    context = multiprocessing.get_context("spawn")
    pool = ProcessPoolExecutor(min(processes, len(units)), mp_context=context, initializer=_ignore_interrupts)
    try:
        under_way = {pool.submit(unit.function, *unit.arguments): unit for unit in units}
        for future in as_completed(under_way):
            future.result()
            yield under_way[future]
    finally:
        pool.shutdown(cancel_futures=True)


def _ignore_interrupts() -> None:
    """Leave Ctrl-C to the main process, which lets the units under way end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
