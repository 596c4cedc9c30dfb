"""Work on untrusted files in separate processes, so that no file can hang or crash the caller.

The C++ libraries that read and decompose meshes may hang, crash or ask for all memory; then only the process ends.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import BinaryIO

ONE_THREAD = {"PXR_WORK_THREAD_LIMIT": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
"""Variables that keep the libraries to one thread."""


def run_isolated(
    module: str, arguments: Sequence[str], seconds: float, content: bytes = b""
) -> subprocess.CompletedProcess[bytes]:
    """Run the function `main` of a module in a new process with one thread, and return it when it has ended.

    Args:
        module: dotted path. arguments: of the command line.
        seconds: limit of the wall-clock time.
        content: standard input.

    Raises:
        subprocess.TimeoutExpired: it takes longer.
    """
    code = f"from {module} import main; main()"
    return subprocess.run(
        [sys.executable, "-P", "-c", code, *arguments],
        input=content,
        capture_output=True,
        timeout=seconds,
        env={**os.environ, **ONE_THREAD},
        check=False,
    )


@contextmanager
def answering(memory: int, cpu_seconds: int | None = None) -> Iterator[BinaryIO]:
    """Bound this process, silence it, and yield the standard output for its answer.

    Output of C++ libraries, on either stream, does not belong to the answer.

    Args:
        memory: largest address space, bytes. cpu_seconds: processor time.
    """
    answer = os.dup(1)
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    if cpu_seconds is not None:
        resource.setrlimit(resource.RLIMIT_CPU, (cpu_seconds, cpu_seconds))
    with os.fdopen(answer, "wb") as stream:
        yield stream
