from __future__ import annotations

import os

import pytest

from labgym.errors import LabgymError
from labgym.runs.local_pool import LocalPool


class Changed:
    """An argument that cannot be unpickled in a worker, like a catalog whose folder changed."""

    def __reduce__(self):
        return refuse, (os.getpid(),)


def refuse(coordinator):
    raise LabgymError(f"the catalog in mine changed since {coordinator} read it")


def test_an_argument_that_a_worker_cannot_read_is_an_error_of_its_call_and_the_worker_lives():
    pool = LocalPool(1)
    worker = pool.submit(os.getpid).result(timeout=60)
    with pytest.raises(LabgymError, match=f"the catalog in mine changed since {os.getpid()} read it"):
        pool.submit(len, Changed()).result(timeout=60)
    assert pool.submit(os.getpid).result(timeout=60) == worker
    pool.shutdown()
