"""The process of the policy that a thread drives: pieces of work that follow one another share it."""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping

from labgym.policies.process.limits import ProcessLimits
from labgym.policies.process.proxy import PolicyProcess
from labgym.policies.process.source import PolicySource

_local = threading.local()


def shared_process(
    source: PolicySource, limits: ProcessLimits | None = None, environment: Mapping[str, str] | None = None
) -> PolicyProcess:
    """Return the process of a policy that this thread opened last, or a new one, which replaces it.

    Loading a policy may take seconds; this way it is loaded once, however many pieces of work drive it.

    Raises:
        LabgymError: the policy cannot be loaded.
    """
    key = os.getpid(), source, limits or ProcessLimits(), None if environment is None else dict(environment)
    if getattr(_local, "key", None) == key:
        process: PolicyProcess = _local.process
        return process
    close_shared_process()
    process = PolicyProcess(source, limits, environment)
    _local.key, _local.process = key, process
    return process


def close_shared_process() -> None:
    """End the process that this thread opened last."""
    key, process = getattr(_local, "key", None), getattr(_local, "process", None)
    _local.key = _local.process = None
    if key is not None and process is not None and key[0] == os.getpid():
        process.close()
