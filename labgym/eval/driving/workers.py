"""Worker processes that drive one layout at a time; results do not depend on their number."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.synchronize import Event

from labgym.errors import LabgymError
from labgym.eval.driving.drive import Drive, Stopped, drive_layout
from labgym.eval.driving.suites import Suite
from labgym.layouts import Layout
from labgym.policies.policy import Driver
from labgym.policies.process import PolicySource, ProcessLimits, shared_process
from labgym.policies.process.hosts import THREAD_VARIABLES


@dataclass(frozen=True)
class Job:
    """The arguments of driving one layout.

    Attributes:
        label: name of the policy in the rows.
        limits: limits of the policy's process.
    """

    source: PolicySource
    label: str
    layout: Layout
    suite: Suite
    seed: int
    limits: ProcessLimits | None = None


def run_jobs(
    jobs: Sequence[Job], workers: int, driver: Driver | None = None
) -> Iterator[tuple[Job, tuple[Drive, ...]]]:
    """Yield each job with its episodes when it is finished: in order with one worker, in any order with more.

    One worker means this process; there, `driver` drives instead of the policy's process. If the consumer stops early,
    or at an error or Ctrl-C, workers stop at their next control step.

    Raises:
        LabgymError: a worker died.
    """
    if workers == 1 or len(jobs) < 2:
        for job in jobs:
            yield job, _drive(job, driver)
        return
    yield from _run_in_processes(jobs, min(workers, len(jobs)))


def _run_in_processes(jobs: Sequence[Job], workers: int) -> Iterator[tuple[Job, tuple[Drive, ...]]]:
    context = multiprocessing.get_context("spawn")
    stop = context.Event()
    executor = ProcessPoolExecutor(workers, mp_context=context, initializer=_begin_worker, initargs=(stop,))
    try:
        with _environment(dict.fromkeys(THREAD_VARIABLES, "1")):
            futures = {executor.submit(_drive, job): job for job in jobs}
        for future in as_completed(futures):
            yield futures[future], future.result()
    except BrokenProcessPool as error:
        raise LabgymError(
            "a worker process died while driving, perhaps out of memory; finished layouts are kept: run again to "
            "resume, with fewer workers if memory is short"
        ) from error
    finally:
        stop.set()
        executor.shutdown(cancel_futures=True)


_stop: Event | None = None
"""Stop event of a worker process, set by its initializer, because an event cannot be sent with a job."""


def _begin_worker(stop: Event) -> None:
    """Set the stop event and leave Ctrl-C to the parent process."""
    global _stop
    _stop = stop
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _drive(job: Job, driver: Driver | None = None) -> tuple[Drive, ...]:
    stop = _stop
    policy = driver if driver is not None else shared_process(job.source, job.limits)
    try:
        return drive_layout(policy, job.layout, job.suite, job.label, job.seed, stop.is_set if stop else lambda: False)
    except Stopped:
        return ()


@contextmanager
def _environment(variables: dict[str, str]) -> Iterator[None]:
    """Set environment variables for the processes started in this context."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
