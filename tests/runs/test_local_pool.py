from __future__ import annotations

import os
import subprocess
import sys
import time
from concurrent.futures import CancelledError

import pytest

from labgym.errors import LabgymError
from labgym.runs.local_pool import LocalPool

LEFT_OPEN = """
import os, time
from labgym.runs.executors import ExecutorOptions
from labgym.runs.shards import Shard, run_shards
from tests.runs.examples import square

if __name__ == "__main__":
    shards = [Shard(str(k), square, (k,)) for k in range(9)]
    outputs = run_shards(shards, None, ExecutorOptions(workers=2), progress=False)
    next(outputs)
"""


class Changed:
    """An argument that cannot be unpickled in a worker, like a catalog whose folder changed."""

    def __reduce__(self):
        return refuse, (os.getpid(),)


def refuse(coordinator):
    raise LabgymError(f"the catalog in mine changed since {coordinator} read it")


def test_an_argument_that_a_worker_cannot_read_is_an_error_of_its_call_and_the_worker_lives():
    pool = LocalPool(1)
    worker = pool.submit(os.getpid).result(timeout=300)
    with pytest.raises(LabgymError, match=f"the catalog in mine changed since {os.getpid()} read it"):
        pool.submit(len, Changed()).result(timeout=300)
    assert pool.submit(os.getpid).result(timeout=300) == worker
    pool.shutdown()


def test_a_program_ends_although_it_left_a_run_with_workers_in_the_middle(tmp_path):
    script = tmp_path / "left_open.py"
    script.write_text(LEFT_OPEN)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, str(script)], env=environment, capture_output=True, timeout=300, check=False)
    assert (done.returncode, done.stderr) == (0, b"")


def test_shutdown_waits_for_all_tasks_or_ends_them_at_once():
    pool = LocalPool(1)
    futures = [pool.submit(time.sleep, 0.05) for _ in range(3)]
    pool.shutdown()
    assert [future.result(timeout=0) for future in futures] == [None] * 3
    pool = LocalPool(1)
    futures = [pool.submit(time.sleep, 600.0) for _ in range(3)]
    pool.shutdown(cancel_futures=True)
    assert all(future.done() for future in futures)
    with pytest.raises(CancelledError):
        futures[2].result(timeout=0)
    with pytest.raises(RuntimeError, match="shut down"):
        pool.submit(os.getpid)
