"""Controls of a Linux process: its death with its parent, its orphans, who may read its memory, its capabilities."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import threading
from collections.abc import Iterable, Iterator
from pathlib import Path

PR_SET_PDEATHSIG = 1
PR_GET_DUMPABLE = 3
PR_SET_DUMPABLE = 4
PR_CAPBSET_DROP = 24
PR_SET_CHILD_SUBREAPER = 36
PR_SET_NO_NEW_PRIVS = 38

CAPABILITY_VERSION = 0x20080522
"""Version 3 of the structures of capget and capset: 64 capabilities in two words."""

READING_CAPABILITIES = (16, 17, 19, 21, 38, 39, 40)
"""Capabilities with which a process reads or changes the memory of others: SYS_MODULE, SYS_RAWIO, SYS_PTRACE,
SYS_ADMIN, PERFMON, BPF and CHECKPOINT_RESTORE."""

ALL_CAPABILITIES = 64
"""Number of capabilities that two words hold; the kernel has fewer."""

_libc = ctypes.CDLL(None, use_errno=True)


class _Header(ctypes.Structure):
    _fields_ = (("version", ctypes.c_uint32), ("pid", ctypes.c_int))


class _Word(ctypes.Structure):
    _fields_ = (("effective", ctypes.c_uint32), ("permitted", ctypes.c_uint32), ("inheritable", ctypes.c_uint32))


def die_with_parent(parent: int) -> None:
    """Have the kernel kill this process when its parent dies; exit if that has already happened.

    The kernel takes the thread that started this process for the parent: it must live as long as its process.

    Args:
        parent: process id of the parent.
    """
    _prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        os._exit(1)


def adopt_orphans() -> None:
    """Become the parent of all descendants whose own parent dies, in place of the init process."""
    _prctl(PR_SET_CHILD_SUBREAPER, 1)


def give_up_reading_others() -> None:
    """Give up for good the capabilities with which this process and its descendants could read other processes.

    Only processes of root have them. Programs that would restore them, such as sudo, no longer do.
    """
    _give_up(READING_CAPABILITIES)


def give_up_capabilities() -> None:
    """Give up for good all capabilities of this process and its descendants, also if root runs it."""
    _give_up(range(ALL_CAPABILITIES))


def _give_up(capabilities: Iterable[int]) -> None:
    for capability in capabilities:
        _prctl(PR_CAPBSET_DROP, capability)
    _prctl(PR_SET_NO_NEW_PRIVS, 1)
    header, words = _Header(CAPABILITY_VERSION, 0), (_Word * 2)()
    if _libc.capget(ctypes.byref(header), ctypes.byref(words)) != 0:
        return
    for capability in capabilities:
        word, bit = words[capability // 32], ~(1 << capability % 32) & 0xFFFFFFFF
        word.effective &= bit
        word.permitted &= bit
        word.inheritable &= bit
    _libc.capset(ctypes.byref(header), ctypes.byref(words))


def prefer_for_out_of_memory() -> None:
    """Have the kernel kill this process before others when memory runs out."""
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")


def thread_count() -> int:
    """Return the number of threads of this process."""
    return sum(1 for _ in Path("/proc/self/task").iterdir())


_unreadable_lock = threading.Lock()
_unreadable_uses = 0
_readable_before = 1


@contextlib.contextmanager
def unreadable_memory() -> Iterator[None]:
    """Deny other processes of this user access to this process's memory, environment and descriptors.

    Processes with the capability SYS_PTRACE are not denied. Debuggers and profilers cannot attach meanwhile.
    """
    global _unreadable_uses, _readable_before
    with _unreadable_lock:
        _unreadable_uses += 1
        if _unreadable_uses == 1:
            _readable_before = _prctl(PR_GET_DUMPABLE, 0)
            _prctl(PR_SET_DUMPABLE, 0)
    try:
        yield
    finally:
        with _unreadable_lock:
            _unreadable_uses -= 1
            if _unreadable_uses == 0 and _readable_before == 1:
                _prctl(PR_SET_DUMPABLE, 1)


def deny_readers() -> None:
    """Deny other processes of this user access to this process's memory from now on."""
    _prctl(PR_SET_DUMPABLE, 0)


def _prctl(option: int, value: int) -> int:
    return int(_libc.prctl(option, ctypes.c_ulong(value), 0, 0, 0))
