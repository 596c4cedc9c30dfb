"""The descendants of a process: their memory, their CPU time, and their end."""

from __future__ import annotations

import contextlib
import os
import signal
import time
from collections.abc import Callable, Set
from dataclasses import dataclass
from pathlib import Path

PAGE_BYTES = os.sysconf("SC_PAGE_SIZE")
TICKS = os.sysconf("SC_CLK_TCK")
"""Units of the CPU time of ended children per second."""
KILL_PATIENCE_S = 5.0
"""Longest time that killed processes are waited for, seconds."""
END_SECONDS = 1.0
"""Longest time that the end of a child is waited for, seconds."""


@dataclass(frozen=True)
class Process:
    """A process of this machine.

    Attributes:
        pid: its id.
        parent: id of its parent.
        ended: whether it has ended and only waits for its parent.
        resident: its memory in RAM, bytes.
        children_s: CPU time of its ended children that it has waited for, seconds.
    """

    pid: int
    parent: int
    ended: bool
    resident: int
    children_s: float = 0.0


def processes() -> dict[int, Process]:
    """Return all processes of this machine by id."""
    table = {}
    for entry in os.scandir("/proc"):
        if entry.name.isdigit():
            # A process may end while the list is read.
            with contextlib.suppress(OSError, ValueError, IndexError):
                fields = Path(entry.path, "stat").read_bytes().rpartition(b")")[2].split()
                pid, parent = int(entry.name), int(fields[1])
                resident, children = int(fields[21]) * PAGE_BYTES, (int(fields[13]) + int(fields[14])) / TICKS
                table[pid] = Process(pid, parent, fields[0] in (b"Z", b"X"), resident, children)
    return table


def descendants(root: int, table: dict[int, Process]) -> frozenset[int]:
    """Return the ids of all descendants of a process, without the process itself."""
    children: dict[int, list[int]] = {}
    for process in table.values():
        children.setdefault(process.parent, []).append(process.pid)
    family: set[int] = set()
    waiting = [root]
    while waiting:
        for child in children.get(waiting.pop(), ()):
            if child not in family:
                family.add(child)
                waiting.append(child)
    return frozenset(family)


def resident_bytes(pids: Set[int], table: dict[int, Process]) -> int:
    """Return the sum of the memory of processes in RAM; pages that they share count for each."""
    return sum(table[pid].resident for pid in pids if pid in table)


def cpu_seconds(root: int) -> float:
    """Return the CPU time of all descendants of a process, with their ended threads and children, seconds."""
    table, seconds = processes(), 0.0
    for pid in descendants(root, table):
        seconds += table[pid].children_s
        # The kernel's number of the CPU clock of a process: man 3 clock_getcpuclockid. It may have ended meanwhile.
        with contextlib.suppress(OSError):
            seconds += time.clock_gettime((~pid << 3) | 2)
    return seconds


def kill_all(selected: Callable[[dict[int, Process]], Set[int]]) -> None:
    """Kill processes until none of them is left running, including those that they start meanwhile.

    Args:
        selected: returns the ids to kill among all processes.
    """
    deadline = time.monotonic() + KILL_PATIENCE_S
    while time.monotonic() < deadline:
        table = processes()
        running = [pid for pid in selected(table) if pid in table and not table[pid].ended]
        if not running:
            return
        for pid in running:
            with contextlib.suppress(ProcessLookupError, PermissionError):
                os.kill(pid, signal.SIGKILL)
        time.sleep(0.001)


def kill_group(leader: int) -> None:
    """Kill a process group at once: also processes that start others faster than `kill_all` finds them.

    Args:
        leader: process id of its leader, which may be a zombie.
    """
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(leader, signal.SIGKILL)


def end_of(child: int) -> str:
    """Return how a child ended, in words; it stays a zombie. A child that lives on closed its connection."""
    deadline = time.monotonic() + END_SECONDS
    while child and time.monotonic() < deadline:
        try:
            ended = os.waitid(os.P_PID, child, os.WEXITED | os.WNOHANG | os.WNOWAIT)
        except ChildProcessError:
            break
        if ended is not None:
            if ended.si_code == os.CLD_EXITED:
                return f"exited with status {ended.si_status}"
            return f"was killed by {_signal_name(ended.si_status)}"
        time.sleep(0.005)
    return "closed its connection"


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
