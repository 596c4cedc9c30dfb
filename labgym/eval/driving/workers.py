"""Worker processes that drive one layout at a time; results do not depend on their number."""

from __future__ import annotations

import multiprocessing
import os
import pickle
import signal
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing.synchronize import Event
from typing import Any

from labgym.errors import LabgymError, OptionError
from labgym.eval.driving.drive import Drive, Stopped, drive_layout
from labgym.eval.driving.suites import Suite
from labgym.layouts import Layout
from labgym.policies import Policy, make_policy

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMEXPR_NUM_THREADS")


@dataclass(frozen=True)
class PolicySource:
    """How a process gets its policy: by name and options, or as a copy of an object.

    Attributes:
        label: name of the policy in the rows.
        options: arguments of the policy's class.
        instance: the policy, if it was passed as an object.
        place: name for `make_policy`; "" if it is the label.
    """

    label: str
    options: dict[str, Any] = field(default_factory=dict)
    instance: Policy | None = None
    place: str = ""

    def make(self) -> Policy:
        """Return the instance, or else a new policy."""
        return self.instance if self.instance is not None else make_policy(self.place or self.label, **self.options)


@dataclass(frozen=True)
class Job:
    """The arguments of driving one layout."""

    source: PolicySource
    layout: Layout
    suite: Suite
    seed: int


def run_jobs(jobs: Sequence[Job], workers: int) -> Iterator[tuple[Job, tuple[Drive, ...]]]:
    """Yield each job with its episodes when it is finished: in order with one worker, in any order with more.

    One worker means this process. If the consumer stops early, or at an error or Ctrl-C, workers stop at their next
    control step.

    Raises:
        OptionError: a policy object cannot be sent to other processes.
        LabgymError: a worker died.
    """
    if workers == 1 or len(jobs) < 2:
        with _one_thread():
            for job in jobs:
                yield job, _drive(job)
        return
    _check_picklable(jobs[0].source)
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


def _drive(job: Job) -> tuple[Drive, ...]:
    policy = job.source.make()
    stop = _stop
    try:
        with _one_thread():
            return drive_layout(
                policy, job.layout, job.suite, job.source.label, job.seed, stop.is_set if stop else lambda: False
            )
    except Stopped:
        return ()
    finally:
        if job.source.instance is None:
            policy.close()


@contextmanager
def _one_thread() -> Iterator[None]:
    """Limit torch, if loaded, to one thread, so that sums do not depend on the number of cores."""
    torch = sys.modules.get("torch")
    if torch is None:
        yield
        return
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


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


def _check_picklable(source: PolicySource) -> None:
    try:
        pickle.dumps(source)
    except (pickle.PicklingError, TypeError, AttributeError) as error:
        raise OptionError(
            f"policy {source.label!r} cannot be sent to worker processes ({error}); pass it by name or use workers=1"
        ) from error
