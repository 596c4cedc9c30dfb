"""Slurm jobs that run shards, one each, by submitit and a folder that all nodes share."""

from __future__ import annotations

import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from labgym.documents import write_bytes
from labgym.errors import LabgymError, OptionError, optional_package
from labgym.runs.blobs import Blob, dumps, loads
from labgym.runs.executors import Workers

FOLDER = "slurm"
"""Subfolder of the run with the jobs' scripts, logs and results."""
POLL_SECONDS = 1.0
QUEUE_POLLS = 20
"""Looks for results between two looks at Slurm's queue."""
DEFAULTS = {"timeout_min": 240, "cpus_per_task": 1, "mem_gb": 4}
"""Parameters of a job that are not set otherwise."""


class JobLostError(LabgymError):
    """A job ended without a result: its node failed, or it exceeded its time or its memory."""


@contextmanager
def slurm_workers(jobs: int, parameters: Mapping[str, Any], folder: Path, cluster: str = "slurm") -> Iterator[Workers]:
    """Yield an executor whose calls are jobs; at the end, those that are still running are cancelled.

    Args:
        jobs: number of jobs in the queue at a time.
        parameters: parameters of the jobs by submitit's names.
        folder: a folder that this machine and the nodes share.
        cluster: submitit's name of the cluster; "local" runs the jobs as processes of this machine.

    Raises:
        OptionError: Slurm is not installed, or a parameter is unknown.
        MissingDependencyError: submitit is not installed.
    """
    with optional_package("submitit", "the executor slurm", "slurm"):
        import submitit
    place = folder.resolve() / FOLDER
    try:
        submitter = submitit.AutoExecutor(place, cluster=cluster)
        submitter.update_parameters(**(DEFAULTS | dict(parameters)))
    except (RuntimeError, NameError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())[:300]
        raise OptionError(f"executor slurm: {reason}; names of parameters are submitit's") from None
    executor = SlurmExecutor(submitter, place)
    try:
        yield Workers(executor, lambda: jobs, (JobLostError,))
    finally:
        executor.shutdown(wait=False, cancel_futures=True)
        if executor.lost:
            for pickled in (*place.glob("*.pkl"), *place.glob("*.blob")):
                pickled.unlink(missing_ok=True)
        else:
            shutil.rmtree(place, ignore_errors=True)


class SlurmExecutor(Executor):
    """Submits calls as jobs and watches for their results.

    Attributes:
        lost: number of jobs that ended without a result; their logs are kept.

    Args:
        submitter: a `submitit.AutoExecutor`.
        place: folder that the nodes share.
    """

    def __init__(self, submitter: Any, place: Path) -> None:
        self.lost = 0
        self._submitter, self._place = submitter, place
        self._jobs: dict[Future[Any], Any] = {}
        self._absent: frozenset[str] = frozenset()
        self._ending = threading.Event()
        self._lock = threading.Lock()
        self._watch = threading.Thread(target=self._poll, name="slurm jobs", daemon=True)
        self._watch.start()

    def submit(self, function: Callable[..., Any], /, *arguments: Any, **keywords: Any) -> Future[Any]:
        """Submit a call as a job.

        Raises:
            LabgymError: Slurm refuses the job.
        """
        future: Future[Any] = Future()
        try:
            pickled = dumps((function, arguments, keywords), self._share)
            job = self._submitter.submit(_outcome, pickled, self._place)
        except Exception as error:
            reason = " ".join(str(error).split())[:300]
            raise LabgymError(f"Slurm refuses a job ({reason}); finished shards are kept") from error
        with self._lock:
            self._jobs[future] = job
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Stop watching; cancel the jobs that are still running if `cancel_futures`, else wait for them if `wait`."""
        while wait and not cancel_futures and self._jobs:
            self._ending.wait(POLL_SECONDS)
        self._ending.set()
        self._watch.join()
        with suppress(Exception):  # Remaining jobs end at their time limit.
            for job in self._jobs.values():
                job.cancel()

    def _share(self, blob: Blob) -> None:
        """Write a blob where the nodes read it."""
        path = self._place / f"{blob.digest}.blob"
        if not path.exists():
            write_bytes(path, blob.content)

    def _poll(self) -> None:
        polls = 0
        while not self._ending.wait(POLL_SECONDS):
            with self._lock:
                jobs = list(self._jobs.items())
            polls += 1
            vanished = self._vanished([job for _, job in jobs]) if polls % QUEUE_POLLS == 0 else frozenset()
            for future, job in jobs:
                if job.done():
                    self._end(future, job)
                elif job.job_id in vanished:
                    self._lose(future, job, "it left the queue")
                else:
                    continue
                with self._lock:
                    del self._jobs[future]

    def _vanished(self, jobs: Sequence[Any]) -> frozenset[str]:
        """Return the ids of jobs that were not in Slurm's queue at this look and the one before.

        submitit learns of lost jobs from Slurm's accounting, which not every cluster has.
        """
        if self._submitter.cluster != "slurm" or not jobs:
            return frozenset()
        command = ["squeue", "--noheader", "--me", "--format=%A"]
        try:
            queue = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout.split()
        except (OSError, subprocess.SubprocessError):
            return frozenset()
        before, self._absent = self._absent, frozenset(job.job_id for job in jobs) - frozenset(queue)
        return self._absent & before

    def _end(self, future: Future[Any], job: Any) -> None:
        """Give a future the outcome of its job."""
        try:
            value, error = job.result()
        except Exception as failure:  # noqa: BLE001 -- submitit has several, and a result file may be broken
            self._lose(future, job, (str(failure).strip().splitlines() or [type(failure).__name__])[0][:200])
            return
        if error is None:
            future.set_result(value)
        else:
            future.set_exception(error)

    def _lose(self, future: Future[Any], job: Any, reason: str) -> None:
        self.lost += 1
        future.set_exception(
            JobLostError(f"Slurm job {job.job_id} ended without a result ({reason}); its logs are {job.paths.stderr}")
        )


def _outcome(pickled: bytes, place: Path) -> tuple[Any, Exception | None]:
    """Return the result of a call, or the exception that it raised: submitit would return its text alone."""
    try:
        function, arguments, keywords = loads(pickled, lambda digest: (place / f"{digest}.blob").read_bytes())
        return function(*arguments, **keywords), None
    except Exception as error:  # noqa: BLE001 -- the coordinator raises it again
        return None, error
