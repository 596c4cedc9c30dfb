"""The processes of the policies that a thread drives: pieces of work that follow one another share them."""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping
from typing import Any

from labgym.policies.process.limits import ProcessLimits
from labgym.policies.process.proxy import PolicyProcess
from labgym.policies.process.source import PolicySource

_local = threading.local()


def shared_process(
    source: PolicySource,
    limits: ProcessLimits | None = None,
    environment: Mapping[str, str] | None = None,
    most: int = 1,
) -> PolicyProcess:
    """Return the process of a policy that this thread opened before, or a new one.

    Loading a policy may take seconds; this way it is loaded once, however many pieces of work drive it.

    Args:
        source, limits, environment: as for `PolicyProcess`.
        most: number of processes that the thread keeps, at least 1; those that it used least recently end.

    Raises:
        LabgymError: the policy cannot be loaded.
    """
    key = source, limits or ProcessLimits(), None if environment is None else dict(environment)
    kept = _kept()
    index = next((place for place, (other, _) in enumerate(kept) if other == key), None)
    if index is not None:
        kept.append(kept.pop(index))
        return kept[-1][1]
    while len(kept) >= most:
        kept.pop(0)[1].close()
    process = PolicyProcess(source, limits, environment)
    kept.append((key, process))
    return process


def close_shared_process() -> None:
    """End the processes that this thread opened."""
    kept = _kept()
    while kept:
        kept.pop()[1].close()


def _kept() -> list[tuple[Any, PolicyProcess]]:
    """Return the open processes with what they were opened for; a fork of this process has none of them."""
    if getattr(_local, "owner", None) != os.getpid():
        _local.owner, _local.processes = os.getpid(), []
    processes: list[tuple[Any, PolicyProcess]] = _local.processes
    return processes
